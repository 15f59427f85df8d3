# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A monotone branch: the curve that an operator follows from its present input, one way."""

import abc

import numpy as np


class Branch(abc.ABC):
    """
    A monotone curve of output over input, valid until the input turns.

    Attributes
    ----------
    knots : ndarray, shape (K,)
        Inputs, ascending, between which the curve is smooth. The present input is the first of
        an increasing branch and the last of a decreasing one; the other end is the end of the
        input range.
    values : ndarray, shape (K,)
        Outputs at the knots.
    increasing : bool
        Whether the input moves up along this branch.

    """

    knots: np.ndarray
    values: np.ndarray
    increasing: bool

    @abc.abstractmethod
    def value(self, u: np.ndarray | float) -> np.ndarray | float:
        """Return the output at inputs; beyond the ends of the branch, that of the nearer end."""

    @abc.abstractmethod
    def slope(self, u: np.ndarray | float) -> np.ndarray | float:
        """Return d output / d input, at a knot that of the piece above it."""

    @abc.abstractmethod
    def inverse(self, y: np.ndarray | float) -> np.ndarray | float:
        """Return the inputs nearest to the present one that give outputs, or come nearest."""


class PiecewiseQuadratic(Branch):
    """
    A branch whose pieces are parabolas, solved in closed form.

    On piece k the output is ``values[k] + slopes[k] d + curvatures[k] d^2``, d = u - knots[k].

    Parameters
    ----------
    knots, values : ndarray, shape (K,)
        Ends of the pieces, ascending, and the outputs there; K >= 1.
    slopes, curvatures : ndarray, shape (K - 1,)
        Slope at the lower end and half the second derivative of each piece.
    increasing : bool
        Whether the input moves up along the branch.

    """

    def __init__(self, knots: np.ndarray, values: np.ndarray, slopes: np.ndarray,
                 curvatures: np.ndarray, increasing: bool) -> None:
        self.knots = knots
        self.values = values
        self.slopes = slopes
        self.curvatures = curvatures
        self.increasing = increasing
        self._sign = -1.0 if values[-1] < values[0] else 1.0
        # Rounding must not turn the order of equal values, which the search relies on.
        self._levels = np.maximum.accumulate(self._sign * values)

    def value(self, u: np.ndarray | float) -> np.ndarray | float:
        """Return the output at inputs; beyond the ends of the branch, that of the nearer end."""
        u = np.clip(np.asarray(u, dtype=float), self.knots[0], self.knots[-1])
        if len(self.knots) == 1:
            return np.full_like(u, self.values[0])[()]
        k = self._piece(u)
        d = u - self.knots[k]
        inside = self.values[k] + d * (self.slopes[k] + self.curvatures[k] * d)
        # The last knot has its own value, so that the far end is exact.
        return np.where(u == self.knots[-1], self.values[-1], inside)[()]

    def slope(self, u: np.ndarray | float) -> np.ndarray | float:
        """Return d output / d input, at a knot that of the piece above it."""
        u = np.clip(np.asarray(u, dtype=float), self.knots[0], self.knots[-1])
        if len(self.knots) == 1:
            return np.zeros_like(u)[()]
        k = self._piece(u)
        return (self.slopes[k] + 2.0 * self.curvatures[k] * (u - self.knots[k]))[()]

    def inverse(self, y: np.ndarray | float) -> np.ndarray | float:
        """Return the inputs nearest to the present one that give outputs, or come nearest."""
        y = np.asarray(y, dtype=float)
        if len(self.knots) == 1:
            return np.full_like(y, self.knots[0])[()]
        level = np.clip(self._sign * y, self._levels[0], self._levels[-1])
        side = 'left' if self.increasing else 'right'
        k = np.searchsorted(self._levels, level, side=side) - 1
        k = np.clip(k, 0, len(self.slopes) - 1)
        rest = level - self._sign * self.values[k]
        slope = self._sign * self.slopes[k]
        bend = self._sign * self.curvatures[k]
        root = slope + np.sqrt(np.maximum(slope * slope + 4.0 * bend * rest, 0.0))
        width = self.knots[k + 1] - self.knots[k]
        # A flat piece is met only at its ends: take the one next to the present input.
        flat = np.full_like(width, 0.0) if self.increasing else width
        d = np.where(root > 0.0, 2.0 * rest / np.where(root > 0.0, root, 1.0), flat)
        u = self.knots[k] + np.clip(d, 0.0, width)
        end = self._levels[-1] if not self.increasing else self._levels[0]
        start = self.knots[-1] if not self.increasing else self.knots[0]
        return np.where(level == end, start, u)[()]

    def _piece(self, u: np.ndarray) -> np.ndarray:
        """Return the index of the piece that each input lies on."""
        k = np.searchsorted(self.knots, u, side='right') - 1
        return np.clip(k, 0, len(self.slopes) - 1)
