# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One root of an increasing function, in few evaluations and without ever leaving its bracket."""

from collections.abc import Callable

ITERATIONS = 120


def increasing_root(function: Callable[[float], float], guess: float, slope: float, lower: float,
                    upper: float, tolerance: float) -> float:
    """
    Return the argument in [lower, upper] at which an increasing function vanishes.

    Secant steps from `guess` inside the bracket that the signs seen so far give; a step that does
    not halve the value seen before is followed by one to the middle, or outwards while there is
    only one sign. Where the function has no root between them, the nearer bound.

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
    seen_low = seen_high = False
    point = min(max(guess, lower), upper)
    value = function(point)
    stride = 1.0
    for _ in range(ITERATIONS):
        if abs(value) <= tolerance:
            return point
        if value > 0.0:
            high, seen_high = point, True
        else:
            low, seen_low = point, True
        if high - low <= 1e-13 * (1.0 + abs(high)):
            return point
        following = point - stride * value / slope
        if not low < following < high:
            if value > 0.0:
                following = 0.5 * (low + high) if seen_low else lower
            else:
                following = 0.5 * (low + high) if seen_high else upper
        change = function(following)
        estimate = (change - value) / (following - point)
        if estimate > 0.0:
            slope = estimate
        if abs(change) > 0.5 * abs(value):
            # Slow: leap further while the root is not enclosed, else halve the bracket.
            stride *= 3.0
            if seen_low and seen_high and abs(change) > tolerance:
                point, value = following, change
                if value > 0.0:
                    high = point
                else:
                    low = point
                following = 0.5 * (low + high)
                change = function(following)
                stride = 1.0
        else:
            stride = 1.0
        point, value = following, change
    return point
