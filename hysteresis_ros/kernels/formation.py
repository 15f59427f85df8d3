# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What martensite keeps of the load under which it formed."""

import numpy as np

from .jit import jit


@jit
def formed(outputs: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """
    Return the elongation of martensite that keeps the strain with which it formed.

    What is added has the strain of its moment; what goes back takes the mean strain along, as in
    the unified model of Lagoudas and others, Int. J. Plasticity 32-33 (2012) 155.

    Parameters
    ----------
    outputs, scales : ndarray, shape (rows,)
        Output of H2 above its least, and the factor by which the load of each row makes its
        strain larger. The first row formed under its own load.

    Returns
    -------
    ndarray, shape (rows,)

    """
    elongation = np.empty(len(outputs))
    present = scales[0] * outputs[0]
    elongation[0] = present
    for n in range(1, len(outputs)):
        change = outputs[n] - outputs[n - 1]
        if change > 0.0:
            present += scales[n] * change
        elif change < 0.0:
            present *= outputs[n] / outputs[n - 1]
        elongation[n] = present
    return elongation
