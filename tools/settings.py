# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Show how the scores of the hidden effects move when each setting is halved and doubled.

None may decide. The cases are those of `tools/hidden.py`, on specimens that are scored nowhere
else.
"""

import argparse
import dataclasses
import sys

import joblib

from hidden import base_model, cases, FIRST_SEED, run, score

from hysteresis_ros.diagnosis.settings import Settings

# A setting that counts stays a number that can be counted.
FACTORS = (0.5, 2.0)


def variants():
    """Return the settings by name: as they are, and with each halved and doubled."""
    usual = Settings()
    found = {'as it is': usual}
    for field in dataclasses.fields(Settings):
        for factor in FACTORS:
            value = getattr(usual, field.name)
            changed = type(value)(factor * value)
            if changed != value:
                found[f'{field.name} {value:g} -> {changed:g}'] = dataclasses.replace(
                    usual, **{field.name: changed})
    return found


def main():
    """Run the cases with every variant, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--first-seed', type=int, default=500)
    parser.add_argument('--every', type=int, default=9, help='of the cases of one specimen')
    parser.add_argument('--jobs', type=int, default=-1)
    args = parser.parse_args()
    chosen = [(*case[:3], case[3] - FIRST_SEED + args.first_seed, *case[4:])
              for case in cases(1, 4)][::args.every]
    seeds = sorted({case[3] for case in chosen})
    parallel = joblib.Parallel(n_jobs=args.jobs)
    models = dict(zip(seeds, parallel(joblib.delayed(base_model)(seed, True) for seed in seeds)))
    heading = None
    for name, settings in variants().items():
        results = parallel(
            joblib.delayed(run)(case, models[case[3]], settings=settings) for case in chosen)
        scores = score(results)
        if heading is None:
            heading = list(scores)
            print('| setting | ' + ' | '.join(heading) + ' |')
            print('|' + '---|' * (1 + len(heading)))
        cells = ['-' if value is None else f'{value:.3g}' for value, *_ in scores.values()]
        print(f'| {name} | ' + ' | '.join(cells) + ' |', flush=True)
        print(f'{len(results)} cases', file=sys.stderr)


if __name__ == '__main__':
    main()
