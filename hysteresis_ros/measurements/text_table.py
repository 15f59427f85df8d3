# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tables in text files: a line of names, then a line of numbers for each row.

Cells are separated by commas, semicolons or tabs; after semicolons and tabs a number may have a
decimal comma. Lines that start with # are comments.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
import csv
from pathlib import Path
import re
from typing import Any, NamedTuple
import warnings

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.columns import Column, Mapped, resolve
from hysteresis_ros.measurements.problems import refuse
from hysteresis_ros.measurements.quantities import QUANTITIES
from hysteresis_ros.measurements.table import is_known
import numpy as np

LONGEST_LINE = 1_000_000
SETTINGS = ('.yaml', '.yml', '.json')
SEPARATORS = (',', ';', '\t')
COMMENT = re.compile(rb'^[ \t]*#', re.MULTILINE)
COMMENT_MARK = '#'


class Layout(NamedTuple):
    """
    How a file is written.

    Attributes
    ----------
    path : Path
    headers : list of str
        Names of the columns as they stand in the file.
    first : int
        Line of the names, counted from 1.
    separator : str
    plain : bool
        Whether NumPy can read the rows from the file itself: no comments, no decimal commas.

    """

    path: Path
    headers: list[str]
    first: int
    separator: str
    plain: bool


class Table(NamedTuple):
    """
    The numbers of a file.

    Attributes
    ----------
    columns : dict of str to ndarray of float64, shape (rows,)
        By meaning, in the units of files; text is left out.
    origin : dict of str to Column
        Of each column, how it stands in the file.
    notes : list of str
        Warnings.

    """

    columns: dict[str, np.ndarray]
    origin: dict[str, Column]
    notes: list[str]


def read_table(path: Path, mapping: Collection[Mapped],
               check: Callable[[Sequence[str]], list[str]],
               check_values: Callable[[dict[str, float], dict[str, Column]], list[str]]) -> Table:
    """
    Read names and numbers.

    Parameters
    ----------
    path : Path
    mapping : collection of Mapped
        Names for the columns.
    check : callable
        Given the meanings of the columns, returns what is wrong with them.
    check_values : callable
        Given the largest absolute values by meaning and the origins, returns what is wrong. It is
        asked only where something else is wrong, so that all is said at once.

    Returns
    -------
    Table

    Raises
    ------
    MeasurementError
        One message with all that is wrong.

    """
    if path.suffix.lower() in SETTINGS:
        raise MeasurementError(f'{path}: {settings_in_words(path)}')
    try:
        if path.is_dir():
            raise MeasurementError(f'{path}: a folder, no table; give a CSV file')
        layout = layout_of(path)
        problems = header_problems(layout)
        columns, wrong = resolve(layout.headers, mapping)
        problems += wrong or check([column.name for column in columns])
        return numbers_of(layout, columns, problems, check_values)
    except UnicodeDecodeError as error:
        raise MeasurementError(
            f'{path}: no UTF-8 text ({error.reason} at byte {error.start}); save the table as '
            'UTF-8 CSV') from None
    except OSError as error:
        raise MeasurementError(f'{path}: {error.strerror or error}') from None


def settings_in_words(path: Path) -> str:
    """Say what a YAML or JSON file is, which is no table."""
    with open(path, encoding='utf-8', errors='replace') as file:
        begin = file.read(4000)
    if re.search(r'^schema: ', begin, re.MULTILINE):
        return 'a model of a muscle, no table; give it as the model, and as data a table or bag'
    if re.search(r'^rosbag2_bagfile_information:', begin, re.MULTILINE):
        return 'the metadata of a recording, no table; give its folder'
    return (f'a {path.suffix[1:].upper()} file, no table; give a CSV file or a rosbag2 folder')


def layout_of(path: Path) -> Layout:
    """Find the line of names and what separates the cells."""
    first, line, commented = 0, '', ''
    with open(path, encoding='utf-8-sig', newline='') as file:
        while not line.strip() or line.lstrip().startswith(COMMENT_MARK):
            commented = line if line.strip() else commented
            line = file.readline(LONGEST_LINE)
            first += 1
            if not line:
                raise MeasurementError(f'{path}: ' + (
                    'nothing but comments (lines that start with #)' if commented
                    else 'the file is empty'))
    if '\0' in line:
        raise MeasurementError(f'{path}: binary data, no table; give a CSV file')
    if len(line) == LONGEST_LINE:
        raise MeasurementError(f'{path}: line {first} has more than {LONGEST_LINE - 1} characters, '
                               'so it does not name columns; give a CSV file')
    by_separator = {separator: cells_of(path, first, line, separator) for separator in SEPARATORS}
    separator = max(by_separator, key=lambda one: len(by_separator[one]))
    headers = by_separator[separator]
    if len(headers) == 1 and '|' in headers[0]:
        raise MeasurementError(
            f'{path}: line {first} is separated by bars; save the table with commas '
            'between the cells and dots in the numbers')
    if all(is_number(cell.replace(',', '.')) for cell in headers):
        mark = commented.strip()
        raise MeasurementError(
            f'{path}: line {first} holds numbers; the first line has to name the columns' + (
                f'. Is that {mark[:60]!r}? Remove the # there, which makes it a comment'
                if mark else ''))
    content = path.read_bytes()
    rows = content.split(b'\n', first)[-1]
    plain = not COMMENT.search(rows) and (separator == ',' or b',' not in rows)
    return Layout(path, headers, first, separator, plain)


def cells_of(path: Path, first: int, line: str, separator: str) -> list[str]:
    """Return the names on a line, divided at one kind of separator."""
    try:
        return [cell.strip() for cell in next(csv.reader([line.strip('\r\n')],
                                                         delimiter=separator))]
    except csv.Error as error:
        raise MeasurementError(f'{path}: line {first}: {error}; give a CSV file') from None


def header_problems(layout: Layout) -> list[str]:
    """Return which columns have no name, or the name of another one."""
    found = []
    for n, name in enumerate(layout.headers):
        if not name:
            found.append(f'line {layout.first}, column {n + 1} has no name')
        elif name in layout.headers[:n]:
            found.append(f'line {layout.first} has two columns {name[:40]!r}; rename one')
    return found


def numbers_of(layout: Layout, columns: list[Column], problems: list[str],
               check_values: Callable[[dict[str, float], dict[str, Column]], list[str]]) -> Table:
    """Read the numbers below the names; as `read_table`."""
    notes: list[str] = []
    usable, values = columns, None
    known = [is_known(column.name) for column in columns]
    if not problems and not text_in_first_row(layout):
        try:
            values = load(layout, columns, usable)
            if values.shape[1] != len(usable) or not np.all(np.isfinite(values[:, known])):
                values = None
        except ValueError:
            values = None
    if values is None:
        usable, notes, cell_problems, largest = examined(layout, columns)
        if problems or cell_problems:
            origin = {column.name: column for column in columns}
            refuse(str(layout.path),
                   [*problems, *cell_problems, *check_values(largest, origin)])
        values = load(layout, columns, usable)
    if len(values) == 0:
        raise MeasurementError(f'{layout.path}: the table has a header and no rows')
    return Table({column.name: column.unit.convert(np.ascontiguousarray(values[:, n]))
                  for n, column in enumerate(usable)},
                 {column.name: column for column in usable}, notes)


def text_in_first_row(layout: Layout) -> bool:
    """Tell whether the first row after the header holds text, to save a parse that must fail."""
    for _, cells in rows_of(layout):
        return any(not is_number(cell) for cell in cells[:len(layout.headers)])
    return False


def load(layout: Layout, columns: Sequence[Column], usable: Sequence[Column]) -> np.ndarray:
    """Parse the numbers in C, ndarray (rows, usable columns)."""
    # NumPy 1.26 takes None and does not say so in its hints.
    chosen: Any = None if len(usable) == len(columns) else [columns.index(one) for one in usable]
    # An absolute path: NumPy would fetch a relative one that looks like an address.
    source: Any = str(layout.path.resolve()) if layout.plain else lines_of(layout)
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'loadtxt: input contained no data', UserWarning)
        return np.loadtxt(source, delimiter=layout.separator,
                          skiprows=layout.first if layout.plain else 0, ndmin=2,
                          encoding='utf-8-sig', comments=None, quotechar='"', usecols=chosen)


def examined(layout: Layout, columns: Sequence[Column]) -> tuple[
        list[Column], list[str], list[str], dict[str, float]]:
    """
    Find the cells that are no numbers: the slow way, taken only when the fast one failed.

    Returns
    -------
    usable : list of Column
        Those that hold numbers only.
    notes : list of str
        Which ones were left out.
    problems : list of str
        Cells of known columns that are no finite numbers, and lines with another number of cells
        than the header.
    largest : dict of str to float
        Largest absolute value of each quantity but the time, in the unit of files.

    """
    text: dict[str, tuple[int, str]] = {}
    problems: list[str] = []
    largest: dict[str, float] = {}
    for line, cells in rows_of(layout):
        if len(cells) != len(columns):
            problems.append(
                f'line {line} has {len(cells)} cells, the header {len(columns)}; '
                + ('the file seems to be cut off there: remove the line'
                   if len(cells) < len(columns) else
                   'use a dot in numbers, not a comma, or put semicolons between the cells'))
            continue
        for column, cell in zip(columns, cells):
            if is_known(column.name):
                what = cell_problem(cell)
                if what:
                    problems.append(f'line {line}, column {column.header!r} {what}; mend or '
                                    'remove the line')
                else:
                    value = abs(column.unit.factor * float(cell) + column.unit.offset)
                    if column.name in QUANTITIES and column.name != 'time':
                        largest[column.name] = max(value, largest.get(column.name, 0.0))
            elif column.header not in text and not is_number(cell):
                text[column.header] = (line, cell)
    notes = [f'{layout.path}: column {name[:40]!r} is left out: line {line} holds {cell[:40]!r}'
             for name, (line, cell) in text.items()]
    usable = [column for column in columns if column.header not in text]
    return usable, notes, problems, largest


def cell_problem(cell: str) -> str:
    """Say why a cell of a known column cannot be used: empty, text, or no finite number."""
    cell = cell.strip()
    if not cell:
        return 'is empty'
    if not is_number(cell):
        return f'is {cell[:40]!r}, not a number'
    return '' if np.isfinite(float(cell)) else f'is {cell}'


def lines_of(layout: Layout) -> Iterator[str]:
    """Yield the lines after the header, blank where a comment was, with decimal points."""
    with open(layout.path, encoding='utf-8-sig', newline='') as file:
        for _ in range(layout.first):
            file.readline()
        for line in file:
            if line.lstrip().startswith(COMMENT_MARK):
                yield '\n'
            else:
                yield line.replace(',', '.') if layout.separator != ',' else line


def rows_of(layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield (line, cells) of the rows after the header that are not blank."""
    reader = csv.reader(lines_of(layout), delimiter=layout.separator)
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells) or len(cells) > 1:
                yield layout.first + reader.line_num, cells
    except csv.Error as error:
        raise MeasurementError(
            f'{layout.path}: line {layout.first + reader.line_num}: {error}') from None


def is_number(cell: str) -> bool:
    """Tell whether a cell is a number in the way that NumPy reads it."""
    try:
        float(cell)
    except ValueError:
        return False
    return '_' not in cell
