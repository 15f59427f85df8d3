# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weights of H2 that suit the rows of a bench best, with effects as they are.

Where an effect depends on what the weights do (the martensite share, kinetics of the wire), these
are fitted to what they cause; see `Feedback`.
"""

from __future__ import annotations

from collections.abc import Sequence
import copy
import dataclasses

import numpy as np
from scipy import sparse

from hysteresis_ros.diagnosis.bench_courses import BenchCourses
from hysteresis_ros.diagnosis.bench_design import (
    Course, Design, Feedback, operator_with, weight_sizes)
from hysteresis_ros.effects import Effect, needs_phase
from hysteresis_ros.identification.kinetic_weights import KineticWeights, Tangent
from hysteresis_ros.identification.nonnegative import extrapolated, part_of
from hysteresis_ros.identification.projection import ProjectedWeights
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.kinetic_stage import cold_input, with_kinetics
from hysteresis_ros.operators import Preisach

# Strength of the weights' regularisation at which sets of effects are compared: only so much that
# the solution is unique. More of it bends the effects' own parameters.
SEARCH_STRENGTH = 3e-9
# Weights and kinetics are fitted to each other until the response changes by less than this share
# of its spread.
SETTLED = 3e-4


@dataclasses.dataclass
class Solution:
    """Effects with the weights that suit the training rows best, and what both predict (n,)."""

    weights: ProjectedWeights
    predicted: np.ndarray
    feedback: Feedback | None


class BenchWeights:
    """
    Weights of H2 for effects as they are, of which the latest are where others are sought.

    Parameters
    ----------
    model : MuscleModel
        Without the effects.
    courses : BenchCourses
    measured : ndarray, shape (n,)
        Response of the rows that are judged.
    levels : int
        Of the grid of H2.

    Attributes
    ----------
    levels : int
    emphasis : ndarray, shape (n,)
        By how much the error of each row counts.
    """

    def __init__(self, model: MuscleModel, courses: BenchCourses, measured: np.ndarray,
                 levels: int) -> None:
        self._model, self._courses, self._measured = model, courses, measured
        self._surroundings = model.surroundings
        self.levels = levels
        self.emphasis = np.ones(len(measured))
        self._strength = SEARCH_STRENGTH
        self._forget()

    def _forget(self) -> None:
        """Begin without anything that was computed before."""
        self._passive: dict[tuple | None, np.ndarray] = {}
        self._phases_of: tuple | None = None
        self._known_phases: list[np.ndarray] = []
        self._kinetic_z: np.ndarray | None = None

    def like(self, levels: int | None = None, strength: float | None = None,
             emphasis: np.ndarray | None = None) -> BenchWeights:
        """
        Return the same with other settings, to be sought from nowhere in particular.

        Parameters
        ----------
        levels : int, optional
            Of the grid of H2.
        strength : float, optional
            Of the regularisation.
        emphasis : ndarray, shape (n,), optional
        """
        other = copy.copy(self)
        other.levels = self.levels if levels is None else levels
        other.emphasis = self.emphasis if emphasis is None else emphasis
        other._strength = self._strength if strength is None else strength
        other._forget()
        return other

    def apart(self) -> BenchWeights:
        """Return the same, from whose work these do not learn; what is known, they share."""
        other = copy.copy(self)
        other._passive = dict(self._passive)
        other._courses = self._courses.apart()
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

    def solve(self, effects: Sequence[Effect], train: np.ndarray | None = None) -> Solution:
        """
        Fit the weights, of which `predicted` is what comes before any sensor's effect.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        train : ndarray of bool, shape (n,), optional
            Rows to fit; all by default.
        """
        feedback = self.feedback(effects, train, self.levels)
        design = self.design(effects, feedback)
        weights = self._projected(design, train)
        return Solution(weights, design.shares @ weights.z + design.known, feedback)

    def near(self, solution: Solution, effects: Sequence[Effect], train: np.ndarray | None
             ) -> np.ndarray:
        """
        Return `predicted` for effects that differ a little from those of a solution.

        Weights that are zero stay so, and so does the feedback.

        Parameters
        ----------
        solution : Solution
        effects : sequence of Effect
            The same effects with other values.
        train : ndarray of bool, shape (n,), or None
            The rows that the solution was fitted to.
        """
        columns = solution.weights.columns
        design = self.design(effects, solution.feedback, columns=columns)
        penalty = self._strength * part_of(design.smoothness, columns)
        penalty.flat[::len(columns) + 1] += self._further(design, train) * np.diag(penalty)
        z = solution.weights.moved(*self._rows(design, train), penalty)
        return design.shares @ z + design.known

    def free_rows(self, solution: Solution, effects: Sequence[Effect]
                  ) -> tuple[np.ndarray, np.ndarray]:
        """
        Return design (n, P) and penalty (P, P) of the weights that are free in a solution.

        Parameters
        ----------
        solution : Solution
        effects : sequence of Effect
            Those that it was found with.
        """
        columns = solution.weights.columns
        design = self.design(effects, solution.feedback, columns=columns)
        return design.shares, self._strength * part_of(design.smoothness, columns)

    def inputs(self, effects: Sequence[Effect], levels: int) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the nodes of a grid of H2, shape (levels + 1,), and its input in judged rows (n,).

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model; those that depend on the martensite share are left aside.
        levels : int
        """
        known = [effect for effect in effects if not effect.needs_phase]
        excitation = self._courses.of(known, None).excitation
        return excitation.nodes(levels), excitation.inputs[excitation.wanted]

    def design(self, effects: Sequence[Effect], feedback: Feedback | None,
               levels: int | None = None, columns: np.ndarray | None = None) -> Design:
        """
        Return the least squares problem of the weights.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        feedback : Feedback or None
            Of the weights, see `feedback`.
        levels : int, optional
            Of another grid of H2.
        columns : ndarray of int, shape (C,), optional
            Of some weights only, and of the bias.
        """
        levels = levels or self.levels
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

    def feedback(self, effects: Sequence[Effect], train: np.ndarray | None, levels: int
                 ) -> Feedback | None:
        """
        Return what the best weights do that they depend on; None where it is nothing.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        train : ndarray of bool, shape (n,), or None
            Rows to fit; all by default.
        levels : int
            Of the grid of H2.
        """
        phases = self._phases(effects, train) if needs_phase(effects) else None
        if Chain(effects, self._surroundings).kinetics > 0.0:
            return Feedback(phases, self._kinetics(effects, train, phases, levels))
        return None if phases is None else Feedback(phases, None)

    def feedback_of(self, effects: Sequence[Effect], design: Design, z: np.ndarray,
                    feedback: Feedback) -> Feedback:
        """
        Return the feedback of other weights.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        design : Design
        z : ndarray, shape (K + 1,)
            Weights times the sizes of their cells, and the bias.
        feedback : Feedback
            That the design was made with, and of the kinds that are asked for.
        """
        phases = feedback.phases
        if phases is not None:
            phases = self._phases_with(effects, _operator(design, z), feedback)
        if feedback.kinetics is None:
            return Feedback(phases, None)
        course = self._courses.of(effects, Feedback(phases, None))
        kinetic = self._added_by_kinetics(effects, course, design.nodes)
        return Feedback(phases, kinetic.tangent(z))

    def _kinetics(self, effects: Sequence[Effect], train: np.ndarray | None,
                  phases: list[np.ndarray] | None, levels: int) -> Tangent:
        """Return what kinetics of all of the wire add to H2 near its best weights."""
        plain = Feedback(phases, None)
        design = self.design(effects, plain, levels)
        course = self._courses.of(effects, plain)
        kinetic = self._added_by_kinetics(effects, course, design.nodes)
        part = course.kinetics * self._courses.judged(course)[0]
        rows = slice(None) if train is None else train

        def residual(z: np.ndarray) -> np.ndarray:
            predicted = design.shares @ z + design.known + part * kinetic.added(z)
            return (self.emphasis * (self._measured - predicted))[rows]

        def solved(tangent: Tangent) -> tuple[np.ndarray, sparse.csr_matrix]:
            near = self.design(effects, Feedback(phases, tangent), levels)
            return self._projected(near, train).z, self._penalty(near, train)

        # Neighbouring parameters, and neighbouring rows, have neighbouring weights.
        if self._kinetic_z is None or len(self._kinetic_z) != design.shares.shape[1]:
            self._kinetic_z = self._projected(design, train).z
        self._kinetic_z = kinetic.fitted(
            self._kinetic_z, residual, solved, SETTLED * float(np.std(self._measured)))
        return kinetic.tangent(self._kinetic_z)

    def _added_by_kinetics(self, effects: Sequence[Effect], course: Course, nodes: np.ndarray
                           ) -> KineticWeights:
        """Return what kinetics of all of the wire add to H2 on a grid."""
        top = cold_input(self._model, Chain(effects, self._surroundings), float(nodes[0]),
                         float(nodes[-1]))
        return course.excitation.kinetic(len(nodes) - 1, top, course.oriented)

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
            feedback = self.feedback(effects, train, self.levels)
            design = self.design(effects, feedback)
            stage = _operator(design, self._projected(design, train).z)
            self._known_phases = self._phases_with(effects, stage, feedback)
            self._phases_of = key
        return self._known_phases

    def _phases_with(self, effects: Sequence[Effect], stage: Preisach, feedback: Feedback | None
                     ) -> list[np.ndarray]:
        """Return the martensite share that an H2 shows in every row of each trial."""
        model = dataclasses.replace(self._model, length_stage=stage)
        whole = with_kinetics(self._model, Chain(effects, self._surroundings), stage)
        course = self._courses.of(effects, feedback)
        return [model.martensite(output) for output in self._courses.outputs(course, whole)]

    def _projected(self, design: Design, train: np.ndarray | None) -> ProjectedWeights:
        # Neighbouring parameters have neighbouring weights, on the same grid.
        key = len(design.nodes), None if train is None else train.tobytes()
        start = self._passive.get(key, self._passive.get(None))
        if start is not None and len(start) != design.shares.shape[1]:
            start = None
        found = ProjectedWeights(*self._rows(design, train), self._penalty(design, train), start)
        self._passive[key] = found.passive
        return found

    def _rows(self, design: Design, train: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Return design and target of the training rows."""
        rows, target = self.emphasis[:, None] * design.shares, self.emphasis * (
            self._measured - design.known)
        return (rows, target) if train is None else (rows[train], target[train])

    def _penalty(self, design: Design, train: np.ndarray | None) -> sparse.csr_matrix:
        penalty = self._strength * design.smoothness
        if train is not None:
            penalty += sparse.diags(
                self._further(design, train) * penalty.diagonal(), format='csr')
        return penalty

    def _further(self, design: Design, train: np.ndarray | None) -> np.ndarray:
        """
        Return by what share more each weight of a design is penalised; see `extrapolated`.

        A transformation ends; a muscle that does not transform goes on as it did.
        """
        shares = design.shares
        if train is None or self._surroundings.drive == 'pressure':
            return np.zeros(shares.shape[1])
        return extrapolated(shares, train)


def _operator(design: Design, z: np.ndarray) -> Preisach:
    """Return H2 with weights (K + 1,) times the sizes of their cells, its bias aside."""
    return operator_with(design.nodes, z[:-1] / weight_sizes(design.nodes), 0.0)
