# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The first-order lag of Eq. 1 over a whole trial, exact for inputs that are held."""

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
