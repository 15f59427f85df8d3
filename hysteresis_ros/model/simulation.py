# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulation of a whole measurement from its inputs alone, trial by trial."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
import copy
import dataclasses
from typing import NamedTuple

import numpy as np

from hysteresis_ros.bicep.balance import statics_of
from hysteresis_ros.effects import Effect, Inputs
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.model.chain import Chain

# Rows of a settled table without times are this far apart [s] (Sec. III-A).
HOLD = 30.0
# Passes at most that bring an effect that depends on the phase into agreement with the phase it
# causes, to this share of martensite, with steps of at least this part of the difference.
PHASE_PASSES, AGREEMENT, SHORTEST = 10, 2e-3, 0.2
# The same for an arm in motion, which takes many more steps.
MOVING_PASSES = 4


@dataclasses.dataclass
class Trial:
    """One trial's inputs: rows of the table, drive and load of shape (rows,), and the rest."""

    rows: slice
    drive: np.ndarray
    load: np.ndarray
    inputs: Inputs


class Response(NamedTuple):
    """
    What the muscle of a trial does, before the sensor.

    `values` (rows,) is the response, `output` (rows,) that of the operator that transforms; on an
    arm `inputs` (rows,) are those of H2, and `rest` [rad] is the angle before the trial.
    """

    values: np.ndarray
    output: np.ndarray
    inputs: np.ndarray | None = None
    rest: float | None = None


def trials_of(model, measurement) -> list[Trial]:
    """
    Split a measurement into trials with the inputs that effects may look at.

    Parameters
    ----------
    model : MuscleModel
        For the scale on which cycles are counted.
    measurement : Measurement
        Bench table or arm run.

    Returns
    -------
    list of Trial
        In the order of the table; `Inputs.clock` and `Inputs.cycles` run on from one to the next.

    Raises
    ------
    MeasurementError
        If the table lacks the model's drive.
    """
    drive = measurement.column(model.drive)
    load = (measurement.columns.get(model.load_name) if model.load_name else None)
    if load is None:
        load = np.zeros(measurement.rows)
    ambient = measurement.columns.get('ambient_temperature')
    low, high = model.ranges.get(model.drive, (0.0, 1.0))
    trials, clock, travel = [], 0.0, 0.0
    for _, rows in measurement.split():
        values = drive[rows]
        count = len(values)
        if measurement.time is None:
            time = HOLD * np.arange(1, count + 1)
        else:
            time = measurement.time[rows]
        step = np.diff(time, prepend=0.0)
        if measurement.settled:
            # The first row is a settled state, too, even where its time is 0.
            step[0] = max(step[0], HOLD)
        travelled = travel + np.cumsum(np.abs(np.diff(values, prepend=model.cold_drive)))
        inputs = Inputs(
            time=time, clock=clock + time, step=step,
            ambient=ambient[rows] if ambient is not None else np.full(count, np.nan),
            phase=np.full(count, np.nan), cycles=travelled / (2.0 * max(high - low, 1e-12)))
        trials.append(Trial(rows, values, load[rows], inputs))
        clock += float(time[-1])
        travel = float(travelled[-1])
    return trials


class Simulator:
    """
    The model run over one measurement, for many sets of effects.

    Parameters
    ----------
    model : MuscleModel
        Operators, geometry and scales; its effects are not looked at.
    measurement : Measurement
        Whose inputs are simulated.
    """

    def __init__(self, model, measurement):
        self.model = model
        self.measurement = measurement
        self.trials = trials_of(model, measurement)
        self._surroundings = model.surroundings
        self._statics = None
        if measurement.response == 'angle' and model.geometry is not None:
            self._statics = statics_of(model.geometry)

    def run(self, effects: Sequence[Effect], inputs_of_stage: list | None = None) -> np.ndarray:
        """
        Simulate with these effects.

        Parameters
        ----------
        effects : sequence of Effect
        inputs_of_stage : list, optional
            Takes H2's inputs (rows,) for each trial of an arm run.

        Returns
        -------
        ndarray, shape (rows,)
            The response as the sensor would give it: force [N], length [m], strain, angle [rad].

        Raises
        ------
        ParameterError, ModelFileError
            If the model lacks what this kind of measurement needs.
        """
        chain = Chain(effects, self._surroundings)
        respond = self._responder(chain)
        result = np.empty(self.measurement.rows)
        for trial in self.trials:
            if chain.needs_phase:
                response = self._agree(
                    respond, trial, MOVING_PASSES if chain.moves else PHASE_PASSES)
            else:
                response = respond(trial, trial.inputs)
            result[trial.rows] = chain.measured(response.values, trial.inputs, response.rest)
            if inputs_of_stage is not None and response.inputs is not None:
                inputs_of_stage.append(response.inputs)
        return result

    def run_many(self, sets: Sequence[Sequence[Effect]], jobs: int = 1) -> np.ndarray:
        """
        Simulate with many sets of effects.

        Parameters
        ----------
        sets : sequence of sequence of Effect
        jobs : int
            Number of threads. They run at the same time, because compiled trials do not hold the
            interpreter.

        Returns
        -------
        ndarray, shape (len(sets), rows)
            What `run` returns for each set.

        Raises
        ------
        ParameterError, ModelFileError
            As `run`.
        """
        if jobs > 1 and len(sets) > 1:
            with ThreadPoolExecutor(min(jobs, len(sets))) as pool:
                rows = list(pool.map(self.run, sets))
        else:
            rows = [self.run(effects) for effects in sets]
        return np.array(rows).reshape(len(sets), self.measurement.rows)

    def _agree(self, respond: Callable, trial: Trial, passes: int) -> Response:
        """Return the response with the phase that it has itself, by Aitken's relaxation."""
        phase, left, part = np.ones(len(trial.drive)), None, 1.0
        for _ in range(passes):
            response = respond(trial, trial.inputs._replace(phase=phase))
            before, left = left, self._phase(response.output) - phase
            if np.sqrt(np.mean(left ** 2)) < AGREEMENT:
                break
            if before is not None:
                change = left - before
                part *= -float(before @ change) / max(float(change @ change), 1e-300)
                part = min(max(part, SHORTEST), 1.0)
            phase = phase + part * left
        return response

    def _phase(self, given):
        """Martensite share as the operator's output shows it."""
        if self.measurement.response == 'force':
            low, high = self.model.force_stage.output_range
            return np.clip((high - given) / max(high - low, 1e-12), 0.0, 1.0)
        return self.model.martensite(given)

    def _responder(self, chain: Chain) -> Callable[[Trial, Inputs], Response]:
        """Return what gives the response of a trial."""
        response = self.measurement.response
        if response == 'force':
            if self.model.force_stage is None:
                raise ParameterError(
                    'the model has no force stage; identify it with --force F.csv')
            operator = copy.deepcopy(self.model.force_stage)
            return lambda trial, inputs: self._force(chain, operator, trial, inputs)
        first = self.model.first_stage(chain)
        if response == 'angle':
            balance = self.model.balance(chain, self._statics)
            return lambda trial, inputs: self._angle(chain, first, balance, trial, inputs)
        stage = self.model.require_length_stage()
        return lambda trial, inputs: self._length(chain, first, stage, trial, inputs)

    def _first(self, chain, first, trial, inputs):
        """Cold x, x of each row, and heat of each row."""
        heat = chain.heat(trial.drive, inputs)
        cold = chain.to_heat(self.model.cold_drive)
        first.reset()
        x = first.simulate(np.concatenate(([cold], heat)))
        return float(x[0]), x[1:], heat

    def _force(self, chain, operator, trial, inputs):
        drive = chain.to_drive(chain.heat(trial.drive, inputs))
        operator.reset()
        operator.step(self.model.cold_drive)
        force = operator.simulate(drive)
        return Response(force, force)

    def _length(self, chain, first, stage, trial, inputs):
        model = self.model
        cold, x, heat = self._first(chain, first, trial, inputs)
        load = chain.load_inside(trial.load) if first.loaded else 0.0 * trial.load
        stage.reset()
        stage.step(model.sign * (cold - load[0]))
        output = stage.simulate(model.sign * (x - load))
        base = stage.output_range[0]
        offset, factor = chain.drift(trial.drive, heat, inputs)
        return Response(base + chain.scale(trial.load) * factor * (output - base)
                        + chain.stretch(trial.load) + offset, output)

    def _angle(self, chain, first, balance, trial, inputs):
        cold, x, heat = self._first(chain, first, trial, inputs)
        offset, factor = chain.drift(trial.drive, heat, inputs)
        rest, angles, outputs, stage_inputs = balance.run(cold, x, inputs.step, offset, factor)
        return Response(angles, outputs, stage_inputs, rest)


def turning_rows(x: np.ndarray) -> np.ndarray:
    """
    Say which rows a rate-independent memory must see: the turns of x, its first and its last.

    Parameters
    ----------
    x : ndarray, shape (rows,)

    Returns
    -------
    ndarray of bool, shape (rows,)
    """
    keep = np.zeros(len(x), dtype=bool)
    keep[[0, -1]] = True
    change = np.sign(np.diff(x))
    # Over a rest the last direction counts.
    moving = np.flatnonzero(change)
    turns = moving[1:][change[moving[1:]] != change[moving[:-1]]]
    keep[turns] = True
    return keep


def predict(model, measurement) -> np.ndarray:
    """Simulate every row of a measurement with the model and its effects, shape (rows,)."""
    return Simulator(model, measurement).run(model.effects)


def predict_linear(model, measurement) -> np.ndarray:
    """
    Predict every row with the linear model (Eq. 11), shape (rows,).

    For an arm run the angle is that at which ``L(theta) = k2 (F(theta) - k1 V - F0)``.

    Raises
    ------
    ParameterError
        If the model has no linear model, or no geometry for an arm run.
    """
    if model.linear is None:
        raise ParameterError('the model has no linear model')
    drive = measurement.column(model.drive)
    if measurement.response == 'force':
        return model.linear.force(drive)
    if measurement.response != 'angle':
        load = measurement.columns.get(model.load_name) if model.load_name else None
        return model.linear.length(drive, np.zeros(len(drive)) if load is None else load)
    geometry = model.require_geometry()
    theta = np.linspace(*geometry.angle_range, 2000)
    needed = model.linear.drive_for_length(geometry.length(theta), geometry.force(theta))
    # The drive falls with the angle; where the load's slope would turn that round, stay.
    needed = np.minimum.accumulate(needed)
    return np.interp(-drive, -needed, theta)
