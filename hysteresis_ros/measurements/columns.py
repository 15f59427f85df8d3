# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the columns of a user's table mean: names, units in headers, and the option `--columns`.

A header may give its unit: `voltage [V]`, `length (mm)`, `angle_deg`. A column with a name of its
own is mapped: `angle=theta_deg:deg,voltage=V,time=t_s`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
import csv
import re
from typing import NamedTuple

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.units import SAME, Unit, unit_names, UNITS
from hysteresis_ros.spelling import closest, short_list

BRACKETED = re.compile(r'(.*?)\s*(?:\[(.*)\]|\((.*)\))')


class Mapped(NamedTuple):
    """An entry of `--columns`: the meaning, and the column with the unit after it, as written."""

    name: str
    text: str

    def __str__(self) -> str:
        return f'{self.name}={self.text}'


class Column(NamedTuple):
    """
    A column of a file.

    Attributes
    ----------
    name : str
        What it means, or its own name where that is not known.
    header : str
        As it stands in the file.
    unit : Unit
        That it is written in.
    confirmed : bool
        Whether the user has named the unit with `--columns`, so that unusual values are meant.

    """

    name: str
    header: str
    unit: Unit = SAME
    confirmed: bool = False


def parse_columns(text: str) -> tuple[Mapped, ...]:
    """
    Read `angle=theta_deg:deg,voltage=V,time=t_s`.

    Parameters
    ----------
    text : str
        Entries `name=column` or `name=column:unit`, separated by commas; an entry with a comma of
        its own stands in quotation marks.

    Returns
    -------
    tuple of Mapped

    Raises
    ------
    MeasurementError
        If an entry has no such form, or its name means nothing.

    """
    found: list[Mapped] = []
    for entry in next(csv.reader([text], skipinitialspace=True), []):
        name, equals, column = (part.strip() for part in entry.partition('='))
        if not equals or not name or not column:
            raise MeasurementError(f'--columns: {entry!r} is not of the form name=column or '
                                   'name=column:unit, such as angle=theta:deg')
        if name not in UNITS:
            close = closest(name, UNITS)
            raise MeasurementError(
                f'--columns: there is no column {name!r}; '
                + (f'did you mean {close!r}?' if close else f'there are {short_list(UNITS, 99)}'))
        if any(name == other.name for other in found):
            raise MeasurementError(f'--columns: {name} is given twice')
        found.append(Mapped(name, column))
    return tuple(found)


def resolve(headers: Sequence[str],
            mapping: Collection[Mapped] = ()) -> tuple[list[Column], list[str]]:
    """
    Tell what the columns of a file mean.

    Parameters
    ----------
    headers : sequence of str
        As they stand in the file.
    mapping : collection of Mapped
        As `parse_columns` gives them.

    Returns
    -------
    columns : list of Column
        In the order of the file.
    problems : list of str
        What is wrong with headers or mapping.

    """
    columns, problems = [Column(header, header) for header in headers], []
    taken: dict[str, int] = {}
    for entry in mapping:
        header, unit_name = entry.text, None
        if header not in headers and ':' in header:
            header, unit_name = (part.strip() for part in header.rsplit(':', 1))
        if header not in headers:
            close = closest(header, headers)
            problems.append(f'--columns {entry}: there is no column {header!r}; ' + (
                f'did you mean {close!r}?' if close else f'there are {short_list(headers)}'))
            continue
        unit = UNITS[entry.name].get(unit_name) if unit_name is not None else (
            unit_in_header(entry.name, header) or SAME)
        if unit is None:
            problems.append(f'--columns {entry}: {unit_name!r} is no unit of {entry.name} that is '
                            f'known; there are {unit_names(entry.name)}')
            continue
        place = headers.index(header)
        columns[place] = Column(entry.name, header, unit, unit_name is not None)
        taken[entry.name] = place
    for place, column in enumerate(columns):
        if place in taken.values():
            continue
        if column.name in taken:
            # What the user has mapped comes before a column that has the name by itself.
            columns[place] = column._replace(name=f'{column.header} (in the file)')
        elif column.name not in UNITS:
            named, problem = from_header(column.header)
            problems += [problem] if problem else []
            if named is not None and named.name not in {*taken, *headers}:
                columns[place] = named
    for name in dict.fromkeys(column.name for column in columns):
        twice = [column.header for column in columns if column.name == name]
        if len(twice) > 1:
            problems.append(f'{" and ".join(map(repr, twice))} both mean {name}; choose one with '
                            f'--columns {name}={twice[0]}')
    return columns, problems


def from_header(header: str) -> tuple[Column | None, str]:
    """
    Read a header that gives its unit.

    Returns
    -------
    column : Column or None
        None where the header has no name that is known, or no unit.
    problem : str
        '' if there is none.

    """
    bracketed = BRACKETED.fullmatch(header.strip())
    if bracketed:
        name = '_'.join(bracketed[1].lower().split())
        unit = (bracketed[2] if bracketed[2] is not None else bracketed[3]).strip()
        if name not in UNITS:
            return None, ''
        if unit not in UNITS[name]:
            return None, (f'column {header[:40]!r}: {unit[:20]!r} is no unit of {name} that is '
                          f'known; there are {unit_names(name)}')
        return Column(name, header, UNITS[name][unit]), ''
    name, _, unit = header.rpartition('_')
    if name.lower() in UNITS and unit.isalpha() and unit in UNITS[name.lower()]:
        return Column(name.lower(), header, UNITS[name.lower()][unit]), ''
    return None, ''


def unit_in_header(name: str, header: str) -> Unit | None:
    """Return the unit that a mapped column's header ends with, as in `theta_deg`, or None."""
    bracketed = BRACKETED.fullmatch(header.strip())
    unit = ((bracketed[2] if bracketed[2] is not None else bracketed[3]).strip() if bracketed
            else header.rpartition('_')[2] if '_' in header else '')
    return UNITS[name].get(unit) if unit else None
