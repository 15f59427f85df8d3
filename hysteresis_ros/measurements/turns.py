# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How often a signal turns."""

import numpy as np


def turns(values: np.ndarray, least: float) -> int:
    """
    Return how often a signal turns by more than its noise.

    Parameters
    ----------
    values : ndarray, shape (n,)
        In the order of time.
    least : float
        Swing that counts, in the same unit; smaller ones are noise.
    """
    count, direction = 0, 0
    low = high = values[0] if len(values) else 0.0
    for value in values.tolist():
        low, high = min(low, value), max(high, value)
        if direction <= 0 and value - low > least:
            count += direction < 0
            direction, high = 1, value
        elif direction >= 0 and high - value > least:
            count += direction > 0
            direction, low = -1, value
    return count
