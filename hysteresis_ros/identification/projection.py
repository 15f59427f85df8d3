# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weights eliminated from a fit: best ones for given rows, and how they follow when the rows move.

Where rows depend on parameters that are not weights, the weights are a function of those
parameters (variable projection: Golub and Pereyra 1973). Its derivative, with the weights that are
at their bound staying there, takes one triangular solve with the factor that the fit left behind.
"""

import numpy as np
from scipy.linalg import lapack

from hysteresis_ros.identification.nonnegative import solve_nonnegative


class ProjectedWeights:
    """
    The z that minimises ``|design @ z - target|^2 / n + z @ penalty @ z``, all z >= 0 but the last.

    Parameters
    ----------
    design : ndarray, shape (n, K)
        The last column is that of the bias.
    target : ndarray, shape (n,)
    penalty : ndarray, shape (K, K)
    start : ndarray of bool, shape (K,), optional
        `passive` of a neighbouring problem.

    Attributes
    ----------
    z : ndarray, shape (K,)
    passive : ndarray of bool, shape (K,)
        Which are not at their bound.
    """

    def __init__(self, design: np.ndarray, target: np.ndarray, penalty: np.ndarray,
                 start: np.ndarray | None = None):
        free = np.zeros(design.shape[1], dtype=bool)
        free[-1] = True
        self.penalty = penalty
        self._gram = design.T @ design / len(target) + penalty
        self.z, self.passive = solve_nonnegative(
            self._gram, design.T @ target / len(target), free, start)
        self._index: np.ndarray | None = None
        self._factor: np.ndarray | None = None

    def moved(self, design: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Return z for rows that differ a little, to first order, the passive set unchanged."""
        if self._index is None:
            self._index = np.flatnonzero(self.passive)
            self._factor, _ = lapack.dpotrf(self._gram[np.ix_(self._index, self._index)])
        slope = design.T @ (target - design @ self.z) / len(target) - self.penalty @ self.z
        change, _ = lapack.dpotrs(self._factor, slope[self._index])
        z = self.z.copy()
        z[self._index] += change
        return z
