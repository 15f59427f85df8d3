# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An effect hidden in an arm of the virtual laboratory, and what the diagnosis says of it."""

import functools

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.measurements import Measurement

TRIALS = {'length_trials': range(4), 'force_trials': [0]}
UNIVERSAL = ['stress_dependence', 'stress_dependent_strain', 'series_compliance']


def clean_bench(seed, muscle='grains'):
    """Return a plain model of a bench on which nothing is hidden, its length and force table."""
    tables = experiment_tables('bench', {}, seed, muscle)
    force, length = (Measurement.from_columns(tables[name]) for name in
                     ('force.csv', 'length.csv'))
    geometry = BicepGeometry.from_mapping(GEOMETRY)
    return identify(length, force, geometry=geometry, **TRIALS).model, length, force


@functools.cache
def bench_model(seed):
    """Return the model of a specimen's bench with what every loaded muscle has."""
    return add_effects(*clean_bench(seed), UNIVERSAL, **TRIALS)[0]


def found_in(effects, seed, names=None, protocol='arm-dynamic', trials=(0, 1, 2, 3), every=1):
    """Return the diagnosis of an arm with hidden effects, from some trials of a recording."""
    table = experiment_tables(protocol, effects, seed)['train.csv']
    run = Measurement.from_columns({name: values[::every] for name, values in table.items()})
    return diagnose(bench_model(seed), [run.select(trials)], names, seed=seed)
