# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What effects make of drive and load of bench tables, before any weight of H2 is fitted."""

from __future__ import annotations

from collections.abc import Sequence
import copy
from typing import Any, TYPE_CHECKING, TypeVar

import numpy as np

from hysteresis_ros.diagnosis.bench_design import Course, Excitation, Feedback
from hysteresis_ros.effects import Effect
from hysteresis_ros.kernels.load_play import follow
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.kinetic_stage import output_along

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.model.first_stage import FirstStage
    from hysteresis_ros.model.trials import Trial
    from hysteresis_ros.operators import HysteresisOperator

Entry = TypeVar('Entry')

# Courses that are remembered, those of the latest effects.
MOST_COURSES = 20


class BenchCourses:
    """
    Courses of the input of H2 for effects, of which the latest are remembered.

    Parameters
    ----------
    model : MuscleModel
        Without the effects.
    trials : sequence of Trial
        Of all tables, one after the other.
    judged : ndarray of int, shape (n,)
        Rows, counted over all trials, that are judged.
    measured : ndarray, shape (n,)
        Their response.
    trial : ndarray of int, shape (n,)
        Trial of each of them.
    following : float
        Share of the nodes of H2's grid that follow the response; see `nodes_along`.

    Attributes
    ----------
    load : ndarray, shape (rows,)
        Of all rows of all trials.
    """

    def __init__(self, model: MuscleModel, trials: Sequence[Trial], judged: np.ndarray,
                 measured: np.ndarray, trial: np.ndarray, following: float) -> None:
        self._model, self._trials, self._following = model, trials, following
        self._surroundings = model.surroundings
        self._judged, self._measured, self._trial = judged, measured, trial
        counts = np.array([len(one.drive) for one in trials])
        # Before its first row each trial has the cold one, with that row's load.
        self._ends = np.cumsum(counts + 1)
        rows = np.arange(counts.sum())
        self._felt = np.insert(rows, np.cumsum(counts) - counts, np.cumsum(counts) - counts)
        self.load = np.concatenate([one.load for one in trials])
        self._wanted = np.zeros(self._ends[-1], dtype=bool)
        self._wanted[judged + np.repeat(np.arange(1, len(counts) + 1), counts)[judged]] = True
        self._courses: dict[tuple, Course] = {}
        self._excitations: dict[tuple, Excitation] = {}

    def apart(self) -> BenchCourses:
        """Return the same; what each comes to know from now on, the other does not."""
        other = copy.copy(self)
        other._courses, other._excitations = dict(self._courses), dict(self._excitations)
        return other

    def of(self, effects: Sequence[Effect], feedback: Feedback | None) -> Course:
        """
        Return the course for effects.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        feedback : Feedback or None
            What H2 does that it depends on, if it does.
        """
        key = tuple((effect.id, *effect.values.values()) for effect in effects)
        if feedback is not None or key not in self._courses:
            course = self._new(Chain(effects, self._surroundings), feedback)
            if feedback is not None:
                return course
            # Folds that are held out in turn begin at the same effects.
            _remember(self._courses, key, course)
        return self._courses[key]

    def outputs(self, course: Course, stage: HysteresisOperator) -> list[np.ndarray]:
        """Return what an H2 gives in every row of each trial."""
        return [output_along(stage, part, oriented)[1:] for part, oriented in zip(
            *(np.split(column, self._ends[:-1]) for column in (
                course.excitation.inputs, course.oriented)))]

    def judged(self, course: Course) -> tuple[np.ndarray, np.ndarray]:
        """Return the factor on the output of H2 and what is added in judged rows, each (n,)."""
        return course.scales[self._judged], course.known[self._judged]

    def _new(self, chain: Chain, feedback: Feedback | None) -> Course:
        load, cold = self.load, chain.to_drive_squared(self._model.cold_drive)
        driven: list[Any] = []
        drifts: list[tuple[np.ndarray, np.ndarray]] = []
        for number, trial in enumerate(self._trials):
            inputs = trial.inputs
            if feedback is not None and feedback.phases is not None:
                inputs = inputs._replace(phase=feedback.phases[number])
            squared = chain.drive_squared(trial.drive, inputs)
            driven += [[cold], squared]
            if chain.drifts:
                drifts.append(chain.drift(trial.drive, squared, inputs))
        offset, factor = np.concatenate(drifts, axis=1) if drifts else (0.0, 1.0)
        scales, known = chain.scale(load) * factor + 0.0 * load, chain.stretch(load) + offset
        return Course(self._excitation(chain, np.concatenate(driven)), scales, known,
                      chain.kinetics, chain.oriented(load)[self._felt])

    def _excitation(self, chain: Chain, squared: np.ndarray) -> Excitation:
        """Return what H2 is given for the drive squared of all trials, shape (rows + trials,)."""
        inside = chain.load_inside(self.load)
        width = chain.loop_width(self.load)
        key = (squared.tobytes(), inside.tobytes(), width.tobytes(),
               chain.load_per_drive_squared())
        if key not in self._excitations:
            first = self._model.first_stage(chain)
            x = self._first(first, squared)
            if first.loaded:
                x -= inside[self._felt]
            given = self._model.sign * x
            if first.loaded and chain.plays:
                given = follow(given, width[self._felt], self._ends)
            _remember(self._excitations, key, Excitation(
                given, self._ends, self._wanted, self._measured, self._trial,
                self._following))
        return self._excitations[key]

    def _first(self, first: FirstStage, squared: np.ndarray) -> np.ndarray:
        """Return x for the drive squared of all trials, each from the cold state."""
        x, begin = np.empty(len(squared)), 0
        for end in self._ends:
            first.reset()
            x[begin:end] = first.simulate(squared[begin:end])
            begin = end
        return x


def _remember(found: dict[tuple, Entry], key: tuple, value: Entry) -> None:
    """Add an entry to a dict of the latest ones."""
    found[key] = value
    if len(found) > MOST_COURSES:
        del found[next(iter(found))]
