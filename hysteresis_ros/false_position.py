# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The root of a function of one number that costs much, between two places on both sides of it."""

from collections.abc import Callable

MOST_TRIALS = 60


def false_position(function: Callable[[float], float], near: tuple[float, float],
                   far: tuple[float, float], tolerance: float, narrowest: float = 0.0) -> float:
    """
    Return a root by false position that cannot stall (the Illinois method).

    Parameters
    ----------
    function : callable
        The place returned is the last one that it was called with, here or before.
    near, far : tuple of float
        Places with their values, of which `far` was evaluated last.
    tolerance : float
        Size of a value at which to stop.
    narrowest : float
        Distance of two places at which to stop: where the function jumps.

    Returns
    -------
    float
    """
    (left, here), (place, there) = near, far
    for _ in range(MOST_TRIALS):
        if abs(there) <= tolerance or abs(place - left) <= narrowest or there == here:
            break
        new = place - there * (place - left) / (there - here)
        value = function(new)
        # An end that stays counts half.
        if value * there < 0.0:
            left, here = place, there
        else:
            here *= 0.5
        place, there = new, value
    return place
