# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What kinetics make of a major loop, and how that follows the loop's weights."""

import numpy as np

from .jit import jit
from .kinetics import LEAST


@jit
def transformed(rising: np.ndarray, falling: np.ndarray, whole: float, inputs: np.ndarray,
                oriented: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """
    Return P / g of each row, in the unit of the branches; see `kernels.kinetics`.

    Parameters
    ----------
    rising, falling : ndarray, shape (M,)
        Branches of the major loop at the inputs.
    whole : float
        What the loop gives from end to end.
    inputs : ndarray, shape (M,)
        Inputs, trial after trial; each trial starts from the lower end.
    oriented : ndarray, shape (M,)
        g, the share of what forms that is oriented.
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
            before, most = n - 1, oriented[n] * whole
            here = min(rising[n], most)
            if n == begin:
                x = here
            elif inputs[n] > inputs[before]:
                left = whole - min(rising[before], most)
                if left > LEAST * whole:
                    x = whole - (whole - x) * (whole - here) / left
            elif inputs[n] < inputs[before]:
                there = falling[before]
                if there > LEAST * whole:
                    x *= falling[n] / there
            x = min(max(x, here), falling[n])
            found[n] = x / oriented[n]
        begin = end
    return found


@jit
def derivative(rising: np.ndarray, falling: np.ndarray, whole: np.ndarray, z: np.ndarray,
               inputs: np.ndarray, oriented: np.ndarray, ends: np.ndarray) -> np.ndarray:
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
    oriented : ndarray, shape (M,)
        g, the share of what forms that is oriented.
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
            before, most = n - 1, oriented[n] * top
            here, move = (up[n], rising[n]) if up[n] < most else (most, oriented[n] * whole)
            if n == begin:
                x, by = here, move.copy()
            elif inputs[n] > inputs[before]:
                past, moved = (up[before], rising[before]) if up[before] < most else (
                    most, oriented[n] * whole)
                left = top - past
                if left > LEAST * top:
                    share, remaining = (top - here) / left, top - x
                    by = whole - share * (whole - by) - remaining / left * (
                        whole - move - share * (whole - moved))
                    x = top - remaining * share
            elif inputs[n] < inputs[before]:
                there = down[before]
                if there > LEAST * top:
                    share = down[n] / there
                    by = share * by + x / there * (falling[n] - share * falling[before])
                    x *= share
            if x < here:
                x, by = here, move.copy()
            if x > down[n]:
                x, by = down[n], falling[n].copy()
            found[n] = by / oriented[n]
        begin = end
    return found
