# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Wires whose ends stay cold: the mean over their places, its controller, and the laboratory's."""

import math

import numpy as np
import pytest
from scipy import optimize

from hidden_cases import found_in
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import Plant
from hysteresis_ros.laboratory.clamps import excess
from hysteresis_ros.laboratory.plant import specimen
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.operators import PrandtlIshlinskii
from model_support import arm_run, bicep_model, effect_of, runs, wandering_voltage

MODEL = bicep_model()
# The same muscle, where the drive squared itself stands against the load.
LINEAR = MODEL.with_effects([effect_of(MODEL, 'stress_dependence', C=0.4)])


def clamped(share, *names, model=MODEL):
    """Return a model whose wires have cold ends, with other effects."""
    return model.with_effects([*model.effects, effect_of(model, 'cold_clamps', share=share),
                               *(effect_of(model, name) for name in names)])


def excess_of_fin(places, share):
    """Return Incropera's excess at distances from the clamp over half the length."""
    half = 1.0 / share
    return 1.0 - np.cosh(half * (1.0 - places)) / math.cosh(half)


@pytest.mark.parametrize('share', [0.005, 0.05, 0.15, 0.2, 0.3, 1.0])
def test_the_places_make_up_the_wire(share):
    parts, warm = catalogue()['cold_clamps'](share=share).places
    assert parts.sum() == pytest.approx(1.0, rel=1e-12)
    assert np.all(parts > 0.0) and np.all((0.0 < warm) & (warm <= 1.0))
    # Mean, and mean square, of 1 - cosh(z) / cosh(Z).
    places = (np.arange(200000) + 0.5) / 200000
    fin = excess_of_fin(places, share)
    assert parts @ warm == pytest.approx(fin.mean(), abs=1e-6)
    assert parts @ warm ** 2 == pytest.approx(np.mean(fin ** 2), abs=1e-5)


def test_without_cold_ends_the_operator_is_the_models_own():
    model = clamped(0.0)
    assert model.chain().places is None
    stage = model.require_length_stage(model.chain())
    np.testing.assert_array_equal(stage.weights, MODEL.length_stage.weights)


def test_wires_that_differ_do_not_share_an_operator_or_its_memory():
    def stage_of(model):
        return model.require_length_stage(model.chain())
    one, again = stage_of(clamped(0.1)), stage_of(clamped(0.1))
    np.testing.assert_array_equal(one.weights, again.weights)
    one.step(one.lower + 0.5 * (one.upper - one.lower))
    assert again.save() == stage_of(clamped(0.1)).save() != one.save()
    for other in (clamped(0.12), clamped(0.1, model=LINEAR), clamped(0.1, 'stress_dependence')):
        assert not np.array_equal(stage_of(other).weights, one.weights), other.effects


def arm_of_fifty_places(model, voltage, share):
    """Balance an arm whose wires are fifty places with an operator each; its angles [rad]."""
    chain, geometry = model.chain(), model.geometry
    warm = excess_of_fin((np.arange(50) + 0.5) / 50, share)
    firsts, stages = zip(*((model.first_stage(chain), model.require_length_stage())
                           for _ in warm))
    angles = []
    for volts in np.append(0.0, voltage):
        x = [first.step(part * volts ** 2) for first, part in zip(firsts, warm)]

        def lacking(theta, x=x):
            load = geometry.force(theta)
            return np.mean([stage.peek(load - own) for stage, own in zip(stages, x)]
                           ) - geometry.length(theta)
        angles.append(optimize.brentq(lacking, *geometry.angle_range, xtol=1e-8))
        for stage, own in zip(stages, x):
            stage.step(geometry.force(angles[-1]) - own)
    return np.array(angles[1:])


# A first stage with hysteresis counts with the mean of its branches only.
@pytest.mark.parametrize('model, share, highest, worst', [
    (LINEAR, 0.06, 6.0, 0.005), (LINEAR, 0.15, 6.0, 0.01), (LINEAR, 0.15, 8.0, 0.01),
    (MODEL, 0.06, 6.0, 0.01), (MODEL, 0.15, 6.0, 0.021)])
def test_the_arm_is_that_of_fifty_places_with_an_operator_each(model, share, highest, worst):
    voltage = np.concatenate((np.linspace(0.0, highest, 13), np.linspace(highest, 2.5, 8),
                              np.linspace(2.5, 4.5, 5), np.linspace(4.5, 0.0, 8)))
    run = arm_run(voltage)
    plain, found = model.predict(run), clamped(share, model=model).predict(run)
    expected = arm_of_fifty_places(model, voltage, share)
    assert np.max(np.abs(found - expected)) < worst * np.ptp(plain)
    assert np.max(np.abs(plain - expected)) > 5.0 * worst * np.ptp(plain)


def test_a_hanging_wire_is_the_mean_of_its_places_too():
    """Without an arm, under the mean load of the bench."""
    model = clamped(0.15, model=bicep_model(geometry=None).with_effects(LINEAR.effects))
    voltage = wandering_voltage(60)
    bench = Measurement.from_columns({
        'trial': np.zeros(60), 'step': np.arange(60), 'voltage': voltage,
        'force': np.full(60, model.mean_load), 'length': np.zeros(60)})
    mean = 0.0
    for warm in excess_of_fin((np.arange(50) + 0.5) / 50, 0.15):
        x = 0.4 * warm * np.append(0.0, voltage) ** 2
        mean = mean + model.require_length_stage().simulate(model.mean_load - x)[1:] / 50.0
    assert np.max(np.abs(model.predict(bench) - mean)) < 0.008 * 0.021


def test_the_cold_arm_is_the_same_and_the_hot_one_lacks_stroke():
    run = arm_run([0.0, 6.0])
    plain = LINEAR.predict(run)
    weak, strong = (clamped(share, model=LINEAR).predict(run) - plain for share in (0.06, 0.15))
    stroke = plain[0] - plain[1]
    # Cold all places are alike, but for the load at which they are.
    assert abs(weak[0]) < 0.005 * stroke and abs(strong[0]) < 0.01 * stroke
    # On average the wire is colder by the share of its ends, which the stroke follows about.
    assert 0.03 < weak[1] / stroke < 0.12 < strong[1] / stroke < 0.3


def test_the_angle_is_a_smooth_function_of_the_share():
    run = arm_run(np.append(wandering_voltage(40, 2), 6.0))
    shares = np.arange(0.01, 0.3, 0.002)
    angles = np.array([clamped(share).predict(run) for share in shares])
    slope = np.diff(angles, axis=0) / 0.002
    # A fit takes differences: no slope changes by more than a hundredth of the largest at once.
    assert np.max(np.abs(np.diff(slope, axis=0))) < 0.03 * np.max(np.abs(slope))


@pytest.mark.parametrize('names', [
    (), ('thermal_lag', 'backlash'), ('unequal_muscles', 'coulomb_friction'), ('inertia',),
    ('stress_dependent_strain', 'formation_memory'), ('latent_heat',), ('transformation_slopes',)])
def test_observer_and_simulation_agree(names):
    model = clamped(0.15, *names)
    run = arm_run(wandering_voltage(80, 5), 0.3)
    observer = model.observer()
    observer.reset(0.0)
    stepped = [observer.step(t, v) for t, v in zip(run.time, run.columns['voltage'])]
    np.testing.assert_allclose(stepped, model.predict(run), atol=math.radians(0.01))


@pytest.mark.parametrize('share', [0.05, 0.2])
def test_a_controller_reaches_what_one_without_it_misses(share):
    model = clamped(share)
    knowing, blind, missed = model.controller(), MODEL.controller(), []
    arms = model.observer(), model.observer()
    for number, target in enumerate(np.radians([100.0, 90.0, 96.0, 88.0, 104.0])):
        angles = [arm.step(30.0 * number, made.setpoint(*made.reference(target)).voltage)
                  for arm, made in zip(arms, (knowing, blind))]
        assert angles[0] == pytest.approx(target, abs=1e-6)
        missed.append(abs(angles[1] - target))
    assert max(missed) > math.radians(10.0 * share)


def test_a_controller_goes_on_from_what_it_saved():
    model = clamped(0.15)
    one, other = model.controller(), model.controller()
    for target in np.radians([100.0, 90.0]):
        one.setpoint(*one.reference(target))
    other.restore(one.save())
    wanted = [made.setpoint(*made.reference(math.radians(96.0))).voltage for made in (one, other)]
    assert wanted[0] == wanted[1]


def test_it_is_there_for_heated_wires_with_a_preisach_operator():
    kind, wire = catalogue()['cold_clamps'], MODEL.surroundings
    assert [drive for drive in ('voltage', 'current', 'power', 'temperature', 'pressure')
            if kind.available(wire._replace(drive=drive))] == ['voltage', 'current', 'power']
    assert not kind.available(wire._replace(sign=1))
    model = bicep_model(length_stage=PrandtlIshlinskii([0.0, 2.0], [5e-4, 5e-4], 0.0, -13.0, 9.0))
    assert not kind.available(model.surroundings)
    with pytest.raises(ParameterError, match=r'cold_clamps\) needs a Preisach length stage.*play'):
        clamped(0.1, model=model).predict(arm_run([1.0, 2.0]))


@pytest.mark.slow
def test_it_is_named_with_its_size_and_not_for_another():
    tried = ['cold_clamps', 'airflow', 'unequal_muscles', 'fatigue', 'slack']
    found = diagnose(MODEL, [runs(clamped(0.08), trials=3, rows=30)], tried)
    assert found.missing == ['cold_clamps']
    assert found.effects[0].share == pytest.approx(0.08, rel=0.05)
    for name in ('airflow', 'unequal_muscles'):
        other = MODEL.with_effects([effect_of(MODEL, name)])
        assert 'cold_clamps' not in diagnose(
            MODEL, [runs(other, trials=3, rows=30)], tried).missing


@pytest.mark.parametrize('share', [0.04, 0.15, 0.3, 1.0])
def test_the_laboratorys_wire_has_the_temperature_of_a_fin(share):
    places = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(excess(places, share), excess_of_fin(places, share), atol=1e-5)


def test_grains_at_the_clamps_stay_martensite():
    material = specimen(1)
    wires = [made.wire() for made in (material, material.with_cold_ends(0.15))]
    for temperature in (120.0, 300.0):
        for wire in wires:
            wire.commit(temperature, 3.0)
        plain, clamped_wire = (wire.martensite for wire in wires)
        assert plain == 0.0 and 0.01 < clamped_wire < 0.15
    # Hotter still, more of the ends transforms.
    wires[1].commit(120.0, 3.0)
    before = wires[1].martensite
    wires[1].commit(600.0, 3.0)
    assert wires[1].martensite < 0.8 * before
    wires[1].commit(22.0, 3.0)
    assert wires[1].martensite == pytest.approx(1.0)


def test_a_strong_one_of_the_laboratory_costs_five_degrees_at_full_heat():
    voltages = np.concatenate((np.linspace(0.0, 6.0, 13), np.linspace(6.0, 0.0, 13)))
    plain, strong, weak = (np.degrees(Plant(1, effects).arm_trial(voltages)['angle'])
                           for effects in ({}, {'cold_clamps': 1.0}, {'cold_clamps': 0.4}))
    for angles, hot, most in ((strong, 4.9, 7.6), (weak, 2.0, 3.1)):
        assert angles[12] - plain[12] == pytest.approx(hot, abs=0.3)
        assert np.max(angles - plain) == pytest.approx(most, abs=0.3)
        assert abs(angles[0] - plain[0]) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize('strength', [1.0, pytest.param(0.4, marks=pytest.mark.long)])
def test_it_is_found_on_an_arm_of_the_laboratory(strength):
    tried = ['cold_clamps', 'airflow', 'unequal_muscles', 'fatigue', 'slack', 'stress_dependence']
    found = found_in({'cold_clamps': strength}, 4, tried, 'arm-steps')
    assert found.missing == ['cold_clamps'], found.sets[:4]
    assert found.effects[0].share == pytest.approx(0.15 * strength, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize('name', [
    pytest.param('unequal_muscles', marks=pytest.mark.long), 'airflow'])
def test_it_is_not_named_where_the_arm_has_another(name):
    tried = ['cold_clamps', 'airflow', 'unequal_muscles', 'fatigue', 'slack', 'stress_dependence']
    assert found_in({name: 1.0}, 4, tried, 'arm-steps').missing == [name]
