# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Preisach plane cut into cells, and the weight above any of its points.

The weight function is constant in each cell of a triangular grid (below Eq. 5). Cell (i, j) of
Eqs. 6 and 8 is the i-th interval of beta from below and the j-th interval of alpha counted from
the diagonal: beta in [x_(i-1), x_i], alpha in [x_(i+j-2), x_(i+j-1)]; j = 1 are the triangles on
the diagonal. The Everett function E(alpha, beta) is the weight over the triangle
{beta <= b <= a <= alpha}; in a cell it is

    E = E(x_a, x_(b+1)) + A p + C q + w p q + (w_a p^2 + w_b q^2) / 2

with p = alpha - x_a, q = x_(b+1) - beta, the weights w, w_a, w_b of the cell and of the two
diagonal cells beside it, and A, C the weight along the row and along the column up to the cell.
In a diagonal cell it is w (alpha - beta)^2 / 2. All terms are non-negative: nothing cancels.

A weight can also lie on the diagonal beta = alpha itself, g per unit of its length: relays without
a loop, the limit of ever smaller diagonal cells. It adds g (alpha - beta) in a diagonal cell, g_a
to A and g_b to C.
"""

import numpy as np

from ..errors import ParameterError
from .base import LARGEST, numbers

# Nodes closer than this share of the range are taken for a mistake.
CLOSEST = 1e-12


def check_nodes(nodes: np.ndarray) -> np.ndarray:
    """
    Return grid nodes as a checked array.

    Parameters
    ----------
    nodes : array_like, shape (N + 1,)
        Strictly increasing inputs at which the weight may jump; they need not be equidistant.

    Raises
    ------
    ParameterError
        If there are fewer than two, or they are not finite or not strictly increasing.

    """
    array = numbers(nodes, 'Preisach nodes')
    if len(array) < 2:
        raise ParameterError(f'Preisach nodes: {len(array)} given, at least 2 are needed')
    if np.max(np.abs(array)) > LARGEST:
        raise ParameterError(f'Preisach nodes: beyond {LARGEST:g}, use another unit')
    gaps = np.diff(array)
    if not np.all(gaps > CLOSEST * (array[-1] - array[0])):
        raise ParameterError(
            f'Preisach nodes: entry {int(np.argmin(gaps)) + 1} ({array[np.argmin(gaps) + 1]!r}) '
            'is not above the one before it')
    return array


def cells(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the intervals of beta and alpha of each cell, in the order of Eq. 8.

    Parameters
    ----------
    levels : int
        Number N of intervals of the grid.

    Returns
    -------
    beta, alpha : ndarray of int, shape (N (N + 1) / 2,)
        Index of the interval from below, from 0; alpha >= beta, equal on the diagonal.

    """
    beta, alpha = np.triu_indices(levels)
    return beta, alpha


def cell_areas(nodes: np.ndarray) -> np.ndarray:
    """Return the area of each cell, shape (N (N + 1) / 2,), in the order of Eq. 8."""
    width = np.diff(nodes)
    beta, alpha = cells(len(width))
    return width[beta] * width[alpha] * np.where(beta == alpha, 0.5, 1.0)


def everett_table(nodes: np.ndarray, weights: np.ndarray,
                  slopes: np.ndarray) -> tuple[np.ndarray, float]:
    """
    Return the Everett function of a piecewise constant weight as `kernels.preisach` reads it.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Checked grid nodes.
    weights : ndarray, shape (N (N + 1) / 2,)
        Non-negative weights in the order of Eq. 8.
    slopes : ndarray, shape (N,)
        Non-negative weights on the diagonal itself, one an interval.

    Returns
    -------
    table : ndarray, shape (3 N + 1 + 4 N^2,)
        Nodes, half the weights of the diagonal cells, slopes, and for each interval of alpha and
        of beta E at the cell's corner, the weight along row and column, and in the cell.
    total : float
        E over the whole plane.

    """
    levels = len(nodes) - 1
    width = np.diff(nodes)
    beta, alpha = cells(levels)
    density = np.zeros((levels, levels))
    density[beta, alpha] = weights
    mass = np.zeros((levels, levels))
    mass[beta, alpha] = weights * cell_areas(nodes)

    # corner[b, a] = E(x_a, x_b); row[b, a]: weight of alpha's interval a from x_b to x_a;
    # column[b, a]: weight of beta's interval b from x_(b+1) to x_a.
    corner = np.zeros((levels + 1, levels + 1))
    corner[:levels, 1:] = np.cumsum(np.cumsum(mass[::-1], axis=0)[::-1], axis=1)
    row = np.zeros((levels + 1, levels))
    column = np.zeros((levels, levels + 1))
    across = np.triu(density * width[:, None], 1)
    row[:levels] = np.cumsum(across[::-1], axis=0)[::-1]
    column[:, 1:] = np.cumsum(np.triu(density * width[None, :], 1), axis=1)

    along = np.concatenate(([0.0], np.cumsum(slopes * width)))
    corner += np.triu(along[None, :] - along[:, None])
    row += slopes[None, :]
    column += slopes[:, None]
    cell = np.stack((corner[1:, :levels].T, row[1:].T, column[:, :levels].T, density.T), axis=-1)
    table = np.concatenate((nodes, np.diag(density) / 2.0, slopes, cell.ravel()))
    return table, float(corner[0, levels])
