# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which rows of a trial an arm at rest has to be balanced in, and what lies between them.

The memory of a play or of a Preisach operator is made of turning points alone. While everything
that moves the arm goes one way, the rows in between change nothing that comes after.
"""

import numpy as np

from .jit import jit


@jit
def balanced_rows(columns: np.ndarray, asked: np.ndarray, spacing: float) -> np.ndarray:
    """
    Return the rows that are asked for, and all in which an input turns, starts or stops.

    Parameters
    ----------
    columns : ndarray, shape (k, rows)
        What moves the arm; the first is the output of the first stage.
    asked : ndarray of bool, shape (rows,)
    spacing : float
        Farthest that the first column may go from one of the rows returned to the next, but within
        a single row.

    Returns
    -------
    ndarray of int, shape (m,)
        In ascending order, with the first and the last.

    """
    count, rows = columns.shape
    kept = np.empty(rows, dtype=np.int64)
    size, last = 0, 0
    for n in range(rows):
        keep = asked[n] or n == 0 or n == rows - 1
        if not keep:
            keep = abs(columns[0, n + 1] - columns[0, last]) > spacing
            for k in range(count):
                keep = keep or (np.sign(columns[k, n] - columns[k, n - 1])
                                != np.sign(columns[k, n + 1] - columns[k, n]))
        if keep:
            kept[size] = last = n
            size += 1
    return kept[:size]


@jit
def between(kept: np.ndarray, x: np.ndarray, values: np.ndarray) -> np.ndarray:
    """
    Return a column in all rows, from those of `balanced_rows`: linear in x between them.

    Parameters
    ----------
    kept : ndarray of int, shape (m,)
    x : ndarray, shape (rows,)
        Output of the first stage.
    values : ndarray, shape (m,)
        The column in the rows `kept`.

    Returns
    -------
    ndarray, shape (rows,)

    """
    column = np.empty(len(x))
    column[0] = values[0]
    for place in range(1, len(kept)):
        begin, end = kept[place - 1], kept[place]
        way, change = x[end] - x[begin], values[place] - values[place - 1]
        for n in range(begin, end):
            share = (x[n] - x[begin]) / way if way != 0.0 else (n - begin) / (end - begin)
            column[n] = values[place - 1] + share * change
        column[end] = values[place]
    return column
