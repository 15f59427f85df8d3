# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle that creeps shows it at the ends of holds, on the arm and on the bench."""

import numpy as np
import pytest

from hidden_cases import bench_model, found_in, TRIALS
from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import bench_of, Plant
from hysteresis_ros.measurements import Measurement
from model_support import bicep_model, effect_of, runs


def miss(model, targets, **options):
    """Return how far an arm of the laboratory that creeps is off, mean of ``|e|`` [deg]."""
    controller = model.controller(arm=True)
    volts = [controller.setpoint(*controller.reference(target)).voltage for target in targets]
    reached = Plant(5, {'creep': 1.0}).arm_trial(volts)['angle']
    return np.degrees(np.mean(np.abs(reached - targets)))


def test_what_has_crept_at_the_ends_of_holds_is_fitted_without_the_time_that_they_hide():
    base = bicep_model()
    creeping = base.with_effects([effect_of(base, 'creep', c=0.3, t0=3.0)])
    run = runs(creeping)
    assert np.std(run.column('angle') - base.predict(run)) > np.radians(0.3)
    made = extend(base, ['creep'], [run]).model.effects[0]
    assert made.c == pytest.approx(0.3, rel=0.02) and made.t0 == 3.0
    assert list(made.intervals) == ['c']
    # In motion both are free.
    moving = extend(base, ['creep'], [runs(creeping, dt=0.5)]).model.effects[0]
    assert {'c', 't0'} <= set(moving.intervals)


@pytest.mark.long
@pytest.mark.parametrize('strength', [1.0, 0.4])
def test_creep_is_named_in_the_settled_rows_of_an_arm(strength):
    found = found_in({'creep': strength}, 5, protocol='arm-steps')
    assert (found.verdict, found.missing) == ('missing', ['creep'])
    assert found.rmse_after < 0.6 * found.rmse_before


@pytest.mark.slow
def test_an_arm_that_creeps_comes_nearer_to_its_targets():
    """The last setpoints count on what creeps until the next one."""
    table = experiment_tables('arm-steps', {'creep': 1.0}, 5)['train.csv']
    model = bench_model(5)
    extended = extend(model, ['creep'], [Measurement.from_columns(table)]).model
    targets = np.radians(np.random.default_rng(1).uniform(100.0, 130.0, 30))
    assert miss(extended, targets) < 0.4 * miss(model, targets)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('muscle, seed', [('tanaka', 8002), ('grains', 3), ('lagoudas', 3)])
def test_creep_on_the_bench_is_named_beside_what_the_load_does(muscle, seed):
    """On the first none of it shows without a loop whose width grows with the load."""
    tables = experiment_tables('bench', {'creep': 1.0}, seed, muscle)
    force, length = (Measurement.from_columns(tables[name])
                     for name in ('force.csv', 'length.csv'))
    plain = identify(
        length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **TRIALS).model
    model, added = add_effects(plain, length, force, **TRIALS)
    assert {'creep', 'stress_dependence'} < {effect.id for effect in added}
    before, after = (one.metrics['length']['verification']['model']['mean_percent']
                     for one in (plain, model))
    assert after < 0.2 * before

    # Lengths under a weight are reached better, too.
    rows = length.column('trial') == 1.0
    load, seen = float(np.mean(length.column('force')[rows])), length.column('length')[rows]
    targets = np.random.default_rng(4).uniform(*np.quantile(seen, [0.1, 0.9]), 30)
    missed = []
    for one in (plain, model):
        controller = one.controller()
        volts = [controller.setpoint(target, load).voltage for target in targets]
        reached = bench_of(seed, {'creep': 1.0}, muscle=muscle).length_trial(volts, load)
        missed.append(np.mean(np.abs(reached - targets)))
    assert missed[1] < 0.6 * missed[0]
