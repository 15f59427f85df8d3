# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The penalty on a rough Preisach weight function.

It acts on weight times area (reversible weight times length), brought back to densities on a plane
of side 1, so that it means the same on every grid. Penalised are differences between cells that are
neighbours along the diagonal, because they stand for loops of the same width, and, less, the
densities themselves, so that cells without data stay at zero. Differences across the diagonal are
not: there the weight of a mild hysteresis rises steeply.
"""

import functools
from typing import NamedTuple

import numpy as np
from scipy import sparse

from hysteresis_ros.operators import cells

# Density of the cells, and of the reversible weights, against its smoothness.
CELL_RIDGE, REVERSIBLE_RIDGE = 0.1, 10.0


class _Grid(NamedTuple):
    """Intervals of each cell (K,), and which two cells are neighbours along the diagonal (R,)."""

    beta: np.ndarray
    alpha: np.ndarray
    first: np.ndarray
    second: np.ndarray


class _Penalty(NamedTuple):
    """What is penalised: both cells of each difference (R,), cells (K,) and intervals (N,)."""

    first: np.ndarray
    second: np.ndarray
    cells: np.ndarray
    intervals: np.ndarray


@functools.lru_cache(maxsize=8)
def _grid(levels: int) -> _Grid:
    beta, alpha = cells(levels)
    # Cells in the order of Eq. 8: rows of beta, each from its diagonal on.
    place = np.full((levels + 1, levels + 1), -1)
    place[beta, alpha] = np.arange(len(beta))
    second = place[beta + 1, alpha + 1]
    first = np.flatnonzero(second >= 0)
    return _Grid(beta, alpha, first, second[first])


def _penalty(nodes: np.ndarray) -> _Penalty:
    width = np.diff(nodes) / (nodes[-1] - nodes[0])
    beta, alpha, first, second = _grid(len(width))
    area = width[beta] * width[alpha] * np.where(beta == alpha, 0.5, 1.0)
    # Squared distance of the two cells' middles, in units of a diagonal step on this grid.
    step = (np.square(width[beta[first]] + width[beta[second]])
            + np.square(width[alpha[first]] + width[alpha[second]])) / 8.0
    gain = np.sqrt((area[first] + area[second]) / (2.0 * step))
    return _Penalty(gain / area[first], gain / area[second], np.sqrt(CELL_RIDGE / area),
                    np.sqrt(REVERSIBLE_RIDGE / width))


def smoothness(nodes: np.ndarray, reversible: bool = False) -> np.ndarray:
    """
    Return the root of the penalty.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Grid.
    reversible : bool
        Whether columns for the N reversible weights follow those of the K cells.

    Returns
    -------
    ndarray, shape (R, K) or (R, K + N)
    """
    found, grid = _penalty(nodes), _grid(len(nodes) - 1)
    differences = np.zeros((len(grid.first), len(found.cells)))
    row = np.arange(len(grid.first))
    differences[row, grid.first] = found.first
    differences[row, grid.second] = -found.second
    root = np.vstack([differences, np.diag(found.cells)])
    if not reversible:
        return root
    ridge = np.diag(found.intervals)
    return np.block([[root, np.zeros((len(root), len(ridge)))],
                     [np.zeros((len(ridge), root.shape[1])), ridge]])


def smoothness_square(nodes: np.ndarray) -> sparse.csr_matrix:
    """
    Return the square of the penalty's root.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Grid.

    Returns
    -------
    csr_matrix, shape (K + N + 1, K + N + 1)
        Of cells, reversible weights and the bias, which costs nothing.
    """
    found, grid = _penalty(nodes), _grid(len(nodes) - 1)
    diagonal = np.concatenate((found.cells ** 2, found.intervals ** 2, [0.0]))
    diagonal[grid.first] += found.first ** 2
    diagonal[grid.second] += found.second ** 2
    mixed = -found.first * found.second
    order, columns, ends = _places(len(nodes) - 1)
    return sparse.csr_matrix(
        (np.concatenate((diagonal, mixed, mixed))[order], columns, ends),
        shape=(len(diagonal),) * 2)


@functools.lru_cache(maxsize=8)
def _places(levels: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the order of the square's entries, row by row, their columns, and the rows' ends."""
    grid = _grid(levels)
    size = len(grid.beta) + levels + 1
    every = np.arange(size)
    rows = np.concatenate((every, grid.first, grid.second))
    columns = np.concatenate((every, grid.second, grid.first))
    order = np.lexsort((columns, rows))
    ends = np.searchsorted(rows[order], np.arange(size + 1))
    return order, columns[order].astype(np.int32), ends.astype(np.int32)
