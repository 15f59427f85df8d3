# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis effects`: the catalogue of physical effects."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
import shutil
import textwrap
from typing import Any, TYPE_CHECKING

from hysteresis_ros.cli.common import add_json, say, Subparsers, write_json

if TYPE_CHECKING:
    from hysteresis_ros.effects import Effect


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'effects', help='the catalogue of physical effects',
        description='Lists the effects that a model may be missing, or explains one.')
    parser.add_argument('name', nargs='?', metavar='NAME', help='the effect to explain')
    add_json(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.effects import catalogue, effect_class

    if args.name:
        effect = effect_class(args.name)
        say(args, explained(effect))
        content = described(effect)
    else:
        known = catalogue()
        say(args, listed(known))
        content = {'effects': [described(effect) for effect in known.values()]}
    if args.json:
        write_json(args.json, content)


def described(effect: type[Effect]) -> dict[str, Any]:
    """Return all that is known of an effect as plain types."""
    return {
        'effect': effect.id, 'stage': effect.stage, 'sentence': effect.sentence,
        'equation': effect.equation, 'source': effect.source,
        'parameters': {p.name: {'unit': p.unit, 'low': p.low, 'high': p.high, 'scale': p.scale,
                                'description': p.description} for p in effect.describe(None)},
        'shows_in': effect.shows_in, 'experiment': effect.experiment,
        'confused_with': list(effect.confused_with), 'kinds': list(effect.kinds),
        'invertible': effect.invertible}


def listed(known: Mapping[str, type[Effect]]) -> str:
    """Return the catalogue, one line an effect, in the order of the stages."""
    width = max(len(name) for name in known)
    lines: list[str] = []
    stage = None
    for name, effect in known.items():
        if effect.stage != stage:
            stage = effect.stage
            lines += ([''] if lines else []) + [f'{stage}:']
        lines.append(f'  {name:{width}}  {effect.sentence}')
    return '\n'.join([*lines, '', '`hysteresis effects NAME` explains one.'])


def explained(effect: type[Effect]) -> str:
    """Return all that is known of an effect, for a terminal."""
    columns = min(shutil.get_terminal_size().columns, 100)
    lines = [f'{effect.id} ({effect.stage})', '', *textwrap.wrap(effect.sentence, columns), '']
    rows = [('equation', effect.equation), ('source', effect.source),
            ('shows in', effect.shows_in), ('excited by', effect.experiment),
            ('confused with', ', '.join(effect.confused_with) or 'nothing in particular'),
            ('can be undone', 'yes, in the controller' if effect.invertible else 'no')]
    for name, text in rows:
        lines += textwrap.wrap(text, columns, initial_indent=f'{name + ":":15}',
                               subsequent_indent=' ' * 15)
    lines += ['', 'parameters:']
    for parameter in effect.describe(None):
        signs = ' (either sign)' if parameter.both_signs else ''
        scale = (f" for the paper's muscle and arm, in proportion to {parameter.scale}"
                 if parameter.scale else '')
        span = f'{parameter.low:g} to {parameter.high:g} {parameter.unit}{signs}{scale}'
        lines += textwrap.wrap(f'{parameter.name}: {span}; {parameter.description}', columns,
                               initial_indent='  ', subsequent_indent='    ')
    return '\n'.join(lines)
