# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A loop as wide as its load says: on the bench, on the arm, in the inverse, and found."""

import dataclasses

from hidden_cases import clean_bench, TRIALS
import numpy as np
import pytest

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.effects import catalogue
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.kernels.load_play import follow
from hysteresis_ros.laboratory import sequences
from hysteresis_ros.laboratory.bench import Bench
from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import specimen
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import Simulator
from hysteresis_ros.model.chain import Chain
from model_support import (
    arm_run, bicep_model, effect_of, misses_of_targets, wandering_voltage)

LOADS = (1.176, 3.136, 5.096, 7.056)


def slopes(model, g=0.3):
    """Return the effect with a value."""
    return effect_of(model, 'transformation_slopes', g=g)


@pytest.mark.parametrize('g', [0.35, -0.35])
def test_relays_switch_on_the_lines_of_both_directions(g):
    """Whatever drive and load do together: brute force with relays of their own."""
    model = bicep_model()
    effect = slopes(model, g)
    rng = np.random.default_rng(4)
    x, load = rng.uniform(0.0, 20.0, 400), rng.uniform(0.0, 2.0 * model.mean_load, 400)
    width = effect.loop_width(load, model.surroundings)
    inputs = follow(load - x, width, np.array([len(x)]))
    for low, high in ((-9.0, -8.5), (-12.0, -2.0), (-3.0, 1.0)):
        up, state = [], True
        down = False
        for heated, cooled, given in zip(load - x, load - width - x, inputs):
            state = True if cooled > high else False if heated < low else state
            down = True if given > high else False if given < low else down
            up.append(state == down)
        # Both begin cold; the first switch makes them one.
        assert all(up[10:])


@pytest.mark.parametrize('g', [0.1, -0.1])
def test_a_load_that_counts_more_widens_or_narrows_as_much_more(g):
    model, loads = bicep_model(), np.array([0.0, 1.0, 3.0])
    width = slopes(model, g).loop_width(loads, model.surroundings)
    for shift in (-0.2, 0.0, 0.5):
        more = effect_of(model, 'stress_dependence', shift=shift)
        found = Chain([slopes(model, g), more], model.surroundings).loop_width(loads)
        np.testing.assert_allclose(found, (1.0 + shift) * width)


def test_width_grows_or_shrinks_with_the_load_and_is_never_negative():
    model = bicep_model()
    loads = np.array([0.0, 1.0, 3.0, 6.0, 9.0])
    np.testing.assert_allclose(
        slopes(model, 0.2).loop_width(loads, model.surroundings), 0.2 * loads)
    np.testing.assert_allclose(
        slopes(model, -0.5).loop_width(loads, model.surroundings), [3.0, 2.5, 1.5, 0.0, 0.0])


@pytest.mark.parametrize('g, others', [
    (0.3, ()), (-0.4, ('stress_dependent_strain', 'series_compliance')),
    (0.3, ('stress_dependent_strain', 'coulomb_friction')),
    (-0.4, ('unequal_muscles', 'coulomb_friction'))])
def test_the_inverse_brings_the_arm_to_its_targets(g, others):
    """What the controller asks for is what the forward model then does."""
    model = bicep_model(others)
    model = model.with_effects([*model.effects, slopes(model, g)])
    assert np.max(misses_of_targets(model)) < 0.01


def test_the_inverse_reaches_lengths_under_a_weight():
    model = bicep_model()
    model = model.with_effects([slopes(model)])
    for load in (2.0, 4.0):
        controller = model.controller()
        wanted = np.random.default_rng(2).uniform(-0.014, -0.004, 20)
        points = [controller.setpoint(float(length), load) for length in wanted]
        table = Measurement.from_columns({
            'trial': np.zeros(20), 'step': np.arange(20.0), 'force': np.full(20, load),
            'voltage': np.array([point.voltage for point in points]), 'length': wanted})
        free = [not point.saturated for point in points]
        assert sum(free) >= 10
        np.testing.assert_allclose(model.predict(table)[free], wanted[free], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize('names', [(), ('coulomb_friction',), ('inertia',), ('unequal_muscles',)])
def test_without_growth_of_the_width_nothing_changes(names):
    model = bicep_model(names)
    run = arm_run(wandering_voltage(40, seed=3), 0.1)
    without = Simulator(model, run).run(model.effects)
    np.testing.assert_array_equal(
        Simulator(model, run).run([*model.effects, slopes(model, 0.0)]), without)
    assert np.abs(Simulator(model, run).run([*model.effects, slopes(model)]) - without).max() > 1e-3


def bench_tables(material, seed):
    """Return the tables of the bench with a wire."""
    bench = Bench(Conditions(material=material), seed=[seed, 11])
    rng = np.random.default_rng([seed, 21])
    drive = sequences.damped_oscillation()
    force = [('force', 0.0, drive)]
    length = [('length', load, drive) for load in LOADS]
    length += [('length', load, sequences.random_steps(40, rng)) for load in LOADS]
    tables = []
    for trials in (force, length):
        columns = {'trial': [], 'voltage': [], 'force': [], 'length': []}
        for number, (what, load, voltage) in enumerate(trials):
            columns['trial'].append(np.full(len(voltage), float(number)))
            columns['voltage'].append(voltage)
            if what == 'force':
                columns['force'].append(bench.force_trial(voltage))
            else:
                columns['force'].append(np.full(len(voltage), load))
                columns['length'].append(bench.length_trial(voltage, load))
        tables.append(Measurement.from_columns({
            name: np.concatenate(values) for name, values in columns.items() if values}))
    return tables


@pytest.mark.slow
@pytest.mark.long
def test_slopes_that_differ_are_named_on_the_bench_and_no_r_phase():
    """C_M / C_A = 1.3; that came out as an R-phase."""
    material = dataclasses.replace(specimen(2), cooling_ratio=1.3)
    force, length = bench_tables(material, 2)
    trials = {'length_trials': range(4), 'force_trials': [0]}
    model = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **trials).model
    extended, added = add_effects(model, length, force, **trials)
    found = {effect.id: effect for effect in added}
    assert set(found) <= {'stress_dependence', 'stress_dependent_strain', 'series_compliance',
                          'transformation_slopes'}
    assert found['transformation_slopes'].g == pytest.approx(1.0 - 1.0 / 1.3, rel=0.2)
    low, high = found['transformation_slopes'].intervals['g']
    assert 0.05 < low < high < 0.45
    before, after = (one.metrics['length']['verification']['model']['mean_percent']
                     for one in (model, extended))
    assert after < 0.5 and after < 0.3 * before


@pytest.mark.slow
@pytest.mark.long
def test_where_loads_left_out_tell_little_the_rows_fitted_decide():
    """Without slopes C followed the strain, and loads left out were predicted as well."""
    _, added = add_effects(*clean_bench(7403, 'lagoudas'), **TRIALS)
    assert {effect.id for effect in added} == {
        'stress_dependence', 'stress_dependent_strain', 'series_compliance',
        'transformation_slopes'}


def test_it_makes_no_sense_without_a_load_or_for_a_muscle_that_extends():
    kind = catalogue()['transformation_slopes']
    there = bicep_model().surroundings
    assert kind.available(there)
    assert not kind.available(there._replace(load=0.0))
    assert not kind.available(there._replace(sign=1))
