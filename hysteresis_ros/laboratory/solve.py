# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Roots of increasing functions, in few evaluations and without ever leaving the bracket."""

from collections.abc import Callable

ITERATIONS = 120


class RootFinder:
    """
    Finds where an increasing function vanishes; remembers how steep it was from call to call.

    Secant steps inside the bracket that the signs seen so far give; where they are slow the bracket
    is halved, or the next step leaps further while there is only one sign.

    Parameters
    ----------
    slope : float
        About how steep the function is (positive).
    tolerance : float
        Absolute value below which the function counts as zero.
    """

    def __init__(self, slope: float, tolerance: float) -> None:
        self._slope = slope
        self._tolerance = tolerance

    def __call__(self, function: Callable[[float], float], guess: float, lower: float,
                 upper: float) -> float:
        """
        Return the argument at which the function vanishes.

        Parameters
        ----------
        function : callable
            Increasing function of one float; evaluated at the result last.
        guess : float
            Where to start.
        lower, upper : float
            Bounds of the argument.

        Returns
        -------
        float
            The nearer bound where there is no root between them.
        """
        tolerance, slope = self._tolerance, self._slope
        low, high = lower, upper
        seen_low = seen_high = slow = False
        stride = 1.0
        point = min(max(guess, lower), upper)
        value = function(point)
        for _ in range(ITERATIONS):
            if -tolerance <= value <= tolerance:
                break
            if value > 0.0:
                high, seen_high = point, True
            else:
                low, seen_low = point, True
            if high - low <= 1e-13 * (1.0 + abs(high)):
                break
            enclosed = seen_low and seen_high
            following = point - stride * value / slope
            halved = enclosed and (slow or not low < following < high)
            if halved:
                following = 0.5 * (low + high)
            elif not low < following < high:
                following = lower if value > 0.0 else upper
            change = function(following)
            estimate = (change - value) / (following - point)
            if estimate > 0.0:
                slope = estimate
            slow = not halved and abs(change) > 0.5 * abs(value)
            stride = 3.0 * stride if slow and not enclosed else 1.0
            point, value = following, change
        self._slope = slope
        return point
