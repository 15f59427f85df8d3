# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Exact signed areas of the cells of the Preisach plane: the rows of the least squares."""

import numpy as np

from ..errors import ParameterError
from ..kernels import areas as kernel
from .base import sequence
from .everett import check_nodes


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
    return kernel.signed_areas(nodes, np.clip(inputs, nodes[0], nodes[-1]))


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
    return kernel.signed_lengths(check_nodes(nodes), np.ascontiguousarray(sequence(inputs)))
