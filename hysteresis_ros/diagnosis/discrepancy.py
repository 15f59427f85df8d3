# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Discrepancy of the base model: how wrong it is by itself, as a covariance of an arm's angles.

Two parts are known before the arm moves. The bench says how large the error of the length is, on
trials or loads that were held out; on the arm it shows as an error of the angle that is alike at
neighbouring drives and responses and differs between the directions of the drive. And the bench
holds the load still, while an arm's load moves with the wire: what a load does in the middle of a
transformation the bench cannot tell. Two models that agree on every bench table bound it: the load
acts inside the operator and leaves its mark in the memory, or the muscle is at each moment as if
its present load had acted all along. Their difference is the second part (`path_difference`).
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import (
    Effect, Inputs, MaterialEffect, Parameter, Statics, Surroundings)
from hysteresis_ros.model.chain import Chain

if TYPE_CHECKING:
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.operators import HysteresisOperator

# The error that differs between the directions of the drive, against the common one.
DIRECTIONAL = 0.5
# Constant loads between which the response is interpolated, and angles of the balance.
LOADS, ANGLES = 12, 400


@dataclasses.dataclass
class Discrepancy:
    """
    The base model's own error, as the parts of its covariance.

    Errors of one part are correlated between rows as these are near each other, by

        1 / sqrt(1 + d^2),

    the rational quadratic kernel with alpha = 1/2: a mixture of errors of every length from that of
    the bench's grid on (Rasmussen and Williams, Gaussian Processes for Machine Learning, eq. 4.19).

    Attributes
    ----------
    parts : ndarray, shape (n, p)
        Standard deviations of independent errors in each row, in the unit of the response.
    places : ndarray, shape (n, m)
        Where each row lies, in units of the length over which errors change.
    """

    parts: np.ndarray
    places: np.ndarray

    @property
    def size(self) -> float:
        """Root mean square, in the unit of the response."""
        return float(np.sqrt(np.mean(np.sum(self.parts ** 2, axis=1))))

    def matrix(self) -> np.ndarray:
        """Return the covariance, shape (n, n)."""
        squares = np.sum(self.places ** 2, axis=1)
        gaps = squares[:, None] + squares[None, :] - 2.0 * self.places @ self.places.T
        return (self.parts @ self.parts.T) / np.sqrt(1.0 + np.maximum(gaps, 0.0))


class Offset(MaterialEffect):
    """A constant added to the elongation, to see what an error of the length does to the angle."""

    id = 'offset'
    parameters = (Parameter('size', 'm', 'what is added', 0.0, 1.0, 0.0, ()),)

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the offset."""
        return np.full(len(drive), self.size), np.ones(len(drive))


def length_error(model: MuscleModel) -> float:
    """
    Return the root mean square error of the length [m] that the bench has shown.

    The largest of that on trials that were not fitted, that on loads left out of the fit, and,
    where neither is known, that on the trials fitted.
    """
    metrics = model.metrics.get('length', {})
    errors = [metrics.get(part, {}).get('rmse') for part in ('verification', 'left_out')]
    known = [float(error) for error in errors if error is not None and np.isfinite(error)]
    if known:
        return max(known)
    error = metrics.get('identification', {}).get('rmse')
    return float(error) if error is not None and np.isfinite(error) else 0.0


def sensitivity(problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """Return how the angle follows an error of the length [rad/m], shape (n,)."""
    step = 0.01 * problem.model.surroundings.span
    up, down = problem.simulate_many(
        [[*effects, Offset(size=step)], [*effects, Offset(size=-step)]])
    return (up - down) / (2.0 * step)


def discrepancy_along(problem: ArmProblem, effects: Sequence[Effect], predicted: np.ndarray,
                      settings: Settings) -> Discrepancy:
    """
    Return the base model's own error of the angle, along the way that the arm takes.

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        All effects of the model, which say where the arm goes.
    predicted : ndarray, shape (n,)
        Response with them.
    settings : Settings

    Returns
    -------
    Discrepancy
    """
    gain, path = sensitivity(problem, effects), path_difference(problem, effects)
    direction = np.ones(len(predicted))
    if 'direction' in problem.signals:
        direction = np.where(problem.signals['direction'] > 0.0, 1.0, -1.0)
    bench = gain * (length_error(problem.model) / math.sqrt(1.0 + DIRECTIONAL ** 2))
    drive = problem.signals.get('drive', np.zeros(len(predicted)))
    return Discrepancy(np.column_stack([bench, DIRECTIONAL * direction * bench, path]),
                       np.column_stack([_unit(drive), _unit(predicted)]) / settings.correlation)


def path_difference(problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """
    Return what the angle would differ if the present load had acted all along, shape (n,).

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        Effects of the model.

    Returns
    -------
    ndarray, shape (n,)
        Angles [rad].

    Raises
    ------
    ParameterError
        If the model has no geometry.
    """
    model = problem.model
    # What the sensor adds is no way of the arm; what depends on the phase would need it, and
    # changes little of what the load does.
    effects = [effect for effect in effects
               if effect.stage != 'sensor' and not effect.needs_phase]
    chain = Chain(effects, model.surroundings)
    first, stage = model.first_stage(chain), model.require_length_stage()
    if not first.loaded:
        return np.zeros(len(problem.measured))
    theta = np.linspace(*model.require_geometry().angle_range, ANGLES)
    load, demand = _statics(chain, model.require_geometry(), theta, stage.output_range[0])
    columns = []
    for simulator, rows in zip(problem.simulators, problem.chosen):
        angle = simulator.run(effects)
        ends = np.interp([np.min(angle), np.max(angle)], theta, load)
        loads = np.linspace(np.min(ends), np.max(ends) + 1e-9 * (1.0 + np.ptp(load)), LOADS)
        for trial in simulator.trials:
            judged = rows[(rows >= trial.rows.start) & (rows < trial.rows.stop)] - trial.rows.start
            drive_squared = chain.drive_squared(trial.drive, trial.inputs)
            first.reset()
            cold = chain.to_drive_squared(model.cold_drive)
            x = first.simulate(np.concatenate(([cold], drive_squared)))
            outputs = np.stack([_held(stage, model.sign * (x - one)) for one in loads])
            moving, still = (_balance(theta, load, demand, loads, given[:, judged]) for given in (
                _along(stage, model.sign, x, angle[trial.rows], theta, load), outputs))
            columns.append(still - moving)
    return np.concatenate(columns)


def _statics(chain: Chain, geometry: BicepGeometry, theta: np.ndarray, base: float
             ) -> tuple[np.ndarray, np.ndarray]:
    """Return the load that H2 feels, and what it has to give above `base`, at each angle."""
    statics = Statics.of(geometry, theta)
    for effect in chain.mechanism:
        statics = effect.forward(statics, geometry)
    force = np.maximum(statics.moment, 0.0) / (
        geometry.muscle_count * np.maximum(statics.moment_arm, 1e-6))
    demand = (statics.length - base - chain.stretch(force)) / (chain.scale(force) + 0.0 * force)
    return chain.load_inside(force) + 0.0 * force, np.maximum.accumulate(demand)


def _held(stage: HysteresisOperator, inputs: np.ndarray) -> np.ndarray:
    """Return H2's output above its least (rows,) for inputs (rows + 1,), the cold one first."""
    stage.reset()
    stage.step(float(inputs[0]))
    return stage.simulate(inputs[1:]) - stage.output_range[0]


def _along(stage: HysteresisOperator, sign: int, x: np.ndarray, angle: np.ndarray,
           theta: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return the same with the load of the arm's angle in each row, shape (1, rows)."""
    felt = np.interp(angle, theta, load)
    return _held(stage, sign * (x - np.concatenate((felt[:1], felt))))[None, :]


def _balance(theta: np.ndarray, load: np.ndarray, demand: np.ndarray, loads: np.ndarray,
             outputs: np.ndarray) -> np.ndarray:
    """Return the angle (rows,) at which outputs (loads, rows) give what the arm demands."""
    if len(outputs) > 1:
        place = np.clip((load - loads[0]) / (loads[1] - loads[0]), 0.0, len(loads) - 1.001)
        below = place.astype(int)
        part = (place - below)[:, None]
        outputs = (1.0 - part) * outputs[below] + part * outputs[below + 1]
    lacking = outputs - demand[:, None]
    above = np.clip(np.argmax(lacking < 0.0, axis=0), 1, len(theta) - 1)
    column = np.arange(lacking.shape[1])
    before, after = lacking[above - 1, column], lacking[above, column]
    share = np.clip(before / np.where(before == after, 1.0, before - after), 0.0, 1.0)
    return theta[above - 1] + share * (theta[above] - theta[above - 1])


def _unit(values: np.ndarray) -> np.ndarray:
    return (values - values.min()) / max(np.ptp(values), 1e-12)
