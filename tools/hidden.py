# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Score the diagnosis on recordings in which a physical effect is hidden.

Every case is made by the virtual laboratory: a bench, from which the model is identified, and two
recordings of the arm. The diagnosis is given the model and the first recording as a user would
have them; the truth is used for the score only. `make hidden` runs the whole grid.
"""

import argparse
import itertools
import json
from pathlib import Path
import sys
import time

import numpy as np

from hysteresis_ros.workers import delayed, in_parallel

# Seeds above this were never looked at while thresholds were chosen.
FIRST_SEED = 1000
STRENGTHS = {'strong': 1.0, 'weak': 0.4}
# Between these a page holds the tables.
MARKS = '<!-- hidden effects: begin -->', '<!-- hidden effects: end -->'
# Effects that only transients can show are hidden in continuous recordings, others in settled ones.
TRANSIENT = {'thermal_lag', 'heating_cooling_asymmetry', 'latent_heat', 'creep',
             'viscous_friction', 'inertia', 'latency', 'ambient_drift', 'fatigue'}


def cases(seeds, others, quick=False):
    """Return (group, protocol, effects by strength, seed) of every case."""
    from hysteresis_ros.laboratory.hidden_physics import hidden_effects, unlisted_effects

    def protocol(names):
        return 'arm-dynamic' if any(name in TRANSIENT for name in names) else 'arm-steps'

    listed = list(hidden_effects())
    found = []
    for name, (group, strength) in itertools.product(listed, STRENGTHS.items()):
        for seed in range(seeds):
            found.append((group, protocol([name]), {name: strength}, FIRST_SEED + seed))
    chance = np.random.default_rng(5)
    for number in range(others):
        seed = FIRST_SEED + 100 + number
        kind = 'arm-dynamic' if number % 4 == 3 else 'arm-steps'
        found.append(('none', kind, {}, seed))
        unlisted = unlisted_effects()
        name = unlisted[number % len(unlisted)]
        found.append(('unknown', 'arm-dynamic' if number % 2 else 'arm-steps', {name: 1.0}, seed))
        pair = sorted(chance.choice(listed, 2, replace=False).tolist())
        found.append(('pair', protocol(pair), {name: 1.0 for name in pair}, seed))
    if quick:
        found = [case for index, case in enumerate(found) if index % 9 == 0]
    return found


def base_model(seed, material):
    """Identify the bench of the specimen, on which nothing is hidden."""
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.identification.bench import identify
    from hysteresis_ros.diagnosis.bench_effects import add_effects
    from hysteresis_ros.laboratory.experiments import experiment_tables
    from hysteresis_ros.laboratory.linkage import GEOMETRY
    from hysteresis_ros.measurements.table import Measurement

    tables = experiment_tables('bench', {}, seed)
    force, length = (Measurement.from_columns(tables[name]) for name in
                     ('force.csv', 'length.csv'))
    trials = {'length_trials': range(4), 'force_trials': [0]}
    model = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **trials).model
    if material:
        model, _ = add_effects(model, length, force, **trials)
    return model


def run(case, model):
    """Diagnose one case with the model of its specimen and return what is scored."""
    from hysteresis_ros.diagnosis.diagnose import diagnose
    from hysteresis_ros.diagnosis.extend import extend, rmse
    from hysteresis_ros.laboratory.experiments import experiment_tables
    from hysteresis_ros.measurements.table import Measurement

    group, protocol, effects, seed = case
    started = time.perf_counter()
    train, test = (Measurement.from_columns(experiment_tables(protocol, effects, seed)[name])
                   for name in ('train.csv', 'test.csv'))
    found = diagnose(model, [train], seed=seed)
    reported = set(found.missing).union(*found.alternatives) if found.missing else set()
    result = {'group': group, 'protocol': protocol, 'truth': sorted(effects), 'seed': seed,
              'verdict': found.verdict, 'missing': found.missing,
              'alternatives': found.alternatives, 'reported': sorted(reported),
              'rmse_before': found.rmse_before, 'rmse_after': found.rmse_after,
              'structure': found.structural_error, 'unexplained': found.unexplained,
              'seconds': time.perf_counter() - started,
              'top': [(row['effect'], round(row['rmse_after'], 5), round(row['p_value'], 3))
                      for row in found.ranking[:4]]}
    if group in ('strong', 'weak') and found.missing:
        clean = Measurement.from_columns(experiment_tables(protocol, {}, seed)['test.csv'])
        extended = extend(model, found.missing, [train]).model
        result['unseen'] = rmse(extended, [test])
        result['clean'] = rmse(model, [clean])
    return result


def score(results):
    """Return for each score what was reached, how many cases it rests on, and what is asked."""
    def share(group, good):
        chosen = [row for row in results if row['group'] == group]
        return (100.0 * sum(map(good, chosen)) / len(chosen) if chosen else None), len(chosen)

    def inside(row):
        return row['truth'][0] in row['reported']

    single = [row for row in results if row['group'] in ('strong', 'weak')]
    sizes = [len(row['reported']) for row in single if row['reported']]
    ratios = [row['unseen'] / row['clean'] for row in single
              if 'unseen' in row and row['truth'][0] in row['missing']]
    return {
        'truth in the reported set, strong [%]': (*share('strong', inside), 'at least 95'),
        'truth in the reported set, weak [%]': (*share('weak', inside), 'at least 85'),
        'truth named first, strong [%]': (
            *share('strong', lambda row: row['missing'][:1] == row['truth']), 'at least 85'),
        'mean size of the reported set': (
            float(np.mean(sizes)) if sizes else None, len(sizes), 'at most 2.5'),
        'false alarm when nothing is hidden [%]': (
            *share('none', lambda row: row['verdict'] in ('missing', 'unknown')), 'at most 5'),
        'unknown when in no catalogue [%]': (
            *share('unknown', lambda row: row['verdict'] == 'unknown'), 'at least 80'),
        'both of a pair found [%]': (
            *share('pair', lambda row: set(row['truth']) <= set(row['reported'])), 'at least 75'),
        'error on the unseen recording over that without effect, median': (
            float(np.median(ratios)) if ratios else None, len(ratios), 'at most 1.3'),
        'the same, share of cases within 1.3 [%]': (
            100.0 * float(np.mean(np.array(ratios) <= 1.3)) if ratios else None, len(ratios), '')}


def to_markdown(results):
    """Return the scores, and a line for each effect, as two tables."""
    lines = ['| score | asked | reached | cases |', '|---|---|---|---|']
    for name, (value, count, asked) in score(results).items():
        lines.append(f'| {name} | {asked} | {"-" if value is None else f"{value:.3g}"} | {count} |')
    lines += ['', '| hidden | strong: named first | strong: in the set | weak: in the set | '
              'unseen error over clean |', '|---|---|---|---|---|']
    for name in sorted({row['truth'][0] for row in results if row['group'] in STRENGTHS}):
        cells = []
        for group, good in (('strong', lambda row: row['missing'][:1] == [name]),
                            ('strong', lambda row: name in row['reported']),
                            ('weak', lambda row: name in row['reported'])):
            chosen = [row for row in results if row['group'] == group and row['truth'] == [name]]
            cells.append(f'{sum(map(good, chosen))} of {len(chosen)}')
        ratios = [row['unseen'] / row['clean'] for row in results
                  if row['group'] in STRENGTHS and row['truth'] == [name] and 'unseen' in row
                  and name in row['missing']]
        cells.append(f'{np.median(ratios):.2f}' if ratios else '-')
        lines.append(f'| `{name}` | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def write_page(results, path):
    """Put the tables between the marks of a page."""
    page = Path(path)
    before, rest = page.read_text(encoding='utf-8').split(MARKS[0])
    _, after = rest.split(MARKS[1])
    page.write_text(f'{before}{MARKS[0]}\n{to_markdown(results)}{MARKS[1]}{after}',
                    encoding='utf-8')


def main():
    """Run the grid and write the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seeds', type=int, default=5, help='for each effect and strength')
    parser.add_argument('--others', type=int, default=20, help='cases of none, unknown, pairs')
    parser.add_argument('--quick', action='store_true', help='every ninth case')
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
    chosen = cases(args.seeds, args.others, args.quick)
    if args.first_seed is not None:
        chosen = [(group, protocol, effects, seed - FIRST_SEED + args.first_seed)
                  for group, protocol, effects, seed in chosen]
    if args.only:
        chosen = [case for case in chosen if args.only in (case[0], *case[2])]
    # Seed by seed, so that what is scored so far is a fair sample.
    chosen.sort(key=lambda case: (case[0] in ('strong', 'weak'), case[-1]))
    results = []
    seeds = sorted({case[-1] for case in chosen})
    models = dict(zip(seeds, in_parallel(
        [delayed(base_model)(seed, not args.paper_model) for seed in seeds], args.jobs)))
    print(f'{len(models)} specimens identified', file=sys.stderr, flush=True)
    for row in in_parallel([delayed(run)(case, models[case[-1]]) for case in chosen], args.jobs):
        results.append(row)
        print(f'{len(results)}/{len(chosen)} {row["group"]} {row["protocol"]} {row["truth"]} '
              f'seed {row["seed"]}: {row["verdict"]} {row["missing"]} {row["alternatives"]} '
              f'{row["rmse_before"]:.4f} -> {row["rmse_after"]:.4f} ({row["structure"]:.4f}) '
              f'{row["top"]} {row["seconds"]:.0f} s', file=sys.stderr, flush=True)
        write(results, args.output)
    for name, (value, count, asked) in score(results).items():
        text = 'no case' if value is None else f'{value:.4g}'
        print(f'{name:64s} {text:>8s}   ({count} cases; asked: {asked})')
    if args.page:
        write_page(results, args.page)
    return None


def write(results, path):
    """Write scores and cases; what is there when the grid is interrupted counts."""
    scores = {name: value for name, (value, *_) in score(results).items()}
    Path(path).write_text(json.dumps({'scores': scores, 'cases': results}, indent=1) + '\n',
                          encoding='utf-8')


if __name__ == '__main__':
    main()
