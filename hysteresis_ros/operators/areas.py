# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Exact signed areas of the cells of the Preisach plane: the rows of the least squares."""

from bisect import bisect_left

import numpy as np

from ..errors import ParameterError
from .base import sequence
from .everett import cell_areas, cells, check_nodes


def signed_areas(nodes: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """
    Return the signed areas s_ij(n) of Eq. 6 after each input, from the cold state.

    Parameters
    ----------
    nodes : array_like, shape (N + 1,)
        Grid nodes, strictly increasing.
    inputs : array_like, shape (M,)
        Inputs in their order in time. One outside the grid counts as the nearer end.

    Returns
    -------
    ndarray, shape (M, N (N + 1) / 2)
        Area where the relays are up minus area where they are down, cells in the order of
        Eq. 8. Output of a Preisach operator = areas @ weights + bias.

    Raises
    ------
    ParameterError
        If the nodes are not increasing or an input is not finite.

    """
    nodes = check_nodes(nodes)
    inputs = sequence(inputs)
    if not np.all(np.isfinite(inputs)):
        raise ParameterError(
            f'Preisach areas: input {int(np.argmin(np.isfinite(inputs)))} is not finite')
    inputs = np.clip(inputs, nodes[0], nodes[-1])
    parents, corners = _history(inputs.tolist(), float(nodes[0]))

    rising = inputs >= corners
    areas = _triangles(nodes, np.maximum(inputs, corners), np.minimum(inputs, corners))
    areas[~rising] *= -1.0
    # A corner is an earlier input (or the cold state, -1), so one pass in order is enough.
    for n, parent in enumerate(parents):
        if parent >= 0:
            areas[n] += areas[parent]
    areas *= 2.0
    areas -= cell_areas(nodes)
    return areas


def signed_lengths(nodes: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """
    Return the signed lengths of the diagonal's intervals: the rows of the reversible weights.

    Parameters
    ----------
    nodes : array_like, shape (N + 1,)
        Grid nodes, strictly increasing.
    inputs : array_like, shape (M,)
        Inputs; without a loop their order does not matter.

    Returns
    -------
    ndarray, shape (M, N)
        Length of each interval below the input less its length above.

    Raises
    ------
    ParameterError
        If the nodes are not increasing.

    """
    nodes = check_nodes(nodes)
    width = np.diff(nodes)
    return 2.0 * np.clip(sequence(inputs)[:, None] - nodes[:-1], 0.0, width) - width


def _history(inputs: list[float], lower: float) -> tuple[list[int], np.ndarray]:
    """
    Find the corner of the staircase that the branch of each input starts from.

    Returns
    -------
    parents : list of int
        Index of the input that made the corner, -1 for the cold state.
    corners : ndarray, shape (M,)
        The corner's input.

    """
    # Minima and, negated, maxima that are not wiped out; both ascend, so bisection finds the
    # survivors. Corner k of the staircase is minimum k, then maximum k.
    minima, maxima = [lower], []
    minimum_of, maximum_of = [-1], []
    parents, corners = [], []
    last, present, up = -1, lower, True
    for n, u in enumerate(inputs):
        if u > present and not up:
            minima.append(present)
            minimum_of.append(last)
            up = True
        elif u < present and up:
            maxima.append(-present)
            maximum_of.append(last)
            up = False
        if up:
            keep = bisect_left(maxima, -u)
            del maxima[keep:], maximum_of[keep:], minima[keep + 1:], minimum_of[keep + 1:]
            parents.append(minimum_of[-1])
            corners.append(minima[-1])
        else:
            keep = bisect_left(minima, u)
            if keep == 0:
                # Negative saturation is the cold state.
                minima, maxima, minimum_of, maximum_of = [lower], [], [-1], []
                up = True
                parents.append(-1)
                corners.append(lower)
            else:
                del minima[keep:], minimum_of[keep:], maxima[keep:], maximum_of[keep:]
                parents.append(maximum_of[-1])
                corners.append(-maxima[-1])
        last, present = n, u
    return parents, np.array(corners)


def _triangles(nodes: np.ndarray, alpha: np.ndarray, beta: np.ndarray) -> np.ndarray:
    """Return the area of {beta <= b <= a <= alpha} in each cell, shape (M, cells)."""
    width = np.diff(nodes)
    i, j = cells(len(width))
    height = np.clip(alpha[:, None] - nodes[:-1], 0.0, width)
    length = np.clip(nodes[1:] - beta[:, None], 0.0, width)
    areas = length[:, i] * height[:, j]
    diagonal = np.clip(height + length - width, 0.0, width)
    areas[:, i == j] = 0.5 * np.square(diagonal)
    return areas
