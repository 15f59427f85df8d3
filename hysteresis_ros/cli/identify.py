# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis identify`: from bench tables to a model."""

from __future__ import annotations

import argparse

from typing import TYPE_CHECKING

from hysteresis_ros.cli.common import (
    add_columns, add_json, bench_tables, count, numbers, processes, say, Steps, Subparsers, warn,
    write_json)
from hysteresis_ros.cli.outputs import InputPath, OutputFile
from hysteresis_ros.cli.rounds import BENCH, Rounds
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.spelling import closest

if TYPE_CHECKING:
    from hysteresis_ros.identification.bench import Identified

AUTO = ('--effects auto: each effect that a bench can show is fitted to the length table, alone\n'
        'and in sets; what predicts held-out trials clearly better is kept, and what every\n'
        'loaded muscle has where it does no harm; kinetics of minor loops, where a row left\n'
        'out is predicted better with them.\n')
NOTHING = ('No effect: with none are trials that were left out predicted clearly better. What\n'
           'each would do says `hysteresis diagnose` of the length table.')
OPERATORS = ('two-stage', 'preisach', 'play', 'bouc-wen', 'linear')


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'identify', help='fit a model to bench tables',
        description='Fits H1 to the force table, H2 to the length table and the linear model to '
        'both, on the trials named, verifies on the others, and prints the rows of Table I.')
    parser.add_argument('--force', type=InputPath, metavar='F.csv', help='force at resting length')
    parser.add_argument('--length', type=InputPath, metavar='L.csv',
                        help='length under constant loads')
    add_columns(parser)
    parser.add_argument('--force-trials', type=numbers, metavar='0',
                        help='trials of the force table to fit (default: all)')
    parser.add_argument('--length-trials', type=numbers, metavar='0-3',
                        help='trials of the length table to fit (default: all)')
    parser.add_argument('--geometry', type=InputPath, metavar='G.yaml',
                        help='the arm that the muscle will move')
    parser.add_argument('--levels', nargs=2, type=count, default=(10, 20), metavar=('N1', 'N2'),
                        help='levels of H1 and H2 (default: 10 20); with effects H2 has a grid of '
                             'its own, at most 2.5 times as fine as 20')
    parser.add_argument('--operator', choices=OPERATORS,
                        help='default: two-stage with a force table, preisach without a load, '
                        'else what predicts held-out trials better')
    parser.add_argument('--effects', default='none', metavar='none|auto|A,B',
                        help="effects of the catalogue to add: none (default, the paper's model), "
                        'those that the tables prove (auto), or those named')
    parser.add_argument('--anchored', action='store_true',
                        help='tie H1(0) to the pretension and H2(0) to zero')
    parser.add_argument('--jobs', type=processes, default=-1, metavar='N',
                        help='processes for --effects (default: -1, one for each core)')
    parser.add_argument('-o', '--output', type=OutputFile, required=True, metavar='MODEL.yaml')
    add_json(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.api import identify
    from hysteresis_ros.diagnosis.determined import undetermined
    from hysteresis_ros.effects import catalogue
    from hysteresis_ros.model.loads import reached_angles
    from hysteresis_ros.report.words import load_in_words

    if args.force is None and args.length is None:
        raise ParameterError('nothing to identify; give --length, --force or both')
    meant = closest(args.effects, ('auto', 'none'))
    if meant not in (None, args.effects) and args.effects not in catalogue():
        raise ParameterError(f'--effects {args.effects}: did you mean {meant!r}?')
    if args.effects == 'auto':
        say(args, AUTO)
    steps, rounds = Steps(), Rounds(BENCH)
    steps('identifying')
    length, force = bench_tables(args)
    found = identify(length, force, force_trials=args.force_trials,
                     length_trials=args.length_trials, geometry=args.geometry,
                     levels=args.levels, operator=args.operator, anchored=args.anchored,
                     effects=args.effects, jobs=args.jobs, progress=rounds)
    rounds.close()
    steps.clear()
    found.model.save(args.output)
    say(args, report(found))
    if args.effects == 'auto' and not found.model.effects:
        say(args, NOTHING)
    for effect in found.model.effects:
        for note in undetermined(effect, 'bench'):
            warn(note)
    for name in worse_than_a_line(found):
        warn(f'{name}: the model is worse than a straight line; check sign and unit of the columns '
             'and the trials')
    if found.model.geometry is not None and found.model.response == 'length':
        warn(load_in_words(found.model, reached_angles(found.model)))
    say(args, f'\nWritten to {args.output}')
    if args.json:
        write_json(args.json, {'model': args.output, **found.to_dict()})


def worse_than_a_line(found: Identified) -> list[str]:
    """Return the rows of Table I in which the linear model has the smaller error."""
    rows = [(f'{name}, {part}', values) for name, parts in found.model.metrics.items()
            for part, values in parts.items() if isinstance(values, dict) and 'linear' in values]
    return [name for name, values in rows
            if values['model']['mean_percent'] > values['linear']['mean_percent']]


def report(found: Identified) -> str:
    """Return the rows of Table I and what the fits say, for a terminal."""
    from hysteresis_ros.comparison.compare import layout
    from hysteresis_ros.report.words import parameters_in_words

    rows = [['Table I', 'mean, model', 'linear', 'std, model', 'linear', 'rows']]
    for name, letter in (('force', 'F'), ('length', 'L')):
        for part, values in found.model.metrics.get(name, {}).items():
            if not isinstance(values, dict) or 'model' not in values:
                continue
            cells = [values[of][key] for key in ('mean_percent', 'std_percent')
                     for of in ('model', 'linear')]
            rows.append([f'{letter}-q {part}', *(
                '-' if cell is None else f'{cell:.2f} %' for cell in cells), str(values['rows'])])
    lines = layout(rows)
    for name, fit in (('H1', found.force_fit), ('H2', found.length_fit)):
        if fit is not None:
            lines.append(f'{name}: {len(fit.weights)} weights, of which the rows determine '
                         f'{fit.rank} combinations, {len(fit.never_excited)} cells never excited, '
                         f'bias {fit.bias:.4g}')
    for effect in found.model.effects:
        values = parameters_in_words(effect.id, effect.to_dict()['parameters'])
        lines.append(f'+ {effect.id}: {values}')
    return '\n'.join(lines)
