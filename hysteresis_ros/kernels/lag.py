# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The first-order lags of Eq. 1 over a whole trial, exact for inputs that are held."""

import math

import numpy as np

from .jit import jit


@jit
def lag(values: np.ndarray, dt: np.ndarray, rising: float, falling: float, released: np.ndarray,
        q: float) -> np.ndarray:
    """
    Return the course of ``dq/dt = d1 (v - q)`` under inputs held from one row to the next.

    Parameters
    ----------
    values, dt : ndarray, shape (rows,)
        Input v, and time since the row before [s].
    rising, falling : float
        Rate d1 [1/s] while q rises and while it falls.
    released : ndarray, shape (rows,)
        What is added to q in each row.
    q : float
        q before the first row.

    Returns
    -------
    ndarray, shape (rows,)

    """
    course = np.empty(len(values))
    for n in range(len(values)):
        rate = rising if values[n] > q else falling
        q = values[n] + (q - values[n]) * math.exp(-rate * dt[n]) + released[n]
        course[n] = q
    return course


@jit
def approach(q: float, value: float, rate: float, growth: float, dt: float) -> float:
    """
    Return q after `dt` where the rate grows with it: ``dq/dt = rate (1 + growth q) (value - q)``.

    The distance ``d = q - value`` obeys Bernoulli's equation ``dd/dt = -rate (c + growth d) d``
    with ``c = 1 + growth value``, so it is ``d exp(-rate c t) / (1 + growth d g)`` with
    ``g = (1 - exp(-rate c t)) / c``. Below 0, where no heating is, values count for the rate as 0.

    Parameters
    ----------
    q, value : float
        Output before, and input.
    rate : float
        Rate at q = 0 [1/s].
    growth : float
        Growth of the rate, one over the unit of q; not negative.
    dt : float
        Time [s].
    """
    faster = 1.0 + growth * max(value, 0.0)
    decay = math.exp(-rate * faster * dt)
    reached = -math.expm1(-rate * faster * dt) / faster
    return value + (q - value) * decay / (1.0 + growth * (max(q, 0.0) - value) * reached)


@jit
def growing_lag(values: np.ndarray, dt: np.ndarray, rate: np.ndarray, growth: np.ndarray,
                q: float) -> np.ndarray:
    """
    Return the course of `approach` under inputs held from one row to the next.

    Parameters
    ----------
    values, dt : ndarray, shape (rows,)
        Input, and time since the row before [s].
    rate, growth : ndarray, shape (rows,)
        As for `approach`, while the input of a row is held.
    q : float
        q before the first row.

    Returns
    -------
    ndarray, shape (rows,)

    """
    course = np.empty(len(values))
    for n in range(len(values)):
        q = approach(q, values[n], rate[n], growth[n], dt[n])
        course[n] = q
    return course
