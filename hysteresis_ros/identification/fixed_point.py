# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A fixed point of a function, with few evaluations."""

from collections.abc import Callable

import numpy as np


def fixed_point(function: Callable[[np.ndarray], np.ndarray], start: np.ndarray, tolerance: float,
                most: int) -> np.ndarray:
    """
    Return a fixed point of a function, by Anderson's iteration with one step remembered.

    The function is evaluated at its own values until these agree; from the third evaluation on,
    where the last two steps extrapolate to the shortest one (Anderson, J. ACM 12 (1965) 547).

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
