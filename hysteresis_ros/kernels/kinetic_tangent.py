# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What kinetics make of a major loop, and how that follows the loop's weights."""

import numpy as np

from .jit import jit
from .kinetics import ANEW, LEAST


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
        x, formed, reverted = 0.0, 0.0, 0.0
        for n in range(begin, end):
            most, up, down = oriented[n] * whole, rising[n], falling[n]
            here, before = min(up, most), max(n - 1, begin)
            if n == begin or inputs[n] > inputs[before]:
                counted = formed if n == begin else max(formed, rising[before])
                counted = min(counted, most)
                if here > counted and whole - counted > LEAST * whole:
                    left = (whole - here) / (whole - counted)
                    x = whole - (whole - x) * left
                    reverted = whole - (whole - reverted) * left ** ANEW
                formed = max(formed, up)
            elif inputs[n] < inputs[before]:
                counted = min(reverted, falling[before])
                if down < counted and counted > LEAST * whole:
                    left = down / counted
                    x *= left
                    formed *= left ** ANEW
                reverted = min(reverted, down)
            x = min(max(x, here), down)
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
    begin, none = 0, np.zeros(len(z))
    for end in ends:
        x, formed, reverted = 0.0, 0.0, 0.0
        by, by_formed, by_reverted = none, none, none
        for n in range(begin, end):
            most = oriented[n] * top
            here, by_here = (up[n], rising[n]) if up[n] < most else (most, oriented[n] * whole)
            before = max(n - 1, begin)
            if n == begin or inputs[n] > inputs[before]:
                counted, by_counted = formed, by_formed
                if n > begin and up[before] > formed:
                    counted, by_counted = up[before], rising[before]
                if counted > most:
                    counted, by_counted = most, oriented[n] * whole
                if here > counted and top - counted > LEAST * top:
                    left = (top - here) / (top - counted)
                    by_left = (whole - by_here - left * (whole - by_counted)) / (top - counted)
                    by = whole - left * (whole - by) - (top - x) * by_left
                    x = top - (top - x) * left
                    kept, by_kept = left ** ANEW, ANEW * left ** (ANEW - 1.0) * by_left
                    by_reverted = whole - kept * (whole - by_reverted) - (top - reverted) * by_kept
                    reverted = top - (top - reverted) * kept
                if up[n] > formed:
                    formed, by_formed = up[n], rising[n].copy()
            elif inputs[n] < inputs[before]:
                counted, by_counted = reverted, by_reverted
                if down[before] < reverted:
                    counted, by_counted = down[before], falling[before]
                if down[n] < counted and counted > LEAST * top:
                    left = down[n] / counted
                    by_left = (falling[n] - left * by_counted) / counted
                    by = left * by + x * by_left
                    x *= left
                    kept, by_kept = left ** ANEW, ANEW * left ** (ANEW - 1.0) * by_left
                    by_formed = kept * by_formed + formed * by_kept
                    formed *= kept
                if down[n] < reverted:
                    reverted, by_reverted = down[n], falling[n].copy()
            if x < here:
                x, by = here, by_here.copy()
            if x > down[n]:
                x, by = down[n], falling[n].copy()
            found[n] = by / oriented[n]
        begin = end
    return found
