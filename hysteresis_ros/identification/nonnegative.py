# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Least squares under a sign constraint, fast from a neighbouring solution."""

from typing import Optional

import numpy as np
from scipy import linalg, sparse
from scipy.linalg import lapack

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.kernels.pivoting import pivot
from hysteresis_ros.kernels.sparse import part, product

# Share of the largest gradient below which a sign is rounding.
TOLERANCE = 1e-11
# Share of the largest unknown below which a sign is rounding.
ROUNDING = 1e-12
SINGULAR = 1        # state of `pivot`
# Unknowns that are tried at once, at least.
FEWEST_MORE = 10
# Share of unknowns off their bound from which on all are taken at once.
MANY = 0.3
# Share of its excitation below which an unknown counts as not excited at all.
LEAST_EXCITED = 1e-3
NO_SOLUTION = 'least squares: the problem is singular; use a strength above 0'


def solve_nonnegative(
        gram: np.ndarray, moment: np.ndarray, free: np.ndarray,
        start: Optional[np.ndarray] = None) -> tuple:
    """
    Minimise x @ gram @ x / 2 - moment @ x with x >= 0 except where `free`.

    Block principal pivoting (Portugal, Judice and Vicente 1994; Kim and Park 2011): unknowns of
    the wrong sign change sides together, one at a time when that stops helping, which makes it
    finite for a positive definite `gram`. It is much faster than adding unknowns one by one, and
    a solution for a neighbouring problem is a good start. Finite may still be too long; then they
    are added one by one (Lawson and Hanson, Solving Least Squares Problems, 1974, ch. 23).

    Parameters
    ----------
    gram : ndarray, shape (K, K)
        Symmetric positive definite.
    moment : ndarray, shape (K,)
    free : ndarray of bool, shape (K,)
        Unknowns without a bound.
    start : ndarray of bool, shape (K,), optional
        Unknowns that are probably not at their bound.

    Returns
    -------
    x : ndarray, shape (K,)
    passive : ndarray of bool, shape (K,)
        Unknowns that are not at their bound.

    Raises
    ------
    IdentificationError
        When `gram` is not positive definite or no solution is found.
    """
    passive = free.copy() if start is None else (start | free)
    # Symmetric: its rows are its columns. One layout is one function to compile.
    rows = np.ascontiguousarray(gram.T if gram.flags.f_contiguous else gram)
    x, state = pivot(rows, moment, free, passive,
                     TOLERANCE * max(float(np.max(np.abs(moment))), 1e-300), ROUNDING)
    if state == SINGULAR:
        raise IdentificationError(NO_SOLUTION)
    if state:
        x = _one_by_one(rows, moment, free)
        passive = free | (x > 0.0)
    # The tolerance on signs is one of rounding: nothing below the bound is handed on.
    return np.where(free | (x > 0.0), x, 0.0), passive


def _one_by_one(gram: np.ndarray, moment: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the solution (K,) of `solve_nonnegative` without a start."""
    from scipy import optimize      # a third of a second that hardly any problem needs
    try:
        factor = linalg.cholesky(gram)
        target = linalg.solve_triangular(factor, moment, trans='T')
        # An unknown without a bound is the difference of two that have one.
        found, _ = optimize.nnls(np.hstack([factor, -factor[:, free]]), target)
    except (linalg.LinAlgError, RuntimeError):
        raise IdentificationError('least squares: no solution found; use a larger strength or '
                                  'fewer levels') from None
    x: np.ndarray = found[:len(moment)]
    x[free] -= found[len(moment):]
    return x


def solve_rows(design: np.ndarray, target: np.ndarray, penalty: sparse.csr_matrix,
               free: np.ndarray, start: Optional[np.ndarray] = None) -> tuple:
    """
    Minimise ``|design @ x - target|^2 / n + x @ penalty @ x``, x >= 0 except where `free`.

    Where few of many unknowns leave their bound, `solve_nonnegative` takes those of `start` and, as
    long as there are any, those that would improve most on its result: of the square of `design`
    only their part is computed.

    Parameters
    ----------
    design : ndarray, shape (n, K)
    target : ndarray, shape (n,)
    penalty : csr_matrix, shape (K, K)
        Symmetric positive definite, at least where `design` does not determine x.
    free : ndarray of bool, shape (K,)
        Unknowns without a bound.
    start : ndarray of bool, shape (K,), optional
        Unknowns that are probably not at their bound.

    Returns
    -------
    x : ndarray, shape (K,)
    passive : ndarray of bool, shape (K,)
        Unknowns that are not at their bound.

    Raises
    ------
    IdentificationError
        As `solve_nonnegative`.
    """
    count = len(target)
    moment = design.T @ target / count
    tolerance = TOLERANCE * max(float(np.max(np.abs(moment))), 1e-300)
    passive = free.copy() if start is None else (start | free)
    tried = passive.copy()
    if np.count_nonzero(passive) > MANY * len(free):
        tried[:] = True
    while True:
        index = np.flatnonzero(tried)
        chosen = design[:, index]
        x, inside = solve_nonnegative(chosen.T @ chosen / count + part_of(penalty, index),
                                      moment[index], free[index], passive[index])
        gradient = (chosen @ x / count) @ design - moment + product(
            x, penalty.indptr, penalty.indices, penalty.data, index)
        gradient[tried] = 0.0
        passive[index] = inside
        better = np.flatnonzero(gradient < -tolerance)
        if len(better) == 0:
            found = np.zeros(len(free))
            found[index] = x
            return found, passive
        most = max(len(index) // 2, FEWEST_MORE)
        more = better[np.argsort(gradient[better])[:most]]
        tried[more] = passive[more] = True


def part_of(penalty: sparse.csr_matrix, index: np.ndarray) -> np.ndarray:
    """Return the rows and columns `index` (P,) of a penalty, shape (P, P)."""
    # SciPy's own indexing takes ten times as long for a part this small.
    return part(penalty.indptr, penalty.indices, penalty.data, index)


def extrapolated(design: np.ndarray, train: np.ndarray) -> np.ndarray:
    """
    Return by what share more each unknown is to be penalised where some rows alone are fitted.

    An unknown that they hardly excite may take up any misfit of them, and then moves the other rows
    by many times as much. It is penalised as if those rows excited it as much as the others do.

    Parameters
    ----------
    design : ndarray, shape (n, K)
        All rows.
    train : ndarray of bool, shape (n,)
        Rows that are fitted.

    Returns
    -------
    ndarray, shape (K,)
    """
    every, fitted = (np.max(np.abs(part), axis=0) for part in (design, design[train]))
    # What no row excites has the penalty that it has.
    return np.divide(every, np.maximum(fitted, LEAST_EXCITED * every), out=np.ones(len(every)),
                     where=every > 0.0) ** 2 - 1.0


def solve(gram: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Return the x with ``gram @ x = moment``; IdentificationError if not positive definite."""
    # LAPACK itself: for a problem this small the checks of scipy.linalg cost as much as its work.
    _, x, failed = lapack.dposv(gram, moment)
    if failed:
        raise IdentificationError(NO_SOLUTION)
    return x


def quick_weights(rows: np.ndarray, target: np.ndarray, scale: np.ndarray, penalty: np.ndarray,
                  start: Optional[np.ndarray] = None) -> tuple:
    """
    Solve the regularised problem of `fit_weights` with weights >= 0, and nothing else.

    For searches that solve thousands of neighbouring problems.

    Parameters
    ----------
    rows : ndarray, shape (M, K)
    target : ndarray, shape (M,)
    scale : ndarray, shape (K,)
        Size of every column.
    penalty : ndarray, shape (K, K)
        Strength times the square of the penalty's root, in the units of `fit_weights`.
    start : ndarray of bool, shape (K + 1,), optional
        Third result of a neighbouring problem.

    Returns
    -------
    weights : ndarray, shape (K,)
    bias : float
    passive : ndarray of bool, shape (K + 1,)
    """
    span = max(float(np.ptp(target)), 1e-300)
    design = np.column_stack([rows / scale, np.ones(len(target))])
    gram = design.T @ design / len(target)
    size = len(gram)
    gram[:-1, :-1] += penalty
    free = np.zeros(size, dtype=bool)
    free[-1] = True
    x, passive = solve_nonnegative(gram, design.T @ target / (len(target) * span), free, start)
    return x[:-1] * span / scale, float(x[-1] * span), passive
