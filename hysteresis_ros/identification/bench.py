# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
From bench tables to a model of the muscle (Sec. IV-B of the paper).

H1 is fitted to the force table, ``z = F - H1[V]`` is formed for the length table (Eq. 10 as it has
to be: z is the input, the measured length the target), and H2 is fitted to it. Every trial starts
from the cold state after a full heat and cool cycle, so before its first row the cold drive is
applied to a saturated memory.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros import __version__
from hysteresis_ros.effects.electrical import ELECTRIC_DRIVES
from hysteresis_ros.errors import IdentificationError, ParameterError
from hysteresis_ros.identification.baselines import fit_linear
from hysteresis_ros.identification.bench_metrics import (
    drive_slope, left_out, measure, rows_left_out)
from hysteresis_ros.identification.first_stage import first_stage_from_lengths
from hysteresis_ros.identification.least_squares import WeightFit
from hysteresis_ros.identification.operators import fit_operator
from hysteresis_ros.identification.trials import choose_trials, fitted_rows
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.result import Brief, Result
from hysteresis_ros.workers import one_blas_thread

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.operators import HysteresisOperator

LEVELS = (10, 20)
# Of one operator; its least squares take memory with the fourth power, 0.2 GB for as many.
MOST_LEVELS = 100
OPERATORS = ('two-stage', 'preisach', 'play', 'bouc-wen', 'linear')


@dataclasses.dataclass(repr=False)
class Identified(Result):
    """
    A model with the fits that it came from.

    Attributes
    ----------
    model : MuscleModel
        Operators, linear model, ranges, metrics.
    force_fit, length_fit : WeightFit or None
        Results of the least squares, with rank, cells never excited and intervals; None where the
        stage has no weights or was not identified.
    force, length : Measurement or None
        The bench tables, with the rows that verify.
    """

    model: MuscleModel
    force_fit: WeightFit | None
    length_fit: WeightFit | None
    force: Measurement | None = None
    length: Measurement | None = None

    def to_dict(self) -> dict:
        """Return plain types for JSON: kind, metrics and effects of the model."""
        return {'kind': self.model.kind, 'metrics': self.model.metrics,
                'effects': [effect.to_dict() for effect in self.model.effects]}

    def brief(self) -> Brief:
        """Return what was identified, with the mean errors as in Table I."""
        rows = [[f'{name}, {part}', *(
            '-' if values[of]['mean_percent'] is None else f'{values[of]["mean_percent"]:.2f} %'
            for of in ('model', 'linear')), str(values['rows'])]
            for name, entry in self.model.metrics.items() for part, values in entry.items()
            if isinstance(values, dict) and 'model' in values]
        effects = ' + '.join(['', *(effect.id for effect in self.model.effects)])
        lines = [f'Identified: {self.model.kind}{effects}, {self.model.response} of '
                 f'{self.model.drive}']
        lines += [f'{row[0]}: mean error {row[1]} (linear {row[2]}), {row[3]} rows'
                  for row in rows]
        return Brief(lines, ['mean error', 'model', 'linear', 'rows'], rows)

    def plot(self, table: str | None = None) -> 'Figure':
        """
        Draw the loops of a bench table, measured and predicted, and the residual on them.

        Parameters
        ----------
        table : {'length', 'force'}, optional
            Default: the length table, else the force table.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ParameterError
            If there is no such table.

        """
        from hysteresis_ros.comparison.compare import compare
        tables = {name: measurement for name, measurement in (
            ('length', self.length), ('force', self.force)) if measurement is not None}
        name = table or next(iter(tables), 'length')
        if name not in tables:
            raise ParameterError(f'no {name} table was identified; there is '
                                 f'{" and ".join(tables) or "none"}')
        return compare(self.model, [tables[name]]).plot('loop')


@dataclasses.dataclass(frozen=True)
class Recipe:
    """
    How each stage is fitted.

    Parameters
    ----------
    kind : str
        Kind of operator, see `fit_operator`.
    anchored : bool
        Whether the known cold state is met exactly.
    plain : bool
        Whether to do no more than the paper: cells only, no regularisation, grid as the data.
    """

    kind: str
    anchored: bool
    plain: bool

    def fit(self, parts: Sequence[np.ndarray], target: np.ndarray, groups: np.ndarray, levels: int,
            anchor: tuple[float, float], placed: bool,
            fitted: np.ndarray | None = None) -> tuple[HysteresisOperator, WeightFit | None]:
        """Return operator and fit; the parameters are those of `fit_operator`."""
        options = {'strength': 0.0, 'reversible': False} if self.plain else {'placed': placed}
        return fit_operator(self.kind, parts, target, groups, levels,
                            anchor=anchor if self.anchored else None, fitted=fitted, **options)


@one_blas_thread()
def identify(length: Measurement | None = None, force: Measurement | None = None, *,
             force_trials: Sequence[float] | None = None,
             length_trials: Sequence[float] | None = None, geometry: BicepGeometry | None = None,
             levels: Sequence[int] = LEVELS, operator: str | None = None, anchored: bool = False,
             plain: bool = False, length_rows: np.ndarray | None = None) -> Identified:
    """
    Identify the muscle from bench tables.

    Parameters
    ----------
    length : Measurement, optional
        Drive, load where there is one, and length or strain.
    force : Measurement, optional
        Drive and force at resting length.
    force_trials, length_trials : sequence of numbers, optional
        Trials to fit; the others verify. Default: all are fitted.
    geometry : BicepGeometry, optional
        The arm, kept in the model.
    levels : (int, int)
        N1 and N2.
    operator : {'two-stage', 'preisach', 'play', 'bouc-wen', 'linear'}, optional
        'preisach' is one operator of the drive; the others are the two-stage cascade made of such
        operators. Default 'two-stage' with a force table, 'preisach' without a load; with a load
        but without a force table what predicts trials better that were held out.
    anchored : bool
        Whether H1(0) is tied to the first force of the cold muscle and H2(0) to zero.
    plain : bool
        Whether to identify as the paper does: weights of the cells only, without regularisation.
    length_rows : ndarray of bool, shape (rows,), optional
        Rows of the length table to fit, of one trial that is held out by pieces: the memory is
        carried through the others. Default: all rows of the trials to fit.

    Returns
    -------
    Identified

    Raises
    ------
    IdentificationError
        If the tables do not suffice or do not fit together.
    """
    some = length if length is not None else force
    if some is None:
        raise IdentificationError('nothing to identify; give a length table, a force table or both')
    loaded = length is not None and length.load is not None
    if operator is None and length is not None and loaded and force is None:
        options = {'length_trials': length_trials, 'geometry': geometry, 'levels': levels,
                   'anchored': anchored, 'plain': plain}
        return _better_of(length, ('two-stage', 'preisach'), options)
    operator = operator or ('two-stage' if loaded or length is None else 'preisach')
    if operator not in OPERATORS:
        raise IdentificationError(
            f'no operator {operator!r}; there are {", ".join(OPERATORS)}')
    if force is not None and length is not None and force.drive != length.drive:
        raise IdentificationError(f'the force table is driven by {force.drive}, the length table '
                                  f'by {length.drive}; they have to be of one muscle')
    if len(levels) != 2 or not 1 <= min(levels) <= max(levels) <= MOST_LEVELS:
        raise IdentificationError(
            f'levels must be two numbers from 1 to {MOST_LEVELS}, not {levels}')
    kind = 'preisach' if operator in ('two-stage', 'preisach') else operator
    recipe = Recipe(kind, anchored, plain)
    model = MuscleModel(
        'preisach' if operator == 'preisach' else 'two-stage', some.drive,
        None if length is None else length.load, 'force' if length is None else length.response,
        None, geometry=geometry)
    _set_ranges(model, length, force)
    force_fit = length_fit = None
    if force is not None:
        rows = choose_trials(force, force_trials, 'force')
        model.force_stage, force_fit = _force_stage(model, force, rows, levels[0], recipe)
    if length is not None:
        rows = choose_trials(length, length_trials, 'length')
        if operator == 'preisach' or not loaded:
            length_fit = _drive_stage(model, length, rows, levels[1], recipe, length_rows)
        else:
            if model.force_stage is None:
                model.force_stage = _first_stage_from_lengths(model, length, rows, levels[0])
            length_fit = _length_stage(model, length, rows, levels[1], recipe, length_rows)
    model.linear = fit_linear(
        length and length.where(fitted_rows(length, length_trials, length_rows)),
        force and force.where(choose_trials(force, force_trials, 'force')))
    slope = None if length is None else drive_slope(model, length)
    model.metrics = measure(model, force, force_trials, length, length_trials, slope)
    if length is not None and length_fit is not None:
        rows = fitted_rows(length, length_trials, length_rows)
        fitted = length.where(rows)
        load = fitted.column(fitted.load) if fitted.load else None
        trial = fitted.column('trial')
        model.metrics['length'].update({
            **left_out(length_fit, fitted.column(fitted.response), trial, load,
                       None if slope is None else slope[rows]),
            **rows_left_out(length_fit, trial, load)})
    model.provenance = _provenance(force, force_trials, length, length_trials)
    return Identified(model, force_fit, length_fit, force, length)


def _better_of(length: Measurement, operators: Sequence[str],
               options: Mapping[str, Any]) -> Identified:
    """Identify with each operator and return what is best on held-out trials."""
    found: list[Identified] = []
    problems = []
    for operator in operators:
        try:
            found.append(identify(length, operator=operator, **options))
        except IdentificationError as error:
            problems.append(error)
    if not found:
        raise problems[-1]

    def held_out(one: Identified) -> float:
        # The paper's plain problem holds nothing out.
        fit = one.length_fit
        if fit is None:
            return np.inf
        return fit.held_out_rmse if len(fit.validation) else fit.rmse
    return min(found, key=held_out)


def _set_ranges(model: MuscleModel, length: Measurement | None, force: Measurement | None) -> None:
    for measurement in (force, length):
        if measurement is None:
            continue
        for name in (measurement.drive, measurement.load, measurement.response,
                     'ambient_temperature'):
            if name is None or name not in measurement.columns:
                continue
            values = measurement.column(name)
            low, high = model.ranges.get(name, (np.inf, -np.inf))
            model.ranges[name] = (float(min(low, values.min())), float(max(high, values.max())))
    if model.load_name is not None and length is not None:
        model.mean_load = float(np.mean(length.column(model.load_name)))


def _parts(measurement: Measurement, rows: np.ndarray) -> list[tuple[float, slice]]:
    """Slices of the chosen trials, in the order of the file."""
    return [(trial, part) for trial, part in measurement.split() if rows[part.start]]


def _force_stage(model: MuscleModel, force: Measurement, rows: np.ndarray, levels: int,
                 recipe: Recipe) -> tuple[HysteresisOperator, WeightFit | None]:
    """Fit H1 to force against drive."""
    drive, target = force.column(model.drive), force.column('force')
    parts = [np.concatenate(([model.cold_drive], drive[part])) for _, part in _parts(force, rows)]
    return recipe.fit(parts, target[rows], force.column('trial')[rows], levels,
                      (model.cold_drive, float(target[rows][0])), placed=False)


def _second_inputs(model: MuscleModel, length: Measurement, rows: np.ndarray) -> list[np.ndarray]:
    """Return the inputs of H2 for each trial, the cold one first."""
    drive = length.column(model.drive)
    load = length.column(model.load_name) if model.load_name else np.zeros(len(drive))
    parts = []
    for _, part in _parts(length, rows):
        x = drive[part]
        cold = model.cold_drive
        if model.force_stage is not None:
            model.force_stage.reset()
            cold = model.force_stage.step(cold)
            x = model.force_stage.simulate(x)
            parts.append(np.concatenate(([load[part][0] - cold], load[part] - x)))
        else:
            parts.append(model.sign * np.concatenate(([cold], x)))
    return parts


def _length_stage(model: MuscleModel, length: Measurement, rows: np.ndarray, levels: int,
                  recipe: Recipe, some: np.ndarray | None) -> WeightFit | None:
    """Fit H2 to length against F - H1[V]."""
    model.length_stage, fit = recipe.fit(
        _second_inputs(model, length, rows), length.column(model.response)[rows],
        length.column('trial')[rows], levels, (0.0, 0.0),
        # The range of a drive is given; that of F - H1[V] is whatever the loads made it.
        placed=model.force_stage is not None, fitted=None if some is None else some[rows])
    return fit


def _drive_stage(model: MuscleModel, length: Measurement, rows: np.ndarray, levels: int,
                 recipe: Recipe, some: np.ndarray | None) -> WeightFit | None:
    """Fit one operator of the drive, of the sign that fits better."""
    results = []
    for sign in (-1, 1):
        model.sign = sign
        fit = _length_stage(model, length, rows, levels, recipe, some)
        residual = model.predict(length) - length.column(model.response)
        rmse = float(np.sqrt(np.mean(residual[rows if some is None else rows & some] ** 2)))
        results.append((rmse, sign, model.length_stage, fit))
    _, model.sign, model.length_stage, fit = min(results, key=lambda result: result[0])
    return fit


def _first_stage_from_lengths(model: MuscleModel, length: Measurement, rows: np.ndarray,
                              levels: int) -> HysteresisOperator:
    """Find H1 without a force table, from the shift of the loops between loads."""
    def columns(name: str) -> list[np.ndarray]:
        values = length.column(name)
        return [values[part] for _, part in _parts(length, rows)]
    return first_stage_from_lengths(
        columns(model.drive), columns(model.load_name or 'force'), columns(model.response),
        model.cold_drive, levels, squared=model.drive in ELECTRIC_DRIVES)


def _provenance(force: Measurement | None, force_trials: Sequence[float] | None,
                length: Measurement | None,
                length_trials: Sequence[float] | None) -> dict[str, Any]:
    entries: dict[str, Any] = {'hysteresis_ros': __version__, 'numpy': np.__version__}
    for name, measurement, trials in (('force', force, force_trials),
                                      ('length', length, length_trials)):
        if measurement is not None:
            rows = choose_trials(measurement, trials, name)
            entries[name] = {
                'source': str(measurement.source).rsplit('/', 1)[-1],
                'sha256': measurement.digest,
                'trials': sorted({float(t) for t in measurement.column('trial')[rows]})}
    if length is not None and length.load is not None:
        # The force table may share its unit, so that the range of the load would say nothing.
        rows, load = choose_trials(length, length_trials, 'length'), length.column(length.load)
        entries['length']['loads'] = [
            float(np.mean(load[part])) for _, part in _parts(length, rows)]
    return entries
