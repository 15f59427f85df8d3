# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit the parameters of effects to bench tables, and test the fit on rows that were held out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import copy
import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from scipy import special    # its stats take a second to import

from hysteresis_ros.diagnosis.arm_fit import DIFFERENCE, Fit
from hysteresis_ros.diagnosis.determined import spans
from hysteresis_ros.diagnosis.observable import unaffected
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of
from hysteresis_ros.diagnosis.profile import profile_interval
from hysteresis_ros.effects import Effect
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.identification.gauss_newton import minimise

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem, Solution

# Starts that are followed for a few steps after all were tried once, if their mean square error is
# not larger than the best's by this factor; the best goes on.
FOLLOWED_STARTS, WORTH_FOLLOWING, FIRST_EVALUATIONS = 2, 2.0, 4
# Decimals, in parts of the response's variance, to which errors of starts without effect agree.
SAME = 9
MOST_EVALUATIONS, HELD_OUT_EVALUATIONS = 8, 3
TOLERANCE = 1e-3
# A parameter whose whole unit moves the response by less than this share of its spread (rms), once
# the weights have followed, is not determined.
UNDETERMINED = 1e-5


class Response:
    """
    The response as a function of the parameters of some effects, H2's weights refitted.

    Parameters
    ----------
    problem : BenchProblem
        Rows.
    fixed : sequence of Effect
        Other effects, which stay as they are.
    effects : sequence of Effect
        Effects with the parameters that are fitted.
    rows : ndarray of bool, shape (n,), optional
        Rows that weights and parameters are fitted to; all by default.
    informed : bool
        Whether all parameters are known beforehand to be plausible, and not only those that are
        one-sided: rows that are left out may be the only ones that tell a parameter.
    """

    def __init__(self, problem: BenchProblem, fixed: Sequence[Effect], effects: Sequence[Effect],
                 rows: np.ndarray | None = None, informed: bool = False) -> None:
        self.problem, self.rows, self._informed = problem, rows, informed
        self.parameters = ParameterVector(effects, problem.kind)
        self._fixed = unaffected(fixed, effects)
        self._fitted: slice | np.ndarray = slice(None) if rows is None else rows
        self._scale = max(float(np.std(problem.measured)), 1e-12)
        self._alone = [ParameterVector([effect], problem.kind) for effect in effects]
        self._values: dict[tuple[int, bytes], Effect] = {}
        self._solutions: dict[bytes, Solution] = {}
        self._derivatives: dict[bytes, np.ndarray] = {}

    def minimise(self, start: np.ndarray, evaluations: int, tolerance: float,
                 held: tuple[int, float] | None = None) -> np.ndarray:
        """Return the vector (k,) of least squares near a start; one component may be held."""
        if len(start) == 0:
            return start
        mean, pull = self._known_beforehand(start)
        lower, upper = self.parameters.lower.copy(), self.parameters.upper.copy()
        if held is not None:
            index, value = held
            lower[index] = upper[index] = value
        emphasis = self.problem.emphasis
        return minimise(
            lambda vector: np.append((emphasis * (self.predicted(vector) - self.problem.measured))[
                self._fitted] / self._scale, pull @ (vector - mean)),
            lambda vector: np.vstack(((emphasis[:, None] * self.jacobian(vector))[
                self._fitted] / self._scale, pull)),
            start, lower, upper, evaluations, tolerance)

    def squares(self, vector: np.ndarray) -> float:
        """Return the sum of squares of the rows fitted, as they count."""
        error = (self.problem.emphasis * (self.predicted(vector) - self.problem.measured))[
            self._fitted]
        return float(error @ error)

    def _known_beforehand(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return mean (k,) and the rows (m, k) that pull those parameters there that need it.

        Rows within a block are not independent: a block weighs as much as one standard deviation.
        """
        mean, spread = self.parameters.prior()
        chosen = np.flatnonzero([self._informed or one.one_sided
                                 for _, one in self.parameters.entries])
        pull = np.zeros((len(chosen), len(mean)))
        if len(chosen):
            error = (self.predicted(start) - self.problem.measured)[self._fitted] / self._scale
            blocks = len(np.unique(self.problem.block[self._fitted]))
            pull[np.arange(len(chosen)), chosen] = np.sqrt(
                error @ error / blocks) / spread[chosen]
        return mean, pull

    def fit(self, vector: np.ndarray) -> Fit:
        """
        Return the effects with the values of a vector (k,), and what they predict.

        A form that comes out neutral is the simplest one and stays so: it is no longer free.
        """
        effects = self.parameters.with_vector(vector)
        kept = self.parameters.free_still(effects)
        solution = self._solution(vector)
        return Fit(effects, vector[kept], solution.predicted, duration=self.problem.duration,
                   passive=solution.weights.passive)

    def predicted(self, vector: np.ndarray) -> np.ndarray:
        """Return the response of all rows, shape (n,)."""
        return self._solution(vector).predicted

    def jacobian(self, vector: np.ndarray) -> np.ndarray:
        """Return the derivatives of the response, shape (n, k)."""
        key = vector.tobytes()
        if key not in self._derivatives:
            columns = [self._derivative(vector, index) for index in range(len(vector))]
            self._derivatives[key] = np.stack(columns, axis=1) if columns else np.zeros(
                (len(self.problem.measured), 0))
        return self._derivatives[key]

    def _solution(self, vector: np.ndarray) -> Solution:
        key = vector.tobytes()
        if key not in self._solutions:
            self._solutions[key] = self.problem.solve(self._effects(vector), self.rows)
        return self._solutions[key]

    def _derivative(self, vector: np.ndarray, index: int) -> np.ndarray:
        solution, moved = self._solution(vector), np.array(vector)
        inside = vector[index] + DIFFERENCE < self.parameters.upper[index]
        moved[index] += DIFFERENCE if inside else -DIFFERENCE
        near = self.problem.near(solution, self._effects(moved), self.rows)
        return (near - solution.predicted) / (moved[index] - vector[index])

    def _effects(self, vector: np.ndarray) -> list[Effect]:
        """Return all effects; one that did not move is made once."""
        found, begin = list(self._fixed), 0
        for number, alone in enumerate(self._alone):
            part = vector[begin:begin + len(alone)]
            begin += len(alone)
            key = number, part.tobytes()
            if key not in self._values:
                self._values[key] = alone.with_vector(part)[0]
            found.append(self._values[key])
        return found


class BenchFitter:
    """
    Fits effects on bench tables, with H2's weights refitted for every value of their parameters.

    Parameters
    ----------
    problem : BenchProblem
        Rows.
    """

    def __init__(self, problem: BenchProblem) -> None:
        self.problem = problem
        self.fixed = list(problem.model.effects)

    def on(self, problem: BenchProblem) -> BenchFitter:
        """Return the same with the weights of another problem of these rows."""
        other = copy.copy(self)
        other.problem = problem
        return other

    def apart(self) -> BenchFitter:
        """Return the same, from whose fits this one does not learn where to begin others."""
        return self.on(self.problem.apart())

    def holding(self, effects: Iterable[Effect]) -> BenchFitter:
        """Return the same with more effects that stay as they are."""
        other = copy.copy(self)
        other.fixed = [*self.fixed, *effects]
        return other

    def fit_but_kinetics(self, effects: Sequence[Effect]) -> tuple[Fit, list[Effect]]:
        """Return the fit of effects beside their kinetics, and all in order, with intervals."""
        kinetics = [effect for effect in effects if isinstance(effect, Kinetics)]
        fitter = self.holding(kinetics)
        fit = fitter.fit([effect for effect in effects if effect not in kinetics])
        found = {effect.id: effect for effect in (*fitter.with_intervals(fit), *kinetics)}
        return fit, [found[effect.id] for effect in effects]

    def fit(self, effects: Sequence[Effect], evaluations: int = MOST_EVALUATIONS,
            tolerance: float = TOLERANCE) -> Fit:
        """
        Fit from the present values of `effects`, by least squares within their bounds.

        Parameters
        ----------
        effects : sequence of Effect
            Effects to fit; their values are the start.
        evaluations : int
            Responses that the optimiser evaluates, at most.
        tolerance : float
            A step that lowers the sum of squares by a smaller share is the last.
        """
        response = Response(self.problem, self.fixed, effects)
        return response.fit(response.minimise(
            response.parameters.vector(), evaluations, tolerance))

    def fit_below(self, starts: Sequence[Sequence[Effect]], error: float) -> Fit | None:
        """
        Fit from the best of several starts, or give up where that promises too little.

        Parameters
        ----------
        starts : sequence of sequence of Effect
            Effects to fit; their values are the starts.
        error : float
            Largest error after the first steps that is worth going on, in the response's unit.
        """
        begun = self.begin(starts)
        return self.fit(begun.effects) if self.error(begun.predicted) <= error else None

    def search(self, known: Sequence[Effect], effect: Effect) -> Fit:
        """
        Fit one more effect together with the `known` ones, from its best starts.

        Parameters
        ----------
        known : sequence of Effect
            Effects found before, fitted again together with the new one.
        effect : Effect
            The new one.
        """
        starts = starts_of(effect, self.problem.kind, self.problem.measured)
        others = [*unaffected(self.fixed, [*known, starts[0]]), *known]
        followed = self._worth_following(
            [[*others, start] for start in starts], 1 if known else FOLLOWED_STARTS)
        return self.best_of([[*known, starts[index]] for index in followed])

    def begin(self, starts: Sequence[Sequence[Effect]]) -> Fit:
        """Follow the best of several starts, each a list of effects, for a few steps."""
        tried = [[*unaffected(self.fixed, effects), *effects] for effects in starts]
        return min((self.fit(starts[index], FIRST_EVALUATIONS)
                    for index in self._worth_following(tried, FOLLOWED_STARTS)),
                   key=lambda fit: self.error(fit.predicted))

    def _worth_following(self, sets: Sequence[Sequence[Effect]], most: int) -> list[int]:
        """Return which sets of all effects of the model begin with the least errors."""
        errors = [self.error(self.problem.simulate(effects)) ** 2 for effects in sets]
        # Starts without any effect, such as stops out of reach, all have the same error.
        spread = max(float(np.var(self.problem.measured)), 1e-300)
        _, order = np.unique(np.round(np.array(errors) / spread, SAME), return_index=True)
        return [int(index) for index in order[:most]
                if index == order[0] or errors[index] <= WORTH_FOLLOWING * min(errors)]

    def best_of(self, starts: Sequence[Sequence[Effect]]) -> Fit:
        """Follow several starts, each a list of effects, for a few steps, and fit the best."""
        begun: list[tuple[float, int, Response, np.ndarray]] = []
        for effects in starts:
            response = Response(self.problem, self.fixed, effects)
            vector = response.minimise(
                response.parameters.vector(), FIRST_EVALUATIONS, TOLERANCE)
            begun.append((self.error(response.predicted(vector)), len(begun), response, vector))
        _, _, response, vector = min(begun)
        return response.fit(response.minimise(vector, MOST_EVALUATIONS, TOLERANCE))

    def error(self, predicted: np.ndarray) -> float:
        """Return the root mean square error of a response (n,), in its unit."""
        return float(np.sqrt(np.mean((self.problem.measured - predicted) ** 2)))

    def cross_validate(self, fit: Fit) -> Fit:
        """Return a fit with the response of every row as predicted by a fit to the other folds."""
        problem, held_out = self.problem.holding_out(), np.empty(len(self.problem.measured))
        problem.begin_near(fit.passive)
        for fold in problem.folds:
            test = problem.fold == fold
            response = Response(problem, self.fixed, fit.effects, ~test, informed=True)
            vector = response.minimise(fit.vector, HELD_OUT_EVALUATIONS, TOLERANCE)
            held_out[test] = response.predicted(vector)[test]
        return dataclasses.replace(fit, held_out=held_out)

    def with_intervals(self, fit: Fit, level: float = 0.95) -> list[Effect]:
        """
        Return the fitted effects with intervals of their parameters.

        From the Jacobian, with the residuals summed by block (a sandwich estimate), because
        residuals of a simulated response are correlated. Where that says nothing of an effect's
        size, its interval is that of the profile of the squares, with as many independent rows as
        there are blocks.
        """
        response = Response(self.problem, self.fixed, fit.effects)
        parameters = response.parameters
        if len(parameters) == 0:
            return fit.effects
        jacobian = response.jacobian(fit.vector)
        if not np.all(np.isfinite(jacobian)):
            return parameters.with_intervals(fit.vector, np.full(len(parameters), np.inf))
        error = self.problem.measured - fit.predicted
        size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        normal = (jacobian / size).T @ (jacobian / size)
        inverse = np.linalg.pinv(normal, rcond=1e-10)
        # What the rows do not determine at all has no end, instead of no width.
        free = 1.0 - np.diag(inverse @ normal) > 0.5
        free |= ~self._moves(jacobian)
        inverse = inverse / np.outer(size, size)
        scores = np.stack([jacobian[rows].T @ error[rows] for rows in (
            self.problem.block == block for block in np.unique(self.problem.block))])
        count = len(scores)
        freedom = max(count - len(parameters), 1)
        covariance = count / freedom * inverse @ (scores.T @ scores) @ inverse
        quantile = float(special.stdtrit(freedom, 0.5 + level / 2.0))
        half = quantile * np.sqrt(np.maximum(np.diag(covariance), 0.0))
        half[free] = np.inf
        effects = parameters.with_intervals(fit.vector, half)
        for index, (number, parameter) in enumerate(parameters.entries):
            intervals = effects[number].intervals
            if (parameter is effects[number].size_parameter
                    and spans(parameter, *intervals[parameter.name])):
                intervals[parameter.name] = parameters.values_at(index, profile_interval(
                    response, fit.vector, index, 1.0 + quantile ** 2 / freedom))
        return effects

    def parameters_in_use(self, fit: Fit) -> int:
        """Return how many parameters of a fit the response depends on; a form may be idle alone."""
        jacobian = Response(self.problem, self.fixed, fit.effects).jacobian(fit.vector)
        return int(np.count_nonzero(self._moves(jacobian)))

    def _moves(self, jacobian: np.ndarray) -> np.ndarray:
        """Return whether each column of a Jacobian (n, k) moves the response at all."""
        spread = float(np.std(self.problem.measured)) * np.sqrt(len(jacobian))
        moves: np.ndarray = ~(np.linalg.norm(jacobian, axis=0) <= UNDETERMINED * spread)
        return moves
