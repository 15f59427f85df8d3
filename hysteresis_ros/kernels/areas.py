# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Exact signed areas of the cells of the Preisach plane after each of many inputs."""

import numpy as np

from .jit import jit


@jit
def signed_areas(nodes: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """
    Return the signed areas s_ij(n) of Eq. 6 after each input, from the cold state.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Grid nodes.
    inputs : ndarray, shape (M,)
        Inputs inside the grid, in their order in time.

    Returns
    -------
    ndarray, shape (M, N (N + 1) / 2)

    """
    levels = len(nodes) - 1
    width = nodes[1:] - nodes[:-1]
    areas = np.empty((len(inputs), levels * (levels + 1) // 2))
    parents, corners = branches(inputs, nodes[0])
    height, length = np.empty(levels), np.empty(levels)
    for n in range(len(inputs)):
        u, corner, parent = inputs[n], corners[n], parents[n]
        side = 1.0 if u >= corner else -1.0
        alpha, beta = max(u, corner), min(u, corner)
        for k in range(levels):
            height[k] = min(max(alpha - nodes[k], 0.0), width[k])
            length[k] = min(max(nodes[k + 1] - beta, 0.0), width[k])
        cell = 0
        for i in range(levels):
            for j in range(i, levels):
                # The triangle between corner and input.
                if i == j:
                    overlap = min(max(height[i] + length[i] - width[i], 0.0), width[i])
                    area = 0.5 * overlap * overlap
                else:
                    area = length[i] * height[j]
                area *= side
                # A corner is an earlier input (or the cold state, -1).
                if parent >= 0:
                    area += areas[parent, cell]
                areas[n, cell] = area
                cell += 1
    for n in range(len(inputs)):
        cell = 0
        for i in range(levels):
            for j in range(i, levels):
                whole = width[i] * width[j] * (0.5 if i == j else 1.0)
                areas[n, cell] = 2.0 * areas[n, cell] - whole
                cell += 1
    return areas


@jit
def branches(inputs: np.ndarray, lower: float) -> tuple[np.ndarray, np.ndarray]:
    """
    Find the corner of the staircase that the branch of each input starts from.

    Parameters
    ----------
    inputs : ndarray, shape (M,)
    lower : float
        Input of the cold state.

    Returns
    -------
    parents : ndarray of int, shape (M,)
        Index of the input that made the corner, -1 for the cold state.
    corners : ndarray, shape (M,)
        The corner's input.

    """
    count = len(inputs)
    parents, corners = np.empty(count, dtype=np.int64), np.empty(count)
    # The staircase without its first maximum: minimum, maximum, minimum, ...; an odd number of
    # corners means that the input rises.
    stack, makers = np.empty(count + 2), np.empty(count + 2, dtype=np.int64)
    stack[0], makers[0] = lower, -1
    depth, last, present = 1, -1, lower
    for n in range(count):
        u = inputs[n]
        up = depth & 1 == 1
        if (u > present and not up) or (u < present and up):
            stack[depth], makers[depth] = present, last
            depth += 1
            up = not up
        if up:
            while depth > 1 and stack[depth - 2] <= u:
                depth -= 2
        elif u <= lower:
            # Negative saturation is the cold state.
            depth = 1
        else:
            while stack[depth - 2] >= u:
                depth -= 2
        parents[n], corners[n] = makers[depth - 1], stack[depth - 1]
        last, present = n, u
    return parents, corners


@jit
def signed_lengths(nodes: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """
    Return the length of each interval below each input less its length above.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
    inputs : ndarray, shape (M,)

    Returns
    -------
    ndarray, shape (M, N)

    """
    levels = len(nodes) - 1
    lengths = np.empty((len(inputs), levels))
    for n in range(len(inputs)):
        for k in range(levels):
            width = nodes[k + 1] - nodes[k]
            lengths[n, k] = 2.0 * min(max(inputs[n] - nodes[k], 0.0), width) - width
    return lengths
