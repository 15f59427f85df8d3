# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts of a symmetric matrix that is mostly zeros, in the three arrays of compressed rows."""

import numpy as np

from .jit import jit


@jit
def part(starts: np.ndarray, columns: np.ndarray, values: np.ndarray, index: np.ndarray
         ) -> np.ndarray:
    """
    Return some rows of a matrix and the same columns, with their zeros.

    Parameters
    ----------
    starts : ndarray of int, shape (K + 1,)
        Where each row's entries begin; `indptr` of SciPy's compressed rows.
    columns : ndarray of int, shape (E,)
        Column of each entry (`indices`).
    values : ndarray, shape (E,)
        Entries (`data`).
    index : ndarray of int, shape (P,)
        Rows, each once.

    Returns
    -------
    ndarray, shape (P, P)

    """
    count = len(index)
    found, place = np.zeros((count, count)), np.full(len(starts) - 1, -1)
    for k in range(count):
        place[index[k]] = k
    for k in range(count):
        for entry in range(starts[index[k]], starts[index[k] + 1]):
            if place[columns[entry]] >= 0:
                found[k, place[columns[entry]]] += values[entry]
    return found


@jit
def product(x: np.ndarray, starts: np.ndarray, columns: np.ndarray, values: np.ndarray,
            index: np.ndarray) -> np.ndarray:
    """
    Return a vector times some rows of a matrix, shape (K,).

    Parameters
    ----------
    x : ndarray, shape (P,)
    starts, columns, values, index : ndarray
        As of `part`.

    """
    found = np.zeros(len(starts) - 1)
    for k in range(len(index)):
        for entry in range(starts[index[k]], starts[index[k] + 1]):
            found[columns[entry]] += x[k] * values[entry]
    return found
