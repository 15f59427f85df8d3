# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Identification: how long it takes, and how far off it is beside the paper's recipe and the line.

The recipe is what the paper describes: weights of the cells by non-negative least squares without
regularisation, on the same tables of the virtual laboratory.
"""

import time

import numpy as np

from hysteresis_ros.identification.bench import identify
from hysteresis_ros.identification.least_squares import SLACK, fit_weights
from hysteresis_ros.identification.operators import smoothness
from hysteresis_ros.laboratory.experiments import LOADS, bench_tables
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.operators import cell_areas, signed_areas
from hysteresis_ros.table1 import FORCE_TRIALS, LENGTH_TRIALS

SEEDS, QUICK_SEEDS = range(3), range(1)
REPEATS, QUICK_REPEATS = 5, 1
TABLES = {'force': 'F', 'length': 'L'}


def identification_benchmarks(quick: bool) -> dict:
    """
    Measure time and errors of the identification.

    Returns
    -------
    dict
        ``identify_148x211_s`` is the paper's problem with cross-validation over 15 strengths,
        ``identify_bench_s`` all of `identify` on both tables; errors are mean |e| in percent of
        the range, averaged over specimens, and ratios to the paper's recipe.
    """
    results = {'identify_148x211_s': problem_time(QUICK_REPEATS if quick else REPEATS)}
    found = {'ours': {}, 'recipe': {}, 'linear': {}}
    times = []
    for seed in QUICK_SEEDS if quick else SEEDS:
        tables = bench_tables({}, seed)
        length = Measurement.from_columns(tables['length.csv'])
        force = Measurement.from_columns(tables['force.csv'])
        options = {'force_trials': FORCE_TRIALS, 'length_trials': LENGTH_TRIALS}
        start = time.perf_counter()
        model = identify(length, force, **options).model
        times.append(time.perf_counter() - start)
        recipe = identify(length, force, plain=True, **options).model
        for table, letter in TABLES.items():
            for part in ('identification', 'verification'):
                key = f'{letter}_{part}'
                of_model = model.metrics[table][part]
                for method, value in (('ours', of_model['model']), ('linear', of_model['linear']),
                                      ('recipe', recipe.metrics[table][part]['model'])):
                    found[method].setdefault(key, []).append(value['mean_percent'])
    results['identify_bench_s'] = float(np.median(times))
    for key, values in found['ours'].items():
        means = {method: float(np.mean(found[method][key])) for method in found}
        results[f'{key}_percent'] = means['ours']
        results[f'{key}_over_recipe_ratio'] = means['ours'] / means['recipe']
        results[f'{key}_linear_over_ours_ratio'] = means['linear'] / means['ours']
    return results


def problem_time(repeats: int) -> float:
    """Return the median time of the problem with 148 rows and 211 unknowns [s]."""
    tables = bench_tables({}, 0)['length.csv']
    chosen = np.isin(tables['trial'], LENGTH_TRIALS)
    groups = tables['trial'][chosen]
    inputs = tables['force'][chosen] - 15.0 * (tables['voltage'][chosen] / 6.0) ** 2
    nodes = np.linspace(inputs.min(), inputs.max(), 21)
    rows = np.concatenate([signed_areas(nodes, inputs[groups == k]) for k in range(len(LOADS))])
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        fit_weights(rows, tables['length'][chosen], groups=groups, scale=cell_areas(nodes),
                    penalty=smoothness(nodes), slack=SLACK)
        times.append(time.perf_counter() - start)
    return float(np.median(times))
