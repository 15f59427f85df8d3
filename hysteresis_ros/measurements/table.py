# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The one table type that every measurement becomes, and the checks that it passes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.problems import refuse
from hysteresis_ros.measurements.quantities import DRIVES, LOADS, QUANTITIES, RESPONSES
from hysteresis_ros.measurements.unit_checks import largest_values, unit_problems, unit_warnings
from hysteresis_ros.spelling import closest, short_list, suggestion
import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.measurements.columns import Column
    from numpy.typing import ArrayLike

SETTLED_HOLD = 20.0
"""Rows of a run that are at least this many seconds apart are settled states, by default."""
TURN, ALMOST = 2.0 * np.pi, 0.1
"""A turn [rad], and the share of it that an arm moves from one row to the next while it wraps."""
CALENDAR = 1e8
"""Times from here on [s], three years, are of a calendar and not since the muscle was cold."""


class MeasurementWarning(UserWarning):
    """A table that can be used, with something in it that looks wrong."""


@dataclass(frozen=True)
class Measurement:
    """
    Rows of a bench table or of an arm run, with the memory wiped before every trial.

    Attributes
    ----------
    kind : str
        'bench' or 'arm'.
    response : str
        What was measured: 'force', 'length', 'strain' or 'angle'.
    drive : str
        What was applied: 'voltage', 'temperature', 'pressure', 'current' or 'power'.
    load : str or None
        'force', 'stress' or None.
    columns : dict of str to ndarray of float64, each shape (rows,)
        Every numeric column, in SI units; unknown ones are kept.
    source : str
        File or folder that the rows came from.
    digest : str
        SHA-256 of that file or folder, hexadecimal; '' if the rows came from no file.
    warnings : tuple of str
        What looked wrong when it was read, one line each.
    settled_time : float
        Time [s] for which the drive has to be held until muscle and arm have settled.
    part_of : Measurement or None
        The recording that trials were taken from; None if they are all here.

    """

    kind: str
    response: str
    drive: str
    load: str | None
    columns: dict = field(repr=False)
    source: str = 'memory'
    digest: str = ''
    warnings: tuple = ()
    settled_time: float = SETTLED_HOLD
    part_of: Measurement | None = field(default=None, repr=False)

    @classmethod
    def from_columns(cls, columns: Mapping[str, ArrayLike], source: str = 'memory',
                     digest: str = '', warnings: Iterable[str] = (),
                     origin: Mapping[str, Column] | None = None) -> Measurement:
        """
        Build a measurement from columns; their names say what it is.

        Parameters
        ----------
        columns : mapping of str to array_like, each shape (rows,)
            A missing `trial` column means one trial.
        source, digest, warnings
            As the attributes.
        origin : mapping of str to Column, optional
            How the columns of a file stood there, for messages that name the option which
            converts them.

        Returns
        -------
        Measurement

        Raises
        ------
        MeasurementError
            If columns are missing, misnamed, of different lengths, empty, not finite, out of
            order, or impossible in their unit; one message says all.

        """
        arrays = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
        kind, response, drive, load = classify(arrays, source)
        rows = len(arrays[response])
        for name, values in arrays.items():
            if values.shape != (rows,):
                raise MeasurementError(
                    f'{source}: column {name!r} has shape {values.shape}, {response!r} has '
                    f'{rows} rows; every column needs one number a row')
        if rows == 0:
            raise MeasurementError(f'{source}: the table has no rows')
        arrays.setdefault('trial', np.zeros(rows))
        notes = list(warnings)
        if 'time' in arrays:
            arrays['time'], note = time_of_trials(arrays['time'], arrays['trial'])
            notes += [f'{source}: {note}'] if note else []
        problems = []
        for name, values in arrays.items():
            if is_known(name) and not np.all(np.isfinite(values)):
                row = int(np.flatnonzero(~np.isfinite(values))[0])
                problems.append(f'row {row}, column {name!r} is {values[row]}; remove the row or '
                                'mend the value')
        measurement = cls(kind, response, drive, load, arrays, str(source), digest)
        if not problems:
            largest = largest_values(arrays)
            problems = order_problems(measurement) + unit_problems(largest, origin)
        refuse(str(source), problems)
        return replace(measurement, warnings=(
            *notes, *name_warnings(measurement), *wrap_warnings(measurement),
            *(f'{source}: {note}' for note in unit_warnings(largest, origin))))

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.columns[self.response])

    @property
    def trials(self) -> np.ndarray:
        """Identifiers of the trials in the order of the file, ndarray of float64."""
        values = self.columns['trial']
        return values[np.concatenate(([True], values[1:] != values[:-1]))]

    @property
    def time(self) -> np.ndarray | None:
        """Time in s from the start of the trial, (rows,), or None for a table without it."""
        return self.columns.get('time')

    @property
    def settled(self) -> bool:
        """Whether each row is a settled state: no time, or rows so far apart."""
        if self.time is None:
            return True
        steps = np.diff(self.time)[np.diff(self.columns['trial']) == 0]
        return bool(steps.size == 0 or steps.min() >= self.settled_time * (1 - 1e-6))

    def column(self, name: str) -> np.ndarray:
        """
        Return one column.

        Parameters
        ----------
        name : str

        Returns
        -------
        ndarray of float64, shape (rows,)

        Raises
        ------
        MeasurementError
            If there is none of that name; the message names the closest one.

        """
        if name not in self.columns:
            raise MeasurementError(
                f'{self.source}: no column {name!r}{suggestion(name, self.columns)}')
        return self.columns[name]

    def split(self) -> list[tuple[float, slice]]:
        """
        Return the trials as (identifier, slice of the rows), in the order of the file.

        Returns
        -------
        list of (float, slice)

        """
        values = self.columns['trial']
        starts = np.concatenate(([0], np.flatnonzero(values[1:] != values[:-1]) + 1, [self.rows]))
        return [(float(values[low]), slice(int(low), int(high)))
                for low, high in zip(starts[:-1], starts[1:])]

    def select(self, trials: Iterable[float]) -> Measurement:
        """
        Return the rows of some trials, whose others are `part_of` it.

        Parameters
        ----------
        trials : iterable of float

        Returns
        -------
        Measurement

        Raises
        ------
        MeasurementError
            If a trial is not in the table.

        """
        wanted = [float(trial) for trial in trials]
        missing = [trial for trial in wanted if trial not in self.trials]
        if missing or not wanted:
            raise MeasurementError(
                f'{self.source}: no trial {trial_list(missing)}; the table has trials '
                f'{trial_list(self.trials)}')
        return self.where(np.isin(self.columns['trial'], wanted))

    def where(self, rows: np.ndarray | slice) -> Measurement:
        """
        Return some rows.

        Trials of which none is left have happened none the less, and are `part_of` it.

        Parameters
        ----------
        rows : ndarray of bool, shape (rows,), or of int, or slice

        Returns
        -------
        Measurement

        """
        found = replace(self, columns={
            name: values[rows] for name, values in self.columns.items()})
        if self.part_of is None and len(found.trials) < len(self.trials):
            return replace(found, part_of=self)
        return found

    def whole(self) -> tuple[Measurement, np.ndarray]:
        """
        Return the rows with the trials that were not taken, and which of them are these.

        Returns
        -------
        Measurement
            With the columns that both have.
        ndarray of bool
            One for each of its rows.

        """
        if self.part_of is None:
            return self, np.ones(self.rows, dtype=bool)
        own = dict(self.split())
        parts = [(self, own[trial]) if trial in own else (self.part_of, rows)
                 for trial, rows in self.part_of.split()]
        taken = np.concatenate([
            np.full(rows.stop - rows.start, table is self) for table, rows in parts])
        return replace(self, part_of=None, columns={
            name: np.concatenate([table.columns[name][rows] for table, rows in parts])
            for name in self.columns if name in self.part_of.columns}), taken


def classify(columns: Collection[str], source: str) -> tuple[str, str, str, str | None]:
    """
    Tell what a table is from the names of its columns.

    Parameters
    ----------
    columns : collection of str
    source : str
        For messages.

    Returns
    -------
    kind, response, drive : str
    load : str or None

    Raises
    ------
    MeasurementError
        If there is no response or no drive among the names.

    """
    refuse(source, missing_columns(columns))
    drive = next(name for name in DRIVES if name in columns)
    response = next(name for name in RESPONSES if name in columns)
    if response == 'angle':
        return 'arm', response, drive, None
    load = None
    if response != 'force':
        load = next((name for name in LOADS if name in columns), None)
    return 'bench', response, drive, load


def missing_columns(columns: Collection[str]) -> list[str]:
    """
    Return what a table lacks to be a measurement, one clause each.

    Parameters
    ----------
    columns : collection of str
        Their meanings.

    Returns
    -------
    list of str

    """
    found = []
    for names, role in ((DRIVES, 'drive'), (RESPONSES, 'response')):
        if not any(name in columns for name in names):
            found.append(f'no column with the {role} ({", ".join(names)}); '
                         + meant_by(names, columns))
    if 'angle' in columns and 'time' not in columns and 'step' not in columns:
        found.append(f"an arm run needs a column 'time' in s{suggestion('time', columns)}")
    return found


def meant_by(names: Sequence[str], columns: Collection[str]) -> str:
    """Say which column probably is one of some names, or which columns there are."""
    unknown = [name for name in columns if not is_known(name)]
    close = [(name, closest(name, unknown)) for name in names if closest(name, unknown)]
    if close:
        name, column = close[0]
        return (f'is {column!r} meant to be {name!r}? Rename it, or give '
                f'--columns {name}={column}')
    return (f'the columns are {short_list(columns)}; say which with '
            f'--columns {names[0]}=COLUMN')


def time_of_trials(time: np.ndarray, trial: np.ndarray) -> tuple[np.ndarray, str]:
    """
    Return the time counted from the start of each trial, and what was changed for that.

    Clocks of instruments run on from one trial to the next, and count from a day of their own. The
    first row of a trial comes after what passed since the row before, but not after more than
    rows are usually apart: what the muscle did between two trials is not known. Nor is what it did
    before the first, where the clock runs on from that to the next.

    Parameters
    ----------
    time, trial : ndarray, shape (rows,)

    Returns
    -------
    ndarray, shape (rows,)
    str
        '' if nothing was.

    """
    begins = np.flatnonzero(np.append(True, np.diff(trial) != 0))
    gaps = np.diff(time)
    between, within = gaps[begins[1:] - 1], np.delete(gaps, begins[1:] - 1)
    runs_on = len(between) > 0 and len(within) > 0 and bool(
        np.all(between > 0.0) and np.all(within >= 0.0))
    far = bool(time[0] > CALENDAR)
    if not (runs_on or far and len(begins) == 1):
        return time, ''
    first = np.zeros(1)
    if runs_on:
        first = np.minimum(np.append(0.0 if far else time[0], between), np.median(within))
    rows = np.diff(np.append(begins, len(time)))
    return time - np.repeat(time[begins] - first, rows), (
        'time runs on from trial to trial; it is counted from the start of each' if runs_on
        else f'time begins at {time[0]:.9g} s; it is counted from there')


def order_problems(measurement: Measurement) -> list[str]:
    """
    Return where the order of the rows contradicts their trials, times or steps.

    A trial that is torn apart, time that goes backwards or a step that comes twice would each make
    the memory of the muscle a guess.
    """
    found = []
    trials = measurement.trials
    if len(np.unique(trials)) < len(trials):
        again = next(t for n, t in enumerate(trials) if t in trials[:n])
        found.append(f'the rows of trial {again:g} are not together; sort the file by trial, or '
                     'number the second part as a trial of its own')
    same = np.diff(measurement.columns['trial']) == 0
    for name in ('time', 'step'):
        if name not in measurement.columns or (name == 'step' and measurement.time is not None):
            continue
        values = measurement.columns[name]
        bad = np.flatnonzero(same & (np.diff(values) < 0 if name == 'time'
                                     else np.diff(values) <= 0))
        if not bad.size:
            continue
        row = int(bad[0])
        what = 'goes backwards' if values[row + 1] < values[row] else 'is repeated'
        found.append(
            f'{name} {what} from row {row} ({values[row]:.9g}) to row '
            f'{row + 1} ({values[row + 1]:.9g}) in trial {measurement.columns["trial"][row]:g}; '
            'give every heat-and-cool cycle a trial of its own, and remove rows written twice')
    return found


def name_warnings(measurement: Measurement) -> tuple[str, ...]:
    """
    Return unknown columns whose names are almost known ones, one line each.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    tuple of str

    """
    absent = [name for name in (*QUANTITIES, 'trial', 'step') if name not in measurement.columns]
    found = []
    for name in measurement.columns:
        if not is_known(name) and not name.startswith(('predicted_', 'reference_')):
            meant = closest(name, absent, 0.8) or _begins_as(name, absent)
            if meant:
                found.append(f'{measurement.source}: column {name!r} is not used; '
                             f'is {meant!r} meant? Rename it')
    return tuple(found)


def _begins_as(name: str, known: Iterable[str]) -> str | None:
    """Return the name of several words of which this one has the first, as in `supply`."""
    first = name.lower().split('_')[0]
    return next((one for one in known if one.startswith(f'{first}_')), None)


def is_known(name: str) -> bool:
    """Tell whether a column's meaning is fixed by the file format."""
    return name in QUANTITIES or name in ('trial', 'step')


def trial_list(trials: Iterable[float]) -> str:
    """Return identifiers of trials for a message."""
    return ', '.join(f'{trial:g}' for trial in list(trials)[:20])


def wrap_warnings(measurement: Measurement) -> tuple[str, ...]:
    """
    Return where the angle of an arm first jumps by a turn, one line or none.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    tuple of str

    """
    if measurement.response != 'angle':
        return ()
    steps = np.diff(measurement.columns['angle'])
    within = np.diff(measurement.columns['trial']) == 0
    rows = np.flatnonzero(within & (np.abs(np.abs(steps) - TURN) < ALMOST * TURN))
    if not len(rows):
        return ()
    return (f'{measurement.source}: angle jumps by a turn from row {rows[0]} to row {rows[0] + 1}'
            f'{f", and {len(rows) - 1} times more" if len(rows) > 1 else ""}: an encoder that '
            'wraps? Unwrap it trial by trial (numpy.unwrap)',)
