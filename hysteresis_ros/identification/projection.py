# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weights eliminated from a fit: best ones for given rows, and how they follow when the rows move.

Where rows depend on parameters that are not weights, the weights are a function of those
parameters (variable projection: Golub and Pereyra 1973). For its derivatives the weights that are
at their bound stay there, so that each takes one small linear problem instead of a constrained one.
"""

import numpy as np
from scipy import sparse

from hysteresis_ros.identification.nonnegative import solve, solve_rows


class ProjectedWeights:
    """
    The z that minimises ``|design @ z - target|^2 / n + z @ penalty @ z``, all z >= 0 but the last.

    Parameters
    ----------
    design : ndarray, shape (n, K)
        The last column is that of the bias.
    target : ndarray, shape (n,)
    penalty : csr_matrix, shape (K, K)
    start : ndarray of bool, shape (K,), optional
        `passive` of a neighbouring problem.

    Attributes
    ----------
    z : ndarray, shape (K,)
    passive : ndarray of bool, shape (K,)
        Which are not at their bound.
    columns : ndarray of int, shape (P,)
        The same as indices.
    """

    def __init__(self, design: np.ndarray, target: np.ndarray, penalty: sparse.csr_matrix,
                 start: np.ndarray | None = None):
        free = np.zeros(design.shape[1], dtype=bool)
        free[-1] = True
        self.z, self.passive = solve_rows(design, target, penalty, free, start)
        self.columns = np.flatnonzero(self.passive)

    def moved(self, design: np.ndarray, target: np.ndarray, penalty: np.ndarray) -> np.ndarray:
        """
        Return the weights for rows that differ a little.

        Parameters
        ----------
        design : ndarray, shape (n, P)
            Only the `columns`; all other weights stay at their bound.
        target : ndarray, shape (n,)
        penalty : ndarray, shape (P, P)

        Returns
        -------
        ndarray, shape (P,)
            Of any sign.
        """
        return solve(design.T @ design / len(target) + penalty,
                     design.T @ target / len(target))
