# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Score the diagnosis on recordings in which a physical effect is hidden.

Every case is made by the virtual laboratory: a bench, from which the model is identified, and two
recordings of the arm. The diagnosis is given the model and the first recording as a user would
have them; the truth is used for the score only. `--muscle` chooses the constitutive model of the
wires; effects that its equations cannot have are left out. `make hidden` runs the whole grid.
"""

import argparse
import json
from pathlib import Path
import sys

from hidden_grid import base_model, cases, FIRST_SEED, run, STRENGTHS
from hidden_scores import FIRST_MUSCLE, print_scores, to_markdown, write, write_page
from hysteresis_ros.laboratory.plant import MUSCLES
from hysteresis_ros.workers import delayed, in_parallel


def main():
    """Run the grid and write the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seeds', type=int, default=5, help='for each effect and strength')
    parser.add_argument('--others', type=int, default=20, help='cases of none, unknown, pairs')
    parser.add_argument('--quick', action='store_true', help='every ninth case')
    parser.add_argument('--muscle', choices=[*MUSCLES, 'all'], default=FIRST_MUSCLE,
                        help='constitutive model of the wires (default: %(default)s)')
    parser.add_argument('--only', help='one effect or group')
    parser.add_argument('--first-seed', type=int)
    parser.add_argument('--paper-model', action='store_true',
                        help='identify without effects of the material')
    parser.add_argument('--jobs', type=int, default=-1)
    parser.add_argument('--page', help='put the tables into this page, between its marks')
    parser.add_argument('--render', metavar='FILE', help='only the page, from an earlier output')
    parser.add_argument('output', nargs='?', default='hidden.json', help='scores and cases')
    args = parser.parse_args()
    if args.render:
        results = json.loads(Path(args.render).read_text(encoding='utf-8'))['cases']
        return write_page(results, args.page) if args.page else print(to_markdown(results))
    muscles = tuple(MUSCLES) if args.muscle == 'all' else (args.muscle,)
    chosen = cases(args.seeds, args.others, args.quick, muscles)
    if args.first_seed is not None:
        chosen = [case._replace(seed=case.seed - FIRST_SEED + args.first_seed)
                  for case in chosen]
    if args.only:
        chosen = [case for case in chosen if args.only in (case.group, *case.effects)]
    # Seed by seed, so that what is scored so far is a fair sample.
    chosen.sort(key=lambda case: (case.group in STRENGTHS, case.seed))
    results = []
    specimens = sorted({(case.muscle, case.seed) for case in chosen})
    models = dict(zip(specimens, in_parallel(
        [delayed(base_model)(*one, not args.paper_model) for one in specimens], args.jobs)))
    print(f'{len(models)} specimens identified', file=sys.stderr, flush=True)
    for row in in_parallel([delayed(run)(case, models[case.muscle, case.seed]) for case in chosen],
                           args.jobs):
        results.append(row)
        print(f'{len(results)}/{len(chosen)} {row["muscle"]} {row["group"]} {row["protocol"]} '
              f'{row["truth"]} seed {row["seed"]}: {row["verdict"]} {row["missing"]} '
              f'{row["alternatives"]} {row["rmse_before"]:.4f} -> {row["rmse_after"]:.4f} '
              f'({row["structure"]:.4f}) {row["top"]} {row["seconds"]:.0f} s',
              file=sys.stderr, flush=True)
        write(results, args.output)
    print_scores(results)
    if args.page:
        write_page(results, args.page)
    return None


if __name__ == '__main__':
    main()
