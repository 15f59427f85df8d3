# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The one table type that every measurement becomes, and the checks that it passes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import difflib
from typing import TYPE_CHECKING

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.quantities import DRIVES, LOADS, QUANTITIES, RESPONSES
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

SETTLED_HOLD = 20.0
"""Rows of a run that are at least this many seconds apart are settled states."""

SECONDS_OF_A_DAY = 86400.0


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
    columns : dict of str to ndarray of float64, each (rows,)
        Every numeric column, in SI units; unknown ones are kept.
    source : str
        File or folder that the rows came from.
    digest : str
        SHA-256 of that file or folder, hexadecimal; '' if the rows came from no file.
    warnings : tuple of str
        What looked wrong when it was read, one line each.

    """

    kind: str
    response: str
    drive: str
    load: str | None
    columns: dict = field(repr=False)
    source: str = 'memory'
    digest: str = ''
    warnings: tuple = ()

    @classmethod
    def from_columns(cls, columns: Mapping[str, ArrayLike], source: str = 'memory',
                     digest: str = '', warnings: Iterable[str] = ()) -> 'Measurement':
        """
        Build a measurement from columns; their names say what it is.

        Parameters
        ----------
        columns : mapping of str to array_like, each (rows,)
            A missing `trial` column means one trial.
        source, digest, warnings
            As the attributes.

        Returns
        -------
        Measurement

        Raises
        ------
        MeasurementError
            If columns are missing, misnamed, of different lengths, empty, or not finite.

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
        for name, values in arrays.items():
            if is_known(name) and not np.all(np.isfinite(values)):
                row = int(np.flatnonzero(~np.isfinite(values))[0])
                raise MeasurementError(
                    f'{source}: row {row}, column {name!r} is {values[row]}; remove the row or '
                    'mend the value')
        measurement = cls(kind, response, drive, load, arrays, str(source), digest)
        check_order(measurement)
        return replace(measurement, warnings=(
            tuple(warnings) + name_warnings(measurement) + unit_warnings(measurement)))

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
        """Whether each row is a settled state: no time, or rows at least 20 s apart."""
        if self.time is None:
            return True
        steps = np.diff(self.time)[np.diff(self.columns['trial']) == 0]
        return bool(steps.size == 0 or steps.min() >= SETTLED_HOLD * (1 - 1e-6))

    def column(self, name: str) -> np.ndarray:
        """
        Return one column.

        Parameters
        ----------
        name : str

        Returns
        -------
        ndarray of float64, (rows,)

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

    def select(self, trials: Iterable[float]) -> 'Measurement':
        """
        Return the rows of some trials.

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

    def where(self, rows: np.ndarray | slice) -> 'Measurement':
        """
        Return some rows.

        Parameters
        ----------
        rows : ndarray of bool (rows,) or of int, or slice

        Returns
        -------
        Measurement

        """
        return replace(self, columns={name: values[rows] for name, values in self.columns.items()})


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
    drive = first_of(DRIVES, columns, 'drive', source)
    response = first_of(RESPONSES, columns, 'response', source)
    if response == 'angle':
        if 'time' not in columns and 'step' not in columns:
            raise MeasurementError(
                f"{source}: an arm run needs a column 'time' in s"
                f'{suggestion("time", columns)}')
        return 'arm', response, drive, None
    load = None
    if response != 'force':
        load = next((name for name in LOADS if name in columns), None)
    return 'bench', response, drive, load


def first_of(names: Sequence[str], columns: Collection[str], role: str, source: str) -> str:
    """Return the first of some names that is a column; MeasurementError if there is none."""
    for name in names:
        if name in columns:
            return name
    unknown = [name for name in columns if not is_known(name)]
    close = [(name, closest(name, unknown)) for name in names if closest(name, unknown)]
    hint = (f'is {close[0][1]!r} meant to be {close[0][0]!r}? Rename it' if close
            else f'the columns are {short_list(columns)}')
    raise MeasurementError(f'{source}: no column with the {role} ({", ".join(names)}); {hint}')


def check_order(measurement: Measurement) -> None:
    """
    Refuse rows whose order contradicts their trials, times or steps.

    Raises
    ------
    MeasurementError
        If a trial is torn apart, time goes backwards or a step comes twice: each would make
        the memory of the muscle a guess.

    """
    trials = measurement.trials
    if len(np.unique(trials)) < len(trials):
        again = next(t for n, t in enumerate(trials) if t in trials[:n])
        raise MeasurementError(
            f'{measurement.source}: the rows of trial {again:g} are not together; sort the file '
            'by trial, or number the second part as a trial of its own')
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
        raise MeasurementError(
            f'{measurement.source}: {name} {what} from row {row} ({values[row]:.9g}) to row '
            f'{row + 1} ({values[row + 1]:.9g}) in trial {measurement.columns["trial"][row]:g}; '
            'give every heat-and-cool cycle a trial of its own, and remove rows written twice')


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
            meant = closest(name, absent, 0.8)
            if meant:
                found.append(f'{measurement.source}: column {name!r} is not used; '
                             f'is {meant!r} meant? Rename it')
    return tuple(found)


def unit_warnings(measurement: Measurement) -> tuple[str, ...]:
    """
    Return what looks wrong by a factor of 1000, one line each.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    tuple of str

    """
    found = []
    for name, quantity in QUANTITIES.items():
        if name == 'time' or name not in measurement.columns:
            continue
        largest = float(np.max(np.abs(measurement.columns[name])))
        unit = quantity.unit or '1'
        meant = None
        if largest > quantity.most:
            meant = quantity.small_unit
        elif 0 < largest < quantity.least:
            meant = quantity.large_unit
        if meant:
            found.append(f'{measurement.source}: {name} reaches {largest:.4g}; is it in {meant}? '
                         f'{unit} is expected')
    if measurement.time is not None:
        for trial, rows in measurement.split():
            span = float(np.ptp(measurement.time[rows]))
            if span > SECONDS_OF_A_DAY:
                found.append(f'{measurement.source}: trial {trial:g} takes {span:.4g} s; is time '
                             'in ms? s is expected')
                break
    return tuple(found)


def is_known(name: str) -> bool:
    """Tell whether a column's meaning is fixed by the file format."""
    return name in QUANTITIES or name in ('trial', 'step')


def closest(name: str, columns: Iterable[str], similarity: float = 0.6) -> str | None:
    """Return the column whose name is most like this one, or None."""
    lowered = {str(column).lower(): column for column in columns}
    matches = difflib.get_close_matches(name.lower(), lowered, 1, similarity)
    return lowered[matches[0]] if matches else None


def suggestion(name: str, columns: Iterable[str]) -> str:
    """Return the end of a message: the column that was probably meant, or what there is."""
    close = closest(name, columns)
    if close:
        return f'; is {close!r} meant? Rename it'
    return f'; the columns are {short_list(columns)}'


def short_list(names: Iterable[str], most: int = 12) -> str:
    """Return names for a message, in quotes, cut off after some."""
    names = [repr(str(name)[:40]) for name in names]
    return ', '.join(names[:most]) + (', ...' if len(names) > most else '')


def trial_list(trials: Iterable[float]) -> str:
    """Return identifiers of trials for a message."""
    return ', '.join(f'{trial:g}' for trial in list(trials)[:20])
