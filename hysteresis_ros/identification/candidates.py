# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The models that are compared with each other: how each is fitted, and what it is given."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.identification.baselines import fit_additive, fit_embedded_line, fit_linear
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.operators import (
    Additive, BoucWen, Cascade, HysteresisOperator, Linear, PrandtlIshlinskii, Preisach)

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement

# Levels of the Preisach operators, of H2 or of the one of the drive; H1 has half as many.
LEVELS = (5, 10, 20)
# Numbers of plays.
PLAYS = (5, 20)
# The line is not kept to the inputs that were fitted: this many ranges of the drive either side.
BEYOND = 10.0


@dataclasses.dataclass(frozen=True)
class Fold:
    """
    What one fit is given.

    Attributes
    ----------
    length : Measurement
    force : Measurement or None
        Tables to fit.
    fitted : ndarray of bool, shape (rows,), or None
        Rows of the length table to fit; None for all.
    """

    length: Measurement
    force: Measurement | None
    fitted: np.ndarray | None


@dataclasses.dataclass(frozen=True)
class FittedModel:
    """
    A model that takes the columns of a table.

    Attributes
    ----------
    operator : Cascade or Additive
    cold : float
        Drive of the cold state.
    sign : int
        The drive is multiplied by it; -1 where the response falls with the drive and there is no
        coupled input.
    load : str or None
        Column of the coupled input.
    """

    operator: Cascade | Additive
    cold: float
    sign: int
    load: str | None

    @property
    def parameters(self) -> int:
        """Numbers that the model stores."""
        return sum(map(parameters_of, self.operator.stages))


@dataclasses.dataclass(frozen=True)
class Candidate:
    """
    A model by name, and how it is fitted: ``fit(fold)`` returns a `FittedModel`.

    `options` are those of `hysteresis identify` that identify it, '' if there are none.
    """

    name: str
    fit: Callable
    options: str = ''


def parameters_of(operator: HysteresisOperator) -> int:
    """Return how many numbers were fitted into an operator; grids and ranges do not count."""
    if isinstance(operator, Preisach):
        reversible = len(operator.reversible) if np.any(operator.reversible) else 0
        return len(operator.weights) + reversible + 1
    if isinstance(operator, PrandtlIshlinskii):
        return len(operator.weights) + len(operator.bends) + 1
    if isinstance(operator, BoucWen):
        return 6 + len(operator.curve.bends)
    return 2


def inputs_of(model: FittedModel, table: Measurement) -> list:
    """Return what a model is given in each trial, the cold state first, (1 + rows, stages)."""
    drive = table.column(table.drive)
    parts = []
    for _, part in table.split():
        columns = [model.sign * np.append(model.cold, drive[part])]
        if model.load is not None:
            load = table.column(model.load)[part]
            columns.append(np.append(load[0], load))
        parts.append(np.column_stack(columns))
    return parts


def candidates(length: Measurement, force: Measurement | None,
               by_trial: bool) -> tuple[list, dict]:
    """
    Return the models that tables allow, and why others are left out.

    Parameters
    ----------
    length, force : Measurement or None
    by_trial : bool
        Whether whole trials are held out; else pieces of one.

    Returns
    -------
    list of Candidate, dict of str to str
    """
    names = [('preisach', f'Preisach N = {levels}', levels) for levels in LEVELS]
    names += [('play', f'Prandtl-Ishlinskii, {plays} plays', plays) for plays in PLAYS]
    names += [('bouc-wen', 'Bouc-Wen', LEVELS[0])]
    found = [Candidate('line', _line, '--operator linear')]
    left_out: dict[str, str] = {}
    found += [Candidate(name, functools.partial(_of_the_drive, kind, levels), (
        f'--operator {kind} --levels {levels} {levels}' if length.load is None else ''))
              for kind, name, levels in names]
    if length.load is None:
        return found, left_out
    if force is None and not by_trial:
        left_out['two-stage models'] = ('one trial shows H1 only with a force table; give --force '
                                        'or more trials')
        return found, left_out
    found += [Candidate(
        f'two-stage {name}', functools.partial(_two_stage, kind, levels),
        f'--operator {"two-stage" if kind == "preisach" else kind} '
        f'--levels {max(1, levels // 2)} {levels}') for kind, name, levels in names]
    found.append(Candidate('embedded line, N = 20', _embedded_line))
    if by_trial:
        found.append(Candidate('additive, N = 20', _additive))
    else:
        left_out['additive, N = 20'] = 'it needs lengths under two loads or more'
    return found, left_out


def _model(operator: Cascade | Additive, length: Measurement, sign: int = 1,
           load: str | None = None) -> FittedModel:
    cold = 0.0 if length.drive != 'temperature' else float(length.column(length.drive).min())
    return FittedModel(operator, cold, sign, load)


def _line(fold: Fold) -> FittedModel:
    length = fold.length if fold.fitted is None else fold.length.where(fold.fitted)
    line = fit_linear(length, fold.force if length.load is not None else None)
    drive = fold.length.column(fold.length.drive)
    reach = BEYOND * (np.ptp(drive) or 1.0)
    first = Linear(line.k1, line.F0, drive.min() - reach, drive.max() + reach)
    if length.load is None:
        return _model(Cascade([Linear(-line.k1 * line.k2, -line.F0 * line.k2, first.lower,
                                      first.upper)]), fold.length)
    low, high = first.output_range
    load = fold.length.column(length.load)
    second = Linear(line.k2, 0.0, BEYOND * -np.max(np.abs(load)) - high,
                    BEYOND * np.max(np.abs(load)) - low)
    return _model(Cascade([first, second]), fold.length, load=length.load)


def _of_the_drive(kind: str, levels: int, fold: Fold) -> FittedModel:
    """Fit one operator of the drive, which does not know the load."""
    table = fold.length
    if table.load is not None:
        columns = {name: values for name, values in table.columns.items() if name != table.load}
        table = type(table).from_columns(columns, source=table.source)
    found = identify(table, operator=kind, levels=(levels, levels), length_rows=fold.fitted).model
    return FittedModel(Cascade([found.require_length_stage()]), found.cold_drive, found.sign, None)


def _two_stage(kind: str, levels: int, fold: Fold) -> FittedModel:
    """Fit both stages of one kind; H1 has half as many levels."""
    found = identify(
        fold.length, fold.force, operator='two-stage' if kind == 'preisach' else kind,
        levels=(max(1, levels // 2), levels), length_rows=fold.fitted).model
    stages = [stage for stage in (found.force_stage, found.length_stage) if stage is not None]
    return FittedModel(Cascade(stages), found.cold_drive, 1, fold.length.load)


def _embedded_line(fold: Fold) -> FittedModel:
    operator, _ = fit_embedded_line(fold.length, fold.force, fitted=fold.fitted)
    return _model(operator, fold.length, load=fold.length.load)


def _additive(fold: Fold) -> FittedModel:
    return _model(fit_additive(fold.length)[0], fold.length, load=fold.length.load)
