# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Places on a grid: an interval k, between entries k - 1 and k, and a share of it."""

import numpy as np

from .clip import clip
from .lean import lean

# Intervals that are looked at along a straight line before a search by halves takes over.
STRAIGHT = 4


@lean
def interval(grid: np.ndarray, column: int, value: float, near: int) -> int:
    """
    Return the interval of an ascending column that a value lies in; the outer ones have no end.

    Parameters
    ----------
    grid : ndarray, shape (n, columns)
    column : int
    value : float
    near : int
        Where to look first.

    """
    last = len(grid) - 1
    low, high = 1, last
    k = min(max(near, low), high)
    for _ in range(STRAIGHT):
        below, above = grid[k - 1, column], grid[k, column]
        if value < below:
            high = k - 1
        elif value >= above:
            low = k + 1
        else:
            return k
        if low >= high:
            return min(max(low, 1), last)
        if not below < above:
            break
        # Where a straight line through this interval would have the value.
        way = (value - below) / (above - below)
        k += int(clip(way, float(low - k), float(high - k)))
    while low < high:
        middle = (low + high) // 2
        if value < grid[middle, column]:
            high = middle
        else:
            low = middle + 1
    return low


@lean
def between(grid: np.ndarray, column: int, k: int, share: float) -> float:
    """Return a column's value at a place."""
    return grid[k - 1, column] + share * (grid[k, column] - grid[k - 1, column])
