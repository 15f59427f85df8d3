# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One root of an increasing function, in few evaluations and without ever leaving its bracket."""

from collections.abc import Callable

ITERATIONS = 80


def increasing_root(function: Callable[[float], float], guess: float, slope: float, lower: float,
                    upper: float, tolerance: float) -> float:
    """
    Return the argument in [lower, upper] at which an increasing function vanishes.

    Secant steps from `guess`, kept inside the bracket that the signs seen so far give; the nearer
    bound where the function has no root between them.

    Parameters
    ----------
    function : callable
        Increasing function of one float.
    guess, slope : float
        Where to start, and about how steep the function is there (positive).
    lower, upper : float
        Bounds of the argument.
    tolerance : float
        Absolute value below which the function counts as zero.
    """
    low, high = lower, upper
    point = min(max(guess, lower), upper)
    value = function(point)
    for _ in range(ITERATIONS):
        if abs(value) <= tolerance:
            return point
        if value > 0.0:
            high = point
        else:
            low = point
        if high - low <= 1e-12 * (1.0 + abs(high)):
            return point
        following = point - value / slope
        if not low < following < high:
            # Outside: the bound itself if it was not tried yet, else the middle.
            edge = lower if value > 0.0 else upper
            tried = low if value > 0.0 else high
            if tried == edge and (following - edge) * value <= 0.0 and point != edge:
                following = edge
            else:
                following = 0.5 * (low + high)
        change = function(following)
        if following != point and change != value:
            estimate = (change - value) / (following - point)
            slope = estimate if estimate > 0.0 else slope
        point, value = following, change
    return point
