# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Places on a grid: an interval k, between entries k - 1 and k, and a share of it."""

import numpy as np

from .lean import lean


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
    if 1 <= near <= last and ((near == 1 or grid[near - 1, column] <= value)
                              and (near == last or value < grid[near, column])):
        return near
    low, high = 1, last
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
