# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Block principal pivoting: a quadratic function's minimum under a sign constraint."""

import numpy as np

from .jit import jit

# Rows that are taken off the rows below in one pass, which is the time that memory takes.
PANEL = 4


@jit
def pivot(gram: np.ndarray, moment: np.ndarray, free: np.ndarray, passive: np.ndarray,
          tolerance: float, rounding: float) -> tuple[np.ndarray, int]:
    """
    Minimise x @ gram @ x / 2 - moment @ x with x >= 0 except where `free`.

    Unknowns of the wrong sign change sides together, one at a time when that stops helping. From a
    start for which it does, the search begins once more at the bound.

    Parameters
    ----------
    gram : ndarray, shape (K, K)
        Symmetric.
    moment : ndarray, shape (K,)
    free : ndarray of bool, shape (K,)
        Unknowns without a bound.
    passive : ndarray of bool, shape (K,)
        Unknowns that are probably not at their bound, all free ones among them; becomes those
        that are not.
    tolerance : float
        Size of a gradient that is rounding.
    rounding : float
        Share of the largest unknown below which a sign is rounding.

    Returns
    -------
    x : ndarray, shape (K,)
    state : int
        0 solved, 1 `gram` is not positive definite, 2 not solved.

    """
    size = len(moment)
    fewest, tries = size + 1, 3
    begun = not np.any(passive & ~free)
    x, wrong = np.zeros(size), np.zeros(size, dtype=np.bool_)
    for _ in range(20 * size):
        index = np.flatnonzero(passive)
        values, definite = solved(gram, moment, index)
        if not definite:
            return x, 1
        x[:] = 0.0
        gradient = -moment
        largest = 0.0
        for k in range(len(index)):
            x[index[k]] = values[k]
            value, row = values[k], gram[index[k]]
            for j in range(size):
                gradient[j] += value * row[j]
            largest = max(largest, abs(values[k]))
        count = last = 0
        for k in range(size):
            if passive[k]:
                wrong[k] = not free[k] and x[k] < -rounding * largest
            else:
                wrong[k] = gradient[k] < -tolerance
            if wrong[k]:
                count += 1
                last = k
        if count == 0:
            return x, 0
        if count < fewest:
            fewest, tries = count, 3
        elif tries > 0:
            tries -= 1
        elif not begun:
            # One at a time, a thousand unknowns took a minute, and came to no end.
            fewest, tries, begun = size + 1, 3, True
            passive[:] = free
            continue
        else:
            wrong[:] = False
            wrong[last] = True
        for k in range(size):
            if wrong[k]:
                passive[k] = not passive[k]
    return x, 2


@jit
def solved(gram: np.ndarray, moment: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, bool]:
    """
    Return the unknowns `index` (P,) that are best while all others are zero, by Cholesky.

    The second result says whether their part of `gram` is positive definite.
    """
    count = len(index)
    # Rows of the upper factor, so that each update runs along one.
    factor, values = np.empty((count, count)), np.empty(count)
    for i in range(count):
        values[i] = moment[index[i]]
        for j in range(i, count):
            factor[i, j] = gram[index[i], index[j]]
    for begin in range(0, count, PANEL):
        end = min(begin + PANEL, count)
        for i in range(begin, end):
            if not factor[i, i] > 0.0:
                return values, False
            root = np.sqrt(factor[i, i])
            for k in range(i, count):
                factor[i, k] /= root
            values[i] /= root
            for j in range(i + 1, end):
                _take_off(factor, values, i, j)
        for j in range(end, count):
            if end < begin + PANEL:
                for i in range(begin, end):
                    _take_off(factor, values, i, j)
            else:
                _take_off_panel(factor, values, begin, j)
    for i in range(count - 1, -1, -1):
        for j in range(i + 1, count):
            values[i] -= factor[i, j] * values[j]
        values[i] /= factor[i, i]
    return values, True


@jit
def _take_off(factor: np.ndarray, values: np.ndarray, i: int, j: int) -> None:
    """Take row i of the upper factor off row j, and off the right side."""
    share = factor[i, j]
    values[j] -= share * values[i]
    # Slices from 0 on, because numba divides only such loops among vector registers.
    above, row = factor[i, j:], factor[j, j:]
    for k in range(len(row)):
        row[k] -= share * above[k]


@jit
def _take_off_panel(factor: np.ndarray, values: np.ndarray, i: int, j: int) -> None:
    """Take as many rows as a panel has, from row i on, off row j: the same in one pass."""
    p, q, r, s = factor[i, j], factor[i + 1, j], factor[i + 2, j], factor[i + 3, j]
    values[j] = (values[j] - p * values[i] - q * values[i + 1] - r * values[i + 2]
                 - s * values[i + 3])
    first, second = factor[i, j:], factor[i + 1, j:]
    third, fourth, row = factor[i + 2, j:], factor[i + 3, j:], factor[j, j:]
    for k in range(len(row)):
        row[k] = row[k] - p * first[k] - q * second[k] - r * third[k] - s * fourth[k]
