# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Values that are impossible in their unit, or unlikely, and the option that converts them."""

from __future__ import annotations

from collections.abc import Mapping

from hysteresis_ros.measurements.columns import Column, unit_in_header
from hysteresis_ros.measurements.quantities import QUANTITIES
from hysteresis_ros.measurements.units import likely_unit, SAME
import numpy as np

SECONDS_OF_A_DAY = 86400.0


def largest_values(columns: Mapping[str, np.ndarray]) -> dict[str, float]:
    """
    Return the largest absolute value of each quantity.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (rows,)
        In the units of files.

    Returns
    -------
    dict of str to float
        Of the time the longest that passes in one trial [s].

    """
    found = {name: float(np.max(np.abs(values))) for name, values in columns.items()
             if name in QUANTITIES and name != 'time'}
    if 'time' in columns:
        time, trial = columns['time'], columns.get('trial', np.zeros(len(columns['time'])))
        found['time'] = max((float(np.ptp(time[trial == one])) for one in np.unique(trial)),
                            default=0.0)
    return found


def unit_problems(largest: Mapping[str, float],
                  origin: Mapping[str, Column] | None = None) -> list[str]:
    """
    Return what is larger than it can be, one clause each.

    Parameters
    ----------
    largest : mapping of str to float
        As `largest_values` gives them.
    origin : mapping of str to Column, optional
        How the columns stand in a file; None where they come from elsewhere.

    Returns
    -------
    list of str
        None for a column whose unit the user has confirmed.

    """
    found = []
    for name, value in largest.items():
        if name != 'time' and value > QUANTITIES[name].most and not confirmed(name, origin):
            found.append(f'{name} reaches {value:.4g} {unit_of_file(name)}, which is impossible; '
                         + advice(name, value, origin))
    return found


def unit_warnings(largest: Mapping[str, float],
                  origin: Mapping[str, Column] | None = None) -> list[str]:
    """Return what is smaller, takes longer or has another unit than expected, one clause each."""
    found = [f'{column.header!r} is read in the unit that --columns names, not in the one of its '
             'name; check which is right' for column in (origin or {}).values()
             if column.confirmed
             and unit_in_header(column.name, column.header) not in (None, column.unit)]
    for name, value in largest.items():
        if confirmed(name, origin):
            continue
        if name == 'time' and value > SECONDS_OF_A_DAY:
            found.append(f'a trial takes {value:.4g} s; {advice(name, value, origin)}')
        elif name != 'time' and 0 < value < QUANTITIES[name].least:
            found.append(f'{name} reaches only {value:.4g} {unit_of_file(name)}; '
                         + advice(name, value, origin))
    return found


def confirmed(name: str, origin: Mapping[str, Column] | None) -> bool:
    """Tell whether the user has named the unit of a column with `--columns`."""
    return origin is not None and name in origin and origin[name].confirmed


def unit_of_file(name: str) -> str:
    """Return the unit of files for a message."""
    return QUANTITIES[name].unit or 'as a ratio'


def advice(name: str, value: float, origin: Mapping[str, Column] | None) -> str:
    """Say which unit is probably meant and how to convert it, or to confirm what is there."""
    unit = QUANTITIES[name].unit or '1'
    likely = 'ms' if name == 'time' else likely_unit(name, value)
    asked = f'is it in {likely}? ' if likely else 'is it in another unit? '
    if origin is None or name not in origin:
        return f'{asked}{unit} is expected: convert it'
    column = origin[name]
    if column.unit != SAME:
        return (f'is the unit in {column.header!r} right? Name it with '
                f'--columns {name}={column.header}:UNIT')
    return (f'{asked}Convert it with --columns {name}={column.header}:{likely or "UNIT"}, or '
            f'confirm it with --columns {name}={column.header}:{unit}')
