# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A Bouc-Wen operator fitted to inputs and outputs, by separable least squares.

With the input brought to 0 to 1, the output is bias + S(x), x = u + p w / (2 sigma rho) for p from
-1 to 0 (an output that lags) and x = (1 - p) u + p w / 2 for p from 0 to 1 (one that leads). The
slopes of S and the bias enter linearly: for every (rho, sigma, n, p) they are solved for (variable
projection, G. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), and only these four are
searched, from many starts, so that the result does not hang on one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import psi

from hysteresis_ros.identification.nonnegative import solve_nonnegative
from hysteresis_ros.operators import BoucWen

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

# Pieces of S, and the least slope of each as a share of the mean one, so that it can be inverted.
PIECES, LEAST_SLOPE = 8, 1e-3
# Of the mean square of differences between neighbouring slopes: it decides where no row does.
SMOOTHNESS = 1e-6
# Bounds of log10(rho), log10(2 sigma), log10(n) and p.
LOWEST = np.array([-0.5, 0.0, 0.0, -1.0])
HIGHEST = np.array([3.0, 2.0, 1.0, 1.0])
# Slow and fast turning, smooth, that lag by what they can, by half of it, and that lead.
GUESSES = [(rate, shape, 0.1, lag) for rate in (0.3, 1.0, 1.7) for shape in (0.05, 0.6)
           for lag in (-0.95, -0.5, 0.3)]
# Points of a sequence that fills the bounds evenly, and how many of the best points are refined.
SPREAD, REFINED = 46, 6
EVALUATIONS = 60
# Steps of the differences that take the place of derivatives: S has corners.
DIFFERENCE = 1e-5


def starts() -> np.ndarray:
    """
    Return where the search starts, shape (S, 4).

    The guesses, and points of the additive recurrence with powers of the root of x^5 = x + 1,
    which has a low discrepancy in four dimensions and needs no random numbers.
    """
    root = 1.1673039782614187
    shares = np.mod(0.5 + np.arange(1, SPREAD + 1)[:, None] * root ** -np.arange(1.0, 5.0), 1.0)
    return np.vstack([GUESSES, LOWEST + shares * (HIGHEST - LOWEST)])


def fit_bouc_wen(parts: Sequence[np.ndarray], target: np.ndarray, low: float, high: float,
                 thin: Sequence[np.ndarray] | None = None, points: np.ndarray | None = None,
                 fitted: np.ndarray | None = None) -> BoucWen:
    """
    Fit a Bouc-Wen operator that rises with its input.

    Parameters
    ----------
    parts : sequence of ndarray, each shape (1 + rows,)
        Inputs of each trial from a saturated memory on; the first has no output.
    target : ndarray, shape (n,)
        Outputs of all other inputs, trial after trial.
    low, high : float
        Input range.
    thin : sequence of ndarray, optional
        Rows of each part that the search looks at, the first included; all of them by default.
    points : ndarray, shape (S, 4), optional
        Where the search starts; `starts` by default.
    fitted : ndarray of bool, shape (n,), optional
        Outputs to fit; the memory is carried through the others. Default: all.

    Returns
    -------
    BoucWen
    """
    whole = _Problem(parts, target, low, high,
                     np.ones(len(target), dtype=bool) if fitted is None else fitted)
    search = whole if thin is None else whole.thinned(thin)
    points = starts() if points is None else points
    costs = [float(np.sum(search.residual(point) ** 2)) for point in points]
    found = [search.refine(points[k]) for k in np.argsort(costs, kind='stable')[:REFINED]]
    best = min(found, key=lambda result: result.cost)
    return whole.operator(best.x)


class _Problem:
    """The least squares problem, input and output brought to ranges of 1."""

    def __init__(self, parts: Sequence[np.ndarray], target: np.ndarray, low: float, high: float,
                 fitted: np.ndarray) -> None:
        self.parts, self.target, self.low, self.high = parts, target, low, high
        self.fitted = fitted
        target = target[fitted]
        self.inputs = [(part - low) / (high - low) for part in parts]
        self.span = float(np.ptp(target)) or 1.0
        self.middle = float(np.mean(target))
        self.outputs = (target - self.middle) / self.span

    def thinned(self, rows: Sequence[np.ndarray]) -> '_Problem':
        """Return the problem with some rows of each part only."""
        first = np.cumsum([0] + [len(part) - 1 for part in self.parts[:-1]])
        kept = np.concatenate([start + some[1:] - 1 for start, some in zip(first, rows)])
        return _Problem([part[some] for part, some in zip(self.parts, rows)], self.target[kept],
                        self.low, self.high, self.fitted[kept])

    def loops(self, vector: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
        """Return x for the rows to fit, shape (n,), and its factors of input and state."""
        from hysteresis_ros.kernels.bouc_wen import follow
        rate, twice, exponent = 10.0 ** vector[:3]
        lag = vector[3]
        factors = (1.0, lag / (twice * rate)) if lag < 0.0 else (1.0 - lag, 0.5 * lag)
        pole = float(psi(1.0) - psi(1.0 / exponent))
        return np.concatenate([
            (factors[0] * part
             + factors[1] * follow(part, 0.0, -1.0, rate, twice - 1.0, exponent, pole))[1:]
            for part in self.inputs])[self.fitted], factors

    def curve(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        """Return the columns of S, centred, the slopes that fit best, and the place of x."""
        start, width = float(x.min()), max(float(np.ptp(x)), 1e-12)
        place = (x - start) / width
        knots = np.arange(PIECES) / PIECES
        columns = np.clip(place[:, None] - knots, 0.0, 1.0 / PIECES)
        centred = columns - columns.mean(axis=0)
        wanted = self.outputs - LEAST_SLOPE * centred.sum(axis=1)
        rough = np.diff(np.eye(PIECES), axis=0)
        gram = (centred.T @ centred / len(x) + SMOOTHNESS * rough.T @ rough
                + 1e-12 * np.eye(PIECES))
        slopes, _ = solve_nonnegative(gram, centred.T @ wanted / len(x),
                                      np.zeros(PIECES, dtype=bool))
        return columns, LEAST_SLOPE + slopes, (start, width)

    def residual(self, vector: np.ndarray) -> np.ndarray:
        """Return the errors and the roughness of S at its best, in shares of the root of n."""
        x, _ = self.loops(vector)
        columns, slopes, _ = self.curve(x)
        error = columns @ slopes
        error -= error.mean() + self.outputs
        return np.append(error / np.sqrt(len(x)), np.sqrt(SMOOTHNESS) * np.diff(slopes))

    def refine(self, vector: np.ndarray) -> OptimizeResult:
        """Return the result of scipy's search from a start."""
        from scipy import optimize     # a third of a second that no other operator needs
        inside = np.clip(vector, LOWEST + 1e-6, HIGHEST - 1e-6)
        return optimize.least_squares(
            self.residual, inside, bounds=(LOWEST, HIGHEST), method='trf', diff_step=DIFFERENCE,
            ftol=1e-12, xtol=1e-10, gtol=1e-12, max_nfev=EVALUATIONS)

    def operator(self, vector: np.ndarray) -> BoucWen:
        """Return the operator with the S that fits all rows."""
        x, factors = self.loops(vector)
        columns, slopes, (start, width) = self.curve(x)
        offset = self.middle - self.span * float(np.mean(columns @ slopes))
        scale = self.span * slopes[0] / width
        place = factors[0] / (self.high - self.low)
        # x counts from the lower end of the input, the operator's from input 0.
        shift = scale * (start + place * self.low)
        thresholds = shift + scale * width * np.arange(1, PIECES) / PIECES
        rate, twice, exponent = 10.0 ** vector[:3]
        return BoucWen(
            scale * place, scale * factors[1], rate / (self.high - self.low), 0.5 * twice,
            float(np.clip(exponent, 1.0, 100.0)), offset - shift, self.low, self.high,
            thresholds, np.diff(slopes) / slopes[0])
