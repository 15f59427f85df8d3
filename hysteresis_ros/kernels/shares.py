# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the weights of a Preisach operator contribute, as shares of their cells, trial by trial."""

import numpy as np

from .areas import branches
from .jit import jit


@jit
def shares(nodes: np.ndarray, inputs: np.ndarray, ends: np.ndarray, wanted: np.ndarray,
           scale: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """
    Return twice the share of each cell whose relays are up, then that of each diagonal interval.

    Times the cells' areas (the intervals' lengths) these are the signed areas (lengths) above
    those of the cold state.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Grid nodes.
    inputs : ndarray, shape (M,)
        Inputs inside the grid, trial after trial; each trial starts from the cold state.
    ends : ndarray of int, shape (trials,)
        Where in `inputs` each trial ends.
    wanted : ndarray of bool, shape (M,)
        Inputs whose rows are returned.
    scale : ndarray, shape (rows wanted,)
        Factor on each row.
    columns : ndarray of int, shape (C,)
        What to return: cells in the order of Eq. 8, the N intervals, and last a column of ones.

    Returns
    -------
    ndarray, shape (rows wanted, C)

    """
    levels = len(nodes) - 1
    cells = levels * (levels + 1) // 2
    lower, upper = np.empty(cells, dtype=np.int64), np.empty(cells, dtype=np.int64)
    cell = 0
    for i in range(levels):
        for j in range(i, levels):
            lower[cell], upper[cell] = i, j
            cell += 1
    width = nodes[1:] - nodes[:-1]
    height, length = np.empty(levels), np.empty(levels)
    result = np.empty((len(scale), len(columns)))
    row = begin = 0
    for end in ends:
        parents, corners = branches(inputs[begin:end], nodes[0])
        # A corner is an earlier input, whose row is needed, too.
        needed = wanted[begin:end].copy()
        for n in range(end - begin - 1, -1, -1):
            if needed[n] and parents[n] >= 0:
                needed[parents[n]] = True
        up = np.zeros((np.sum(needed), len(columns)))
        place = np.cumsum(needed) - 1
        for n in range(end - begin):
            if not needed[n]:
                continue
            u, corner, parent, here = inputs[begin + n], corners[n], parents[n], place[n]
            side = 2.0 if u >= corner else -2.0
            alpha, beta = max(u, corner), min(u, corner)
            for k in range(levels):
                height[k] = min(max(alpha - nodes[k], 0.0), width[k]) / width[k]
                length[k] = min(max(nodes[k + 1] - beta, 0.0), width[k]) / width[k]
            if parent >= 0:
                up[here] = up[place[parent]]
            for c in range(len(columns)):
                cell = columns[c]
                if cell < cells:
                    i, j = lower[cell], upper[cell]
                    if i < j:
                        up[here, c] += side * length[i] * height[j]
                    else:
                        # The triangle between corner and input; such a cell is half a square.
                        overlap = min(max(height[i] + length[i] - 1.0, 0.0), 1.0)
                        up[here, c] += side * overlap * overlap
                elif cell < cells + levels:
                    k = cell - cells
                    up[here, c] = 2.0 * min(max(u - nodes[k], 0.0), width[k]) / width[k]
                else:
                    up[here, c] = 1.0
            if wanted[begin + n]:
                for c in range(len(columns)):
                    result[row, c] = up[here, c]
                    if columns[c] < cells + levels:
                        result[row, c] *= scale[row]
                row += 1
        begin = end
    return result
