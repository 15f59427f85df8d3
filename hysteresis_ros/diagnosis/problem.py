# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What effects are judged on: measured rows, how they are held out, and what was recorded with them.

How a model answers to them is told by the kind of the measurements: see `arm_problem` and
`bench_problem`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import Effect
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.metrics import largest_noise, resolution_noise
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model.simulation import Simulator

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement

# A long recording is judged on about this many rows; between them nothing new is learned.
MOST_ROWS = 400
MOST_FOLDS = 4
# Blocks for significance: about this many a recording.
BLOCKS = 24


def judged_rows(measurement: Measurement) -> np.ndarray:
    """Return the rows (n,) that are no history, which only says what the muscle remembers."""
    history = measurement.columns.get('history')
    if history is None:
        return np.arange(measurement.rows)
    return np.flatnonzero(history == 0.0)


class Problem:
    """
    Measured rows of one or more recordings of one kind.

    Parameters
    ----------
    model : MuscleModel
    measurements : sequence of Measurement
        All of one kind and one response.

    Attributes
    ----------
    rows : int
        Of all measurements, judged or not.
    measured : ndarray, shape (n,)
        The response in the rows that are judged: an angle [rad], a length [m] or a strain.
    noise : float
        Standard deviation that the sensor's resolution causes, in the unit of the response.
    largest_noise : float
        Standard deviation that white noise can have at most, as all rows show it.
    clock, own_clock : ndarray, shape (n,)
        Time of each row since the first recording began, and since its own did [s].
    ambient : ndarray, shape (n,)
        Recorded temperature of the room [degC], NaN where there is none.
    trial, fold, block : ndarray of int, shape (n,)
        Which trial a row is of, which rows are held out together, and which count as one in the
        significance.
    signals : dict of str to ndarray, shape (n,)
        What was recorded or follows from it, and varies: drive, rate, time, since_step, cycles,
        ...
    """

    # Effects to try; None for the whole catalogue.
    catalogue: tuple[str, ...] | None = None
    # Processes for the fits; -1 for all cores.
    jobs: int = 1

    def __init__(self, model: MuscleModel, measurements: Sequence[Measurement]) -> None:
        self.model = model
        self.measurements = measurements
        self.kind = measurements[0].kind
        self.response = measurements[0].response
        self.settled = all(m.settled for m in measurements)
        self.rows = sum(m.rows for m in measurements)
        self.stride = max(1, sum(len(judged_rows(m)) for m in measurements) // MOST_ROWS)
        self.chosen = [judged_rows(m)[::self.stride] for m in measurements]
        # What the model has acts before the onset of what is tried.
        self.simulators = [Simulator(model, *pair, model.effects)
                           for pair in zip(measurements, self.chosen)]
        if not any(map(len, self.chosen)):
            raise MeasurementError(f'{measurements[0].source}: every row is history (the column '
                                   "'history' is not 0), so none is left to judge")
        self.measured = self.pick([m.column(m.response) for m in measurements])
        self.noise = max(resolution_noise(m) for m in measurements)
        self.largest_noise = max(largest_noise(m) for m in measurements)
        self._divide()
        self.signals = self._signals()

    def completed(self, effects: Sequence[Effect]) -> MuscleModel:
        """
        Return the model with effects; where weights are refitted, with new ones.

        Parameters
        ----------
        effects : sequence of Effect
            All effects of the model.
        """
        raise NotImplementedError

    def pick(self, columns: Sequence[np.ndarray]) -> np.ndarray:
        """Return the judged rows of a column given for every recording, shape (n,)."""
        return np.concatenate([column[rows] for column, rows in zip(columns, self.chosen)])

    def _divide(self) -> None:
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

    @property
    def duration(self) -> float:
        """Time from the beginning of a recording to its last row [s], of the longest one."""
        return float(np.max(self.own_clock))

    def _signals(self) -> dict[str, np.ndarray]:
        columns: dict[str, list[np.ndarray]] = {}
        for simulator in self.simulators:
            parts: dict[str, list[np.ndarray]] = {}
            for trial in simulator.trials:
                drive, time = trial.drive, np.asarray(trial.inputs.time)
                change = np.diff(drive, prepend=self.model.cold_drive)
                moving = np.abs(change) > 1e-3 * max(np.ptp(drive), 1e-12)
                last = np.maximum.accumulate(np.where(moving, np.arange(len(drive)), 0))
                of_trial = {
                    'drive': drive, 'load': trial.load,
                    'rate': _rate(drive, time),
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
        self.own_clock, self.ambient = signals['clock'], signals['ambient']
        self.clock = signals['clock'] + np.repeat(ends[:-1], [len(rows) for rows in self.chosen])
        return {name: values for name, values in signals.items()
                if np.all(np.isfinite(values)) and np.ptp(values) > 0.0}


def _rate(drive: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the derivative of the drive [1/s] in each row; rows of one time have the same."""
    _, first, place = np.unique(time, return_index=True, return_inverse=True)
    if len(first) < 2:
        return np.zeros(len(drive))
    return np.gradient(drive[first], time[first])[place]
