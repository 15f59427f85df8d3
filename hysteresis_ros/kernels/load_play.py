# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The play between load and second stage that makes a loop as wide as its load says.

H2's input follows ``v = F - x`` down while the muscle heats, and ``v - w(F)`` up while it cools;
between both it stays. A relay of H2 then goes down where v falls below its lower threshold, and up
where v rises above the upper one plus w(F): its loop is wider by w(F), whatever F and x do.
"""

import numpy as np

from .jit import jit
from .lean import lean


@lean
def held(before: float, v: float, width: float) -> float:
    """Return the input of H2 after the one before, for ``v = F - x`` and a loop wider by width."""
    return min(max(before, v - width), v)


@jit
def follow(values: np.ndarray, widths: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """
    Return the inputs of H2 for some trials, each of which begins after cooling down.

    Parameters
    ----------
    values, widths : ndarray, shape (rows,)
        v and w(F), trial after trial.
    ends : ndarray of int, shape (trials,)
        Where each trial ends.

    Returns
    -------
    ndarray, shape (rows,)

    """
    inputs = np.empty(len(values))
    begin = 0
    for end in ends:
        place = -np.inf
        for n in range(begin, end):
            place = held(place, values[n], widths[n])
            inputs[n] = place
        begin = end
    return inputs
