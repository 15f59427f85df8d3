# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulation of a whole measurement from its inputs alone, trial by trial."""

import copy
import dataclasses

import numpy as np

from hysteresis_ros.effects import Inputs, SensorEffect
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.model.chain import Chain

# Rows of a settled table without times are this far apart [s] (Sec. III-A).
HOLD = 30.0
# Passes at most that bring an effect that depends on the phase into agreement with the phase it
# causes, to this share of martensite, with steps of at least this part of the difference.
PHASE_PASSES, AGREEMENT, SHORTEST = 10, 2e-3, 0.2
# The same for an arm in motion, which is balanced in every row.
MOVING_PASSES = 4
# True responses that are kept.
REMEMBERED = 4
# Step, as a share of the first stage's range, that is a jump.
JUMP = 0.03
# Change of that step from one row to the next that is the end of a ramp.
BEND = 0.003


@dataclasses.dataclass
class Trial:
    """One trial's inputs: rows of the table, drive and load of shape (rows,), and the rest."""

    rows: slice
    drive: np.ndarray
    load: np.ndarray
    inputs: Inputs


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
    stride : int
        In a continuous arm run only every `stride`-th row of the table is balanced, and every row
        at which the first stage jumps, bends or turns round, so that the memory stays exact; rows
        between are interpolated. An arm with inertia or viscous friction is balanced in every row.
    """

    def __init__(self, model, measurement, stride: int = 1):
        self.model = model
        self.measurement = measurement
        self.stride = 1 if measurement.settled else stride
        self.trials = trials_of(model, measurement)
        self._remembered: dict[tuple, tuple] = {}
        self._rest: float | None = None

    def run(self, effects, inputs_of_stage: list | None = None) -> np.ndarray:
        """
        Simulate with these effects.

        Parameters
        ----------
        effects : sequence of Effect
        inputs_of_stage : list, optional
            Takes for each trial of an arm run H2's inputs, the rows they belong to, and the
            trial's number of rows.

        Returns
        -------
        ndarray, shape (rows,)
            The response as the sensor would give it: force [N], length [m], strain, angle [rad].

        Raises
        ------
        ParameterError, ModelFileError
            If the model lacks what this kind of measurement needs.
        """
        chain = Chain(effects, self.model.surroundings)
        result, rest = self._before_sensor(effects, chain, inputs_of_stage)
        if chain.sensor:
            result = result.copy()
            for trial in self.trials:
                result[trial.rows] = chain.measured(
                    result[trial.rows], trial.inputs, rest)
        return result

    def _before_sensor(self, effects, chain, inputs_of_stage):
        """
        Return the true response, and on an arm that of the rest before each trial.

        The last few are remembered, for fits of the sensor.
        """
        key = (self.stride, *((effect.id, *effect.values.items()) for effect in effects
                              if not isinstance(effect, SensorEffect)))
        if inputs_of_stage is None and key in self._remembered:
            return self._remembered[key]
        result = np.empty(self.measurement.rows)
        respond = self._responder(chain, inputs_of_stage)
        for number, trial in enumerate(self.trials):
            if chain.needs_phase:
                result[trial.rows] = self._agree(
                    respond, trial, MOVING_PASSES if chain.moves else PHASE_PASSES)
                if inputs_of_stage is not None:
                    # Of all passes the last one counts.
                    del inputs_of_stage[number:-1]
            else:
                result[trial.rows], _ = respond(trial, trial.inputs)
        if len(self._remembered) >= REMEMBERED:
            del self._remembered[next(iter(self._remembered))]
        self._remembered[key] = result, self._rest
        return self._remembered[key]

    def _agree(self, respond, trial, passes):
        """Return the response with the phase that it has itself, by Aitken's relaxation."""
        phase, left, part = np.ones(len(trial.drive)), None, 1.0
        for _ in range(passes):
            response, given = respond(trial, trial.inputs._replace(phase=phase))
            before, left = left, self._phase(given) - phase
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

    def _responder(self, chain, inputs_of_stage):
        """Return what gives response and operator's output for a trial."""
        response = self.measurement.response
        if response == 'force':
            if self.model.force_stage is None:
                raise ParameterError(
                    'the model has no force stage; identify it with --force F.csv')
            operator = copy.deepcopy(self.model.force_stage)
            return lambda trial, inputs: self._force(chain, operator, trial, inputs)
        first = self.model.first_stage(chain)
        if response == 'angle':
            balance = self.model.balance(chain)

            def respond(trial, inputs):
                return self._angle(chain, first, balance, trial, inputs, inputs_of_stage)
            return respond
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
        return force, force

    def _length(self, chain, first, stage, trial, inputs):
        model = self.model
        cold, x, heat = self._first(chain, first, trial, inputs)
        load = chain.load_inside(trial.load) if first.loaded else 0.0 * trial.load
        stage.reset()
        stage.step(model.sign * (cold - load[0]))
        output = stage.simulate(model.sign * (x - load))
        base = stage.output_range[0]
        offset, factor = chain.drift(trial.drive, heat, inputs)
        return (base + chain.scale(trial.load) * factor * (output - base)
                + chain.stretch(trial.load) + offset), output

    def _angle(self, chain, first, balance, trial, inputs, inputs_of_stage):
        cold, x, heat = self._first(chain, first, trial, inputs)
        offset, factor = chain.drift(trial.drive, heat, inputs)
        chosen = (np.arange(len(x)) if self.stride == 1 or balance.has_dynamics
                  else self._chosen_rows(trial.rows.start, cold, x))
        steps = np.diff(np.cumsum(inputs.step)[chosen], prepend=0.0).tolist()
        balance.start()
        self._rest = balance.settle(cold)
        angles, outputs, stage_inputs = [], [], []
        for row in zip(x[chosen].tolist(), steps, offset[chosen].tolist(),
                       factor[chosen].tolist()):
            angles.append(balance.step(*row))
            outputs.append(balance.output)
            stage_inputs.append(balance.operators[0].input)
        if inputs_of_stage is not None:
            inputs_of_stage.append((np.array(stage_inputs), chosen, len(x)))
        if len(chosen) == len(x):
            return np.array(angles), np.array(outputs)
        return tuple(np.interp(inputs.time, inputs.time[chosen], column)
                     for column in (angles, outputs))

    def _chosen_rows(self, start, cold, x):
        rows = np.arange(len(x))
        keep = ((start + rows) % self.stride == 0) | turning_rows(x)
        change = np.abs(np.diff(x, prepend=cold)) / max(np.ptp(x), 1e-12)
        # A jump is seen from both sides, so that nothing is interpolated over it.
        jump = change > JUMP
        keep |= jump
        keep[:-1] |= jump[1:]
        # Where a ramp begins or ends, a straight line between the rows beside it would miss it.
        bend = np.abs(np.diff(x, 2, prepend=[cold, cold])) / max(np.ptp(x), 1e-12)
        keep[:-1] |= bend[1:] > BEND
        return rows[keep]


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
