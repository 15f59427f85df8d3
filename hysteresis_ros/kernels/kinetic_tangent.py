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
            here, counted = min(up, most), min(formed, most)
            if n == begin or inputs[n] > inputs[n - 1]:
                if here > counted and whole - counted > LEAST * whole:
                    left = (whole - here) / (whole - counted)
                    x = whole - (whole - x) * left
                    reverted = down + (reverted - down) * left ** ANEW
                formed = max(formed, up)
            elif inputs[n] < inputs[n - 1]:
                if down < reverted and reverted > LEAST * whole:
                    left = down / reverted
                    x *= left
                    formed = up + (formed - up) * left ** ANEW
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
            if n == begin or inputs[n] > inputs[n - 1]:
                counted, by_counted = (formed, by_formed) if formed < most else (
                    most, oriented[n] * whole)
                if here > counted and top - counted > LEAST * top:
                    left = (top - here) / (top - counted)
                    by_left = (whole - by_here - left * (whole - by_counted)) / (top - counted)
                    by = whole - left * (whole - by) - (top - x) * by_left
                    x = top - (top - x) * left
                    kept = left ** ANEW
                    by_reverted = (falling[n] + kept * (by_reverted - falling[n])
                                   + (reverted - down[n]) * ANEW * left ** (ANEW - 1.0) * by_left)
                    reverted = down[n] + (reverted - down[n]) * kept
                if up[n] > formed:
                    formed, by_formed = up[n], rising[n].copy()
            elif inputs[n] < inputs[n - 1] and down[n] < reverted:
                if reverted > LEAST * top:
                    left = down[n] / reverted
                    by_left = (falling[n] - left * by_reverted) / reverted
                    by = left * by + x * by_left
                    x *= left
                    kept = left ** ANEW
                    by_formed = (rising[n] + kept * (by_formed - rising[n])
                                 + (formed - up[n]) * ANEW * left ** (ANEW - 1.0) * by_left)
                    formed = up[n] + (formed - up[n]) * kept
                reverted, by_reverted = down[n], falling[n].copy()
            if x < here:
                x, by = here, by_here.copy()
            if x > down[n]:
                x, by = down[n], falling[n].copy()
            found[n] = by / oriented[n]
        begin = end
    return found
