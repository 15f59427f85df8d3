# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis diagnose`: which physical effect the model is missing."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hysteresis_ros.cli.common import (
    add_data, add_json, add_model, add_report, add_settled, add_trials, origin, processes, read_all,
    say, seed, Subparsers, warn, warn_of_loads, write_json)
from hysteresis_ros.cli.rounds import BENCH, Rounds

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

UNITS = {'angle': (57.29577951308232, 'deg'), 'length': (1e3, 'mm'), 'strain': (100.0, '%'),
         'force': (1.0, 'N')}


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'diagnose', help='which physical effect is missing',
        description='Tries every effect of the catalogue that the data can show, on rows that '
        'were not fitted, and names one only if it explains more than chance and more than the '
        "base model's own error could.")
    add_model(parser)
    add_data(parser)
    add_settled(parser)
    add_trials(parser, 'the others are not looked at')
    parser.add_argument('--jobs', type=processes, default=-1, metavar='N',
                        help='processes (default: -1, one for each core)')
    parser.add_argument('--seed', type=seed, default=0, metavar='S',
                        help='of the random draws behind the p values (default: 0)')
    add_json(parser)
    add_report(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.api import diagnose, load_model

    model = load_model(args.model)
    measurements = read_all(args.data, args, args.trials)
    rounds = Rounds(BENCH)
    found = diagnose(model, measurements, jobs=args.jobs, seed=args.seed, progress=rounds)
    rounds.close()
    warn_of_loads(model, measurements)
    warn(without_bench_effects(model, measurements))
    say(args, to_text(found, measurements[-1].response))
    if args.json:
        write_json(args.json, found.to_dict())
    if args.report:
        from hysteresis_ros.report.diagnosis_page import write_diagnosis
        write_diagnosis(args.report, model, measurements, found, args.model, origin(args))


def without_bench_effects(model: MuscleModel, measurements: Sequence[Measurement]) -> str:
    """Say that a model lacks what its bench could have told, '' if it does not."""
    loads = model.provenance.get('length', {}).get('loads', ())
    if model.effects or len(set(loads)) < 2 or measurements[0].response != 'angle':
        return ''
    return ('the model has no effects, and what its bench lacks may be taken for something of the '
            'arm; first identify it with --effects auto')


def to_text(found: Diagnosis, response: str) -> str:
    """Return the diagnosis for a terminal."""
    from hysteresis_ros.comparison.compare import layout
    from hysteresis_ros.report.reasons import all_probabilities
    from hysteresis_ros.report.words import (
        draws_in_words, error_in_words, noise_in_words, parameters_in_words, typical_in_words,
        verdict_in_words)

    factor, unit = UNITS[response]
    lines = [verdict_in_words(found), '']
    errors = [(f'{error_in_words(found)} on rows not fitted', found.rmse_before,
               found.rmse_after),
              ('RMSE of all these rows', found.pooled_before, found.pooled_after)]
    lines += [f'{name}: {factor * before:.3g} {unit}'
              + (f', with the effects {factor * after:.3g} {unit}' if found.missing else '')
              for name, before, after in errors if before is not None and after is not None]
    if typical_in_words(found):
        lines.append(f'({typical_in_words(found)})')
    lines.append(', '.join([
        f'{noise_in_words(found)} {factor * found.noise_floor:.2g} {unit}',
        *(f'{name} {factor * value:.2g} {unit}' for name, value in (
            ('error of the base model, as its bench shows, about', found.bench_error),
            ('with what no bench of constant loads shows', found.structural_error),
            ('no error matters below', found.small_error)) if value is not None),
        f'unexplained {100.0 * found.unexplained:.0f} %']))
    if found.sets:
        lines.append('probability: ' + all_probabilities(found))
    rows = [['effect', f'{found.error_name} after [{unit}]', 'gain', 'p', 'absorbed', 'parameters']]
    for row in found.ranking[:10]:
        values = parameters_in_words(row['effect'], row['parameters'], intervals=False)
        rows.append([row['effect'], f'{factor * row["rmse_after"]:.3g}',
                     f'{100.0 * row["gain"]:.0f} %', found.p_value(row),
                     f'{100.0 * row["absorbed"]:.0f} %',
                     values + ('' if row['plausible'] else ' (outside its physical range)')])
    lines += ['', *layout(rows)]
    if len(rows) > 1:
        lines.append('absorbed: share of what an effect changes that other weights of the model '
                     'could change, too')
    if draws_in_words(found):
        lines.append(draws_in_words(found))
    if found.not_excited:
        lines += ['', 'could not have shown: ' + ', '.join(found.not_excited)]
    lines += ['', 'next: ' + found.experiment]
    return '\n'.join(lines)
