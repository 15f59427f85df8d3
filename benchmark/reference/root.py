# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Roots of functions that cost much and change little from one sample to the next."""

import math

MOST_ITERATIONS = 60


def bracket(residual, start: float, here: float, step: float,
            low: float = -math.inf, high: float = math.inf) -> tuple:
    """
    Return two points about the root of a falling function, beginning where the last one was.

    Parameters
    ----------
    residual : callable
        Falls with its argument.
    start, here : float
        Where to begin, and the residual there.
    step : float
        About how far the root is; of the residual's sign.
    low, high : float
        Ends of the range. If there is no root inside, the second point is the nearer end.

    Returns
    -------
    near, here, far, there : float
        The points with their residuals; there was called last.
    """
    near, far = start, min(max(start + step, low), high)
    there = residual(far)
    for _ in range(MOST_ITERATIONS):
        if there * here <= 0.0 or far in (low, high):
            break
        # A little further than the straight line through both says.
        fall = here - there
        reach = 1.3 * there / fall * (far - near) if fall * here > 0.0 else math.inf
        step = math.copysign(min(max(abs(reach), abs(step)), 8.0 * abs(step)), here)
        near, here = far, there
        far = min(max(far + step, low), high)
        there = residual(far)
    return near, here, far, there


def illinois(residual, near: float, here: float, far: float, there: float,
             tolerance: float) -> float:
    """
    Return the root between two points by false position that cannot stall at one end.

    The fastest choice for a function without steep places.

    Parameters
    ----------
    residual : callable
        The function.
    near, here, far, there : float
        Points on both sides of the root, with their residuals.
    tolerance : float
        Size of the residual at which to stop.
    """
    for _ in range(MOST_ITERATIONS):
        if abs(there) <= tolerance or there == here:
            break
        middle = far - there * (far - near) / (there - here)
        value = residual(middle)
        if value * there < 0.0:
            near, here = far, there
        else:
            here *= 0.5
        far, there = middle, value
    return far
