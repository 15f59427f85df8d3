# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis columns`: what the columns of a table may be called, and in which units."""

from __future__ import annotations

import argparse

from hysteresis_ros.cli.common import add_json, say, Subparsers, write_json
from hysteresis_ros.measurements.quantities import DRIVES, LOADS, QUANTITIES, RESPONSES
from hysteresis_ros.measurements.units import UNITS

COUNTS = {'trial': 'number of the trial; each begins after a heat and cool cycle',
          'step': 'number of the row in its trial, for tables without time'}
ROLES = (('drives', DRIVES), ('responses', RESPONSES), ('loads', LOADS))


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'columns', help='names and units of the columns of a table',
        description='Lists the columns that tables may have, the unit of each, and other units '
        'that are converted where the header or --columns names them.')
    add_json(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    say(args, listed())
    if args.json:
        write_json(args.json, {'columns': [described(name) for name in (*QUANTITIES, *COUNTS)]})


def described(name: str) -> dict[str, object]:
    """Return what is known of a column as plain types."""
    quantity = QUANTITIES.get(name)
    return {'column': name, 'unit': quantity.unit if quantity else '',
            'meaning': quantity.meaning if quantity else COUNTS[name],
            'units': [unit for unit in UNITS[name] if unit]}


def listed() -> str:
    """Return the table of columns for a terminal, with the ways to spell them."""
    rows = [['column', 'unit', 'converted from', 'meaning']]
    for name in (*QUANTITIES, *COUNTS):
        entry = described(name)
        unit = str(entry['unit'] or '1')
        others = [one for one in UNITS[name] if one not in (unit, '') and name not in COUNTS]
        rows.append([name, unit, ', '.join(others), str(entry['meaning'])])
    widths = [max(len(row[n]) for row in rows) for n in range(3)]
    lines = ['  '.join(cell.ljust(width) for cell, width in zip(row, [*widths, 0])).rstrip()
             for row in rows]
    lines += [''] + [f'{role + ":":11}{", ".join(names)}' for role, names in ROLES]
    return '\n'.join([
        *lines, '',
        'A header may give the unit: voltage [mV], length (mm), angle_deg. Other names are mapped',
        'with --columns, on every command that reads tables:',
        '  --columns angle=theta_deg:deg,voltage=V,time=t_s',
        'Cells are separated by commas, semicolons or tabs; after semicolons and tabs numbers may '
        'have a',
        'decimal comma. Lines that start with # are comments.'])
