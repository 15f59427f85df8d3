# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What effects are judged on: measured rows, how they are held out, and the model's answer to them.

An arm run is judged with the weights that the bench gave, frozen: refitted weights would absorb
most of what an effect does. A bench table is where those weights come from, so there every set of
effects gets weights of its own, fitted to the rows that are not held out.
"""

import dataclasses

import numpy as np

from hysteresis_ros.diagnosis.structure import Offset
from hysteresis_ros.effects import SensorEffect
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.identification.least_squares import SLACK, fit_weights, quick_weights
from hysteresis_ros.identification.operators import preisach_rows, smoothness
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.simulation import Simulator, turning_rows
from hysteresis_ros.operators import Preisach, cell_areas

# A long recording is judged on about this many rows; between them nothing new is learned. Weights
# that are refitted again and again ask for fewer.
MOST_ROWS = {'arm': 800, 'bench': 400}
MOST_FOLDS = 4
# Blocks for significance: about this many a recording.
BLOCKS = 24
# Strength of the weights' regularisation at which sets of effects are compared: only so much that
# the solution is unique. More of it bends the effects' own parameters.
SEARCH_STRENGTH = 1e-8
# A finer grid has to lower the held-out error by this share.
WORTH = 0.02
# How much finer than the model's the grid of H2 may be once its effects are known.
FINER = 1.0, 1.5, 2.0


def sensor_resolution(measurement) -> float:
    """Return the standard deviation that the steps of the response's sensor cause."""
    values = np.unique(measurement.column(measurement.response))
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * max(np.ptp(values), 1e-300)]
    return float(np.min(steps) / np.sqrt(12.0)) if len(steps) else 0.0


class Problem:
    """
    Measured rows of one or more recordings of one kind.

    Attributes
    ----------
    measured : ndarray, shape (n,)
        The response in the rows that are judged.
    trial, fold, block : ndarray of int, shape (n,)
        Which trial a row is of, which rows are held out together, and which count as one in the
        significance.
    signals : dict of str to ndarray, shape (n,)
        What was recorded or follows from it: drive, rate, time, since_step, cycles, ...
    """

    def __init__(self, model, measurements):
        self.model = model
        self.measurements = measurements
        self.kind = measurements[0].kind
        self.response = measurements[0].response
        self.settled = all(m.settled for m in measurements)
        rows = sum(m.rows for m in measurements)
        self.stride = max(1, rows // MOST_ROWS[self.kind])
        self.simulators = [Simulator(model, m, self.stride) for m in measurements]
        self.chosen = [np.arange(0, m.rows, self.stride) for m in measurements]
        self.measured = self.pick([m.column(m.response) for m in measurements])
        self.noise = max(sensor_resolution(m) for m in measurements)
        self._divide()
        self.signals = self._signals()

    def pick(self, columns) -> np.ndarray:
        """Return the judged rows of a column given for every recording, shape (n,)."""
        return np.concatenate([column[rows] for column, rows in zip(columns, self.chosen)])

    def _divide(self):
        """Hold out whole trials; with a single one, blocks in time."""
        count, columns = 0, []
        for measurement in self.measurements:
            index = np.empty(measurement.rows, dtype=int)
            for _, part in measurement.split():
                index[part] = count
                count += 1
            columns.append(index)
        self.trial = self.pick(columns)
        position = np.arange(len(self.trial))
        if count > 1:
            self.fold = self.trial % min(count, MOST_FOLDS)
        else:
            self.fold = position * (2 * MOST_FOLDS) // len(position) % MOST_FOLDS
        parts = max(1, round(BLOCKS / count))
        self.block = np.empty(len(position), dtype=int)
        number = 0
        for trial in np.unique(self.trial):
            rows = np.flatnonzero(self.trial == trial)
            pieces = max(min(parts, len(rows) // 3), 1)
            self.block[rows] = number + np.arange(len(rows)) * pieces // len(rows)
            number += pieces

    @property
    def folds(self) -> np.ndarray:
        """Identifiers of the folds."""
        return np.unique(self.fold)

    def _signals(self) -> dict:
        columns: dict[str, list] = {}
        for simulator in self.simulators:
            parts: dict[str, list] = {}
            for trial in simulator.trials:
                drive, time = trial.drive, np.asarray(trial.inputs.time)
                change = np.diff(drive, prepend=self.model.cold_drive)
                moving = np.abs(change) > 1e-3 * max(np.ptp(drive), 1e-12)
                last = np.maximum.accumulate(np.where(moving, np.arange(len(drive)), 0))
                of_trial = {
                    'drive': drive, 'load': trial.load,
                    'rate': np.gradient(drive, time) if len(drive) > 1 else np.zeros(1),
                    'direction': np.sign(change)[last], 'time': time,
                    'clock': trial.inputs.clock, 'since_step': time - time[last],
                    'cycles': trial.inputs.cycles, 'ambient': trial.inputs.ambient}
                for name, values in of_trial.items():
                    parts.setdefault(name, []).append(values)
            for name, values in parts.items():
                columns.setdefault(name, []).append(np.concatenate(values))
        signals = {name: self.pick(values) for name, values in columns.items()}
        # Recordings follow each other; each begins its clock anew.
        ends = np.cumsum([0.0] + [s.trials[-1].inputs.clock[-1] for s in self.simulators])
        self.clock = signals['clock'] + np.repeat(ends[:-1], [len(rows) for rows in self.chosen])
        return {name: values for name, values in signals.items()
                if np.all(np.isfinite(values)) and np.ptp(values) > 0.0}


class ArmProblem(Problem):
    """Arm runs, simulated with the frozen weights of the bench."""

    refits = False

    def simulate(self, effects, train=None) -> np.ndarray:
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

    def completed(self, effects):
        """Return the model with these effects."""
        return self.model.with_effects(effects)

    def weight_columns(self, effects) -> np.ndarray:
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
            areas = np.concatenate([
                np.apply_along_axis(lambda column: np.interp(
                    np.arange(count), chosen, column), 0, preisach_rows(stage.nodes, u, True))
                for u, chosen, count in inputs])
            columns.append((((moved - base) / step)[:, None] * areas)[rows])
        return np.concatenate(columns)


@dataclasses.dataclass
class Design:
    """The least squares problem of H2's weights: areas (n, K), known part (n,), grid nodes."""

    rows: np.ndarray
    known: np.ndarray
    nodes: np.ndarray


class BenchProblem(Problem):
    """Bench tables, with weights refitted to the training rows for every set of effects."""

    refits = True

    def __init__(self, model, measurements):
        super().__init__(model, measurements)
        stage = model.require_length_stage()
        if not isinstance(stage, Preisach):
            raise MeasurementError(f'effects on bench tables need a Preisach length stage, this '
                                   f'model has a {stage.kind} one; identify it with --operator '
                                   'two-stage or preisach')
        self.levels = len(stage.nodes) - 1
        self._passive = None
        self._square = None

    def _design(self, effects, levels=None) -> Design:
        model = self.model
        chain = Chain(effects, model.surroundings)
        first = model.first_stage(chain)
        cold = chain.to_heat(model.cold_drive)
        parts, scales, known = [], [], []
        phases = iter(self._phases(chain) if chain.needs_phase else ())
        for simulator in self.simulators:
            for trial in simulator.trials:
                inputs = trial.inputs
                if chain.needs_phase:
                    inputs = inputs._replace(phase=next(phases))
                heat = chain.heat(trial.drive, inputs)
                first.reset()
                x = first.simulate(np.concatenate(([cold], heat)))
                load = chain.load_inside(trial.load) if first.loaded else 0.0 * trial.load
                parts.append(model.sign * (x - np.concatenate((load[:1], load))))
                offset, factor = chain.drift(trial.drive, heat, inputs)
                scales.append(chain.scale(trial.load) * factor)
                known.append(chain.stretch(trial.load) + offset)
        low = min(part.min() for part in parts)
        high = max(part.max() for part in parts)
        margin = 1e-6 * max(high - low, 1e-12)
        nodes = np.linspace(low - margin, high + margin, (levels or self.levels) + 1)
        picked = self._picked()
        rows = np.concatenate([
            _areas(nodes, part, keep) for part, keep in zip(parts, picked)])
        rows *= np.concatenate([scale[keep] for scale, keep in zip(scales, picked)])[:, None]
        return Design(rows, np.concatenate(
            [value[keep] for value, keep in zip(known, picked)]), nodes)

    def _picked(self) -> list:
        """Judged rows of each trial, counted from the trial's first."""
        picked = []
        for simulator, chosen in zip(self.simulators, self.chosen):
            for trial in simulator.trials:
                inside = (chosen >= trial.rows.start) & (chosen < trial.rows.stop)
                picked.append(chosen[inside] - trial.rows.start)
        return picked

    def _phases(self, chain) -> list:
        """Return for each trial the martensite share as the measured response shows it."""
        shown = [
            self.model.sign * (simulator.measurement.column(self.response)[trial.rows]
                               - chain.stretch(trial.load))
            for simulator in self.simulators for trial in simulator.trials]
        low, high = min(map(np.min, shown)), max(map(np.max, shown))
        return [(high - values) / max(high - low, 1e-300) for values in shown]

    def fit_stage(self, effects, levels):
        """
        Fit H2's weights to all rows, their regularisation cross-validated over the trials.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        levels : int
            Of H2.

        Returns
        -------
        WeightFit, Design
        """
        design = self._design(effects, levels)
        groups = self.trial if len(np.unique(self.trial)) > 1 else self.block
        fit = fit_weights(
            design.rows, self.measured - design.known, groups=groups, scale=_scale(design.nodes),
            slack=SLACK, penalty=smoothness(design.nodes, reversible=True))
        return fit, design

    def simulate(self, effects, train=None) -> np.ndarray:
        """Return the response of the judged rows, shape (n,), weights fitted to `train` (n,)."""
        design = self._design(effects)
        rows = slice(None) if train is None else train
        # Neighbouring parameters have neighbouring weights.
        weights, bias, self._passive = quick_weights(
            design.rows[rows], (self.measured - design.known)[rows],
            _scale(design.nodes), self._penalty(design.nodes), self._passive)
        response = design.rows @ weights + bias + design.known
        for effect in effects:
            if isinstance(effect, SensorEffect):
                response = self._sensed(effect, response)
        return response

    def _penalty(self, nodes):
        """Square of the penalty; it is the same for all grids of equal intervals."""
        if self._square is None:
            root = smoothness(nodes, reversible=True)
            self._square = SEARCH_STRENGTH * root.T @ root
        return self._square

    def _sensed(self, effect, response):
        sensed = response.copy()
        for trial in np.unique(self.trial):
            rows = self.trial == trial
            inputs = self.simulators[0].trials[0].inputs._replace(
                time=self.signals['time'][rows])
            sensed[rows] = effect.forward(response[rows], inputs)
        return sensed

    def weight_columns(self, effects) -> np.ndarray:
        """Return how each weight of H2 moves the response of the judged rows, shape (n, K)."""
        return self._design(effects).rows

    def completed(self, effects):
        """
        Return the model with these effects and H2's weights refitted to all rows.

        What the effects explain no longer has to be smoothed over, so that the grid may be finer
        where held-out rows say so.
        """
        best = None
        for factor in FINER:
            fit, design = self.fit_stage(effects, round(factor * self.levels))
            if best is not None and fit.validation.min() > (1.0 - WORTH) * best[0].validation.min():
                break
            best = fit, design
        fit, design = best
        scale = _scale(design.nodes)
        count = len(cell_areas(design.nodes))
        stage = Preisach(design.nodes, fit.weights[:count], fit.bias + float(fit.weights @ scale),
                         fit.weights[count:])
        return dataclasses.replace(self.model, effects=list(effects), length_stage=stage)


def _areas(nodes, part, keep):
    """Areas above saturation, (rows, K + N), of the kept rows; the first input is the cold one."""
    wanted = np.zeros(len(part), dtype=bool)
    wanted[keep + 1] = True
    needed = wanted | turning_rows(part)
    rows = preisach_rows(nodes, part[needed], reversible=True) + _scale(nodes)
    return rows[wanted[needed]]


def _scale(nodes):
    """Sizes of the cells and, for the reversible weights, of the intervals, shape (K + N,)."""
    return np.append(cell_areas(nodes), np.diff(nodes))


def problem_for(model, measurements) -> Problem:
    """
    Return the problem that suits the kind of the measurements.

    Raises
    ------
    MeasurementError
        If they are of kinds that cannot be judged together, or hold nothing to explain.
    """
    measurements = list(measurements)
    if not measurements:
        raise MeasurementError('no measurement was given; name CSV files or bag folders')
    if all(m.kind == 'bench' for m in measurements):
        measurements = [m for m in measurements if m.response != 'force']
        if not measurements:
            raise MeasurementError('a force table at resting length has no load to explain; give '
                                   'the length table as well')
    kinds = sorted({f'{m.kind} {m.response}' for m in measurements})
    if len(kinds) > 1:
        raise MeasurementError(f'the measurements are of several kinds ({", ".join(kinds)}); give '
                               'either bench tables or arm runs')
    if measurements[0].kind == 'bench':
        return BenchProblem(model, measurements)
    return ArmProblem(model, measurements)
