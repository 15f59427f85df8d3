# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What `identify --effects auto` says that benches lack, on specimens of each constitutive model.

The same physics has to be given the same names, whatever the specimen, with parameters that the
bench determines. Prints one line for each specimen and a table for docs/results.md.
"""

import argparse
from collections import Counter
import sys

from hidden_grid import base_model
from hysteresis_ros.laboratory.plant import MUSCLES
import numpy as np


def main():
    """Identify the benches and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--muscle', choices=[*MUSCLES, 'all'], default='all')
    parser.add_argument('--first-seed', type=int, default=7201)
    parser.add_argument('--seeds', type=int, default=12)
    args = parser.parse_args()
    print('| wire | named on most | the same names | else | length, verification |')
    print('|---|---|---|---|---|')
    for muscle in MUSCLES if args.muscle == 'all' else [args.muscle]:
        names, errors = [], []
        for seed in range(args.first_seed, args.first_seed + args.seeds):
            model = base_model(muscle, seed, True)
            names.append(tuple(sorted(effect.id for effect in model.effects)))
            errors.append(model.metrics['length']['verification']['model']['mean_percent'])
            print(f'{muscle} {seed} {errors[-1]:.3f} %: ' + '; '.join(
                f'{effect.id} ' + ', '.join(
                    f'{name} {effect.values[name]:.3g} ({low:.3g} to {high:.3g})'
                    for name, (low, high) in effect.intervals.items())
                for effect in model.effects), file=sys.stderr, flush=True)
        (most, count), *others = Counter(names).most_common()
        other = '; '.join(f'{times} with {", ".join(sorted(set(one) ^ set(most)))} other'
                          for one, times in others)
        print(f'| {muscle} | {", ".join(most)} | {count} of {len(names)} | {other} | '
              f'{np.median(errors):.2f} %, at most {np.max(errors):.2f} % |', flush=True)


if __name__ == '__main__':
    main()
