# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Preisach operators in series that are alike but for their inputs: one Preisach operator again.

Where the input of one of them is an increasing function phi(u) of a common input u, a relay that
switches at (alpha, beta) does so at u = phi^-1(alpha) and phi^-1(beta). So the operator of u has
the weight of the cell ``[phi(x_b), phi(x_b+1)] x [phi(x_a), phi(x_a+1)]`` in the cell of the nodes
x_a and x_b, and the mean of many operators the mean of these weights::

    W = sum of p_k A_k W_1 A_k^T,    A_k[a, i] = (cell i and phi_k(cell a)) / (x_a+1 - x_a)

with p_k their parts, W and W_1 the densities, symmetric in alpha and beta, and `and` the length in
common. In the corners of the cells the Everett function is exact; inside a cell the weight is even
again.
"""

import numpy as np

from ..errors import ParameterError
from .everett import cells
from .preisach import Preisach


def mean_in_series(operator: Preisach, nodes: np.ndarray, inputs: np.ndarray,
                   parts: np.ndarray) -> Preisach:
    """
    Return the mean of operators that are alike, each with an input of its own.

    Parameters
    ----------
    operator : Preisach
        One of them.
    nodes : ndarray, shape (N + 1,)
        Grid of the common input, strictly increasing.
    inputs : ndarray, shape (K, N + 1)
        Input of each operator at the nodes, increasing, from the lower end of its range or below
        to the upper end or above.
    parts : ndarray, shape (K,)
        Part of each in the mean; their sum is 1.

    Raises
    ------
    ParameterError
        If `inputs` do not cover the range, so that some relays would have no place.
    """
    if np.any(inputs[:, 0] > operator.lower) or np.any(inputs[:, -1] < operator.upper):
        raise ParameterError('operators in series: inputs do not cover the range '
                             f'{operator.lower:g} to {operator.upper:g}')
    levels = len(operator.nodes) - 1
    beta, alpha = cells(levels)
    density = np.zeros((levels, levels))
    density[beta, alpha] = density[alpha, beta] = operator.weights
    below = np.clip(inputs[:, :, None] - operator.nodes[:-1], 0.0, np.diff(operator.nodes))
    width = np.diff(nodes)
    overlap = np.diff(below, axis=1) / width[:, None]
    mean = np.einsum('k,kab->ab', parts, overlap @ density @ overlap.transpose(0, 2, 1))
    slopes = np.einsum('k,kai,i->a', parts, overlap, operator.reversible)
    return Preisach(nodes, mean[cells(len(width))], operator.bias, slopes)
