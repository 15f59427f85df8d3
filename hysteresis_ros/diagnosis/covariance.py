# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Covariance of the residuals of a simulated response.

::

    K = s^2 D + a^2 exp(-|dt| / tau) + w^2 I

with D the discrepancy of the base model (`discrepancy`), a drift that is correlated in time within
a trial, and white noise. s, a, tau and w are estimated from the residuals themselves by their
marginal likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning, ch. 5), so
that neither noise nor autocorrelation is taken for an effect. Their priors are weak: s lies near
one, because the bench says how large the discrepancy is, a is of its size or less (half-Cauchy).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import copy
import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg, special

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.discrepancy import Discrepancy

# Bounds of the amplitudes against the discrepancy's size: as good as nothing, as good as all.
WIDEST = 1e3
# Spread (natural logarithm) of the correlation time about the middle of those that can be seen.
TIME_SPREAD = 1.5
# Largest scale of the discrepancy (natural logarithm): two standard deviations of its prior. What
# goes beyond is no error that the bench has seen.
LARGEST_SCALE = 0.6
EVALUATIONS = 25
# Degrees of freedom of whitened residuals: those of clean arms of three constitutive models have a
# kurtosis of 5 to 40, where a Gaussian has 3, and Student's t a finite one only above 4.
TAILS = 4.0
_TINY = 1e-300


@dataclasses.dataclass
class Point:
    """
    One covariance, factorised.

    Attributes
    ----------
    values : ndarray, shape (4,)
        Logarithms of s, a, tau [s] and w.
    factor : ndarray, shape (n, n)
        Lower Cholesky factor of K.
    constant : float
        Logarithm of the Gaussian density at no residual, with the prior of `values`.
    """

    values: np.ndarray
    factor: np.ndarray
    constant: float

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """Return columns (n,) or (n, k) in units in which the covariance is the identity."""
        return linalg.solve_triangular(self.factor, columns, lower=True, check_finite=False)

    def log_density(self, whitened: np.ndarray) -> np.ndarray:
        """
        Return the log density of residuals, with the prior of `values`.

        Student's t instead of the Gaussian, so that single rows do not decide. In whitened units
        each row is what the rows before do not say of it.

        Parameters
        ----------
        whitened : ndarray, shape (n,) or (n, k)
            One residual, or several, as `whiten` gives them.

        Returns
        -------
        ndarray, shape () or (k,)
        """
        at_none = (special.gammaln(0.5 * (TAILS + 1.0)) - special.gammaln(0.5 * TAILS)
                   + 0.5 * np.log(2.0 / TAILS))
        return self.constant + len(whitened) * at_none - 0.5 * (TAILS + 1.0) * np.sum(
            np.log1p(whitened ** 2 / TAILS), axis=0)


def noise_of(values: np.ndarray) -> float:
    """Return the standard deviation of the white noise that a `Point`'s values (4,) say."""
    return float(np.exp(values[3]))


class Covariance:
    """
    Covariances of residuals on the rows of one problem.

    Parameters
    ----------
    discrepancy : Discrepancy
        D.
    clock : ndarray, shape (n,)
        Time of each row [s].
    trial : ndarray of int, shape (n,)
        Trial of each row, whose rows lie side by side; those of different trials share the
        discrepancy only.
    resolution : float
        Standard deviation that the sensor's steps cause; the noise is at least this.
    largest_noise : float
        Standard deviation that the noise can have at most.
    scale_spread : float
        Spread (natural logarithm) of s.

    Attributes
    ----------
    discrepancy : Discrepancy
    size : float
        Root mean square of the discrepancy, but for what martensite keeps: that has one course.
    points : list of Point
        Covariances at hand; see `add`.
    """

    def __init__(self, discrepancy: Discrepancy, clock: np.ndarray, trial: np.ndarray,
                 resolution: float, largest_noise: float, scale_spread: float) -> None:
        self.discrepancy = discrepancy
        edges = [0, *(np.flatnonzero(np.diff(trial)) + 1).tolist(), len(trial)]
        self._trials = [slice(*pair) for pair in zip(edges, edges[1:])]
        self._gaps = [np.abs(clock[own, None] - clock[own]) for own in self._trials]
        self._spread = scale_spread
        self.size = discrepancy.size_besides_kept
        span = max(*(float(np.max(gaps)) for gaps in self._gaps), _TINY)
        steps = np.diff(clock)[np.diff(trial) == 0]
        shortest = max(float(np.median(steps)), 1e-9 * span) if len(steps) else span
        self.resolution = max(resolution, 1e-4 * self.size, _TINY)
        self._scale = max(self.size, self.resolution)
        self._middle = 0.5 * np.log(shortest * span)
        self._low = np.array([-LARGEST_SCALE, np.log(self._scale / WIDEST),
                              np.log(2.0 * shortest), np.log(self.resolution)])
        self._high = np.array([LARGEST_SCALE, np.log(WIDEST * self._scale), np.log(3.0 * span),
                               np.log(min(max(largest_noise, _TINY), WIDEST * self._scale))])
        self._high = np.maximum(self._high, self._low)
        self.points: list[Point] = []

    def of(self, discrepancy: Discrepancy) -> Covariance:
        """Return covariances with another discrepancy, and none at hand."""
        other = copy.copy(self)
        other.discrepancy, other.points = discrepancy, []
        return other

    def start(self, drift: float = 0.1, noise: float = 0.0) -> np.ndarray:
        """Return values (4,) with a drift and a noise given as shares of the discrepancy."""
        return np.clip([0.0, np.log(max(drift * self._scale, _TINY)), self._middle,
                        np.log(max(noise * self._scale, self.resolution))], self._low, self._high)

    def _parts(self, values: np.ndarray, matrix: np.ndarray
               ) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
        """Return discrepancy (n, n), drift of each trial (m, m), and the covariance (n, n)."""
        discrepancy = np.exp(2.0 * values[0]) * matrix
        drift, total = [], discrepancy.copy()
        for own, gaps in zip(self._trials, self._gaps):
            block = np.exp(2.0 * values[1]) * np.exp(-gaps / np.exp(values[2]))
            total[own, own] += block
            drift.append(block)
        total.flat[::len(total) + 1] += np.exp(2.0 * values[3])
        return discrepancy, drift, total

    def _prior(self, values: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the log density of values (4,), and its gradient."""
        ratio = np.exp(values[1]) / self._scale
        white = np.exp(values[3]) / (3.0 * self.resolution + self._scale)
        away = (values[2] - self._middle) / TIME_SPREAD
        density = (-0.5 * (values[0] / self._spread) ** 2 - np.log1p(ratio ** 2) + np.log(ratio)
                   - 0.5 * away ** 2 - np.log1p(white ** 2))
        gradient = np.array([
            -values[0] / self._spread ** 2, 1.0 - 2.0 * ratio ** 2 / (1.0 + ratio ** 2),
            -away / TIME_SPREAD, -2.0 * white ** 2 / (1.0 + white ** 2)])
        return float(density), gradient

    def point(self, values: np.ndarray) -> Point:
        """
        Return the covariance for values (4,).

        Raises
        ------
        LinAlgError
            If it is not positive definite by rounding.
        """
        return next(self.points_at([values]))

    def points_at(self, several: Iterable[np.ndarray]) -> Iterator[Point]:
        """Iterate over the covariances for several values (4,); see `point`."""
        matrix = self.discrepancy.matrix()
        for values in several:
            total = self._parts(values, matrix)[2]
            factor = linalg.cholesky(total, lower=True, check_finite=False)
            constant = (self._prior(values)[0] - float(np.sum(np.log(np.diag(factor))))
                        - 0.5 * len(total) * np.log(2.0 * np.pi))
            yield Point(np.array(values), factor, constant)

    def white(self, size: float) -> Point:
        """Return the covariance of white noise of a size alone: a fit is one by least squares."""
        count = self._trials[-1].stop
        values = np.array([self._low[0], self._low[1], self._middle, np.log(size)])
        return Point(values, size * np.eye(count), -np.inf)

    def add(self, values: np.ndarray) -> Point:
        """Return the covariance for values (4,) and keep it among the `points`."""
        found = self.point(values)
        self.points.append(found)
        return found

    def largest_error(self, rng: np.random.Generator, count: int, level: float = 0.95,
                      kept: bool = True) -> float:
        """
        Return the root mean square error that the discrepancy stays below, at a probability.

        Parameters
        ----------
        rng : numpy.random.Generator
        count : int
            Number of draws.
        level : float
            The probability.
        kept : bool
            Whether what martensite keeps counts.

        Returns
        -------
        float
            In the unit of the response.
        """
        values, vectors = linalg.eigh(self.discrepancy.matrix(kept))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = root @ rng.standard_normal((len(values), count))
        scale = np.exp(self._spread * rng.standard_normal(count))
        errors = scale * np.sqrt(np.mean(draws ** 2, axis=0))
        return float(np.hypot(np.quantile(errors, level), self.resolution))

    def fit(self, residual: np.ndarray, values: np.ndarray | None = None) -> np.ndarray:
        """
        Return the values (4,) of highest posterior density for a residual of shape (n,).

        Parameters
        ----------
        residual : ndarray, shape (n,)
            Measured less simulated.
        values : ndarray, shape (4,), optional
            Where to begin; by default both where all is noise and where all is drift.

        Returns
        -------
        ndarray, shape (4,)
            As `Point.values`.
        """
        share = float(np.sqrt(np.mean(residual ** 2))) / self._scale
        starts = [self.start(0.1, share), self.start(share, 0.1)] if values is None else [
            np.clip(values, self._low, self._high)]
        matrix = self.discrepancy.matrix()
        from scipy import optimize     # a third of a second that bench tables do not need
        with np.errstate(all='ignore'):
            found = [optimize.minimize(
                self._cost, start, (residual, matrix), jac=True, method='L-BFGS-B',
                bounds=list(zip(self._low, self._high)), options={'maxfun': EVALUATIONS})
                for start in starts]
        return min(found, key=lambda one: one.fun).x

    def _cost(self, values: np.ndarray, residual: np.ndarray, matrix: np.ndarray
              ) -> tuple[float, np.ndarray]:
        """Return minus the log posterior density of values (4,), and its gradient."""
        discrepancy, drift, total = self._parts(values, matrix)
        try:
            factor = linalg.cho_factor(total, lower=True, check_finite=False)
        except linalg.LinAlgError:
            return 1e300, np.zeros(4)
        solved = linalg.cho_solve(factor, residual, check_finite=False)
        inverse = linalg.lapack.dpotri(factor[0], lower=1)[0]
        diagonal = np.diag(inverse).copy()
        # Only the lower triangle is there; what is summed is symmetric.
        inverse = np.tril(inverse, -1)
        prior, slope = self._prior(values)

        def trace(part: np.ndarray, own: slice = slice(None)) -> float:
            inside = 2.0 * np.sum(inverse[own, own] * part) + diagonal[own] @ np.diag(part)
            return 0.5 * (inside - solved[own] @ part @ solved[own])

        blocks = list(zip(self._trials, drift, self._gaps))
        gradient = np.array([
            2.0 * trace(discrepancy), 2.0 * sum(trace(part, own) for own, part, _ in blocks),
            sum(trace(part * gaps, own) for own, part, gaps in blocks) / np.exp(values[2]),
            np.exp(2.0 * values[3]) * (np.sum(diagonal) - solved @ solved)])
        cost = (0.5 * residual @ solved + float(np.sum(np.log(np.diag(factor[0])))) - prior)
        return float(cost), gradient - slope
