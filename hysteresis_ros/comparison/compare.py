# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Model against measurement: errors, what each added effect did to them, where it fails."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
import os
from typing import Any, TYPE_CHECKING

from hysteresis_ros.measurements.metrics import Errors, errors, finite, Floor, noise_floor
from hysteresis_ros.comparison.signals import signals_of, varies
from hysteresis_ros.comparison.where import blocks_of, number, regions
from hysteresis_ros.errors import MeasurementError, ParameterError
from hysteresis_ros.measurements.holds import hold_ends, mean_of_windows
from hysteresis_ros.measurements.quantities import QUANTITIES, shown
from hysteresis_ros.result import Brief, Result
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

FAR_OUTSIDE = 30.0
"""A recording that exceeds the identified range by this factor is probably in another unit."""


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """
    A model and what was measured, over all rows of all recordings.

    Attributes
    ----------
    quantity, unit : str
        What was measured, and its unit.
    name : str
        What the model is: `two-stage`, `preisach`, ..., with the effects added to it.
    model : Errors
        Of the model with all its effects.
    linear : Errors or None
        Of the linear model, if there is one.
    extensions : list of (str, Errors)
        The model without effects first, then with each effect added, the full one last; empty
        for a model without effects.
    settled : dict
        For a continuous run with holds: `rows`, `model` and `linear` at the ends of the holds.
    by_trial : list of dict
        `source`, `trial`, `rows`, `model` and `linear` errors; percentages of the whole range.
    where : list of Region
        Worst first.
    floor : Floor
        RMSE of the noise of the recording alone; no model has less.
    warnings : list of str
        What looked wrong in the recordings.
    measured, predicted, linear_predicted : ndarray of float64, shape (rows,)
        In the unit above; the last one None without a linear model.
    trial : ndarray of int, shape (rows,)
        Trials of all recordings, counted from 0.
    time : ndarray of float64, shape (rows,), or None
        Time since the first recording began, the recordings one after the other.
    drive, load : str, str or None
        Names of the signals.
    signals : dict of str to ndarray, shape (rows,)
        Those that every recording has.
    continuous : bool
        Whether any recording is.
    sources : list of str
        Files and folders.

    """

    quantity: str
    unit: str
    name: str
    model: Errors
    linear: Errors | None
    extensions: list
    settled: dict
    by_trial: list
    where: list
    floor: Floor
    warnings: list
    measured: np.ndarray = field(repr=False)
    predicted: np.ndarray = field(repr=False)
    linear_predicted: np.ndarray | None = field(repr=False)
    trial: np.ndarray = field(repr=False)
    time: np.ndarray | None = field(repr=False)
    drive: str
    load: str | None
    signals: dict = field(repr=False)
    continuous: bool
    sources: list

    @property
    def rows(self) -> int:
        """Number of rows compared."""
        return len(self.measured)

    @property
    def residual(self) -> np.ndarray:
        """Measured less predicted, ndarray of float64 (rows,)."""
        return self.measured - self.predicted

    def to_dict(self) -> dict[str, Any]:
        """
        Return the comparison as plain types, without the rows themselves.

        Returns
        -------
        dict

        """
        def named(values: Errors | None) -> dict[str, float | None] | None:
            return None if values is None else values.to_dict()

        return {
            'rows': self.rows, 'quantity': self.quantity, 'unit': self.unit,
            'model': self.model.to_dict(), 'linear': named(self.linear),
            'by_trial': [{**entry, 'model': entry['model'].to_dict(),
                          'linear': named(entry['linear'])} for entry in self.by_trial],
            'where': [region.to_dict() for region in self.where],
            'name': self.name, 'continuous': self.continuous,
            'extensions': [{'name': name, **values.to_dict()}
                           for name, values in self.extensions],
            'settled': {key: value if key == 'rows' else named(value)
                        for key, value in self.settled.items()} or None,
            'noise_floor': {'rmse': finite(self.floor.value), 'origin': self.floor.origin},
            'warnings': list(self.warnings), 'sources': list(self.sources)}

    def brief(self) -> Brief:
        """Return the RMSE and where the model fails most, with the table of errors."""
        unit, scale = shown(self.quantity)
        others = [f'noise floor {number(scale * self.floor.value)} {unit}']
        if self.linear is not None:
            others.insert(0, f'linear {number(scale * self.linear.rmse)} {unit}')
        lines = [f'Comparison of {self.name}: {self.quantity}, {self.rows} rows of '
                 + self._trials_in_words(),
                 f'RMSE {number(scale * self.model.rmse)} {unit} ({", ".join(others)})']
        lines += [f'where: {region.text}' for region in self.where[:1]]
        return Brief(lines, *self.table())

    def plot(self, name: str = 'overlay') -> 'Figure':
        """
        Draw one of the comparison's pictures.

        Parameters
        ----------
        name : str
            `overlay` (measured and predicted, and the residual below), `signals` (the residual
            against every signal), `loop`, `coverage`, and where there is what they need
            `waterfall`, `plane`, `since_step`, `correlogram`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ParameterError
            If there is no such picture of this comparison.

        """
        from hysteresis_ros.report.plots import figures
        drawn = figures(self)
        if name not in drawn:
            raise ParameterError(f'no picture {name!r} of this comparison; there are '
                                 f'{", ".join(drawn)}')
        return drawn[name]

    def table(self) -> tuple[list[str], list[list[str]]]:
        """
        Return the rows of the table of errors.

        Returns
        -------
        header : list of str
        rows : list of list of str

        """
        unit, scale = shown(self.quantity)
        header = ['model', f'mean |e| [{unit}]', f'std [{unit}]', f'RMSE [{unit}]',
                  'mean [%]', 'std [%]']

        def row(name: str, values: Errors) -> list[str]:
            return [name] + [number(scale * value) for value in values[:3]] + [
                f'{value:.2f}' if np.isfinite(value) else '-' for value in values[3:]]

        rows = [] if self.linear is None else [row('linear', self.linear)]
        rows += [row(name, values) for name, values in self.extensions or
                 [(self.name, self.model)]]
        rows.append([f'noise floor ({self.floor.origin})', '', '',
                     number(scale * self.floor.value), '', ''])
        if self.settled:
            ends = f'{self.settled["rows"]} ends of holds'
            if self.settled['linear'] is not None:
                rows.append(row(f'linear, {ends}', self.settled['linear']))
            rows.append(row(f'{self.name}, {ends}', self.settled['model']))
        return header, rows

    def _trials_in_words(self) -> str:
        count = len(self.by_trial)
        return f'{count} trial' if count == 1 else f'{count} trials'

    def to_text(self) -> str:
        """Return the table and where the model fails, for a terminal."""
        header, rows = self.table()
        what = 'continuous run' if self.continuous else 'settled states'
        lines = [f'{self.quantity}: {self.rows} rows of {self._trials_in_words()}, {what}, from '
                 f'{", ".join(os.path.basename(os.path.normpath(s)) for s in self.sources)}', '']
        lines += layout([header, *rows])
        unit, scale = shown(self.quantity)
        worst = sorted(self.by_trial, key=lambda entry: -entry['model'].rmse)[:3]
        if len(self.by_trial) > 1:
            lines += ['', 'Worst trials: ' + ', '.join(
                f'{entry["trial"]:g} ({number(scale * entry["model"].rmse)} {unit} RMS)'
                for entry in worst)]
        lines += ['', 'Where it fails:' if self.where else
                  'No region stands out: the error is much the same everywhere.']
        lines += [f'  {n}. {region.text}' for n, region in enumerate(self.where, 1)]
        return '\n'.join(lines)


def layout(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of cells as lines: the first column to the left, the others to the right."""
    widths = [max(len(row[n]) for row in rows) for n in range(len(rows[0]))]
    return ['  '.join(cell.ljust(width) if n == 0 else cell.rjust(width)
                      for n, (cell, width) in enumerate(zip(row, widths))).rstrip()
            for row in rows]


def compare(model: MuscleModel, measurements: Iterable[Measurement],
            progress: Callable[[str], None] | None = None) -> Comparison:
    """
    Compare a model with recordings, on the response simulated from the inputs alone.

    Parameters
    ----------
    model : MuscleModel
        With effects or without.
    measurements : list of Measurement
        Of one quantity.
    progress : callable, optional
        Called with a word before each part of the work.

    Returns
    -------
    Comparison

    Raises
    ------
    MeasurementError
        If there are no measurements, or of several quantities.
    ParameterError
        If the model lacks what this kind of measurement needs.

    """
    measurements = list(measurements)
    progress = progress or (lambda word: None)
    check_alike(measurements)
    first = measurements[0]
    measured = np.concatenate([m.column(m.response) for m in measurements])
    predictions = []
    for name, stage in ladder(model):
        progress(name)
        predictions.append((name, [stage.predict(m, method='preisach') for m in measurements]))
    linear = None
    if model.linear is not None:
        progress('linear')
        linear = [model.predict(m, method='linear') for m in measurements]
    progress('where it fails')
    span = float(np.ptp(measured))
    of_rows = [(name, np.concatenate(parts)) for name, parts in predictions]
    predicted = of_rows[-1][1]
    linear_predicted = None if linear is None else np.concatenate(linear)
    signals = common_signals(model, measurements, predictions[-1][1])
    trial = trial_numbers(measurements)
    residual = measured - predicted
    block = blocks_of(residual, trial)
    of_trials = {}
    if trial[-1] > 0 and len(measurements) == 1:
        of_trials = {'trial': first.column('trial')}
    elif trial[-1] > 0:
        of_trials = {'trial_number': trial.astype(float)}
    return Comparison(
        quantity=first.response, unit=QUANTITIES[first.response].unit, name=of_rows[-1][0],
        model=errors(residual, span),
        linear=None if linear is None else errors(measured - linear_predicted, span),
        extensions=[(name, errors(measured - values, span)) for name, values in of_rows]
        if len(of_rows) > 1 else [],
        settled=at_ends_of_holds(measurements, predictions[-1][1], linear, span),
        by_trial=by_trial(measurements, residual,
                          None if linear is None else measured - linear_predicted, trial, span),
        where=regions({**signals, **of_trials}, residual, block, first.response),
        floor=noise_floor(measurements),
        warnings=[note for m in measurements for note in (*m.warnings, *range_notes(model, m))],
        measured=measured, predicted=predicted, linear_predicted=linear_predicted, trial=trial,
        time=running_time(measurements), drive=first.drive, load=first.load, signals=signals,
        continuous=any(not m.settled for m in measurements),
        sources=[m.source for m in measurements])


def check_alike(measurements: Sequence[Measurement]) -> None:
    """Refuse measurements that have no error in common."""
    if not measurements:
        raise MeasurementError('no measurement was given; name CSV files or bag folders')
    for name in ('response', 'drive'):
        kinds = sorted({getattr(m, name) for m in measurements})
        if len(kinds) > 1:
            raise MeasurementError(
                f'the measurements differ in their {name} ({", ".join(kinds)}); compare them one '
                'kind at a time')


def ladder(model: MuscleModel) -> list[tuple[str, MuscleModel]]:
    """
    Return the model at every stage of its extension.

    Parameters
    ----------
    model : MuscleModel

    Returns
    -------
    list of (str, MuscleModel)
        Without the added effects, with each one added, and last the model itself. Effects of a
        bench fit, whose weights belong to them, are in all of them.

    """
    fitted = bench_effects(model.provenance)
    base = [effect for effect in model.effects if effect.id in fitted]
    added = [effect for effect in model.effects if effect.id not in fitted]
    name = ' + '.join([model.kind, *(effect.id for effect in base)])
    stages = [(name, model.with_effects(base) if added else model)]
    for n, effect in enumerate(added, 1):
        chosen = [e for e in model.effects if e in base or e in added[:n]]
        stages.append((f'+ {effect.id}',
                       model if n == len(added) else model.with_effects(chosen)))
    return stages


def bench_effects(provenance: Mapping[str, Any]) -> set[str]:
    """
    Return the effects whose parameters were fitted together with the weights of the bench.

    Parameters
    ----------
    provenance : dict
        Of a model.

    Returns
    -------
    set of str
        Those of every extension up to the last one on a bench table: it refitted the weights
        with all that was there.

    """
    bench = {provenance.get(name, {}).get('sha256') for name in ('length', 'force')} - {None, ''}
    found, so_far = set(), set()
    for extension in provenance.get('extended', ()):
        so_far |= set(extension['effects'])
        if extension.get('kind') == 'bench' or any(
                data.get('sha256') in bench for data in extension.get('data', ())):
            found = set(so_far)
    return found


def common_signals(model: MuscleModel, measurements: Sequence[Measurement],
                   predictions: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Return the signals that every measurement has, put together, dict of ndarray (rows,)."""
    found = [signals_of(m, values, model.geometry) for m, values in zip(measurements, predictions)]
    names = [name for name in found[0] if all(name in signals for signals in found)]
    if len(found) > 1:
        # A signal that is constant in each recording may differ between them.
        names += [name for name in measurements[0].columns if name in QUANTITIES
                  and name not in names and name not in ('time', measurements[0].response)
                  and all(name in m.columns for m in measurements)]
        found = [{**m.columns, **signals} for m, signals in zip(measurements, found)]
    together = {name: np.concatenate([signals[name] for signals in found]) for name in names}
    alone = set(measurements[0].columns) - {measurements[0].drive}
    return {name: values for name, values in together.items()
            if varies(values, name if name in alone else '')}


def trial_numbers(measurements: Sequence[Measurement]) -> np.ndarray:
    """Return the number of each row's trial over all recordings, ndarray of int (rows,)."""
    sizes = [rows.stop - rows.start for m in measurements for _, rows in m.split()]
    return np.repeat(np.arange(len(sizes)), sizes)


def running_time(measurements: Sequence[Measurement]) -> np.ndarray | None:
    """Return the time over all recordings, s, (rows,), None if one of them has none."""
    if any(m.time is None for m in measurements):
        return None
    parts, before = [], 0.0
    for measurement in measurements:
        for _, rows in measurement.split():
            time = measurement.column('time')[rows]
            parts.append(before + time)
            before = float(parts[-1][-1])
    return np.concatenate(parts)


def by_trial(measurements: Sequence[Measurement], residual: np.ndarray,
             linear_residual: np.ndarray | None, trial: np.ndarray,
             span: float) -> list[dict[str, Any]]:
    """Return the errors of each trial, as in `Comparison`."""
    names = [(m.source, number) for m in measurements for number in m.trials]
    entries = []
    for index, (source, name) in enumerate(names):
        inside = trial == index
        entries.append({
            'source': source, 'trial': float(name), 'rows': int(np.sum(inside)),
            'model': errors(residual[inside], span),
            'linear': None if linear_residual is None else errors(linear_residual[inside], span)})
    return entries


def at_ends_of_holds(measurements: Sequence[Measurement], predictions: Sequence[np.ndarray],
                     linear: Sequence[np.ndarray] | None, span: float) -> dict[str, Any]:
    """Return the errors of continuous runs at the ends of their holds, {} if not held."""
    residuals, linear_residuals = [], []
    for n, measurement in enumerate(measurements):
        windows = None if measurement.settled else hold_ends(measurement)
        if windows is None:
            continue
        measured = measurement.column(measurement.response)
        residuals.append(mean_of_windows(measured - predictions[n], windows))
        if linear is not None:
            linear_residuals.append(mean_of_windows(measured - linear[n], windows))
    if not residuals:
        return {}
    residual = np.concatenate(residuals)
    return {'rows': len(residual), 'model': errors(residual, span),
            'linear': errors(np.concatenate(linear_residuals), span) if linear_residuals else None}


def range_notes(model: MuscleModel, measurement: Measurement) -> list[str]:
    """
    Say where a recording leaves the ranges on which the model was identified.

    Parameters
    ----------
    model : MuscleModel
    measurement : Measurement

    Returns
    -------
    list of str

    """
    notes = []
    for name in (measurement.drive, measurement.load):
        if name is None or name not in model.ranges:
            continue
        seen = model.ranges[name]
        values = measurement.column(name)
        low, high = float(values.min()), float(values.max())
        size = max(abs(seen[0]), abs(seen[1]))
        largest = max(abs(low), abs(high))
        unit = QUANTITIES[name].unit
        margin = 0.05 * (seen[1] - seen[0])
        where = (f'{measurement.source}: {name} spans {low:.4g} to {high:.4g} {unit}, the model '
                 f'was identified on {seen[0]:.4g} to {seen[1]:.4g} {unit}')
        if size > 0 and (largest > FAR_OUTSIDE * size or 0 < largest < size / FAR_OUTSIDE):
            notes.append(f'{where}; is one of them in another unit?')
        elif low < seen[0] - margin or high > seen[1] + margin:
            notes.append(f'{where}; beyond it the prediction is an extrapolation')
    return notes
