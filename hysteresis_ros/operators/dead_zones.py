# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A piecewise linear curve of one-sided dead zones, and its inverse.

Behind an operator whose loops are alike at every level they make loops that differ from level to
level and let them saturate (K. Kuhnen, Eur. J. Control 9 (2003) 407).
"""

from typing import Any

import numpy as np

from .base import numbers
from ..errors import ParameterError


class DeadZones:
    """
    The strictly rising curve x + sum of bends[l] * max(x - thresholds[l], 0).

    Parameters
    ----------
    thresholds : array_like, shape (L,)
        Where the slope changes, strictly increasing.
    bends : array_like, shape (L,)
        By how much; the slope, 1 below the first threshold, has to stay positive.
    where : str
        How messages name the operator.

    Raises
    ------
    ParameterError
        If one of these conditions does not hold or a value is not finite.

    """

    def __init__(self, thresholds: Any, bends: Any, where: str) -> None:
        self.thresholds = numbers(thresholds, f'{where}: thresholds')
        self.bends = numbers(bends, f'{where}: bends')
        if np.any(np.diff(self.thresholds) <= 0.0) or len(self.bends) != len(self.thresholds):
            raise ParameterError(f'{where}: thresholds have to be strictly increasing, with one '
                                 'bend each')
        self.slopes = np.concatenate(([1.0], 1.0 + np.cumsum(self.bends)))
        if np.any(self.slopes <= 0.0):
            raise ParameterError(f'{where}: the bends turn the slope of the output to '
                                 f'{np.min(self.slopes)}, it has to stay positive')
        for array in (self.thresholds, self.bends, self.slopes):
            array.flags.writeable = False
        self._pairs = list(zip(self.thresholds.tolist(), self.bends.tolist()))
        self._bent = self.values(self.thresholds)

    def value(self, x: float) -> float:
        """Return the curve at x."""
        y = x
        for threshold, bend in self._pairs:
            if x <= threshold:
                break
            y += bend * (x - threshold)
        return y

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return the curve at each of x, shape (n,)."""
        over = np.maximum(x[:, None] - self.thresholds, 0.0)
        return x + np.sum(self.bends * over, axis=-1)

    def slope(self, x: float) -> float:
        """Return the slope of the curve at x, to the right of a threshold there."""
        return float(self.slopes[np.searchsorted(self.thresholds, x, side='right')])

    def inverse(self, y: float) -> float:
        """Return the x at which the curve is y."""
        k = int(np.searchsorted(self._bent, y))
        if k == 0:
            return y
        return float(self.thresholds[k - 1] + (y - self._bent[k - 1]) / self.slopes[k])
