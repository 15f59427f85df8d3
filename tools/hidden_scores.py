# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Scores of the hidden-effect grid: as JSON, as text, and as tables of a page."""

import json
from pathlib import Path
from typing import Any

import numpy as np

# Groups with one hidden effect.
SINGLE = 'strong', 'weak'
# Between these a page holds the tables.
MARKS = '<!-- hidden effects: begin -->', '<!-- hidden effects: end -->'
# Bins of the probabilities in the reliability table: name, and where each begins [%].
BINS = {'<50': 0.0, '50-70': 50.0, '70-90': 70.0, '>=90': 90.0}
# A set with a residual of at most this times that of the truth predicts as well.
AS_WELL = 1.05
# Earlier outputs do not name the muscle.
FIRST_MUSCLE = 'grains'

# The same to an arm that is at rest in every row: they count as one.
TWINS = {'supply_sag': 'airflow', 'airflow': 'supply_sag'}

Row = dict[str, Any]


def inside(row: Row) -> bool:
    """Whether the one effect that is hidden is in the reported set."""
    return not _named(row).isdisjoint(row['reported'])


def first(row: Row) -> bool:
    """Whether it is named first."""
    return not _named(row).isdisjoint(row['missing'][:1])


def _named(row: Row) -> set[str]:
    return {row['truth'][0], TWINS.get(row['truth'][0], row['truth'][0])}


def score(results: list[Row]) -> dict[str, tuple]:
    """Return for each score what was reached, how many cases it rests on, and what is asked."""
    def share(group, good):
        chosen = [row for row in results if row['group'] == group]
        return (100.0 * sum(map(good, chosen)) / len(chosen) if chosen else None), len(chosen)

    def both(row):
        return set(row['truth']) <= set(row['reported'])

    def as_well(row):
        return both(row) or (0 < len(row['missing']) <= len(row['truth']) and
                             row.get('unseen', 1.0) <= AS_WELL * row.get('unseen_of_truth', 0.0))

    single = [row for row in results if row['group'] in SINGLE]
    sizes = [len(row['reported']) for row in single if row['reported']]
    ratios = [row['unseen'] / row['clean'] for row in single
              if 'unseen' in row and row['truth'][0] in row['missing']]
    return {
        'truth in the reported set, strong [%]': (*share('strong', inside), 'at least 97'),
        'truth in the reported set, weak [%]': (*share('weak', inside), 'at least 90'),
        'truth named first, strong [%]': (
            *share('strong', first), 'at least 90'),
        'mean size of the reported set': (
            float(np.mean(sizes)) if sizes else None, len(sizes), 'at most 2.2'),
        'false alarm when nothing is hidden [%]': (
            *share('none', lambda row: row['verdict'] in ('missing', 'unknown')), 'at most 2'),
        'unknown when in no catalogue [%]': (
            *share('unknown', lambda row: row['verdict'] == 'unknown'), 'at least 85'),
        'both of a pair found [%]': (
            *share('pair', both), 'at least 80'),
        'both found, or as few that predict as well [%]': (*share('pair', as_well), ''),
        'error on the unseen recording over that without effect, median': (
            float(np.median(ratios)) if ratios else None, len(ratios), 'at most 1.3'),
        'the same, share of cases within 1.3 [%]': (
            100.0 * float(np.mean(np.array(ratios) <= 1.3)) if ratios else None, len(ratios), '')}


def muscles_of(results: list[Row]) -> dict[str, list[Row]]:
    """Return the results of each muscle, in the order in which the muscles come first."""
    found: dict[str, list[Row]] = {}
    for row in results:
        found.setdefault(row.get('muscle', FIRST_MUSCLE), []).append(row)
    return found


def reliability(results: list[Row]) -> list[Row]:
    """
    Compare the probabilities of the most probable sets with how often these are the truth.

    Parameters
    ----------
    results : list of dict
        From `run`; those of earlier outputs without `sets` do not count.

    Returns
    -------
    list of dict
        For all muscles together (where there are several) and for each of them, bin by bin: its
        number of cases, their mean probability [%] and the share [%] in which the set is true.
    """
    by_muscle = muscles_of(results)
    if len(by_muscle) > 1:
        by_muscle = {'all': results, **by_muscle}
    edges = list(BINS.values())
    rows = []
    for muscle, chosen in by_muscle.items():
        said = [most_probable(row) for row in chosen if row.get('sets')]
        places = np.searchsorted(edges, [100.0 * share for share, _ in said], side='right') - 1
        for place, name in enumerate(BINS):
            inside = np.array(said)[places == place] if said else np.empty((0, 2))
            mean, true = 100.0 * inside.mean(axis=0) if len(inside) else (None, None)
            rows.append({'muscle': muscle, 'bin': name, 'cases': len(inside),
                         'mean probability [%]': mean, 'true [%]': true})
    return rows


def most_probable(row: Row) -> tuple[float, bool]:
    """Return the probability of the most probable set, and whether that set is the truth."""
    best = max(row['sets'], key=lambda one: one['probability'])
    truth = {'unknown'} if row['group'] == 'unknown' else set(row['truth'])
    return best['probability'], set(best['effects']) == truth


def to_markdown(results: list[Row]) -> str:
    """Return scores and reliability, and a line for each effect, as tables."""
    by_muscle = muscles_of(results)
    scores = [score(rows) for rows in by_muscle.values()]
    lines = ['| score | asked | ' + ' | '.join(f'{name} | cases' for name in by_muscle) + ' |',
             '|---|---' + '|---|---' * len(by_muscle) + '|']
    for name, (*_, asked) in score(results).items():
        cells = [f'{_number(value)} | {count}' for value, count, _ in (one[name] for one in scores)]
        lines.append(f'| {name} | {asked} | ' + ' | '.join(cells) + ' |')
    if any(row['cases'] for row in reliability(results)):
        lines += ['', '| muscle | probability of the first set [%] | cases | mean [%] | '
                  'it is true [%] |', '|---|---|---|---|---|']
        lines += [f'| {row["muscle"]} | {row["bin"]} | {row["cases"]} | '
                  f'{_number(row["mean probability [%]"])} | {_number(row["true [%]"])} |'
                  for row in reliability(results)]
    if any(row['group'] in SINGLE for row in results):
        lines += ['', *_effect_lines(by_muscle)]
    return '\n'.join(lines) + '\n'


def _number(value: float | None) -> str:
    return '-' if value is None else f'{value:.3g}'


def _effect_lines(by_muscle: dict[str, list[Row]]) -> list[str]:
    """Return the table of the effects, a column for each muscle."""
    lines = ['| hidden: strong, named first and in the set; weak, in the set | '
             + ' | '.join(by_muscle) + ' |', '|---' * (1 + len(by_muscle)) + '|']
    for name in sorted({row['truth'][0] for rows in by_muscle.values() for row in rows
                        if row['group'] in SINGLE}):
        lines.append(f'| `{name}` | ' + ' | '.join(
            _effect_cell(name, rows) for rows in by_muscle.values()) + ' |')
    return lines


def _effect_cell(name: str, results: list[Row]) -> str:
    """Return how often an effect was found on one muscle; '-' where it was not hidden."""
    strong, weak = ([row for row in results if row['group'] == group and row['truth'] == [name]]
                    for group in SINGLE)
    cells = []
    if strong:
        cells.append(f'{sum(map(first, strong))}, {sum(map(inside, strong))} of {len(strong)}')
    if weak:
        cells.append(f'{sum(map(inside, weak))} of {len(weak)}')
    return '; '.join(cells) or '-'


def write_page(results: list[Row], path: str | Path) -> None:
    """Put the tables between the marks of a page."""
    page = Path(path)
    before, rest = page.read_text(encoding='utf-8').split(MARKS[0])
    _, after = rest.split(MARKS[1])
    page.write_text(f'{before}{MARKS[0]}\n{to_markdown(results)}{MARKS[1]}{after}',
                    encoding='utf-8')


def print_scores(results: list[Row]) -> None:
    """Print the scores of each muscle and the reliability of the probabilities."""
    for muscle, rows in muscles_of(results).items():
        print(f'{muscle}:')
        for name, (value, count, asked) in score(rows).items():
            text = 'no case' if value is None else f'{value:.4g}'
            print(f'{name:64s} {text:>8s}   ({count} cases; asked: {asked})')
    print('probability of the most probable set, and how often it is the truth:')
    for row in reliability(results):
        print(f'{row["muscle"]:9s} {row["bin"]:>6s} %: {row["cases"]:4d} cases, mean '
              f'{_number(row["mean probability [%]"])} %, true {_number(row["true [%]"])} %')


def write(results: list[Row], path: str | Path) -> None:
    """Write scores and cases; what is there when the grid is interrupted counts."""
    content = {'scores': _values(results),
               'muscles': {muscle: _values(rows) for muscle, rows in muscles_of(results).items()},
               'reliability': reliability(results), 'cases': results}
    Path(path).write_text(json.dumps(content, indent=1) + '\n', encoding='utf-8')


def _values(results: list[Row]) -> dict[str, float | None]:
    return {name: value for name, (value, *_) in score(results).items()}
