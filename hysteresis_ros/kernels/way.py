# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Variation from row to row of a response that rises with its input, without its noise."""

import numpy as np

from .jit import jit


@jit
def risen(inputs: np.ndarray, response: np.ndarray, trial: np.ndarray) -> np.ndarray:
    """
    Return by how much each row goes beyond all rows since the input's last turn.

    Noise goes to and fro, and so counts once in a branch and not in every row.

    Parameters
    ----------
    inputs, response : ndarray, shape (n,)
    trial : ndarray of int, shape (n,)
        Trial of each row.

    Returns
    -------
    ndarray, shape (n - 1,)

    """
    steps = np.zeros(max(len(inputs) - 1, 0))
    side, furthest = 0.0, 0.0
    for n in range(len(steps)):
        if n == 0 or trial[n] != trial[n - 1]:
            side, furthest = 0.0, response[n]
        if trial[n + 1] != trial[n]:
            continue
        way = inputs[n + 1] - inputs[n]
        if way * side <= 0.0 and way != 0.0:
            side, furthest = (1.0 if way > 0.0 else -1.0), response[n]
        beyond = side * (response[n + 1] - furthest)
        if beyond > 0.0:
            steps[n], furthest = beyond, response[n + 1]
    return steps
