# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis extend`: add effects to a model and see the error fall."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
import math
from typing import Any, TYPE_CHECKING

from hysteresis_ros.cli.common import (
    add_columns, add_json, add_model, add_report, add_settled, add_trials, divided, origin,
    read_all, say, Subparsers, warn, write_json)
from hysteresis_ros.cli.diagnose import UNITS
from hysteresis_ros.cli.outputs import InputPath, OutputFile
from hysteresis_ros.errors import ParameterError

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.extend import Extension
    from hysteresis_ros.effects import Effect
    from hysteresis_ros.model import MuscleModel


class Joined(argparse.Action):
    """Lists of an option that is given several times, as one."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 values: Any, option_string: str | None = None) -> None:
        """Add a list to those before."""
        before = getattr(namespace, self.dest)
        setattr(namespace, self.dest, values if before is None else f'{before},{values}')


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'extend', help='add effects, fit them, and show the error before and after',
        description='Fits the effects to the recordings of --data, writes the extended model, and '
        'shows the error before and after, also on the recordings of --test, which are not '
        'fitted.')
    add_model(parser)
    parser.add_argument('--add', required=True, action=Joined, metavar='EFFECT[,EFFECT]',
                        help='effects to add, in order; may be given several times')
    parser.add_argument('--data', nargs='+', type=InputPath, required=True, metavar='TRAIN',
                        help='recordings to fit: CSV files or rosbag2 folders')
    parser.add_argument('--test', nargs='+', type=InputPath, default=[], metavar='TEST',
                        help='recordings that are not fitted')
    parser.add_argument('--namespace', metavar='NS',
                        help='which arm to take from a bag that recorded several')
    add_columns(parser)
    add_settled(parser)
    add_trials(parser, 'the others are not fitted')
    parser.add_argument('--values', type=values_of, metavar='EFFECT.PARAMETER=VALUE,...',
                        help='give the effects these values, in the units that `hysteresis '
                        'effects` lists, and fit none of them')
    parser.add_argument('--force', action='store_true',
                        help='fit effects that the recordings cannot show, with a warning')
    parser.add_argument('-o', '--output', type=OutputFile, required=True, metavar='MODEL.yaml')
    add_json(parser)
    add_report(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.diagnosis.extend import extend, extend_by_hand
    from hysteresis_ros.model import MuscleModel

    model = MuscleModel.load(args.model)
    train, unseen = divided(read_all(args.data, args), args.trials)
    test = [*unseen, *read_all(args.test, args)]
    names = [name.strip() for name in args.add.split(',') if name.strip()]
    if args.values is None:
        extension = extend(model, names, train, test, force=args.force)
    else:
        extension = extend_by_hand(model, with_values(model, names, args.values), train, test)
    for note in extension.warnings:
        warn(note)
    extension.model.save(args.output)
    say(args, to_text(extension, train[0].response))
    say(args, f'\nWritten to {args.output}')
    if args.json:
        write_json(args.json, extension.to_dict())
    if args.report:
        from hysteresis_ros.report.diagnosis_page import write_extension
        write_extension(args.report, model, extension, train, test, args.output,
                        origin(args))


def values_of(text: str) -> dict[str, dict[str, float]]:
    """Read `EFFECT.PARAMETER=VALUE,...` as values by parameter by effect."""
    found: dict[str, dict[str, float]] = {}
    for part in text.split(','):
        name, _, number = part.partition('=')
        effect, _, parameter = name.strip().partition('.')
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not (effect and parameter and math.isfinite(value)):
            raise argparse.ArgumentTypeError(f'{part!r} is not EFFECT.PARAMETER=VALUE')
        found.setdefault(effect, {})[parameter] = value
    return found


def with_values(model: MuscleModel, names: Sequence[str],
                values: Mapping[str, Mapping[str, float]]) -> list[Effect]:
    """
    Return effects with values given by hand.

    Raises
    ------
    ParameterError
        If an effect is unknown, has no such parameter, or names and values do not go together.
    """
    from hysteresis_ros.effects import effect_class

    for lacking, where in ((set(names) - set(values), '--values gives no value to'),
                           (set(values) - set(names), '--add does not name')):
        if lacking:
            raise ParameterError(f'{where} {", ".join(sorted(lacking))}; name the same effects in '
                                 '--add and --values')
    return [effect_class(name)(model.surroundings, **values[name]) for name in names]


def to_text(extension: Extension, response: str) -> str:
    """Return the gain for a terminal."""
    from hysteresis_ros.report.words import parameters_in_words

    factor, unit = UNITS[response]
    lines = []
    for effect in extension.added:
        values = parameters_in_words(effect.id, effect.to_dict()['parameters'])
        lines.append(f'+ {effect.id}: {values}')
    for name in extension.implausible:
        lines.append(f'! {name} is outside its physical range: an implausible explanation')
    for label, errors in (('fitted', extension.train), ('not fitted', extension.test)):
        if errors:
            lines.append(f'RMSE on data {label}: {factor * errors["rmse_before"]:.3g} {unit} -> '
                         f'{factor * errors["rmse_after"]:.3g} {unit}')
    lines += [f'  {name:32s} {factor * value:.3g} {unit}' for name, value in extension.steps]
    return '\n'.join(lines)
