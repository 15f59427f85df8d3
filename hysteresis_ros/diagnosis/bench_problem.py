# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects judged on bench tables.

A bench table is where the weights come from, so every set of effects gets weights of its own,
fitted to the rows that are not held out.
"""

from __future__ import annotations

from collections.abc import Sequence
import copy
import dataclasses
import functools
from typing import Literal, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_courses import BenchCourses
from hysteresis_ros.diagnosis.bench_design import Design, operator_with, weight_sizes
from hysteresis_ros.diagnosis.bench_weights import BenchWeights, Solution
from hysteresis_ros.diagnosis.problem import Problem
from hysteresis_ros.diagnosis.significance import surely_larger, typical_error
from hysteresis_ros.effects import Effect, SensorEffect
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.identification.bench import LEVELS
from hysteresis_ros.identification.bench_metrics import drive_slope, left_out, rows_left_out
from hysteresis_ros.identification.grid import FOLLOWING
from hysteresis_ros.identification.least_squares import (
    fit_weights, SLACK, WEAKER_STRENGTHS)
from hysteresis_ros.identification.nonnegative import solve
from hysteresis_ros.identification.smoothness import smoothness
from hysteresis_ros.operators import Preisach
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.identification.weight_fit import WeightFit
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

# Strength of the regularisation of weights that predict rows held out: more of it widens a steep
# loop, which under a load that was not fitted counts as the error of the effects.
HELD_OUT_STRENGTH = 1e-9
# How often weights and their feedback are fitted to each other.
PASSES = 2
# A finer grid has to lower the error of trials held out by this share.
WORTH = 0.02
# How much finer than the usual one the grid of H2 may be for these, once its effects are known.
FINER = 1.0, 1.5, 2.0
# How much finer it is for the weights of all rows. On looked-at wires 2 leaves compensation up to a
# quarter worse, and 3 to 5 are no better.
FINEST = 2.5
# Share of the way of the response from which on rows are sparse: of benches in steps 0.89 and
# more goes past nodes, of sweeps 0.51 at most, with an alloy that transforms within 10 K.
SPARSE_SHARE = 0.7
# Share of the response's range below which an error does not matter.
SMALL_ERROR = 0.01
# Share of the range of the loads by which two that count as the same may differ.
SAME_LOAD = 0.02
# How much finer it is where sets of effects are judged: cells as wide as a loop take up what an
# effect does to its width, and bend the effect's parameters. Of 48 benches 1 loses an effect of
# the load on four; 2 names about the same as 1.5, and takes twice as long.
JUDGED = 1.5
# The same for muscles that do not transform: the response of a pneumatic one varies evenly with its
# input, so that its grid is even, too.
JUDGED_EVEN = 2.0


class BenchProblem(Problem):
    """Bench tables, with weights refitted to the training rows for every set of effects."""

    refits: Literal[True] = True

    def __init__(self, model: MuscleModel, measurements: Sequence[Measurement]) -> None:
        super().__init__(model, measurements)
        stage = model.require_length_stage()
        if not isinstance(stage, Preisach):
            raise MeasurementError(f'effects on bench tables need a Preisach length stage, this '
                                   f'model has a {stage.kind} one; identify it with --operator '
                                   'two-stage or preisach')
        # A model with effects was refined before; twice refined, rows would not determine it.
        self._usual_levels = min(len(stage.nodes) - 1, LEVELS[1])
        self._surroundings = model.surroundings
        self._transforms = model.surroundings.drive != 'pressure'
        trials = [trial for simulator in self.simulators for trial in simulator.trials]
        begins = np.cumsum([0] + [simulator.measurement.rows for simulator in self.simulators])
        courses = BenchCourses(
            model, trials,
            np.concatenate([begin + chosen for begin, chosen in zip(begins, self.chosen)]),
            self.measured, self.trial, FOLLOWING if self._transforms else 0.0)
        self._weights = BenchWeights(model, courses, self.measured, self._usual_levels)
        self._holding_out: BenchProblem | None = None
        loads = np.array([np.mean(trial.load) for trial in trials])
        # Which load each trial has, shape (trials,); those that count as the same are equal.
        self._load_of_trial = np.round(loads / max(SAME_LOAD * np.ptp(loads), 1e-12))

    def _with(self, weights: BenchWeights) -> BenchProblem:
        """Return the same rows with weights that are sought in another way."""
        other = copy.copy(self)
        other._weights, other._holding_out = weights, None
        return other

    @property
    def levels(self) -> int:
        """Of the grid of H2."""
        return self._weights.levels

    @property
    def emphasis(self) -> np.ndarray:
        """By how much the error of each row counts in the fits, shape (n,); see `balanced`."""
        return self._weights.emphasis

    def with_emphasis(self, emphasis: np.ndarray) -> BenchProblem:
        """Return the same with rows whose errors count by another amount (n,)."""
        return self._with(self._weights.like(emphasis=emphasis))

    def finer(self) -> BenchProblem:
        """Return the same rows with H2 on the grid on which sets of effects are judged."""
        return self._with(self._weights.like(levels=round(
            (JUDGED if self._transforms else JUDGED_EVEN) * self._usual_levels)))

    def finest(self, effects: Sequence[Effect]) -> BenchProblem:
        """
        Return the same rows with weights that follow steps as closely as those of the last fit may.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        """
        if not self.rows_are_sparse(effects):
            return self.finer()
        return self._with(self._weights.like(
            levels=round(FINEST * self._usual_levels), strength=float(WEAKER_STRENGTHS[0])))

    def apart(self) -> BenchProblem:
        """Return the same, from whose work this one does not learn; what is known, it shares."""
        other = self._with(self._weights.apart())
        if self._holding_out is not None:
            other._holding_out = self._holding_out.apart()
        return other

    def begin_near(self, passive: np.ndarray | None) -> None:
        """Let weights be sought near others first; see `BenchWeights.begin_near`."""
        self._weights.begin_near(passive)

    def holding_out(self) -> BenchProblem:
        """Return the same rows and grid, with weights regularised as for rows held out."""
        if self._holding_out is None:
            self._holding_out = self._with(self._weights.like(strength=HELD_OUT_STRENGTH))
        return self._holding_out

    def balanced(self, effects: Sequence[Effect], train: np.ndarray | None = None
                 ) -> BenchProblem:
        """
        Return the same, with less weight on loads that are off by more than what matters.

        Loads have errors of their own size, unknown beforehand (see `typical_error`): each row
        counts with the variance of its fold, but for what is below `small_error`.

        Parameters
        ----------
        effects : sequence of Effect
            Those with which rows are fitted.
        train : ndarray of bool, shape (n,), optional
            Rows that are fitted; all by default.
        """
        rows = np.ones(len(self.measured), dtype=bool) if train is None else train
        fold = self.fold[rows]
        squares = (self.measured - self.finer().simulate(effects, train))[rows] ** 2
        variance = np.bincount(fold, weights=squares) / np.maximum(np.bincount(fold), 1)
        weight = 1.0 / np.maximum(variance[fold], self.small_error ** 2)
        emphasis = np.ones(len(rows))
        emphasis[rows] = np.sqrt(weight / np.mean(weight))
        return self.with_emphasis(emphasis)

    @functools.cached_property
    def loads_return(self) -> bool:
        """Whether a load comes back after another one, so that use can be told from load."""
        loads = self._load_of_trial
        kinds = len(np.unique(loads))
        return kinds == 1 or 1 + np.count_nonzero(np.diff(loads)) > kinds

    @property
    def small_error(self) -> float:
        """Error below which none matters, in the unit of the response."""
        return max(self.noise, SMALL_ERROR * float(np.ptp(self.measured)))

    def squares(self, response: np.ndarray) -> np.ndarray:
        """Return the mean square error of a response (n,) in each fold, shape (folds,)."""
        squares, rows = (np.bincount(self.fold, weights=weights) for weights in (
            (self.measured - response) ** 2, np.ones(len(response))))
        return squares[rows > 0] / rows[rows > 0]

    def typical_error(self, response: np.ndarray, least: float | None = None) -> float:
        """
        Return the geometric mean over the folds of the RMSE of a response (n,).

        Errors of a fold below `least`, by default `small_error`, count as none; see
        `significance.typical_error`.
        """
        return float(typical_error(
            self.squares(response), self.small_error if least is None else least))

    def predicts_as_well(self, response: np.ndarray, other: np.ndarray, practical: float) -> bool:
        """
        Whether rows held out may be predicted by a response (n,) as well as by another one.

        Its typical error is larger by no more than what matters, a share `practical`, or by no
        more than chance over the folds may make of it.
        """
        if self.typical_error(response) <= (1.0 + practical) * self.typical_error(other):
            return True
        return not surely_larger(self.squares(response), self.squares(other), self.small_error)

    @property
    def left_out_together(self) -> np.ndarray:
        """Groups of rows, shape (n,), by the load, or by the trial where all loads are the same."""
        loads = self._load_of_trial
        return loads[self.trial] if len(np.unique(loads)) > 1 else self.trial

    def fit_stage(self, effects: Sequence[Effect], levels: int, train: np.ndarray | None = None,
                  press: bool = False) -> tuple[WeightFit, Design]:
        """
        Fit H2's weights, their regularisation cross-validated over the trials or rows.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        levels : int
            Of H2.
        train : ndarray of bool, shape (n,), optional
            Rows to fit; all by default.
        press : bool
            Cross-validate over rows: what lies between them is to be predicted, not another trial.

        Returns
        -------
        WeightFit, Design
        """
        rows = slice(None) if train is None else train
        groups = self.trial[rows]
        if len(np.unique(groups)) == 1:
            groups = self.block[rows]
        feedback = self._weights.feedback(effects, train, levels)
        for remaining in range(PASSES if feedback else 0, -1, -1):
            design = self._weights.design(effects, feedback, levels)
            fit = fit_weights(
                design.rows[rows], (self.measured - design.known)[rows], groups=groups,
                scale=weight_sizes(design.nodes), slack=None if press else SLACK, press=press,
                penalty=smoothness(design.nodes, reversible=True), emphasis=self.emphasis[rows])
            if remaining and feedback:
                # That of these weights, which are smoother, is not quite the same.
                z = np.append(fit.weights * weight_sizes(design.nodes), fit.bias)
                feedback = self._weights.feedback_of(effects, design, z, feedback)
        return fit, design

    def rows_are_sparse(self, effects: Sequence[Effect]) -> bool:
        """
        Whether rows are further apart than the nodes of the usual grid, where it matters.

        That is, most of the way that the response goes is gone between rows with more than one node
        between their inputs of H2.
        """
        nodes, inputs = self._weights.inputs(effects, self._usual_levels)
        passed = np.abs(np.diff(np.searchsorted(nodes, inputs)))
        way = np.abs(np.diff(self.measured)) * (np.diff(self.trial) == 0)
        return bool(np.sum(way[passed > 1]) > SPARSE_SHARE * np.sum(way))

    def stage(self, effects: Sequence[Effect], levels: int, train: np.ndarray) -> Preisach:
        """Return H2 as rows to train on (n,) give it, with all effects of the model."""
        fit, design = self.fit_stage(effects, levels, train, press=self.rows_are_sparse(effects))
        return operator_with(design.nodes, fit.weights, fit.bias)

    def simulate(self, effects: Sequence[Effect], train: np.ndarray | None = None) -> np.ndarray:
        """Return the response of the judged rows, shape (n,), weights fitted to `train` (n,)."""
        return self.solve(effects, train).predicted

    def solve(self, effects: Sequence[Effect], train: np.ndarray | None = None) -> Solution:
        """Fit H2's weights with effects as they are; see `BenchWeights.solve`."""
        solution = self._weights.solve(effects, train)
        return dataclasses.replace(
            solution, predicted=self._sensed(effects, solution.predicted))

    def near(self, solution: Solution, effects: Sequence[Effect],
             train: np.ndarray | None = None) -> np.ndarray:
        """Return the response for effects near those of a solution; see `BenchWeights.near`."""
        return self._sensed(effects, self._weights.near(solution, effects, train))

    def _sensed(self, effects: Sequence[Effect], response: np.ndarray) -> np.ndarray:
        """Return what sensors show of a response (n,)."""
        for effect in effects:
            if isinstance(effect, SensorEffect):
                response = self._sensed_with(effect, response)
        return response

    def _sensed_with(self, effect: SensorEffect, response: np.ndarray) -> np.ndarray:
        sensed = response.copy()
        for trial in np.unique(self.trial):
            rows = self.trial == trial
            inputs = self.simulators[0].trials[0].inputs._replace(
                time=self.signals['time'][rows])
            sensed[rows] = effect.forward(response[rows], inputs)
        return sensed

    def left_out_rmse(self, effects: Sequence[Effect]) -> float:
        """
        Return the RMSE of a row left out, by generalised cross-validation.

        The RMSE of all rows, divided by the share of them that the weights cannot follow: 1 - trace
        of the hat matrix / n (Golub, Heath and Wahba, Technometrics 21 (1979) 215).

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        """
        solution = self.solve(effects)
        rows, penalty = self._weights.free_rows(solution, effects)
        gram = rows.T @ rows / len(rows)
        followed = np.trace(solve(gram + penalty, gram)) / len(rows)
        residual = self.measured - solution.predicted
        return float(np.sqrt(np.mean(residual ** 2)) / (1.0 - followed))

    def weight_columns(self, effects: Sequence[Effect]) -> np.ndarray:
        """Return how each weight of H2 moves the response of the judged rows, shape (n, K)."""
        return self._weights.design(
            effects, self._weights.feedback(effects, None, self.levels)).rows

    def completed(self, effects: Sequence[Effect]) -> MuscleModel:
        """
        Return the model with these effects and H2's weights refitted to all rows.

        What the effects explain no longer has to be smoothed over, so that the grid may be finer
        where trials left out say so. Where rows are further apart than its nodes, the weights
        follow as much as predicts a row left out best, on a grid that is finer still; what trials
        left out are off by is that of the weights before.
        """
        (fit, design), *finer = map_in_forks(
            lambda factor: self.fit_stage(effects, round(factor * self._usual_levels)),
            FINER, self.jobs)
        for other in finer:
            if other[0].held_out_rmse < (1.0 - WORTH) * fit.held_out_rmse:
                fit, design = other
        by_trials = fit
        if self.rows_are_sparse(effects):
            fit, design = self.fit_stage(
                effects, round(FINEST * self._usual_levels), press=True)
        stage = operator_with(design.nodes, fit.weights, fit.bias)
        found = dataclasses.replace(
            self.model, effects=list(effects), length_stage=stage, replicates=[])
        slope = self.pick([drive_slope(found, one) for one in self.measurements])
        load = self.signals.get('load')
        found.metrics = {**found.metrics, 'length': {
            **found.metrics.get('length', {}),
            **left_out(by_trials, self.measured, self.trial, load, slope),
            **rows_left_out(fit, self.trial, load)}}
        return found
