# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects judged on runs of an arm, with the weights that the bench gave, frozen.

Refitted weights would absorb most of what an effect does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import contextlib
import dataclasses
import itertools
from typing import Literal, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.problem import Problem
from hysteresis_ros.diagnosis.discrepancy import Offset
from hysteresis_ros.effects import Effect, needs_phase
from hysteresis_ros.identification.operators import preisach_rows
from hysteresis_ros.model.simulation import Simulator, WORTH_THREADS
from hysteresis_ros.operators import Preisach
from hysteresis_ros.workers import forks, map_in_forks, threads

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

# Rows that are simulated, and as many more for each simulation as it takes besides, from which on
# forks pay: it takes ten ms to make and end one.
WORTH_FORKS = 50_000
# Responses that are kept: a fit often begins where another one was.
MOST_KEPT = 4000


class ArmProblem(Problem):
    """Arm runs, simulated with the frozen weights of the bench."""

    refits: Literal[False] = False

    def __init__(self, model: MuscleModel, measurements: Sequence[Measurement]) -> None:
        super().__init__(model, measurements)
        self._known: dict[tuple, np.ndarray] = {}
        self._replicated = [
            [Simulator(dataclasses.replace(model, length_stage=one.length_stage), *pair,
                       model.effects) for pair in zip(measurements, self.chosen)]
            for one in model.replicates]

    def simulate(self, effects: Sequence[Effect], train: np.ndarray | None = None) -> np.ndarray:
        """
        Return the simulated response of the judged rows, shape (n,).

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        train : ndarray of bool, shape (n,), optional
            Not used: nothing but the effects' own parameters is fitted here.
        """
        return self.pick([simulator.run(effects) for simulator in self.simulators])

    def simulate_many(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        """
        Return the simulated response of the judged rows for sets of effects.

        Parameters
        ----------
        sets : sequence of list of Effect
            All effects of the model, for each simulation.

        Returns
        -------
        ndarray, shape (len(sets), n)
        """
        keys = [tuple((effect.id, *effect.values.values()) for effect in effects)
                for effects in sets]
        # Another thread may empty what is known meanwhile.
        responses = [self._known.get(key) for key in keys]
        new = [index for index, response in enumerate(responses) if response is None]
        found = self._simulate_new([sets[index] for index in new])
        for index, response in zip(new, found):
            responses[index] = response
        if len(self._known) > MOST_KEPT:
            self._known.clear()
        for index, response in zip(new, found):
            # A phase is sought from that of the run before, so that these differ a little.
            if not needs_phase(sets[index]):
                self._known[keys[index]] = response
        return np.array(responses).reshape(len(sets), len(self.measured))

    def _simulate_new(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        """Return the response (len(sets), n) of the judged rows for sets that are not known."""
        if forks(self.jobs) < 2 or len(sets) * (self.rows + WORTH_THREADS) < WORTH_FORKS:
            return self._run_many(sets)
        found = map_in_forks(self._apart, sets, self.jobs)
        for effects, (_, phases) in zip(sets, found):
            self.keep_phases(effects, phases)
        return np.array([response for response, _ in found])

    def _run_many(self, sets: Sequence[Sequence[Effect]]) -> np.ndarray:
        runs = [simulator.run_many(sets, threads(self.jobs))[:, rows]
                for simulator, rows in zip(self.simulators, self.chosen)]
        return np.concatenate(runs, axis=1)

    def _apart(self, effects: Sequence[Effect]) -> tuple[np.ndarray, list[np.ndarray | None]]:
        """Return the response of the judged rows, and the phases for `keep_phases`."""
        runs = [simulator.run_apart(effects) for simulator in self.simulators]
        return self.pick([response for response, _ in runs]), [phase for _, phase in runs]

    def phases(self, effects: Sequence[Effect]) -> list[np.ndarray | None]:
        """Return the phases of each recording (rows,) that a run with these effects begins with."""
        if not needs_phase(effects):
            return [None] * len(self.simulators)
        return [simulator.known_phases.nearest(effects) for simulator in self.simulators]

    def keep_phases(self, effects: Sequence[Effect], phases: Sequence[np.ndarray | None]) -> None:
        """Keep phases of each recording (rows,) for runs with similar effects to begin with."""
        for simulator, phase in zip(self.simulators, phases):
            simulator.known_phases.keep(effects, phase)

    @contextlib.contextmanager
    def no_phases_kept(self) -> Iterator[None]:
        """
        Forget in the end the phases that runs have kept in the meantime.

        Those of replicates as well, which `keep_phases` does not know: they are few.
        """
        simulators = [*self.simulators, *itertools.chain(*self._replicated)]
        known = [simulator.known_phases.copy() for simulator in simulators]
        try:
            yield
        finally:
            for simulator, one in zip(simulators, known):
                simulator.known_phases = one

    def simulate_replicates(self, effects: Sequence[Effect]) -> np.ndarray:
        """
        Return the response of the judged rows as the model's replicates simulate it.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.

        Returns
        -------
        ndarray, shape (R, n)
        """
        responses = [self.pick([simulator.run(replicate.instead_of(self.model.effects, effects))
                                for simulator in simulators])
                     for replicate, simulators in zip(self.model.replicates, self._replicated)]
        return np.array(responses).reshape(len(responses), len(self.measured))

    def completed(self, effects: Sequence[Effect]) -> MuscleModel:
        """Return the model and its replicates with these effects."""
        model = self.model.with_effects(effects)
        model.replicates = [
            dataclasses.replace(one, effects=one.instead_of(self.model.effects, effects))
            for one in model.replicates]
        return model

    def weight_columns(self, effects: Sequence[Effect]) -> np.ndarray:
        """Return how each weight of H2 moves the response of the judged rows, shape (n, K)."""
        stage = self.model.length_stage
        if not isinstance(stage, Preisach):
            return np.zeros((len(self.measured), 0))
        step = 0.01 * self.model.surroundings.span
        columns = []
        for simulator, rows in zip(self.simulators, self.chosen):
            inputs: list[np.ndarray] = []
            base = simulator.run(effects, inputs)
            moved = simulator.run([*effects, Offset(size=step)])
            areas, first = [], 0
            for u in inputs:
                own = rows[(rows >= first) & (rows < first + len(u))] - first
                areas.append(preisach_rows(stage.nodes, u, True)[own])
                first += len(u)
            columns.append(((moved - base) / step)[rows, None] * np.concatenate(areas))
        return np.concatenate(columns)
