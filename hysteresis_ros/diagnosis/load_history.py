# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a load that moves while the muscle transforms does, and a bench of constant loads cannot tell.

Models that agree on every table with constant loads differ on an arm: the load acts inside the
operator and leaves its mark in the memory, which is the model here; or the muscle is at each moment
as if its present load had acted all along.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import Effect, Statics
from hysteresis_ros.kernels.load_play import follow
from hysteresis_ros.model.chain import Chain

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.operators import HysteresisOperator

# Constant loads between which the response is interpolated, and angles of the balance.
LOADS, ANGLES = 12, 400


@dataclasses.dataclass(frozen=True)
class LoadHistory:
    """
    What the load does along an arm's way.

    Attributes
    ----------
    load : ndarray, shape (n,)
        Tension of each muscle at rest [N].
    martensite : ndarray, shape (n,)
        Share of martensite, 0 to 1.
    path : ndarray, shape (n,)
        What the angle would differ if the present load had acted all along [rad].
    """

    load: np.ndarray
    martensite: np.ndarray
    path: np.ndarray


def load_history(problem: ArmProblem, effects: Sequence[Effect]) -> LoadHistory:
    """
    Return what the load does on an arm's way, and would make of it if it left no mark.

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        Effects of the model, which say where the arm goes.

    Returns
    -------
    LoadHistory

    Raises
    ------
    ParameterError
        If the model has no geometry.
    """
    # What the sensor adds is no way of the arm; what depends on the phase would need it, and
    # changes little of what the load does.
    effects = [effect for effect in effects
               if effect.stage != 'sensor' and not effect.needs_phase]
    return LoadHistory(*map(np.concatenate, zip(*_ways(problem, effects))))


def _ways(problem: ArmProblem, effects: Sequence[Effect]
          ) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Give load, martensite and difference in the rows that are judged, trial by trial."""
    model = problem.model
    chain = Chain(effects, model.surroundings)
    first, stage = model.first_stage(chain), model.require_length_stage(chain)
    arm, span = _Statics(model, chain), max(float(np.ptp(stage.output_range)), 1e-12)
    for simulator, rows in zip(problem.simulators, problem.chosen):
        angle = simulator.run(effects)
        loads = arm.loads_between(np.min(angle), np.max(angle))
        for trial in simulator.trials:
            judged = rows[(rows >= trial.rows.start) & (rows < trial.rows.stop)] - trial.rows.start
            drive_squared = simulator.drive_squared(chain, trial, simulator.past(effects))
            first.reset()
            cold = chain.to_drive_squared(model.cold_drive)
            x = first.simulate(np.concatenate(([cold], drive_squared)))
            tension, felt, width = (
                _from_cold(np.interp(angle[trial.rows], arm.theta, values))
                for values in (arm.tension, arm.load, arm.width))
            if not first.loaded:
                felt, width = 0.0 * felt, 0.0 * width
            moving = _held(stage, model.sign * (x - felt), width)[1:]
            path = np.zeros(len(judged))
            if first.loaded:
                still = np.stack([
                    _held(stage, model.sign * (x - load), np.full(len(x), arm.width_at(load)))
                    for load in loads])[:, 1:]
                # What has lengthened the muscle besides, or holds the arm, does so either way.
                besides = (arm.demand_at(angle[trial.rows])
                           - arm.demand_at(arm.angle(loads, moving)))
                path = (arm.angle(loads, (still + besides)[:, judged])
                        - arm.angle(loads, (moving + besides)[judged]))
            yield tension[1:][judged], moving[judged] / span, path


class _Statics:
    """The arm at rest, angle by angle."""

    def __init__(self, model: MuscleModel, chain: Chain) -> None:
        geometry = model.require_geometry()
        self.theta = np.linspace(*geometry.angle_range, ANGLES)
        statics = Statics.of(geometry, self.theta)
        for effect in chain.mechanism:
            statics = effect.forward(statics, geometry)
        self.tension = force = np.maximum(statics.moment, 0.0) / (
            geometry.muscle_count * np.maximum(statics.moment_arm, 1e-6))
        # What H2 feels, and by how much its loop is wider.
        self.load, self.width = chain.load_inside(force), chain.loop_width(force)
        base = model.require_length_stage().output_range[0]
        self._demand = np.maximum.accumulate(
            (statics.length - base - chain.stretch(force)) / chain.scale(force))
        self._by_load = np.argsort(self.load, kind='stable')

    def loads_between(self, low: float, high: float) -> np.ndarray:
        """Return loads, shape (LOADS,), over a range of angles [rad]."""
        ends = np.interp([low, high], self.theta, self.load)
        return np.linspace(np.min(ends), np.max(ends) + 1e-9 * (1.0 + np.ptp(self.load)), LOADS)

    def width_at(self, load: float) -> float:
        """Return by how much the loop is wider under a load."""
        return float(np.interp(load, self.load[self._by_load], self.width[self._by_load]))

    def demand_at(self, angle: np.ndarray) -> np.ndarray:
        """Return H2's output above its least that angles (rows,) [rad] demand."""
        return np.interp(angle, self.theta, self._demand)

    def angle(self, loads: np.ndarray, outputs: np.ndarray) -> np.ndarray:
        """
        Return the angle [rad] at which outputs give what the arm demands.

        Parameters
        ----------
        loads : ndarray, shape (LOADS,)
        outputs : ndarray, shape (rows,) or (LOADS, rows)
            Of H2, above its least, whatever the load, or under each of the loads.

        Returns
        -------
        ndarray, shape (rows,)
        """
        if outputs.ndim > 1:
            place = np.clip((self.load - loads[0]) / (loads[1] - loads[0]), 0.0, len(loads) - 1.001)
            below = place.astype(int)
            part = (place - below)[:, None]
            outputs = (1.0 - part) * outputs[below] + part * outputs[below + 1]
        theta, lacking = self.theta, np.atleast_2d(outputs) - self._demand[:, None]
        # Beyond the last angle nothing is lacking anywhere.
        short = lacking < 0.0
        first = np.where(np.any(short, axis=0), np.argmax(short, axis=0), len(theta) - 1)
        above = np.clip(first, 1, len(theta) - 1)
        column = np.arange(lacking.shape[1])
        before, after = lacking[above - 1, column], lacking[above, column]
        share = np.clip(before / np.where(before == after, 1.0, before - after), 0.0, 1.0)
        return theta[above - 1] + share * (theta[above] - theta[above - 1])


def _from_cold(values: np.ndarray) -> np.ndarray:
    """Return values of rows (rows,) with the cold state before them, which has the first's."""
    return np.concatenate((values[:1], values))


def _held(stage: HysteresisOperator, inputs: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Return H2's output above its least for its inputs and what its loop is wider by (rows,)."""
    if np.any(widths > 0.0):
        inputs = follow(inputs, widths, np.array([len(inputs)]))
    stage.reset()
    return stage.simulate(inputs) - stage.output_range[0]
