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

from collections.abc import Iterable, Iterator, Sequence
import copy
import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from hysteresis_ros.identification.gauss_newton import damped_step, DAMPING, LESS, MORE

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.discrepancy import Discrepancy

# Bounds of the amplitudes against the discrepancy's size: as good as nothing, as good as all.
WIDEST = 1e3
# Spread (natural logarithm) of the correlation time about the middle of those that can be seen.
TIME_SPREAD = 1.5
# Largest scale of the discrepancy (natural logarithm): two standard deviations of its prior. What
# goes beyond is no error that the bench has seen.
LARGEST_SCALE = 0.6
# Standard deviations that a Gaussian stays below at 95 %.
ONE_SIDED = 1.645
# Steps of a fit, at most, and the gain in log density that is not worth one.
EVALUATIONS, SMALL_GAIN = 25, 0.01
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
        # A fit whitens thousands of times, where checks take longer than the solution.
        whitened: np.ndarray = linalg.lapack.dtrtrs(self.factor, columns, lower=1)[0]
        return whitened

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
        at_none = (math.lgamma(0.5 * (TAILS + 1.0)) - math.lgamma(0.5 * TAILS)
                   + 0.5 * math.log(2.0 / TAILS))
        return self.constant + len(whitened) * at_none - 0.5 * (TAILS + 1.0) * np.sum(
            np.log1p(whitened ** 2 / TAILS), axis=0)


def noise_of(values: np.ndarray) -> float:
    """Return the standard deviation of the white noise that a `Point`'s values (4,) say."""
    return float(np.exp(values[3]))


def _equal_square(whitened: np.ndarray) -> np.ndarray:
    """Return the square of equal rows as probable by Student's t as some, (n,) or (n, k)."""
    square: np.ndarray = TAILS * np.expm1(np.mean(np.log1p(whitened ** 2 / TAILS), axis=0))
    return square


def _largest_square(whitened: np.ndarray) -> np.ndarray:
    """Return the largest square of rows, (n,) or (n, k)."""
    largest: np.ndarray = np.max(whitened ** 2, axis=0)
    return largest


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
        Root mean square of the discrepancy, but for what has one course.
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
        self.size = discrepancy.size_besides_courses
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
        # What does not depend on the discrepancy, by the values: sets of effects, each with a
        # discrepancy of its own, are compared under the same ones.
        self._drifts: dict[bytes, list[np.ndarray]] = {}
        self.points: list[Point] = []

    def of(self, discrepancy: Discrepancy) -> Covariance:
        """Return covariances with another discrepancy, and none at hand."""
        # It shares the drifts.
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
        drift = self._drift(values)
        return discrepancy, drift, self._total(discrepancy.copy(), drift, values)

    def _drift(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the drift of each trial (m, m) for values (4,)."""
        return [np.exp(2.0 * values[1]) * np.exp(-gaps / np.exp(values[2]))
                for gaps in self._gaps]

    def _total(self, total: np.ndarray, drift: Sequence[np.ndarray], values: np.ndarray
               ) -> np.ndarray:
        """Add to the discrepancy (n, n), in place, drift and noise."""
        for own, block in zip(self._trials, drift):
            total[own, own] += block
        total.flat[::len(total) + 1] += np.exp(2.0 * values[3])
        return total

    def _prior(self, values: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Return the log density of values (4,), its gradient, and the curvatures, sign changed."""
        ratio = np.exp(values[1]) / self._scale
        white = np.exp(values[3]) / (3.0 * self.resolution + self._scale)
        away = (values[2] - self._middle) / TIME_SPREAD
        density = (-0.5 * (values[0] / self._spread) ** 2 - np.log1p(ratio ** 2) + np.log(ratio)
                   - 0.5 * away ** 2 - np.log1p(white ** 2))
        gradient = np.array([
            -values[0] / self._spread ** 2, 1.0 - 2.0 * ratio ** 2 / (1.0 + ratio ** 2),
            -away / TIME_SPREAD, -2.0 * white ** 2 / (1.0 + white ** 2)])
        curvature = np.array([self._spread ** -2.0, (2.0 * ratio / (1.0 + ratio ** 2)) ** 2,
                              TIME_SPREAD ** -2.0, (2.0 * white / (1.0 + white ** 2)) ** 2])
        return float(density), gradient, curvature

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
            key = values.tobytes()
            if key not in self._drifts:
                self._drifts[key] = self._drift(values)
            total = self._total(np.exp(2.0 * values[0]) * matrix, self._drifts[key], values)
            # Transposed it is the same matrix in Fortran's order, which LAPACK need not copy.
            factor = linalg.cholesky(total.T, lower=True, overwrite_a=True, check_finite=False)
            constant = (self._prior(values)[0] - float(np.sum(np.log(np.diag(factor))))
                        - 0.5 * len(total) * np.log(2.0 * np.pi))
            yield Point(np.array(values), factor, constant)

    def white(self, size: float) -> Point:
        """Return the covariance of white noise of a size alone: a fit is one by least squares."""
        count = self._trials[-1].stop
        values = np.array([self._low[0], self._low[1], self._middle, np.log(size)])
        return Point(values, size * np.eye(count).T, -np.inf)

    def add(self, values: np.ndarray) -> Point:
        """Return the covariance for values (4,) and keep it among the `points`."""
        found = self.point(values)
        self.points.append(found)
        return found

    def _draws(self, matrix: np.ndarray, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return draws (n, count) of errors with a covariance (n, n), each of its own scale."""
        values, vectors = linalg.eigh(matrix)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws: np.ndarray = root @ rng.standard_normal((len(values), count))
        return draws * np.exp(self._spread * rng.standard_normal(count))

    def largest_error(self, rng: np.random.Generator, count: int, level: float = 0.95,
                      courses: bool = True) -> float:
        """
        Return the root mean square error that the discrepancy stays below, at a probability.

        Parameters
        ----------
        rng : numpy.random.Generator
        count : int
            Number of draws.
        level : float
            The probability.
        courses : bool
            Whether what has one course counts.

        Returns
        -------
        float
            In the unit of the response.
        """
        return self._largest(self._draws(self.discrepancy.matrix(courses), rng, count), level)

    def _largest(self, draws: np.ndarray, level: float) -> float:
        """Return the root mean square that draws (n, count) stay below at a probability."""
        errors = np.sqrt(np.mean(draws ** 2, axis=0))
        return float(np.hypot(np.quantile(errors, level), self.resolution))

    def equivalent_rmse(self, residuals: Sequence[np.ndarray], noise: float,
                        rng: np.random.Generator, count: int, level: float) -> np.ndarray:
        """
        Return of residuals the root mean square of an error of the base model as improbable.

        Each row counts by the variance that it may have, as an error that is small where the arm
        moves far is large where it rests: that of discrepancy, noise, and once more what the base
        model is off by on average, whose size is known better than its place. Sizes are those of
        equal rows as probable by Student's t, so that single rows do not decide, unless one is
        further off than its tails say.

        Parameters
        ----------
        residuals : sequence of ndarray, each of shape (n,)
            Measured less simulated.
        noise : float
            Standard deviation of the white noise in them, which does not count.
        rng : numpy.random.Generator
        count : int
            Number of draws.
        level : float
            Probability with which the error stays below `largest_error`, of what has no course,
            which is returned for a residual of that size.

        Returns
        -------
        ndarray, shape (residuals,)
            In the unit of the response.
        """
        matrix = self.discrepancy.matrix(courses=False)
        noise = max(noise, self.resolution)
        deviation = np.sqrt(np.diag(matrix) + noise ** 2
                            + self.discrepancy.size_besides_courses ** 2)
        draws = self._draws(matrix, rng, count)
        white = noise * rng.standard_normal(draws.shape)
        heavy = draws * np.sqrt(TAILS / rng.chisquare(TAILS, draws.shape))
        own = np.stack([self.discrepancy.besides_courses(residual, deviation)
                        for residual in residuals], axis=1)
        squares = np.zeros(own.shape[1])
        for measure, drawn in ((_equal_square, draws), (_largest_square, heavy)):
            found, of_noise, of_all = (measure((rows.T / deviation).T)
                                       for rows in (own, white, drawn + white))
            beyond = np.median(of_noise)
            squares = np.maximum(
                squares, (found - beyond) / max(np.quantile(of_all, level) - beyond, _TINY))
        return np.asarray(self._largest(draws, level) * np.sqrt(squares))

    def fit(self, residual: np.ndarray, values: np.ndarray | None = None) -> np.ndarray:
        """
        Return the values (4,) of highest posterior density for a residual of shape (n,).

        Parameters
        ----------
        residual : ndarray, shape (n,)
            Measured less simulated.
        values : ndarray, shape (4,), optional
            Where to begin, besides where all is drift; by default where all is noise.

        Returns
        -------
        ndarray, shape (4,)
            As `Point.values`.
        """
        share = float(np.sqrt(np.mean(residual ** 2))) / self._scale
        drifting = self.start(share, 0.1)
        starts = [drifting, self.start(0.1, share) if values is None else np.clip(
            values, self._low, self._high)]
        matrix = self.discrepancy.matrix()
        with np.errstate(all='ignore'):
            found = [self._least_cost(start, residual, matrix) for start in starts]
        return min(found, key=lambda one: one[0])[1]

    def noise_at_most(self, values: np.ndarray, residual: np.ndarray) -> float:
        """
        Return the standard deviation that white noise stays below at about 95 %.

        Of few rows it is known to a few percent only, which of much noise is more than the base
        model's own error. By a Gaussian about the values found, that is as wide as their average
        information says.

        Parameters
        ----------
        values : ndarray, shape (4,)
            As `fit` found them.
        residual : ndarray, shape (n,)
            Measured less simulated.

        Returns
        -------
        float
            In the unit of the response.
        """
        with np.errstate(all='ignore'):
            information = self._cost(values, residual, self.discrepancy.matrix())[2]
        further = ONE_SIDED * math.sqrt(max(linalg.pinvh(information)[3, 3], 0.0))
        return float(np.exp(min(values[3] + further, self._high[3])))

    def _least_cost(self, values: np.ndarray, residual: np.ndarray, matrix: np.ndarray
                    ) -> tuple[float, np.ndarray]:
        """Return the least cost near values (4,), and where it is."""
        damping = DAMPING
        cost, gradient, curvature = self._cost(values, residual, matrix)
        for _ in range(EVALUATIONS):
            step = damped_step(
                curvature, gradient, damping, self._low - values, self._high - values)
            if -(gradient + 0.5 * curvature @ step) @ step < SMALL_GAIN:
                break
            there = self._cost(values + step, residual, matrix)
            if there[0] < cost:
                values, (cost, gradient, curvature) = values + step, there
                damping *= LESS
            else:
                damping = max(MORE * damping, DAMPING)
        return cost, values

    def _cost(self, values: np.ndarray, residual: np.ndarray, matrix: np.ndarray
              ) -> tuple[float, np.ndarray, np.ndarray]:
        """
        Return minus the log posterior density of values (4,), its gradient and its curvature.

        The curvature is the mean of the observed and the expected one, in which all traces cancel:
        the average information (Gilmour, Thompson and Cullis, Biometrics 51 (1995) 1440).
        """
        discrepancy, drift, total = self._parts(values, matrix)
        factor, failed = linalg.lapack.dpotrf(total.T, lower=1, clean=0, overwrite_a=1)
        if failed:
            return math.inf, np.zeros(4), np.eye(4)
        solved = linalg.lapack.dpotrs(factor, residual, lower=1)[0]
        half_log_determinant = float(np.sum(np.log(np.diag(factor))))
        # Columns (dK / dvalue) K^-1 residual, of which gradient and curvature are made.
        noise = 2.0 * np.exp(2.0 * values[3])
        changes = np.zeros((len(residual), 4))
        changes[:, 0] = 2.0 * discrepancy @ solved
        changes[:, 3] = noise * solved
        inverse = linalg.lapack.dpotri(factor, lower=1)[0]
        diagonal = np.diag(inverse).copy()
        # Only the lower triangle is there; what is summed is symmetric.
        inverse = np.tril(inverse, -1)

        def trace(part: np.ndarray, own: slice = slice(None)) -> float:
            return float(2.0 * np.sum(inverse[own, own] * part) + diagonal[own] @ np.diag(part))

        traces = np.array([2.0 * trace(discrepancy), 0.0, 0.0, noise * np.sum(diagonal)])
        for own, part, gaps in zip(self._trials, drift, self._gaps):
            slower = part * gaps / np.exp(values[2])
            changes[own, 1] = 2.0 * part @ solved[own]
            changes[own, 2] = slower @ solved[own]
            traces[1:3] += 2.0 * trace(part, own), trace(slower, own)
        density, slope, bend = self._prior(values)
        information = changes.T @ linalg.lapack.dpotrs(factor, changes, lower=1)[0]
        return (float(0.5 * residual @ solved) + half_log_determinant - density,
                0.5 * (traces - changes.T @ solved) - slope, 0.5 * information + np.diag(bend))
