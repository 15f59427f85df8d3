# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Nonlinear least squares within bounds, for few parameters and residuals that are dear.

Gauss-Newton steps with Marquardt's damping, each the best within the bounds. Unlike
`scipy.optimize.least_squares` this takes no derivative that no step uses, and costs nothing to
import.
"""

from collections.abc import Callable

import numpy as np

# Damping, as a share of each parameter's own curvature (Marquardt, J. SIAM 11 (1963) 431): at
# first, and its factors after success and failure. With less at first some Lagoudas' benches end in
# the simplest form of what their load does.
DAMPING, LESS, MORE = 3e-2, 0.1, 10.0
# A curvature counts as this share of the largest at least, and is never 0.
SMALLEST, TINY = 1e-9, 1e-300
# Longest step, in the parameters' units, in which their range is about one.
LONGEST = 1.0
# Components held or let go for one step, at most, for each parameter.
MOST_CHANGES = 5
# A step that is shorter, in these units and as a share of the parameters, is the last.
SHORTEST = 1e-3


def minimise(residual: Callable[[np.ndarray], np.ndarray],
             jacobian: Callable[[np.ndarray], np.ndarray], start: np.ndarray, lower: np.ndarray,
             upper: np.ndarray, evaluations: int, tolerance: float) -> np.ndarray:
    """
    Return the vector of least squares near a start; the last one where something is not finite.

    Parameters
    ----------
    residual : callable
        Of a vector (k,), returns the residuals (n,).
    jacobian : callable
        Of a vector (k,), returns the derivatives of the residuals (n, k).
    start, lower, upper : ndarray, shape (k,)
    evaluations : int
        Residuals that are looked at, at most, that of the start included.
    tolerance : float
        A step that lowers the sum of squares by a smaller share is the last.

    Returns
    -------
    ndarray, shape (k,)
    """
    vector = np.clip(start, lower, upper)
    errors = residual(vector)
    cost, damping, normal = float(errors @ errors), DAMPING, None
    for _ in range(evaluations - 1):
        if normal is None:
            slopes = jacobian(vector)
            normal = slopes.T @ slopes, slopes.T @ errors
        if not all(np.all(np.isfinite(part)) for part in normal):
            break
        step = damped_step(*normal, damping, lower - vector, upper - vector)
        errors_there = residual(vector + step)
        cost_there = float(errors_there @ errors_there)
        length = float(np.linalg.norm(step))
        last = length <= SHORTEST * (SHORTEST + float(np.linalg.norm(vector)))
        if cost_there < cost:
            last |= cost - cost_there < tolerance * cost
            vector, errors, cost, normal = vector + step, errors_there, cost_there, None
            damping *= LESS
        else:
            damping *= MORE
        if last:
            break
    return vector


def damped_step(curvature: np.ndarray, gradient: np.ndarray, damping: float, lowest: np.ndarray,
                highest: np.ndarray) -> np.ndarray:
    """
    Return the step that minimises a damped quadratic within bounds, cut at the longest.

    Components are held at a bound, and let go, one at a time.

    Parameters
    ----------
    curvature : ndarray, shape (k, k)
    gradient : ndarray, shape (k,)
    damping : float
        Added to the diagonal, as a share of each of its entries.
    lowest, highest : ndarray, shape (k,)
        Bounds of the step; 0 is within.

    Returns
    -------
    ndarray, shape (k,)
    """
    size = len(gradient)
    own = np.diag(curvature)
    damped = curvature + damping * np.diag(np.maximum(own, SMALLEST * float(own.max()) + TINY))
    step, free = np.zeros(size), np.ones(size, dtype=bool)
    for _ in range(MOST_CHANGES * size):
        ends = ~free
        move = np.zeros(size)
        move[free] = -step[free] - np.linalg.solve(
            damped[np.ix_(free, free)], gradient[free] + damped[np.ix_(free, ends)] @ step[ends])
        room = np.where(move > 0.0, highest - step, lowest - step)
        shares = np.divide(room, move, out=np.full(size, np.inf), where=move != 0.0)
        step = np.clip(step + min(float(shares.min()), 1.0) * move, lowest, highest)
        if shares.min() < 1.0:
            free[np.argmin(shares)] = False
            continue
        pull = gradient + damped @ step
        inward = np.where(step <= lowest, -pull, pull) * ends
        if not np.any(inward > 0.0):
            break
        free[np.argmax(inward)] = True
    return step * min(1.0, LONGEST / max(float(np.linalg.norm(step)), 1e-300))
