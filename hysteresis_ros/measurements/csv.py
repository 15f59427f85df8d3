# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements and references in CSV files."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
import csv
import hashlib
import io
from pathlib import Path
from typing import TYPE_CHECKING
import warnings

from hysteresis_ros.atomic import AnyPath, replacing
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.columns import Mapped
from hysteresis_ros.measurements.problems import refuse
from hysteresis_ros.measurements.quantities import RESPONSES
from hysteresis_ros.measurements.table import Measurement, MeasurementWarning, missing_columns
from hysteresis_ros.measurements.text_table import read_table
from hysteresis_ros.measurements.unit_checks import unit_problems
from hysteresis_ros.spelling import suggestion
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def read_csv(path: AnyPath, mapping: Collection[Mapped] = ()) -> Measurement:
    """
    Read a CSV file.

    Numeric columns with unknown names are kept, columns of text are left out with a warning.

    Parameters
    ----------
    path : str or Path
    mapping : collection of Mapped
        What columns with names of their own mean, as `parse_columns` gives it.

    Returns
    -------
    Measurement

    Raises
    ------
    MeasurementError
        With the line and the column of all that cannot be read, and values that are impossible in
        their unit, such as millimetres where metres are expected.

    Warns
    -----
    MeasurementWarning
        For what can be read and looks wrong.

    """
    path = Path(path)
    columns, origin, notes = read_table(path, mapping, missing_columns, unit_problems)
    measurement = Measurement.from_columns(columns, str(path), digest(path), notes, origin)
    for note in measurement.warnings:
        warnings.warn(note, MeasurementWarning, stacklevel=2)
    return measurement


def read_reference(path: AnyPath, mapping: Collection[Mapped] = ()) -> dict[str, np.ndarray]:
    """
    Read a table of references: `trial, step` and what the muscle is to do.

    Parameters
    ----------
    path : str or Path
    mapping : collection of Mapped
        As `read_csv`.

    Returns
    -------
    dict of str to ndarray of float64 (rows,)
        Finite in every column whose name means something; `trial` is added if it is missing.

    Raises
    ------
    MeasurementError
        As `read_csv`, and for a table without a response.

    """
    path = Path(path)

    def check(names: Sequence[str]) -> list[str]:
        if any(name in names for name in RESPONSES):
            return []
        return ['a reference needs force, or force and length, or angle'
                + suggestion(RESPONSES[0], names)]

    columns, origin, notes = read_table(path, mapping, check, unit_problems)
    # A single row out of reach is a wish; most of them impossible is another unit.
    usual = {name: float(np.median(np.abs(columns[name]))) for name in RESPONSES
             if name in columns}
    refuse(str(path), unit_problems(usual, origin))
    for note in notes:
        warnings.warn(note, MeasurementWarning, stacklevel=2)
    rows = len(next(iter(columns.values())))
    return columns if 'trial' in columns else {'trial': np.zeros(rows), **columns}


def digest(path: AnyPath) -> str:
    """Return the SHA-256 of a file, or of the files of a folder in the order of their names."""
    path = Path(path)
    found = hashlib.sha256()
    files = [path] if path.is_file() else sorted(p for p in path.rglob('*') if p.is_file())
    for file in files:
        with open(file, 'rb') as stream:
            while block := stream.read(1 << 20):
                found.update(block)
    return found.hexdigest()


def write_csv(measurement: Measurement | Mapping[str, ArrayLike], path: AnyPath) -> None:
    """
    Write a table.

    Parameters
    ----------
    measurement : Measurement or mapping of str to array_like, each shape (rows,)
        Columns in their order; `trial`, `step` and flags are written as whole numbers.
    path : str or Path

    Raises
    ------
    MeasurementError
        If the columns differ in length.
    OSError
        If the file cannot be written.

    """
    columns = measurement.columns if isinstance(measurement, Measurement) else measurement
    values = [np.asarray(column) for column in columns.values()]
    if not values or len({v.shape for v in values}) != 1 or values[0].ndim != 1:
        raise MeasurementError(f'{path}: columns of one length are needed')
    whole = [name in ('trial', 'step') and np.all(v == np.round(v)) or v.dtype.kind in 'biu'
             for name, v in zip(columns, values)]
    formats = ['%d' if is_whole else '%.12g' for is_whole in whole]
    names = io.StringIO()
    csv.writer(names, lineterminator='').writerow(columns)
    with replacing(path) as file:
        np.savetxt(file, np.column_stack([v.astype(float) for v in values]), delimiter=',',
                   header=names.getvalue(), comments='', fmt=formats)
