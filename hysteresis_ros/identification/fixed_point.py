# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Find what a function leaves as it is, with few evaluations."""

from collections.abc import Callable

import numpy as np


def fixed_point(function: Callable[[np.ndarray], np.ndarray], start: np.ndarray, tolerance: float,
                most: int) -> np.ndarray:
    """
    Return the last value of a function that is evaluated at its own values, until these agree.

    From the third on at the place where the last two steps, extended as a line, would be shortest
    (Anderson, J. ACM 12 (1965) 547, with one step remembered).

    Parameters
    ----------
    function : callable
        Of an array (n,), to one.
    start : ndarray, shape (n,)
    tolerance : float
        Standard deviation of the last step, at most.
    most : int
        Evaluations at most, whether values agree by then or not.

    Returns
    -------
    ndarray, shape (n,)
    """
    found = function(start)
    step = found - start
    following = found
    for _ in range(1, most):
        if np.std(step) <= tolerance:
            break
        before, step_before = found, step
        found = function(following)
        step = found - following
        change = step - step_before
        share = float(change @ step) / max(float(change @ change), np.finfo(float).tiny)
        following = found - share * (found - before)
    return found
