# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What weights of a Preisach operator contribute where all that transforms follows kinetics.

Minor loops of such a muscle are scaled from the branches of its major loop (`kernels.kinetics`), so
that its response is linear in the weights on the major loop only. Least squares go from tangent to
tangent (Gauss-Newton).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from hysteresis_ros.kernels.kinetic_tangent import derivative, transformed
from hysteresis_ros.kernels.shares import shares
from hysteresis_ros.operators import cell_areas


# Tangents at most, and shares of the way to the best weights of one that are tried in turn.
MOST_TANGENTS, STEPS = 8, (1.0, 0.5, 0.25)


class Tangent(NamedTuple):
    """
    What kinetics add to a response for weights near some: ``rows @ z + constant``.

    Parameters
    ----------
    rows : ndarray, shape (n, K + 1)
        The last column is that of the bias.
    constant : ndarray, shape (n,)
    """

    rows: np.ndarray
    constant: np.ndarray


class KineticWeights:
    """
    How a response that follows kinetics depends on the weights of H2.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Grid nodes.
    inputs : ndarray, shape (M,)
        Inputs inside the grid, trial after trial; each trial starts from the lower end.
    ends : ndarray of int, shape (trials,)
        Where in `inputs` each trial ends.
    wanted : ndarray of bool, shape (M,)
        Inputs, n of them, whose response is returned.
    plain : ndarray, shape (n, K + 1)
        What the weights and, last, the bias contribute without kinetics.
    top : float
        Input at which all has transformed.
    oriented : ndarray, shape (M,)
        Share of what forms that each input's load orients.
    """

    def __init__(self, nodes: np.ndarray, inputs: np.ndarray, ends: np.ndarray,
                 wanted: np.ndarray, plain: np.ndarray, top: float, oriented: np.ndarray) -> None:
        self._oriented = oriented
        self._inputs, self._ends, self._wanted = np.minimum(inputs, top), ends, wanted
        self._plain = plain[:, :-1]
        count = len(inputs)
        columns = np.arange(len(cell_areas(nodes)) + len(nodes) - 1)
        places = np.append(self._inputs, top)
        risen = shares(nodes, places, np.arange(1, count + 2), np.ones(count + 1, dtype=bool),
                       np.ones(count + 1), columns)
        self._rising, self._whole = risen[:-1], risen[-1]
        turned = np.full(2 * count, top)
        turned[1::2] = self._inputs
        self._falling = shares(nodes, turned, np.arange(2, 2 * count + 1, 2),
                               np.arange(2 * count) % 2 == 1, np.ones(count), columns)

    def added(self, z: np.ndarray) -> np.ndarray:
        """Return what kinetics add to the response of weights and bias (K + 1,), shape (n,)."""
        weights = z[:-1]
        found = transformed(self._rising @ weights, self._falling @ weights,
                            float(self._whole @ weights), self._inputs, self._oriented,
                            self._ends)
        return found[self._wanted] - self._plain @ weights

    def tangent(self, z: np.ndarray) -> Tangent:
        """Return what kinetics add for weights and bias near some, shape (K + 1,)."""
        found = derivative(self._rising, self._falling, self._whole, z[:-1], self._inputs,
                           self._oriented, self._ends)[self._wanted] - self._plain
        rows = np.column_stack((found, np.zeros(len(found))))
        return Tangent(rows, self.added(z) - rows @ z)

    def fitted(self, start: np.ndarray, residual: Callable[[np.ndarray], np.ndarray],
               solved: Callable[[Tangent], tuple[np.ndarray, sparse.csr_matrix]],
               settled: float) -> np.ndarray:
        """
        Return weights and bias of least squares, shape (K + 1,), by Gauss-Newton steps.

        A step is cut short where the response bends away from its tangent. Where none lowers mean
        square and penalty together, weights stay as they are.

        Parameters
        ----------
        start : ndarray, shape (K + 1,)
        residual : callable
            Of weights and bias, returns that of the rows that are fitted (n,).
        solved : callable
            Of a tangent, returns the weights and bias that suit it best, and the penalty on them
            (K + 1, K + 1).
        settled : float
            A step that changes the residual by a smaller standard deviation is the last.

        Returns
        -------
        ndarray, shape (K + 1,)
        """
        z, here = start, residual(start)
        for _ in range(MOST_TANGENTS):
            best, penalty = solved(self.tangent(z))
            cost = _cost(here, z, penalty)
            for step in STEPS:
                there = z + step * (best - z)
                errors = residual(there)
                # A comparison that NaN does not pass.
                if _cost(errors, there, penalty) < cost:
                    break
            else:
                break
            change, z, here = float(np.std(errors - here)), there, errors
            if change <= settled:
                break
        return z


def _cost(residual: np.ndarray, z: np.ndarray, penalty: sparse.csr_matrix) -> float:
    return float(residual @ residual) / len(residual) + float(z @ (penalty @ z))
