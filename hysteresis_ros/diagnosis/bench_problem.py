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
from scipy import sparse

from hysteresis_ros.diagnosis.bench_courses import BenchCourses
from hysteresis_ros.diagnosis.bench_design import (
    Course, Design, Feedback, operator_with, weight_sizes)
from hysteresis_ros.diagnosis.problem import Problem
from hysteresis_ros.diagnosis.significance import surely_larger, typical_error
from hysteresis_ros.effects import Effect, needs_phase, SensorEffect
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.identification.bench_metrics import drive_slope, left_out
from hysteresis_ros.identification.grid import FOLLOWING
from hysteresis_ros.identification.kinetic_weights import KineticWeights, Tangent
from hysteresis_ros.identification.least_squares import SLACK, fit_weights
from hysteresis_ros.identification.nonnegative import extrapolated, part_of, solve
from hysteresis_ros.identification.projection import ProjectedWeights
from hysteresis_ros.identification.smoothness import smoothness
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.kinetic_stage import cold_input, with_kinetics
from hysteresis_ros.operators import Preisach
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.identification.weight_fit import WeightFit
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

# Strength of the weights' regularisation at which sets of effects are compared: only so much that
# the solution is unique. More of it bends the effects' own parameters.
SEARCH_STRENGTH = 3e-9
# The same for weights that predict rows held out: more of it widens a steep loop, which under a
# load that was not fitted counts as the error of the effects.
HELD_OUT_STRENGTH = 1e-9
# How often weights and their feedback are fitted to each other.
PASSES = 2
# Weights and kinetics are fitted to each other until the response changes by less than this share
# of its spread.
SETTLED = 3e-4
# A finer grid has to lower the held-out error by this share.
WORTH = 0.02
# How much finer than the model's the grid of H2 may be once its effects are known.
FINER = 1.0, 1.5, 2.0
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


@dataclasses.dataclass
class Solution:
    """Effects with the weights that suit the training rows best, and what both predict (n,)."""

    weights: ProjectedWeights
    predicted: np.ndarray
    feedback: Feedback | None


class BenchProblem(Problem):
    """
    Bench tables, with weights refitted to the training rows for every set of effects.

    Attributes
    ----------
    levels : int
        Of the grid of H2.
    emphasis : ndarray, shape (n,)
        By how much the error of each row counts in the fits; see `balanced`.
    """

    refits: Literal[True] = True

    def __init__(self, model: MuscleModel, measurements: Sequence[Measurement]) -> None:
        super().__init__(model, measurements)
        stage = model.require_length_stage()
        if not isinstance(stage, Preisach):
            raise MeasurementError(f'effects on bench tables need a Preisach length stage, this '
                                   f'model has a {stage.kind} one; identify it with --operator '
                                   'two-stage or preisach')
        self.levels = self._levels_of_model = len(stage.nodes) - 1
        self._surroundings = model.surroundings
        self._transforms = model.surroundings.drive != 'pressure'
        trials = [trial for simulator in self.simulators for trial in simulator.trials]
        begins = np.cumsum([0] + [simulator.measurement.rows for simulator in self.simulators])
        self._courses = BenchCourses(
            model, trials,
            np.concatenate([begin + chosen for begin, chosen in zip(begins, self.chosen)]),
            self.measured, self.trial, FOLLOWING if self._transforms else 0.0)
        loads = np.array([np.mean(trial.load) for trial in trials])
        # Which load each trial has, shape (trials,); those that count as the same are equal.
        self._load_of_trial = np.round(loads / max(SAME_LOAD * np.ptp(loads), 1e-12))
        self._strength = SEARCH_STRENGTH
        self.emphasis = np.ones(len(self.measured))
        self._forget()

    def _forget(self) -> None:
        """Begin without anything that was computed before."""
        self._holding_out: BenchProblem | None = None
        self._passive: dict[tuple | None, np.ndarray] = {}
        self._phases_of: tuple | None = None
        self._known_phases: list[np.ndarray] = []
        self._kinetic_z: np.ndarray | None = None

    def finer(self) -> BenchProblem:
        """Return the same rows with H2 on the grid on which sets of effects are judged."""
        other = copy.copy(self)
        other.levels = round(
            (JUDGED if self._transforms else JUDGED_EVEN) * self._levels_of_model)
        other._forget()
        return other

    def apart(self) -> BenchProblem:
        """Return the same, from whose work this one does not learn; what is known, it shares."""
        other = copy.copy(self)
        other._passive = dict(self._passive)
        other._courses = self._courses.apart()
        if self._holding_out is not None:
            other._holding_out = self._holding_out.apart()
        return other

    def begin_near(self, passive: np.ndarray | None) -> None:
        """
        Let weights be sought near others first, whatever was found before.

        Parameters
        ----------
        passive : ndarray of bool, shape (K + 1,), or None
            Those of a neighbouring problem that are not at their bound, and the bias.
        """
        self._passive = {} if passive is None else {None: passive}
        self._kinetic_z = None

    def holding_out(self) -> BenchProblem:
        """Return the same rows and grid, with weights regularised as for rows held out."""
        if self._holding_out is None:
            other = copy.copy(self)
            other._strength = HELD_OUT_STRENGTH
            other._forget()
            self._holding_out = other
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
        other = copy.copy(self)
        other.emphasis = np.ones(len(rows))
        other.emphasis[rows] = np.sqrt(weight / np.mean(weight))
        other._forget()
        return other

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

    def _design(self, effects: Sequence[Effect], levels: int | None = None,
                train: np.ndarray | None = None, feedback: Feedback | None = None,
                columns: np.ndarray | None = None) -> Design:
        levels = levels or self.levels
        feedback = feedback or self._feedback(effects, train, levels)
        course = self._courses.of(effects, feedback)
        scale, known = self._courses.judged(course)
        shares = course.excitation.shares(levels, scale, columns)
        if feedback is not None and feedback.kinetics is not None:
            rows, constant = feedback.kinetics
            part = course.kinetics * scale
            shares = shares + part[:, None] * (rows if columns is None else rows[:, columns])
            known = known + part * constant
        return Design(shares, known, course.excitation.nodes(levels),
                      course.excitation.smoothness(levels))

    def _feedback(self, effects: Sequence[Effect], train: np.ndarray | None, levels: int
                  ) -> Feedback | None:
        """Return what the best weights do that they depend on; None where it is nothing."""
        phases = self._phases(effects, train) if needs_phase(effects) else None
        if Chain(effects, self._surroundings).kinetics > 0.0:
            return Feedback(phases, self._kinetics(effects, train, phases, levels))
        return None if phases is None else Feedback(phases, None)

    def _kinetics(self, effects: Sequence[Effect], train: np.ndarray | None,
                  phases: list[np.ndarray] | None, levels: int) -> Tangent:
        """Return what kinetics of all of the wire add to H2 near its best weights."""
        plain = Feedback(phases, None)
        design = self._design(effects, levels, feedback=plain)
        course = self._courses.of(effects, plain)
        kinetic = self._added_by_kinetics(effects, course, design.nodes)
        part = course.kinetics * self._courses.judged(course)[0]
        rows = slice(None) if train is None else train

        def residual(z: np.ndarray) -> np.ndarray:
            predicted = design.shares @ z + design.known + part * kinetic.added(z)
            return (self.emphasis * (self.measured - predicted))[rows]

        def solved(tangent: Tangent) -> tuple[np.ndarray, sparse.csr_matrix]:
            near = self._design(effects, levels, feedback=Feedback(phases, tangent))
            return self._projected(near, train).z, self._penalty(near, train)

        # Neighbouring parameters, and neighbouring rows, have neighbouring weights.
        if self._kinetic_z is None or len(self._kinetic_z) != design.shares.shape[1]:
            self._kinetic_z = self._projected(design, train).z
        self._kinetic_z = kinetic.fitted(
            self._kinetic_z, residual, solved, SETTLED * float(np.std(self.measured)))
        return kinetic.tangent(self._kinetic_z)

    def _added_by_kinetics(self, effects: Sequence[Effect], course: Course, nodes: np.ndarray
                           ) -> KineticWeights:
        """Return what kinetics of all of the wire add to H2 on a grid."""
        top = cold_input(self.model, Chain(effects, self._surroundings), float(nodes[0]),
                         float(nodes[-1]))
        return course.excitation.kinetic(len(nodes) - 1, top)

    def _phases(self, effects: Sequence[Effect], train: np.ndarray | None) -> list[np.ndarray]:
        """
        Return the martensite share in every row of each trial.

        As a fit of those effects that do not depend on it predicts it from the inputs; the
        measured response would let an effect that follows the share predict rows from themselves.
        """
        effects = [effect for effect in effects if not effect.needs_phase]
        key = (None if train is None else train.tobytes(),
               *((effect.id, *effect.values.items()) for effect in effects))
        if key != self._phases_of:
            feedback = self._feedback(effects, train, self.levels)
            design = self._design(effects, train=train, feedback=feedback)
            stage = _operator(design, self._projected(design, train).z)
            self._known_phases = self._phases_with(effects, stage, feedback)
            self._phases_of = key
        return self._known_phases

    def _phases_with(self, effects: Sequence[Effect], stage: Preisach, feedback: Feedback | None
                     ) -> list[np.ndarray]:
        """Return the martensite share that an H2 shows in every row of each trial."""
        model = dataclasses.replace(self.model, length_stage=stage)
        whole = with_kinetics(self.model, Chain(effects, self._surroundings), stage)
        course = self._courses.of(effects, feedback)
        return [model.martensite(output) for output in self._courses.outputs(course, whole)]

    def _feedback_with(self, effects: Sequence[Effect], fit: WeightFit, design: Design,
                       feedback: Feedback) -> Feedback:
        """Return the feedback of an H2, of the kinds that that of another one has."""
        z = np.append(fit.weights * weight_sizes(design.nodes), fit.bias)
        phases = feedback.phases
        if phases is not None:
            phases = self._phases_with(effects, _operator(design, z), feedback)
        if feedback.kinetics is None:
            return Feedback(phases, None)
        course = self._courses.of(effects, Feedback(phases, None))
        kinetic = self._added_by_kinetics(effects, course, design.nodes)
        return Feedback(phases, kinetic.tangent(z))

    def fit_stage(self, effects: Sequence[Effect], levels: int, train: np.ndarray | None = None
                  ) -> tuple[WeightFit, Design]:
        """
        Fit H2's weights, their regularisation cross-validated over the trials.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        levels : int
            Of H2.
        train : ndarray of bool, shape (n,), optional
            Rows to fit; all by default.

        Returns
        -------
        WeightFit, Design
        """
        rows = slice(None) if train is None else train
        groups = self.trial[rows]
        if len(np.unique(groups)) == 1:
            groups = self.block[rows]
        feedback = self._feedback(effects, train, levels)
        for remaining in range(PASSES if feedback else 0, -1, -1):
            design = self._design(effects, levels, feedback=feedback)
            fit = fit_weights(
                design.rows[rows], (self.measured - design.known)[rows], groups=groups,
                scale=weight_sizes(design.nodes), slack=SLACK,
                penalty=smoothness(design.nodes, reversible=True), emphasis=self.emphasis[rows])
            if remaining and feedback:
                # That of these weights, which are smoother, is not quite the same.
                feedback = self._feedback_with(effects, fit, design, feedback)
        return fit, design

    def stage(self, effects: Sequence[Effect], levels: int, train: np.ndarray) -> Preisach:
        """Return H2 as rows to train on (n,) give it, with all effects of the model."""
        fit, design = self.fit_stage(effects, levels, train)
        return operator_with(design.nodes, fit.weights, fit.bias)

    def simulate(self, effects: Sequence[Effect], train: np.ndarray | None = None) -> np.ndarray:
        """Return the response of the judged rows, shape (n,), weights fitted to `train` (n,)."""
        return self.solve(effects, train).predicted

    def solve(self, effects: Sequence[Effect], train: np.ndarray | None = None) -> Solution:
        """
        Fit H2's weights with effects as they are.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        train : ndarray of bool, shape (n,), optional
            Rows to fit; all by default.
        """
        feedback = self._feedback(effects, train, self.levels)
        design = self._design(effects, feedback=feedback)
        weights = self._projected(design, train)
        return Solution(weights, self._response(effects, design, weights.z), feedback)

    def near(self, solution: Solution, effects: Sequence[Effect],
             train: np.ndarray | None = None) -> np.ndarray:
        """
        Return the response for effects that differ a little from those of a solution.

        Weights that are zero stay so, and so does the feedback.

        Parameters
        ----------
        solution : Solution
        effects : sequence of Effect
            The same effects with other values.
        train : ndarray of bool, shape (n,), optional
            The rows that the solution was fitted to.
        """
        columns = solution.weights.columns
        design = self._design(effects, feedback=solution.feedback, columns=columns)
        penalty = self._strength * part_of(design.smoothness, columns)
        penalty.flat[::len(columns) + 1] += self._further(design, train) * np.diag(penalty)
        z = solution.weights.moved(*self._rows(design, train), penalty)
        return self._response(effects, design, z)

    def _response(self, effects: Sequence[Effect], design: Design, z: np.ndarray) -> np.ndarray:
        response = design.shares @ z + design.known
        for effect in effects:
            if isinstance(effect, SensorEffect):
                response = self._sensed(effect, response)
        return response

    def _rows(self, design: Design, train: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Return design and target of the training rows."""
        rows, target = self.emphasis[:, None] * design.shares, self.emphasis * (
            self.measured - design.known)
        return (rows, target) if train is None else (rows[train], target[train])

    def _further(self, design: Design, train: np.ndarray | None) -> np.ndarray:
        """
        Return by what share more each weight of a design is penalised; see `extrapolated`.

        A transformation ends; a muscle that does not transform goes on as it did.
        """
        shares = design.shares
        if train is None or not self._transforms:
            return np.zeros(shares.shape[1])
        return extrapolated(shares, train)

    def _projected(self, design: Design, train: np.ndarray | None) -> ProjectedWeights:
        # Neighbouring parameters have neighbouring weights, on the same grid.
        key = len(design.nodes), None if train is None else train.tobytes()
        start = self._passive.get(key, self._passive.get(None))
        if start is not None and len(start) != design.shares.shape[1]:
            start = None
        found = ProjectedWeights(*self._rows(design, train), self._penalty(design, train), start)
        self._passive[key] = found.passive
        return found

    def _penalty(self, design: Design, train: np.ndarray | None) -> sparse.csr_matrix:
        penalty = self._strength * design.smoothness
        if train is not None:
            penalty += sparse.diags(
                self._further(design, train) * penalty.diagonal(), format='csr')
        return penalty

    def _sensed(self, effect: SensorEffect, response: np.ndarray) -> np.ndarray:
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
        design = self._design(effects, feedback=solution.feedback)
        columns, count = solution.weights.columns, len(self.measured)
        rows = design.shares[:, columns]
        gram = rows.T @ rows / count
        followed = np.trace(solve(
            gram + self._strength * part_of(design.smoothness, columns), gram))
        residual = self.measured - solution.predicted
        return float(np.sqrt(np.mean(residual ** 2)) / (1.0 - followed / count))

    def weight_columns(self, effects: Sequence[Effect]) -> np.ndarray:
        """Return how each weight of H2 moves the response of the judged rows, shape (n, K)."""
        return self._design(effects).rows

    def completed(self, effects: Sequence[Effect]) -> MuscleModel:
        """
        Return the model with these effects and H2's weights refitted to all rows.

        What the effects explain no longer has to be smoothed over, so that the grid may be finer
        where held-out rows say so.
        """
        (fit, design), *finer = map_in_forks(
            lambda factor: self.fit_stage(effects, round(factor * self._levels_of_model)),
            FINER, self.jobs)
        for other in finer:
            if other[0].held_out_rmse < (1.0 - WORTH) * fit.held_out_rmse:
                fit, design = other
        stage = operator_with(design.nodes, fit.weights, fit.bias)
        found = dataclasses.replace(
            self.model, effects=list(effects), length_stage=stage, replicates=[])
        slope = self.pick([drive_slope(found, one) for one in self.measurements])
        found.metrics = {**found.metrics, 'length': {**found.metrics.get('length', {}), **left_out(
            fit, self.measured, self.trial, self.signals.get('load'), slope)}}
        return found


def _operator(design: Design, z: np.ndarray) -> Preisach:
    """Return H2 with weights (K + 1,) times the sizes of their cells, its bias aside."""
    return operator_with(design.nodes, z[:-1] / weight_sizes(design.nodes), 0.0)
