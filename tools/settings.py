# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Show how the scores of the hidden effects move when each setting is halved and doubled.

The cases are those of `tools/hidden.py`, on specimens that are scored nowhere else; the models are
identified once, with the settings as they are. The table is Markdown: a row for each changed
setting, with what each score is and, in parentheses, by how much it moved.
"""

import argparse
from collections.abc import Sequence
import dataclasses
from pathlib import Path
import sys

from hidden_grid import base_model, Case, cases, FIRST_SEED, run
from hidden_scores import FIRST_MUSCLE, Row, score
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.laboratory.plant import MUSCLES
from hysteresis_ros.workers import delayed, in_parallel
import numpy as np

NAMES = [field.name for field in dataclasses.fields(Settings)]
FACTORS = (0.5, 2.0)
USUAL = 'as it is'
# Cases of none, of an unknown effect and of a pair, of which `sample` takes its share.
OTHERS = 4


def variants(names: Sequence[str] = NAMES) -> dict[str, Settings]:
    """Return the settings by what was changed: nothing, and each named one halved and doubled."""
    usual = Settings()
    found = {USUAL: usual}
    for name in names:
        value = getattr(usual, name)
        for factor in FACTORS:
            # A setting that counts stays a number that can be counted.
            changed = type(value)(factor * value)
            found[f'{name} {value:g} -> {changed:g}'] = dataclasses.replace(
                usual, **{name: changed})
    return found


def sample(count: int, first_seed: int, only: str | None = None,
           muscle: str = FIRST_MUSCLE) -> list[Case]:
    """
    Return cases of the hidden-effect grid, spread over it: one at random of each stretch.

    Parameters
    ----------
    count : int
        How many, at most.
    first_seed : int
        Takes the place of the grid's own.
    only : str, optional
        One effect or group.
    muscle : str
        Constitutive model of the wires.
    """
    found = [case for case in cases(1, OTHERS, muscles=(muscle,))
             if only is None or only in (case.group, *case.effects)]
    count = min(count, len(found))
    # Strengths take turns in the grid: an even distance would meet one of them alone.
    places = np.random.default_rng(first_seed).random(count) + np.arange(count)
    spread = [found[int(place * len(found) / count)] for place in places]
    return [case._replace(seed=case.seed - FIRST_SEED + first_seed) for case in spread]


def to_markdown(results: dict[str, list[Row]]) -> str:
    """
    Return a table of the scores, a row for each variant of the settings.

    Parameters
    ----------
    results : dict of str to list of dict
        What `hidden_grid.run` returned for every case, by name of variant; the first one is
        what the others are compared with. Scores that no case counts for are left out.
    """
    scores = {name: {key: value for key, (value, *_) in score(rows).items()}
              for name, rows in results.items()}
    usual = next(iter(scores.values()))
    heading = [key for key in usual if any(one[key] is not None for one in scores.values())]
    lines = ['| setting | cases | ' + ' | '.join(heading) + ' |',
             '|---|---' + '|---' * len(heading) + '|']
    for name, found in scores.items():
        cells = [_cell(found[key], usual[key]) for key in heading]
        lines.append(f'| {name} | {len(results[name])} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _cell(value: float | None, usual: float | None) -> str:
    if value is None:
        return '-'
    moved = '' if usual is None or value == usual else f' ({value - usual:+.3g})'
    return f'{value:.3g}{moved}'


def main() -> None:
    """Run the cases with every variant, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--cases', type=int, default=12, metavar='N',
                        help='of each variant, at most (default: %(default)s)')
    parser.add_argument('--first-seed', type=int, default=500)
    parser.add_argument('--only', help='one effect or group')
    parser.add_argument('--settings', nargs='+', choices=NAMES, default=NAMES, metavar='NAME',
                        help='those to change (default: all)')
    parser.add_argument('--muscle', choices=MUSCLES, default=FIRST_MUSCLE,
                        help='constitutive model of the wires (default: %(default)s)')
    parser.add_argument('--jobs', type=int, default=-1)
    parser.add_argument('--output', metavar='FILE', help='the table, too')
    args = parser.parse_args()
    chosen = sample(args.cases, args.first_seed, args.only, args.muscle)
    if not chosen:
        parser.error('no case: --cases has to be 1 or more, and --only an effect or group that '
                     'the muscle has')
    seeds = sorted({case.seed for case in chosen})
    models = dict(zip(seeds, in_parallel(
        [delayed(base_model)(args.muscle, seed, True) for seed in seeds], args.jobs)))
    print(f'{len(models)} specimens identified', file=sys.stderr, flush=True)
    results: dict[str, list[Row]] = {}
    for name, settings in variants(args.settings).items():
        results[name] = list(in_parallel(
            [delayed(run)(case, models[case.seed], settings) for case in chosen], args.jobs))
        print(f'{name}: {len(chosen)} cases', file=sys.stderr, flush=True)
        if args.output:
            Path(args.output).write_text(to_markdown(results), encoding='utf-8')
    print(to_markdown(results), end='')


if __name__ == '__main__':
    main()
