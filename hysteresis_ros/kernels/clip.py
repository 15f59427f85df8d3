# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Limits of a value in a kernel."""

from .lean import lean


@lean
def clip(value: float, low: float, high: float) -> float:
    """
    Return what is nearest to a value in a range.

    Compiled, `min` and `max` look for NaN first: of a whole trial that took a tenth of the time.
    """
    if value < low:
        return low
    return high if value > high else value
