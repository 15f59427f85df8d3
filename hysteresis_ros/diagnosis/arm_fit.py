# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fit effects to runs of an arm: maximum a posteriori, in whitened residuals.

Gauss-Newton steps with Levenberg's damping. For a first look at a set, derivatives are differences
at the start and carried on by secants from there (Broyden's update; Madsen, Nielsen and Tingleff,
Methods for non-linear least squares problems, 2004, sec. 3.5). Sets are shared between processes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import contextlib
import dataclasses
import math
from typing import Any, TYPE_CHECKING, TypeAlias

import numpy as np

from hysteresis_ros.diagnosis.covariance import Covariance, noise_of, Point
from hysteresis_ros.diagnosis.observable import unaffected
from hysteresis_ros.diagnosis.parameters import ParameterVector
from hysteresis_ros.effects import Effect, needs_phase
from hysteresis_ros.model.simulation import WORTH_THREADS
from hysteresis_ros.workers import forks, map_in_forks, map_in_threads

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.discrepancy import Discrepancy

# Simulated responses are smooth only on this scale of the parameters' units.
DIFFERENCE = 0.02
MOST_STEPS, POLISHING_STEPS = 12, 3
# What the damping is divided by after a good step, and multiplied by after a bad one.
EASIER, HARDER = 10.0, 30.0
FIRST_DAMPING, MOST_DAMPING = 1e-2, 1e3
# A step that gains less than this in the log posterior ends the fit.
LEAST_GAIN = 0.1
# Longest step in the parameters' units, in which their range is about one.
LONGEST = 1.0
# The base model's own error bends an estimate by up to about this share.
ESTIMATE_SLACK = 0.15
# Fits without their covariances, these covariances' discrepancies, and phases to keep.
Answer: TypeAlias = 'list[tuple[Fit, Discrepancy | None, list[np.ndarray | None]]]'
# Standard deviations to each side of a 95 % interval.
FACTOR = 1.96


@dataclasses.dataclass
class Fit:
    """
    Effects fitted to the judged rows.

    Attributes
    ----------
    effects : list of Effect
        The fitted ones, with values.
    vector : ndarray, shape (k,)
        Their free parameters in the units of `ParameterVector`.
    predicted : ndarray, shape (n,)
        Response with them.
    jacobian : ndarray, shape (n, k)
        Derivatives of `predicted`; empty on a bench, where only the sets found need them.
    log_evidence : float
        Laplace's approximation; see `Fitter.judge`.
    values : ndarray, shape (4,), or None
        Of the covariance of the residuals under which the evidence is largest; see `Point`. None
        before `Fitter.judge`, or where no covariance gives a finite evidence.
    spread : ndarray, shape (k, k)
        Posterior covariance of `vector`.
    held_out : ndarray, shape (n,)
        Response of every row as predicted by a fit to the other folds; empty before
        `cross_validate`.
    covariance : Covariance or None
        That of the error of base model and effects along the way that the arm takes with these
        effects; None for the base model's along the way that it takes without.
    judged : int
        How many covariances at hand were tried with `covariance`.
    duration : float
        Of the recording that was fitted [s].
    passive : ndarray of bool, shape (K + 1,), or None
        On a bench: the weights of H2 that are not at their bound, and the bias, with which fits of
        neighbouring values begin.
    """

    effects: list[Effect]
    vector: np.ndarray
    predicted: np.ndarray
    jacobian: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    log_evidence: float = -np.inf
    values: np.ndarray | None = None
    spread: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    held_out: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    covariance: Covariance | None = None
    judged: int = 0
    duration: float = 0.0
    passive: np.ndarray | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Identifiers of the effects, sorted."""
        return tuple(sorted(effect.id for effect in self.effects))

    def require_values(self) -> np.ndarray:
        """
        Return the `values`.

        Raises
        ------
        ValueError
            If there are none.
        """
        if self.values is None:
            raise ValueError('a fit has no covariance before it is judged')
        return self.values

    @property
    def noise(self) -> float:
        """Standard deviation of the white noise, in the unit of the response."""
        return noise_of(self.require_values())

    def implausible(self) -> list[str]:
        """Names of parameters, or sums, whose estimate is outside their physical range."""
        return [f'{effect.id}.{name}' for effect in self.effects
                for name in effect.implausible(ESTIMATE_SLACK, self.duration)]


class _Walk:
    """One set of effects on its way to the maximum."""

    def __init__(self, effects: Sequence[Effect], kind: str) -> None:
        self.parameters = ParameterVector(effects, kind)
        self.mean, self.spread = self.parameters.prior()
        inside = 1e-6 * (self.parameters.upper - self.parameters.lower)
        self.vector = np.clip(self.parameters.vector(), self.parameters.lower + inside,
                              self.parameters.upper - inside)
        self.damping = FIRST_DAMPING
        # Arrays (n,) and (n, k); None while they are not known at the vector.
        self.predicted: Any = None
        self.jacobian: Any = None
        # Whether the derivatives are differences at the vector, not carried on from another.
        self.fresh = False
        self.cost, self.active = np.inf, True

    def penalty(self, vector: np.ndarray) -> float:
        """Return minus twice the log density of the prior at a vector (k,), but for a constant."""
        return float(np.sum(((vector - self.mean) / self.spread) ** 2))

    def moved(self) -> tuple[list[np.ndarray], list[float]]:
        """Return the vectors, each moved in one parameter, with the movements."""
        upper, vectors, steps = self.parameters.upper, [], []
        for index, value in enumerate(self.vector):
            step = DIFFERENCE if value + DIFFERENCE < upper[index] else -DIFFERENCE
            vectors.append(self.vector.copy())
            vectors[-1][index] += step
            steps.append(step)
        return vectors, steps

    def doubt(self) -> None:
        """End where the derivatives are exact, else have them made anew."""
        if self.fresh:
            self.active = False
        else:
            self.jacobian = None

    def step_to(self, vector: np.ndarray, predicted: np.ndarray, cost: float) -> None:
        """Move to a vector (k,) with its response (n,) if that is better, and damp accordingly."""
        if not cost < self.cost:
            if self.fresh:
                self.damping *= HARDER
                self.active = self.damping < MOST_DAMPING
            else:
                self.jacobian = None
            return
        self.damping = max(self.damping / EASIER, 1e-6)
        step = vector - self.vector
        wrong = predicted - self.predicted - self.jacobian @ step
        self.jacobian = self.jacobian + np.outer(wrong, step) / float(step @ step)
        self.vector, self.predicted, self.cost, self.fresh = vector, predicted, cost, False

    def candidate(self, jacobian: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the vector after one step, and the cost that it saves by the linearisation."""
        precision = self.spread ** -2.0
        matrix = jacobian.T @ jacobian + np.diag(precision)
        slope = jacobian.T @ residual - (self.vector - self.mean) * precision
        damped = matrix + self.damping * np.diag(np.diag(matrix))
        step = np.clip(np.linalg.solve(damped, slope), -LONGEST, LONGEST)
        vector = np.clip(self.vector + step, self.parameters.lower, self.parameters.upper)
        step = vector - self.vector
        return vector, float(2.0 * slope @ step - step @ matrix @ step)


class Fitter:
    """
    Fits sets of effects on one problem.

    Parameters
    ----------
    problem : Problem
        Runs of an arm.
    covariance : Covariance
        Of the residuals.
    discrepancy : callable
        ``discrepancy(fit)``: the `Discrepancy` of the base model along the way of a fit.
    """

    def __init__(self, problem: ArmProblem, covariance: Covariance,
                 discrepancy: Callable[[Fit], Discrepancy]) -> None:
        self.problem = problem
        self.covariance = covariance
        self.discrepancy = discrepancy
        self.fixed = list(problem.model.effects)
        # The covariances of the fit judged last, since it is often judged again after a step.
        self._judged: tuple[Covariance, list[Point]] = (covariance, [])

    def simulate(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        """Return the responses (len(sets), n) with sets of effects added to the model's own."""
        with np.errstate(all='ignore'):
            return self.problem.simulate_many([self._all(effects) for effects in sets])

    def error(self, predicted: np.ndarray) -> float:
        """Return the root mean square error of a response (n,), in its unit."""
        return float(np.sqrt(np.mean((self.problem.measured - predicted) ** 2)))

    def fit(self, sets: Sequence[Sequence[Effect]], point: Point,
            steps: int = MOST_STEPS, exact: bool = True) -> list[Fit]:
        """
        Fit sets of effects from their present values; those whose simulation fails are left out.

        Parameters
        ----------
        sets : sequence of list of Effect
        point : Point
            Covariance of the residuals.
        steps : int
            Gauss-Newton steps at most.
        exact : bool
            Whether all derivatives are differences; if not, those after the first are carried on by
            secants until a step fails.

        Returns
        -------
        list of Fit
        """
        found = self.shared(lambda effects: self.fit_one(effects, point, steps, exact), sets)
        return [fit for fits in found for fit in fits]

    def fit_one(self, effects: Sequence[Effect], point: Point, steps: int = MOST_STEPS,
                exact: bool = True) -> list[Fit]:
        """Fit one set of effects; none if its simulation fails. See `fit`."""
        walk = _Walk(effects, self.problem.kind)
        walk.predicted, = self._at(walk, [walk.vector])
        walk.cost = self._cost(walk, walk.vector, walk.predicted, point)
        if not math.isfinite(walk.cost):
            return []
        for _ in range(steps):
            if walk.jacobian is None:
                self._differentiate(walk)
            if not walk.active or not len(walk.vector):
                break
            vector, saved = walk.candidate(
                point.whiten(walk.jacobian), point.whiten(self.problem.measured - walk.predicted))
            if saved <= 2.0 * LEAST_GAIN:
                walk.doubt()
                continue
            predicted, = self._at(walk, [vector])
            walk.step_to(vector, predicted, self._cost(walk, vector, predicted, point))
            if exact and not walk.fresh:
                walk.jacobian = None
        if walk.jacobian is None:
            self._differentiate(walk)
        if not np.all(np.isfinite(walk.jacobian)):
            return []
        found = walk.parameters.with_vector(walk.vector)
        free = walk.parameters.free_still(found)
        return [self.judge(Fit(found, walk.vector[free], walk.predicted, walk.jacobian[:, free],
                               duration=self.problem.duration))]

    def shared(self, fit: Callable[[Sequence[Effect]], list[Fit]],
               sets: Sequence[Sequence[Effect]]) -> list[list[Fit]]:
        """
        Return the fits that are made of each set of effects, shared with forks, or with threads.

        Each begins with the phases known before all of them, whoever comes first.

        Parameters
        ----------
        fit : callable
            Of a set of effects, to a list of `Fit`.
        sets : sequence of list of Effect

        Returns
        -------
        list of list of Fit
        """
        problem = self.problem

        def answer(effects: Sequence[Effect]) -> Answer:
            with (problem.no_phases_kept() if needs_phase(self._all(effects))
                  else contextlib.nullcontext()):
                # A covariance is large, and all but its discrepancy is known here.
                return [(dataclasses.replace(one, covariance=None),
                         one.covariance.discrepancy if one.covariance else None,
                         problem.phases(self._all(one.effects))) for one in fit(effects)]

        if forks(problem.jobs) < 2 and problem.rows >= WORTH_THREADS:
            # Threads have one memory of phases.
            alone = [not needs_phase(self._all(effects)) for effects in sets]
            known = iter(map_in_threads(
                answer, [effects for effects, one in zip(sets, alone) if one], problem.jobs))
            answers = [next(known) if one else answer(effects)
                       for effects, one in zip(sets, alone)]
        else:
            answers = map_in_forks(answer, sets, problem.jobs)
        found: list[list[Fit]] = []
        for fits in answers:
            found.append([])
            for one, discrepancy, phases in fits:
                problem.keep_phases(self._all(one.effects), phases)
                found[-1].append(dataclasses.replace(
                    one, covariance=self.covariance.of(discrepancy) if discrepancy else None))
        return found

    def _all(self, effects: Sequence[Effect]) -> list[Effect]:
        """Return the effects of the model with further ones."""
        return [*unaffected(self.fixed, effects), *effects]

    def _at(self, walk: _Walk, vectors: Sequence[np.ndarray]) -> np.ndarray:
        """Return the responses (len(vectors), n) of a walk at its vectors."""
        return self.simulate([walk.parameters.with_vector(vector) for vector in vectors])

    def _differentiate(self, walk: _Walk) -> None:
        vectors, steps = walk.moved()
        walk.jacobian = ((self._at(walk, vectors) - walk.predicted).T / np.array(steps)
                         if steps else np.zeros((len(walk.predicted), 0)))
        walk.fresh = True
        walk.active = walk.active and bool(np.all(np.isfinite(walk.jacobian)))

    def _cost(self, walk: _Walk, vector: np.ndarray, predicted: np.ndarray, point: Point) -> float:
        """Return minus twice the log posterior at a vector (k,), but for a constant."""
        if not np.all(np.isfinite(predicted)):
            return math.inf
        whitened = point.whiten(self.problem.measured - predicted)
        return float(whitened @ whitened) + walk.penalty(vector)

    def judge(self, fit: Fit) -> Fit:
        """
        Return a fit with its evidence, the largest over the covariances at hand.

        Laplace: log p(y | set) = log p(y | x, K) + log p(x) + k/2 log 2 pi - 1/2 log det H, with
        H = J' K^-1 J + the prior's precision (MacKay, Information Theory, ch. 28).
        """
        mean, spread = ParameterVector(fit.effects, self.problem.kind).prior()
        away = (fit.vector - mean) / spread
        points: Iterable[Point]
        prior = -0.5 * float(away @ away) - float(np.sum(np.log(spread)))
        if fit.covariance is None:
            best, points = dataclasses.replace(fit, log_evidence=-np.inf), self.covariance.points
        else:
            best = dataclasses.replace(fit, judged=len(self.covariance.points))
            points = self._points_of(fit.covariance, fit.judged)
        columns = np.column_stack([self.problem.measured - fit.predicted, fit.jacobian])
        precision = np.diag(spread ** -2.0)
        for point in points:
            whitened = point.whiten(columns)
            residual, jacobian = whitened[:, 0], whitened[:, 1:]
            matrix = jacobian.T @ jacobian + precision
            evidence = (float(point.log_density(residual)) + prior
                        - 0.5 * float(np.linalg.slogdet(matrix)[1]))
            if evidence > best.log_evidence:
                best = dataclasses.replace(
                    best, log_evidence=evidence, values=point.values, spread=np.linalg.inv(matrix))
        return best

    def _points_of(self, covariance: Covariance, first: int) -> Iterable[Point]:
        """Return the covariances at hand from the first on, with a fit's own discrepancy."""
        values = [point.values for point in self.covariance.points]
        if first > 0:
            return covariance.points_at(values[first:])
        owner, points = self._judged
        known = points if owner is covariance else []
        known = [*known, *covariance.points_at(values[len(known):])]
        # Threads may judge other fits meanwhile.
        self._judged = covariance, known
        return known

    def point(self, fit: Fit) -> Point:
        """Return the covariance of the residuals under which a fit's evidence is largest."""
        return (fit.covariance or self.covariance).point(fit.require_values())

    def along(self, fit: Fit) -> Fit:
        """Return a fit judged by the discrepancy along the way that the arm takes with it."""
        own = self.covariance.of(self.discrepancy(fit))
        return self.judge(dataclasses.replace(
            fit, covariance=own, judged=0, log_evidence=-np.inf))

    def polished(self, fit: Fit) -> Fit:
        """Fit the effects once more, under the covariance that the fit is judged by."""
        if not len(fit.vector):
            return fit
        again = [self.judge(dataclasses.replace(one, covariance=fit.covariance, judged=0,
                                                log_evidence=-np.inf))
                 for one in self.fit([fit.effects], self.point(fit), POLISHING_STEPS)]
        return max([fit, *again], key=lambda one: one.log_evidence)

    def covariance_values(self, fit: Fit) -> np.ndarray:
        """Return the values (4,) of the covariance that suit the residual of a fit best."""
        own = fit.covariance or self.covariance
        return own.fit(self.problem.measured - fit.predicted, fit.require_values())

    def refined(self, fit: Fit, values: np.ndarray) -> Fit:
        """Return a fit whose effects are fitted once more, under a covariance of values (4,)."""
        point = (fit.covariance or self.covariance).point(values)
        better = self.fit([fit.effects], point, POLISHING_STEPS) if len(fit.vector) else []
        better = [one if fit.covariance is None else self.along(one) for one in better]
        return max([self.judge(fit), *better], key=lambda one: one.log_evidence)

    def least_squares(self, fit: Fit) -> Fit:
        """
        Return a fit whose effects predict best: by least squares, whatever the covariance.

        Where an effect's equation is not quite that of nature, the values that predict best are
        not the most probable ones. Their intervals contain those of the most probable ones, which
        is what the rows say where their errors last.
        """
        if not len(fit.vector):
            return fit
        white = self.covariance.white(max(self.error(fit.predicted), self.covariance.resolution))
        found, = self.fit([fit.effects], white) or [fit]
        # A form may have come out neutral, and is no longer free.
        free = ParameterVector(fit.effects, self.problem.kind).free_still(found.effects)
        spread = fit.spread[np.ix_(free, free)]
        size = np.sqrt(np.maximum(np.diag(spread), 1e-300))
        wider = 1.0 + np.abs(found.vector - fit.vector[free]) / (FACTOR * size)
        return dataclasses.replace(
            found, log_evidence=fit.log_evidence, values=fit.values,
            spread=spread * np.outer(wider, wider))

    def towards_least(self, fit: Fit) -> np.ndarray:
        """Return the response (n,), linearised, after one step towards the least squares."""
        if not len(fit.vector):
            return fit.predicted
        walk = _Walk(fit.effects, self.problem.kind)
        walk.vector = fit.vector
        step = self._step(fit, walk, np.ones(len(fit.predicted), dtype=bool))
        response: np.ndarray = fit.predicted + fit.jacobian @ step
        return response

    def with_intervals(self, fit: Fit, factor: float = FACTOR) -> list[Effect]:
        """Return the fitted effects with 95 % intervals of their parameters."""
        half = factor * np.sqrt(np.maximum(np.diag(fit.spread), 0.0))
        return ParameterVector(fit.effects, self.problem.kind).with_intervals(fit.vector, half)

    def cross_validate(self, fits: Iterable[Fit]) -> list[Fit]:
        """
        Return fits with the response of every row as predicted by a fit to the other folds.

        One Gauss-Newton step from the fit to all rows, or a part of it, as the other folds say.
        """
        fits = list(fits)
        folds = self.problem.folds
        sets, counts = [], []
        for fit in fits:
            walk = _Walk(fit.effects, self.problem.kind)
            walk.vector = fit.vector
            own: list[list[Effect]] = []
            for fold in folds if len(fit.vector) else ():
                step = self._step(fit, walk, self.problem.fold != fold)
                own += [walk.parameters.with_vector(np.clip(
                    fit.vector + part * step, walk.parameters.lower, walk.parameters.upper))
                    for part in (1.0, 0.25)]
            sets += own
            counts.append(len(own))
        found = []
        for fit, responses in zip(fits, np.split(self.simulate(sets), np.cumsum(counts)[:-1])):
            held_out = fit.predicted.copy()
            for index, fold in enumerate(folds if len(fit.vector) else ()):
                test = self.problem.fold == fold
                # No step comes first: of the time of an event in rows held out, others say nothing.
                tried = (fit.predicted, *responses[2 * index:2 * index + 2])
                error = [np.mean((self.problem.measured - one)[~test] ** 2) for one in tried]
                held_out[test] = tried[int(np.nanargmin(error))][test]
            found.append(dataclasses.replace(fit, held_out=held_out))
        return found

    def _step(self, fit: Fit, walk: _Walk, train: np.ndarray) -> np.ndarray:
        """
        Return the Gauss-Newton step towards the rows to train on, shape (k,).

        What changes nothing in these stays: of the time of an event in other rows they say nothing.
        """
        # Rows held out get no say; under the covariance of all rows that is a large noise.
        jacobian, residual = (fit.jacobian[train],
                              (self.problem.measured - fit.predicted)[train])
        matrix = jacobian.T @ jacobian
        variance = max(float(np.mean(residual ** 2)), 1e-300)
        slope = jacobian.T @ residual / variance - (fit.vector - walk.mean) / walk.spread ** 2
        slope[np.diag(matrix) == 0.0] = 0.0
        matrix = matrix / variance + np.diag(walk.spread ** -2.0)
        return np.clip(np.linalg.solve(matrix, slope), -LONGEST, LONGEST)
