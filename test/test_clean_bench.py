# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How often a bench is said to show what it does not: tables that a model itself has made."""

from model_support import autoregressive, with_noise
import numpy as np
import pytest

from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.effects import catalogue
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.measurements import Measurement

TRIALS = {'length_trials': range(4), 'force_trials': [0]}
UNIVERSAL = ['stress_dependence', 'stress_dependent_strain', 'series_compliance']
# Of the length [m]: about half of what a model without effects leaves of the laboratory's tables.
NOISE = 2e-4
SEEDS = 8
# If an effect were named in 5 % of all tables, no more of 8 would be with a probability of 99.4 %.
MOST = 2


@pytest.fixture(scope='module')
def bench():
    """Return a function for lengths that a model with or without effects has made, and forces."""
    tables = bench_tables({}, 11)
    force, length = (Measurement.from_columns(tables[f'{name}.csv'])
                     for name in ('force', 'length'))
    plain = identify(length, force, **TRIALS).model
    usual, added = add_effects(plain, length, force, UNIVERSAL, **TRIALS)
    assert plain.effects == [] and {effect.id for effect in added} == set(UNIVERSAL)
    fitted = length.select(range(4))

    def made(as_usual, rho, seed):
        noise = autoregressive(np.random.default_rng(seed), 4, fitted.rows // 4, rho)
        lengths = (usual if as_usual else plain).predict(fitted)
        clean = Measurement.from_columns({**fitted.columns, 'length': lengths})
        return with_noise(clean, NOISE * noise), force
    return made


def not_universal(names):
    """Return those effects that a muscle under load need not have."""
    return [name for name in names if not catalogue()[name].universal]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('rho', [0.0, 0.9])
@pytest.mark.parametrize('as_usual', [False, True], ids=['without effects', 'as usual'])
def test_what_no_muscle_need_have_is_seldom_named_on_a_bench_without_it(bench, as_usual, rho):
    """
    One table in twenty is asked for, over the whole catalogue together.

    Noise that lasts for ten rows looks like wear, which grows from row to row.
    """
    wrong = {}
    for seed in range(SEEDS):
        length, force = bench(as_usual, rho, seed)
        found = diagnose(identify(length, force, **TRIALS).model, [length])
        if not_universal(found.missing):
            wrong[seed] = found.missing
    assert len(wrong) <= MOST, wrong


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('rho', [0.0, 0.9])
def test_nothing_is_added_to_a_bench_without_any_effect(bench, rho):
    """Beside what is known beforehand, of three tables to none."""
    for seed in range(3):
        length, force = bench(False, rho, seed)
        model = identify(length, force, **TRIALS).model
        _, added = add_effects(model, length, force, **TRIALS)
        assert not_universal(effect.id for effect in added) == []
