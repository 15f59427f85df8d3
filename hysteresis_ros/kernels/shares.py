# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the weights of a Preisach operator contribute, as shares of their cells, trial by trial."""

import numpy as np

from .areas import branches
from .jit import jit


@jit
def shares(nodes, inputs, ends, wanted):
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

    Returns
    -------
    ndarray, shape (rows wanted, N (N + 1) / 2 + N)

    """
    levels = len(nodes) - 1
    cells = levels * (levels + 1) // 2
    result = np.empty((np.sum(wanted), cells + levels))
    height, length = np.empty(levels), np.empty(levels)
    row = begin = 0
    for end in ends:
        parents, corners = branches(inputs[begin:end], nodes[0])
        needed = wanted[begin:end].copy()
        for n in range(end - begin - 1, -1, -1):
            if needed[n] and parents[n] >= 0:
                needed[parents[n]] = True
        up = np.empty((np.sum(needed), cells))
        place = np.zeros(end - begin, dtype=np.int64)
        used = 0
        for n in range(end - begin):
            if not needed[n]:
                continue
            u, corner, parent = inputs[begin + n], corners[n], parents[n]
            side = 2.0 if u >= corner else -2.0
            alpha, beta = max(u, corner), min(u, corner)
            for k in range(levels):
                width = nodes[k + 1] - nodes[k]
                height[k] = min(max(alpha - nodes[k], 0.0), width) / width
                length[k] = min(max(nodes[k + 1] - beta, 0.0), width) / width
            cell = 0
            for i in range(levels):
                # The triangle between corner and input; a cell on the diagonal is half a square.
                overlap = min(max(height[i] + length[i] - 1.0, 0.0), 1.0)
                up[used, cell] = side * overlap * overlap
                for j in range(i + 1, levels):
                    up[used, cell + j - i] = side * length[i] * height[j]
                cell += levels - i
            if parent >= 0:
                # A corner is an earlier input.
                for cell in range(cells):
                    up[used, cell] += up[place[parent], cell]
            if wanted[begin + n]:
                for cell in range(cells):
                    result[row, cell] = up[used, cell]
                for k in range(levels):
                    width = nodes[k + 1] - nodes[k]
                    result[row, cells + k] = 2.0 * min(max(u - nodes[k], 0.0), width) / width
                row += 1
            place[n] = used
            used += 1
        begin = end
    return result
