# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis operators`: which operator describes a muscle best, and what it costs."""

from __future__ import annotations

import argparse

from typing import TYPE_CHECKING

from hysteresis_ros.cli.common import (
    add_columns, add_json, bench_tables, progress, say, Steps, Subparsers, write_json)
from hysteresis_ros.cli.outputs import InputPath, OutputFile

if TYPE_CHECKING:
    from hysteresis_ros.identification.choice import Choice


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'operators', help='operators side by side on held-out trials',
        description='Fits the line, Preisach operators of several grids, Prandtl-Ishlinskii and '
        'Bouc-Wen operators, alone and in two stages, and the additive and embedded models that '
        'the paper rejects, with one trial held out in turn (of one trial alone, blocks of rows). '
        'Prints errors, number of parameters and time of a step, and says which to take.')
    parser.add_argument('--length', type=InputPath, required=True, metavar='L.csv',
                        help='length or strain, under loads or not')
    parser.add_argument('--force', type=InputPath, metavar='F.csv', help='force at resting length')
    add_columns(parser)
    add_json(parser)
    parser.add_argument('--plot', type=OutputFile, metavar='P.png',
                        help='draw the error over parameters and over the time of a step')
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.identification.choice import compare_operators

    steps = Steps()
    steps('reading')
    length, force = bench_tables(args)
    assert length is not None    # the option is required
    steps.clear()
    choice = compare_operators(length, force, progress=lambda items, total: progress(
        items, 'operators', total))
    say(args, report(choice))
    if args.json:
        write_json(args.json, {**choice.to_dict(), 'advice': advice(choice)})
    if args.plot:
        from hysteresis_ros.atomic import write_bytes
        from hysteresis_ros.report.choice_plot import choice_figure
        from hysteresis_ros.report.drawing import png
        write_bytes(args.plot, png(choice_figure(choice)))


def report(choice: Choice) -> str:
    """
    Return the table and the advice for a terminal.

    Parameters
    ----------
    choice : Choice

    Returns
    -------
    str

    """
    from hysteresis_ros.comparison.compare import layout

    rows = [['operator', 'held out', 'fitted', 'parameters', 'simulate', 'invert']]
    for score in choice.scores:
        rows.append([score.name, percent(score.held_out, choice), percent(score.fitted, choice),
                     str(score.parameters), f'{score.simulate_us:.2f} us',
                     f'{score.invert_us:.1f} us'])
    used = '' if choice.used == choice.rows else f' of {choice.rows}'
    lines = [f'RMSE of the {choice.response} in percent of its range, {choice.used}{used} rows, '
             f'{choice.folds} {choice.parts} held out in turn; time of a row', '', *layout(rows)]
    lines += [f'left out: {name}: {reason}' for name, reason in choice.left_out.items()]
    return '\n'.join([*lines, '', advice(choice)])


def percent(error: float, choice: Choice) -> str:
    """Return an error as a share of the response's range."""
    return f'{100.0 * error / choice.span:.2f} %'


def advice(choice: Choice) -> str:
    """Return which operator to take, in one line."""
    best, simplest = choice.best, choice.simplest
    how = f' `hysteresis identify {simplest.options}` identifies it.' if simplest.options else ''
    if best is simplest:
        return (f'Take {best.name}: the smallest error ({percent(best.held_out, choice)}), and '
                f'nothing with fewer than its {best.parameters} parameters comes as close.{how}')
    return (f'Take {simplest.name} ({percent(simplest.held_out, choice)} with '
            f'{simplest.parameters} parameters): it cannot be told from the smallest error, '
            f'{percent(best.held_out, choice)} of {best.name} with {best.parameters}.{how}')
