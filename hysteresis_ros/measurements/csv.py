# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements in CSV files: header, comma, dot, UTF-8."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import csv
import hashlib
import io
from pathlib import Path
from typing import Any, TYPE_CHECKING
import warnings

from hysteresis_ros.atomic import AnyPath, replacing
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.quantities import RESPONSES
from hysteresis_ros.measurements.table import (
    classify, is_known, Measurement, MeasurementWarning, suggestion)
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

LONGEST_LINE = 1_000_000
SETTINGS = ('.yaml', '.yml', '.json')


def read_csv(path: AnyPath) -> Measurement:
    """
    Read a CSV file.

    Numeric columns with unknown names are kept, columns of text are left out with a warning.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Measurement

    Raises
    ------
    MeasurementError
        With the line and the column of what cannot be read.

    Warns
    -----
    MeasurementWarning
        For what can be read and looks wrong, such as millimetres where metres are expected.

    """
    path = Path(path)
    columns, notes = parse(path, lambda names: classify(names, str(path)))
    measurement = Measurement.from_columns(columns, str(path), digest(path), notes)
    for note in measurement.warnings:
        warnings.warn(note, MeasurementWarning, stacklevel=2)
    return measurement


def read_reference(path: AnyPath) -> dict[str, np.ndarray]:
    """
    Read a table of references: `trial, step` and what the muscle is to do.

    Parameters
    ----------
    path : str or Path

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

    def check(names: Sequence[str]) -> None:
        if not any(name in names for name in RESPONSES):
            raise MeasurementError(
                f'{path}: a reference needs force, or force and length, or angle'
                f'{suggestion(RESPONSES[0], names)}')

    columns, notes = parse(path, check)
    for note in notes:
        warnings.warn(note, MeasurementWarning, stacklevel=2)
    rows = len(next(iter(columns.values())))
    return columns if 'trial' in columns else {'trial': np.zeros(rows), **columns}


def parse(path: Path,
          check: Callable[[Sequence[str]], object]) -> tuple[dict[str, np.ndarray], list[str]]:
    """
    Read header and numbers.

    Parameters
    ----------
    path : Path
    check : callable
        Called with the names of the columns before the numbers are read; refuses by raising.

    Returns
    -------
    columns : dict of str to ndarray
    notes : list of str
        Warnings.

    """
    if path.suffix.lower() in SETTINGS:
        raise MeasurementError(f'{path}: a {path.suffix[1:].upper()} file, no table; give a CSV '
                               'file or a rosbag2 folder')
    try:
        if path.is_dir():
            raise MeasurementError(f'{path}: a folder, no table; give a CSV file')
        names, first = header(path)
        check(names)
        return numbers_of(path, names, first)
    except UnicodeDecodeError as error:
        raise MeasurementError(
            f'{path}: no UTF-8 text ({error.reason} at byte {error.start}); save the table as '
            'UTF-8 CSV') from None
    except OSError as error:
        raise MeasurementError(f'{path}: {error.strerror or error}') from None


def numbers_of(path: Path, names: list[str],
               first: int) -> tuple[dict[str, np.ndarray], list[str]]:
    """Read the numbers under a header; as `parse`."""
    usable = list(names)
    notes: list[str] = []
    if text_in_first_row(path, names, first):
        usable, notes = numeric_columns(path, names, first)
    try:
        values = load(path, names, usable, first)
        if values.shape[1] != len(usable) or not np.all(np.isfinite(
                values[:, [is_known(name) for name in usable]])):
            raise ValueError
    except ValueError:
        usable, notes = numeric_columns(path, names, first)
        values = load(path, names, usable, first)
    if len(values) == 0:
        raise MeasurementError(f'{path}: the table has a header and no rows')
    return {name: np.ascontiguousarray(values[:, n]) for n, name in enumerate(usable)}, notes


def header(path: Path) -> tuple[list[str], int]:
    """
    Read the names of the columns.

    Returns
    -------
    names : list of str
    first : int
        Line of the header, counted from 1.

    """
    with open(path, encoding='utf-8-sig', newline='') as file:
        first, line = 0, ''
        while not line.strip():
            line = file.readline(LONGEST_LINE)
            first += 1
            if not line:
                raise MeasurementError(f'{path}: the file is empty')
    if '\0' in line:
        raise MeasurementError(f'{path}: binary data, no table; give a CSV file')
    if len(line) == LONGEST_LINE:
        raise MeasurementError(f'{path}: line {first} has more than {LONGEST_LINE - 1} characters, '
                               'so it does not name columns; give a CSV file')
    try:
        cells = [cell.strip() for cell in next(csv.reader([line.strip('\r\n')]))]
    except csv.Error as error:
        raise MeasurementError(
            f'{path}: line {first}: {error}; give a CSV file') from None
    if len(cells) == 1:
        for separator, name in ((';', 'semicolons'), ('\t', 'tabs'), ('|', 'bars')):
            if separator in cells[0]:
                raise MeasurementError(
                    f'{path}: line {first} is separated by {name}; save the table with commas '
                    'between the cells and dots in the numbers')
    if all(is_number(cell) for cell in cells):
        raise MeasurementError(
            f'{path}: line {first} holds numbers; the first line has to name the columns')
    for n, name in enumerate(cells):
        if not name:
            raise MeasurementError(f'{path}: line {first}, column {n + 1} has no name')
        if name in cells[:n]:
            raise MeasurementError(
                f'{path}: line {first} has two columns {name[:40]!r}; rename one')
    return cells, first


def text_in_first_row(path: Path, names: Sequence[str], first: int) -> bool:
    """Tell whether the first row after the header holds text, to save a parse that must fail."""
    for _, cells in rows_of(path, first):
        return any(not is_number(cell) for cell in cells[:len(names)])
    return False


def load(path: Path, names: Sequence[str], usable: Sequence[str], first: int) -> np.ndarray:
    """Parse the numbers in C, ndarray (rows, usable columns)."""
    # NumPy 1.26 takes None and does not say so in its hints.
    columns: Any = None if len(usable) == len(names) else [names.index(name) for name in usable]
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'loadtxt: input contained no data', UserWarning)
        # An absolute path: NumPy would fetch a relative one that looks like an address.
        return np.loadtxt(str(path.resolve()), delimiter=',', skiprows=first, ndmin=2,
                          encoding='utf-8-sig', comments=None, quotechar='"',
                          usecols=columns)


def numeric_columns(path: Path, names: Sequence[str], first: int) -> tuple[list[str], list[str]]:
    """
    Find the cells that are no numbers: the slow way, taken only when the fast one failed.

    Returns
    -------
    usable : list of str
        Columns that hold numbers only.
    notes : list of str
        Which ones were left out.

    Raises
    ------
    MeasurementError
        If the cell is in a column whose name means something, or if a line has another number
        of cells than the header.

    """
    text = {}
    for line, cells in rows_of(path, first):
        if len(cells) != len(names):
            raise MeasurementError(
                f'{path}: line {line} has {len(cells)} cells, the header {len(names)}; '
                + ('the file seems to be cut off there: remove the line'
                   if len(cells) < len(names) else 'use a dot in numbers, not a comma'))
        for name, cell in zip(names, cells):
            if is_known(name):
                check_cell(path, line, name, cell)
            elif name not in text and not is_number(cell):
                text[name] = (line, cell)
    notes = [f'{path}: column {name[:40]!r} is left out: line {line} holds {cell[:40]!r}'
             for name, (line, cell) in text.items()]
    return [name for name in names if name not in text], notes


def check_cell(path: Path, line: int, name: str, cell: str) -> None:
    """Refuse a cell of a known column that is empty, text, or no finite number."""
    cell = cell.strip()
    if not cell:
        what = 'is empty'
    elif not is_number(cell):
        what = f'is {cell[:40]!r}, not a number'
    elif not np.isfinite(float(cell)):
        what = f'is {cell}'
    else:
        return
    raise MeasurementError(f'{path}: line {line}, column {name!r} {what}; mend or remove the line')


def rows_of(path: Path, first: int) -> Iterator[tuple[int, list[str]]]:
    """Yield (line, cells) of the rows after the header that are not blank."""
    with open(path, encoding='utf-8-sig', newline='') as file:
        for _ in range(first):
            file.readline()
        reader = csv.reader(file)
        try:
            for cells in reader:
                if any(cell.strip() for cell in cells) or len(cells) > 1:
                    yield first + reader.line_num, cells
        except csv.Error as error:
            raise MeasurementError(
                f'{path}: line {first + reader.line_num}: {error}') from None


def is_number(cell: str) -> bool:
    """Tell whether a cell is a number in the way that NumPy reads it."""
    try:
        float(cell)
    except ValueError:
        return False
    return '_' not in cell


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
    measurement : Measurement or mapping of str to array_like (rows,)
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
