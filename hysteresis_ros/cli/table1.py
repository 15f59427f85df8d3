# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis table1`: the paper's experiment in the virtual laboratory, beside its Table I."""

import argparse
from collections.abc import Mapping
from typing import Any

from hysteresis_ros.cli.common import (
    add_json, count, progress, say, seed, Subparsers, write_json)

HEADERS = {'two-stage': 'two-stage', 'linear': 'linear', 'with effects': '+ effects'}


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    from hysteresis_ros.laboratory.muscles import MUSCLES, SOFT_MUSCLES

    parser = subparsers.add_parser(
        'table1', help="the paper's experiment in the virtual laboratory",
        description='Identifies, verifies and compensates as in Sec. VII of the paper, on several '
        "specimens of the virtual laboratory, and prints the paper's Table I beside ours.")
    parser.add_argument('--seeds', type=count, default=5, metavar='N',
                        help='number of specimens (default: 5)')
    parser.add_argument('--first-seed', type=seed, default=0, metavar='S',
                        help='seed of the first (default: 0)')
    parser.add_argument('--effects', default='none', metavar='none|auto|A,B',
                        help='also the two-stage model with effects: those that the bench proves '
                        '(auto), or those named (default: none)')
    parser.add_argument('--muscle', default='grains', metavar='MODEL',
                        help=f'{", ".join(MUSCLES)} (default: grains), or a muscle that is no '
                        f'wire, and has no arm: {", ".join(SOFT_MUSCLES)}')
    parser.add_argument('--jobs', type=count, default=1, metavar='N',
                        help='processes for the search of effects (default: 1)')
    add_json(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.table1 import table1

    effects = {'none': (), 'auto': None}.get(args.effects, args.effects.split(','))
    seeds = range(args.first_seed, args.first_seed + args.seeds)
    result = table1(progress(seeds, 'specimens'), effects, args.jobs, args.muscle)
    say(args, report(result))
    if args.json:
        write_json(args.json, result)


def report(result: Mapping[str, Any]) -> str:
    """
    Return the table for a terminal.

    Parameters
    ----------
    result : dict
        As `hysteresis_ros.table1.table1` returns it.

    Returns
    -------
    str

    """
    from hysteresis_ros.comparison.compare import layout

    methods = list(result['rows'][0]['ours'])
    paper = 'the paper and of ' if result['rows'][0]['paper'] else ''
    kind = '' if result['muscle'] == 'grains' else f' ({result["muscle"]})'
    lines = [f'Table I of {paper}{len(result["seeds"])} specimens of the laboratory{kind}: '
             'mean error (standard deviation)']
    rows = [['', *(f'paper, {HEADERS[method]}' for method in result['rows'][0]['paper']),
             *(f'ours, {HEADERS[method]}' for method in methods)]]
    for row in result['rows']:
        cells = [f'{values["mean"]:.2f} ({values["std"]:.2f}) {row["unit"]}'
                 for values in (*row['paper'].values(), *row['ours'].values())]
        rows.append([row['name'], *cells])
    lines += layout(rows)
    lines += ['', 'The models that the paper compares with:']
    rows = []
    for name, values in result['baselines'].items():
        unit = '' if '(mm)' in name else ' %'
        rows.append([name, *(f'{part} {value:.2f}{unit}' for part, value in values.items())])
    lines += layout(rows)
    for one in result['seeds']:
        if one['effects']:
            lines.append(f'specimen {one["seed"]}: + {", ".join(one["effects"])}')
    return '\n'.join(lines)
