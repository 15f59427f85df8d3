# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What kinetics make of a major loop, and how that follows the loop's weights."""

import numpy as np

from .jit import jit
from .kinetics import LEAST


@jit
def transformed(rising: np.ndarray, falling: np.ndarray, whole: float, inputs: np.ndarray,
                ends: np.ndarray) -> np.ndarray:
    """
    Return what has transformed in each row, in the unit of the branches; see `kernels.kinetics`.

    Parameters
    ----------
    rising, falling : ndarray, shape (M,)
        Branches of the major loop at the inputs.
    whole : float
        What the loop gives from end to end.
    inputs : ndarray, shape (M,)
        Inputs, trial after trial; each trial starts from the lower end.
    ends : ndarray of int, shape (trials,)
        Where in `inputs` each trial ends.

    Returns
    -------
    ndarray, shape (M,)
    """
    found = np.empty(len(inputs))
    begin = 0
    for end in ends:
        x = 0.0
        for n in range(begin, end):
            before = n - 1
            if n == begin:
                x = rising[n]
            elif inputs[n] > inputs[before]:
                left = whole - rising[before]
                if left > LEAST * whole:
                    x = whole - (whole - x) * (whole - rising[n]) / left
            elif inputs[n] < inputs[before]:
                there = falling[before]
                if there > LEAST * whole:
                    x *= falling[n] / there
            x = min(max(x, rising[n]), falling[n])
            found[n] = x
        begin = end
    return found


@jit
def derivative(rising: np.ndarray, falling: np.ndarray, whole: np.ndarray, z: np.ndarray,
               inputs: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """
    Return the derivative of `transformed` with respect to each of the weights.

    Parameters
    ----------
    rising, falling : ndarray, shape (M, K)
        What each weight contributes to the branches of the major loop at the inputs.
    whole : ndarray, shape (K,)
        What each contributes to the loop from end to end.
    z : ndarray, shape (K,)
        The weights.
    inputs : ndarray, shape (M,)
        Inputs, trial after trial; each trial starts from the lower end.
    ends : ndarray of int, shape (trials,)
        Where in `inputs` each trial ends.

    Returns
    -------
    ndarray, shape (M, K)
    """
    found = np.empty(rising.shape)
    up, down, top = rising @ z, falling @ z, whole @ z
    begin = 0
    for end in ends:
        x, by = 0.0, np.zeros(len(z))
        for n in range(begin, end):
            before = n - 1
            if n == begin:
                x, by = up[n], rising[n].copy()
            elif inputs[n] > inputs[before]:
                left = top - up[before]
                if left > LEAST * top:
                    share, remaining = (top - up[n]) / left, top - x
                    by = whole - share * (whole - by) - remaining / left * (
                        whole - rising[n] - share * (whole - rising[before]))
                    x = top - remaining * share
            elif inputs[n] < inputs[before]:
                there = down[before]
                if there > LEAST * top:
                    share = down[n] / there
                    by = share * by + x / there * (falling[n] - share * falling[before])
                    x *= share
            if x < up[n]:
                x, by = up[n], rising[n].copy()
            if x > down[n]:
                x, by = down[n], falling[n].copy()
            found[n] = by
        begin = end
    return found
