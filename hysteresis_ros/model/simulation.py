# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulation of a whole measurement from its inputs alone, trial by trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
import copy
import dataclasses
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np

from hysteresis_ros.bicep.balance import ArmBalance, statics_of
from hysteresis_ros.effects import Effect, Inputs
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.kernels.formation import elongations
from hysteresis_ros.kernels.load_play import follow
from hysteresis_ros.kernels.thinned import balanced_rows, between
from hysteresis_ros.model.agreement import Agreement, KnownPhases
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.first_stage import FirstStage
from hysteresis_ros.model.kinetic_stage import output_along
from hysteresis_ros.model.onset import Past, rows_before, rows_of
from hysteresis_ros.model.stepper import Stepper
from hysteresis_ros.model.trials import Trial, trials_of
from hysteresis_ros.operators import HysteresisOperator

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model.muscle import Lifting, MuscleModel

# Effects that depend on the phase are brought into agreement with the phase that they cause in each
# row, to this share of martensite (rms), in so many passes at most. An arm in motion has many more
# rows.
AGREEMENT, PASSES, MOVING_PASSES = 1e-6, 16, 8
# Fits compare thousands of sets of effects, and are content with less.
FIT_AGREEMENT, FIT_PASSES = 2e-3, 5
# Where all rows count in a fit, an arm at rest is balanced after each change of x by this share of
# H2's range, and in between is interpolated.
SPACING = 0.01
# Rows from which on threads pay: a simulation takes half a ms in the interpreter, which only one of
# them has at a time, and about 1 us a row outside.
WORTH_THREADS = 1000
# Balances that are kept, each with a table of some thousand numbers.
MOST_BALANCES = 64


class Response(NamedTuple):
    """
    What the muscle of a trial does, before the sensor.

    `values` (rows,) is the response, `output` (rows,) that of the operator that transforms; on an
    arm `inputs` (rows,) are those of H2, and `rest` [rad] is the angle before the trial.
    `drive_squared` (rows,) is what the muscle feels, empty where it is not asked for.
    """

    values: np.ndarray
    output: np.ndarray
    drive_squared: np.ndarray
    inputs: np.ndarray | None = None
    rest: float | None = None


class Simulator:
    """
    The model run over one measurement, for many sets of effects.

    Parameters
    ----------
    model : MuscleModel
        Operators, geometry and scales; its effects are not looked at.
    measurement : Measurement
        Whose inputs are simulated.
    judged : ndarray of int, shape (m,), optional
        Rows of the measurement that are looked at; the others may be interpolated where that does
        not change these. All by default.
    before : sequence of Effect, optional
        Effects that act in the rows of an arm run that lie before the onset of all others; see
        `model.onset`. By default there is no onset.

    Attributes
    ----------
    known_phases : KnownPhases
        Of the runs before, from which those of similar effects begin.

    Raises
    ------
    MeasurementError
        If the rows before the onset are not the first ones of a single trial.
    """

    def __init__(self, model: MuscleModel, measurement: Measurement,
                 judged: np.ndarray | None = None, before: Sequence[Effect] | None = None
                 ) -> None:
        self.model = model
        self.measurement = measurement
        self.trials = trials_of(model, measurement)
        self._whole: tuple[Simulator, np.ndarray] | None = None
        if measurement.part_of is not None:
            whole, taken = measurement.whole()
            self._whole = Simulator(model, whole), taken
        self._before = list(before or ())
        self._onset = (rows_before(measurement)
                       if before is not None and measurement.response == 'angle' else 0)
        self._pasts: dict[tuple, Past] = {}
        self._asked: np.ndarray | None = None
        if judged is not None and len(judged) < measurement.rows:
            self._asked = np.zeros(measurement.rows, dtype=bool)
            self._asked[judged] = True
        self._surroundings = model.surroundings
        self._balances: dict[tuple, ArmBalance] = {}
        self.known_phases = KnownPhases(np.ones(measurement.rows))
        self._statics = None
        if measurement.response == 'angle' and model.geometry is not None:
            self._statics = statics_of(model.geometry)

    def run(self, effects: Sequence[Effect], inputs_of_stage: list[np.ndarray] | None = None,
            exact: bool = False) -> np.ndarray:
        """
        Simulate with these effects.

        Parameters
        ----------
        effects : sequence of Effect
        inputs_of_stage : list, optional
            Takes H2's inputs (rows,) for each trial of an arm run.
        exact : bool
            Whether an arm is followed row by row, which takes about fifty times as long, where the
            phase does not come into agreement with all rows at once: strong latent heat.

        Returns
        -------
        ndarray, shape (rows,)
            The response as the sensor would give it: force [N], length [m], strain, angle [rad].

        Raises
        ------
        ParameterError, ModelFileError
            If the model lacks what this kind of measurement needs.
        """
        response, phase = self.run_apart(effects, inputs_of_stage, exact)
        self.known_phases.keep(effects, phase)
        return response

    def run_apart(self, effects: Sequence[Effect],
                  inputs_of_stage: list[np.ndarray] | None = None, exact: bool = False
                  ) -> tuple[np.ndarray, np.ndarray | None]:
        """
        Simulate with these effects, and leave no trace in the phases known; see `run`.

        Returns
        -------
        response : ndarray, shape (rows,)
        phase : ndarray, shape (rows,), or None
            The martensite share, where effects need it.
        """
        chain = Chain(effects, self._surroundings)
        if chain.yields[0] < np.inf and self._whole is not None and not self._onset:
            return self._run_whole(*self._whole, effects, inputs_of_stage, exact)
        past = self.past(effects)
        respond = self._responder(chain, exact, past)
        result = np.empty(self.measurement.rows)
        phase = None
        if chain.needs_phase:
            known = self.known_phases.nearest(effects)
            found = self._agree(chain, respond, np.ones_like(known) if exact else known, exact)
            phase = known.copy()
            for one in found:
                phase[one.trial.rows] = one.phase
            agree = [one.agrees for one in found]
            if chain.yields[0] < np.inf:
                # What a trial leaves behind the next ones begin with.
                agree = [all(agree)] * len(found)
            by_row = (exact and self.measurement.response == 'angle' and past is None
                      and not all(agree))
            arm = self._balance(chain) if by_row else None
            responses = [
                one.response if arm is None or agrees else self._row_by_row(chain, one.trial, arm)
                for one, agrees in zip(found, agree)]
        else:
            responses = respond(self.trials)
        for trial, response in zip(self.trials, responses):
            result[trial.rows] = (
                chain.measured(response.values, trial.inputs, response.rest) if past is None
                else past.measured(chain, response.values, trial.inputs))
            if inputs_of_stage is not None and response.inputs is not None:
                inputs_of_stage.append(response.inputs)
        return result, phase

    def _run_whole(self, whole: Simulator, taken: np.ndarray, effects: Sequence[Effect],
                   inputs_of_stage: list[np.ndarray] | None, exact: bool
                   ) -> tuple[np.ndarray, np.ndarray | None]:
        """Simulate what the trials that were not taken leave behind, too; see `run_apart`."""
        known = np.ones(len(taken))
        known[taken] = self.known_phases.nearest(effects)
        # Each thread begins with phases of its own.
        simulator = copy.copy(whole)
        simulator.known_phases = KnownPhases(known)
        of_trials: list[np.ndarray] = []
        response, phase = simulator.run_apart(effects, of_trials, exact)
        if inputs_of_stage is not None:
            inputs_of_stage += [inputs for trial, inputs in zip(simulator.trials, of_trials)
                                if taken[trial.rows.start]]
        return response[taken], None if phase is None else phase[taken]

    def past(self, effects: Sequence[Effect]) -> Past | None:
        """Return what the arm has done before the onset, None if these effects always act."""
        if not self._onset:
            return None
        lasting = [effect for effect in effects if effect.lasting]
        key = tuple((effect.id, *effect.values.values()) for effect in lasting)
        if key not in self._pasts:
            chain = Chain([*self._before, *lasting], self._surroundings)
            whole, first = self.trials[0], slice(self._onset)
            trial = dataclasses.replace(
                whole, rows=first, drive=whole.drive[first], load=whole.load[first],
                inputs=rows_of(whole.inputs, first))
            balance = self._balance(chain)
            response = self._row_by_row(chain, trial, balance)
            self._pasts[key] = Past(chain, response, balance, self._phase(response.output))
        return self._pasts[key]

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
        if jobs > 1 and len(sets) > 1 and self.measurement.rows >= WORTH_THREADS:
            with ThreadPoolExecutor(min(jobs, len(sets))) as pool:
                found = list(pool.map(self.run_apart, sets))
        else:
            found = [self.run_apart(effects) for effects in sets]
        # Not before all have run, or the result would depend on who comes first.
        for effects, (_, phase) in zip(sets, found):
            self.known_phases.keep(effects, phase)
        return np.array([row for row, _ in found]).reshape(len(sets), self.measurement.rows)

    @staticmethod
    def _patience(moves: bool, exact: bool) -> tuple[int, float]:
        """Return how many passes are made at most, and the agreement that ends them."""
        if exact:
            return MOVING_PASSES if moves else PASSES, AGREEMENT
        return FIT_PASSES, FIT_AGREEMENT

    def _agree(self, chain: Chain, respond: Callable, phase: np.ndarray, exact: bool
               ) -> list[Agreement]:
        """
        Return each trial with the phase that it has itself, begun with a phase (rows,).

        Where trials depend on those before, they go on together until all agree.
        """
        passes, agreement = self._patience(chain.moves, exact)
        together = chain.yields[0] < np.inf
        found = [Agreement(trial, phase[trial.rows], agreement) for trial in self.trials]
        searching = found
        for _ in range(passes):
            for one, response in zip(searching, respond([one.driven() for one in searching])):
                one.take(response, self._phase(response.output), chain)
            still = [one for one in searching if one.searching]
            if not still:
                break
            searching = searching if together else still
        return found

    def _row_by_row(self, chain: Chain, trial: Trial, balance: Lifting) -> Response:
        """Return the response of an arm whose phase is found in each row before the next."""
        arm = Stepper(self.model, chain, self.model.first_stage(chain), balance)
        rest = arm.start(float(trial.inputs.clock[0] - trial.inputs.dt[0]))
        columns = [np.broadcast_to(column, trial.drive.shape).tolist()
                   for column in (trial.drive, *trial.inputs)]
        rows = [(arm.step(drive, Inputs(*inputs)), balance.output, balance.operators[0].input)
                for drive, *inputs in zip(*columns)]
        angles, outputs, stage_inputs = np.array(rows, dtype=float).reshape(-1, 3).T
        return Response(angles, outputs, np.array([]), stage_inputs, rest)

    def _phase(self, given: np.ndarray) -> np.ndarray:
        """Martensite share as the operator's output shows it."""
        stage = self.model.force_stage
        if self.measurement.response == 'force' and stage is not None:
            low, high = stage.output_range
            return np.clip((high - given) / max(high - low, 1e-12), 0.0, 1.0)
        return self.model.martensite(given)

    def _responder(self, chain: Chain, exact: bool = False, past: Past | None = None
                   ) -> Callable[[Sequence[Trial]], list[Response]]:
        """Return what gives the responses of trials."""
        response = self.measurement.response
        if response == 'force':
            if self.model.force_stage is None:
                raise ParameterError(
                    'the model has no force stage; identify it with --force F.csv')
            operator = copy.deepcopy(self.model.force_stage)
            return lambda trials: [self._force(chain, operator, trial) for trial in trials]
        first = self.model.first_stage(chain)
        if response == 'angle':
            balance = self._balance(chain)
            if past is not None:
                return lambda trials: [self._angles_since(past, chain, first, balance, trial)
                                       for trial in trials]
            asked = None if exact or chain.moves else self._asked
            return lambda trials: self._angles(chain, first, balance, asked, trials)
        stage = self.model.require_length_stage(chain)
        return lambda trials: [self._length(chain, first, stage, trial) for trial in trials]

    def _balance(self, chain: Chain) -> Lifting:
        """Return the balance of an arm, with what happens to its muscles meanwhile."""
        return self.model.lifting(chain, lambda muscles: self._balance_with(chain, muscles))

    def _balance_with(self, chain: Chain, muscles: int | None) -> ArmBalance:
        """Return the balance of some muscles; most sets of effects differ in what it knows not."""
        # What happens meanwhile none of them knows.
        key = (muscles, *((effect.id, *effect.values.values())
                          for effect in (*chain.material, *chain.mechanism)
                          if effect not in chain.meanwhile))
        made = self._balances.get(key)
        if made is None:
            made = self.model.balance(chain, self._statics, muscles)
            if len(self._balances) >= MOST_BALANCES:
                self._balances.clear()
            self._balances[key] = made
        # Each thread has a state of its own.
        return made.copy()

    @staticmethod
    def drive_squared(chain: Chain, trial: Trial, past: Past | None = None) -> np.ndarray:
        """Return the drive squared that the muscle feels in the rows of a trial, (rows,)."""
        if past is None:
            return chain.drive_squared(trial.drive, trial.inputs)
        return past.drive_squared(chain, trial.drive, trial.inputs)

    def _first(self, chain: Chain, first: FirstStage, trial: Trial, past: Past | None = None
               ) -> tuple[float, np.ndarray, np.ndarray]:
        """Return x in the cold state, and x and drive squared of each row."""
        drive_squared = self.drive_squared(chain, trial, past)
        cold = chain.to_drive_squared(self.model.cold_drive)
        first.reset()
        x = first.simulate(np.concatenate(([cold], drive_squared)))
        return float(x[0]), x[1:], drive_squared

    def _force(self, chain: Chain, operator: HysteresisOperator, trial: Trial) -> Response:
        drive_squared = chain.drive_squared(trial.drive, trial.inputs)
        operator.reset()
        operator.step(self.model.cold_drive)
        force = operator.simulate(chain.to_drive(drive_squared))
        return Response(force, force, drive_squared)

    def _length(self, chain: Chain, first: FirstStage, stage: HysteresisOperator, trial: Trial
                ) -> Response:
        model = self.model
        cold, x, drive_squared = self._first(chain, first, trial)
        load = chain.load_inside(trial.load) if first.loaded else 0.0 * trial.load
        given = model.sign * (np.concatenate(([cold], x)) - np.concatenate((load[:1], load)))
        if chain.plays and first.loaded:
            width = chain.loop_width(trial.load)
            given = follow(given, np.concatenate((width[:1], width)), np.array([len(given)]))
        oriented = chain.oriented(trial.load) + 0.0 * trial.load
        outputs = output_along(stage, given, np.concatenate((oriented[:1], oriented)))
        rest, output = outputs[0], outputs[1:]
        base = stage.output_range[0]
        offset, factor = chain.drift(trial.drive, drive_squared, trial.inputs)
        scale, kept = chain.scale(trial.load), chain.keeps_strain
        if kept:
            transformed = factor * elongations(
                kept, chain.oriented_anew, np.concatenate(([rest], output)) - base,
                np.concatenate((scale[:1], scale)))[1:]
        else:
            transformed = scale * factor * (output - base)
        return Response(base + transformed + chain.stretch(trial.load) + offset, output,
                        drive_squared)

    def _angles(self, chain: Chain, first: FirstStage, balance: Lifting,
                asked: np.ndarray | None, trials: Sequence[Trial]) -> list[Response]:
        """Return what the arm does; the trials run in one call of the kernel."""
        # The phase is looked at in all rows, and what martensite keeps is an integral over them.
        spacing = SPACING * balance.span if chain.needs_phase or chain.keeps_strain else np.inf
        cold, columns, rows, felt = 0.0, [], [], []
        for trial in trials:
            cold, x, drive_squared = self._first(chain, first, trial)
            felt.append(drive_squared)
            columns.append(np.array([
                x, *chain.drift(trial.drive, drive_squared, trial.inputs), trial.inputs.dt,
                trial.inputs.clock]))
            if asked is not None:
                read = chain.rows_read(asked[trial.rows], trial.inputs)
                if chain.break_time < np.inf:
                    read = read | _rows_around(trial.inputs.clock, chain.break_time)
                rows.append(balanced_rows(columns[-1][:3], read, spacing))
        kept = [own[:, one] for own, one in zip(columns, rows)] if rows else columns
        ends = np.cumsum([own.shape[1] for own in kept])
        x, offset, factor, dt, clock = np.concatenate(kept, axis=1)
        rest, *found = balance.run(cold, ends, x, dt, offset, factor, clock)
        responses = []
        for place, (end, angle) in enumerate(zip(ends, np.broadcast_to(rest, len(ends)).tolist())):
            angles, outputs, inputs = (
                column[end - kept[place].shape[1]:end] for column in found)
            if rows:
                angles, outputs, inputs = (between(rows[place], columns[place][0], column)
                                           for column in (angles, outputs, inputs))
            responses.append(Response(angles, outputs, felt[place], inputs, angle))
        return responses

    def _angles_since(self, past: Past, chain: Chain, first: FirstStage, balance: Lifting,
                      trial: Trial) -> Response:
        """Return what the arm does: what is known before the onset, and what follows."""
        since = slice(past.rows, None)
        _, x, drive_squared = self._first(chain, first, trial, past)
        offset, factor = chain.drift(trial.drive, drive_squared, trial.inputs)
        arm: Any = balance
        arm.take_over(past.balance)
        found = arm.proceed(*(column[since] for column in (
            x, trial.inputs.dt, offset, factor, trial.inputs.clock)))
        angles, outputs, inputs = np.concatenate((past.columns, found), axis=1)
        return Response(angles, outputs, drive_squared, inputs, past.rest)


def _rows_around(clock: np.ndarray, time: float) -> np.ndarray:
    """Return whether each row of a trial (rows,) is the last before a time or the first after."""
    found = np.zeros(len(clock), dtype=bool)
    after = int(np.searchsorted(clock, time, 'right'))
    found[max(after - 1, 0):after + 1] = True
    return found


def predict(model: MuscleModel, measurement: Measurement) -> np.ndarray:
    """Simulate every row of a measurement with the model and its effects, shape (rows,)."""
    return Simulator(model, measurement).run(model.effects, exact=True)


def predict_linear(model: MuscleModel, measurement: Measurement) -> np.ndarray:
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
    low, high = geometry.angle_range
    theta = np.linspace(low, high, 2000)
    needed = model.linear.drive_for_length(geometry.length(theta), geometry.force(theta))
    # The drive falls with the angle; where the load's slope would turn that round, stay.
    needed = np.minimum.accumulate(needed)
    return np.interp(-drive, -needed, theta)
