# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle that breaks in mid recording: before and after, when, and that of the laboratory."""

import dataclasses
import math

import numpy as np
import pytest

from hidden_cases import found_in
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.extend import extend, rmse
from hysteresis_ros.effects import catalogue
from hysteresis_ros.laboratory import Plant
from hysteresis_ros.laboratory.arm import Arm
from hysteresis_ros.laboratory.conditions import Air, Conditions
from hysteresis_ros.laboratory.linkage import Linkage
from hysteresis_ros.model import Simulator
from model_support import (
    arm_run, bicep_model, effect_of, GEOMETRY, runs, STRENGTHS, wandering_voltage)

MODEL = bicep_model()
FEWER = bicep_model(geometry=dataclasses.replace(GEOMETRY, muscle_count=2))


def broken(time, *names):
    """Return the model whose muscle breaks, with other effects."""
    return MODEL.with_effects([effect_of(MODEL, 'wire_break', time=time),
                               *(effect_of(MODEL, name) for name in names)])


def angles(model, run, **options):
    """Return the simulated angles [rad] of a run."""
    return Simulator(model, run).run(model.effects, **options)


@pytest.mark.parametrize('dt', [0.1, 30.0])
@pytest.mark.parametrize('names', [(), ('creep',), ('unequal_muscles', 'coulomb_friction')])
def test_before_all_muscles_bear_the_load_and_after_one_less(names, dt):
    run = arm_run(wandering_voltage(60, 3), dt)
    time = 20.5 * dt
    with_all = angles(MODEL.with_effects([effect_of(MODEL, name) for name in names]), run)
    found = angles(broken(time, *names), run)
    np.testing.assert_allclose(found[:20], with_all[:20], atol=1e-9)
    assert np.max(np.abs(found[21:] - with_all[21:])) > 0.05
    # It sinks: no angle is smaller than it was with all of them, as far as the phase agrees.
    assert np.min(found - with_all) > -1e-7


def test_the_memory_is_handed_over():
    """The turning points before count after it, under the load after it."""
    voltage = np.array([4.5, 3.0, 4.0, 4.0, 3.6, 4.4])
    found = angles(broken(100.0), arm_run(voltage, 30.0))
    # By hand: two arms in turn, the second goes on where the first one stood.
    first, second = (model.balance(model.chain()) for model in (MODEL, FEWER))
    stage = MODEL.first_stage(MODEL.chain())
    first.settle(stage.step(0.0))
    expected = []
    for number, volts in enumerate(voltage):
        arm = first if number < 3 else second
        if number == 3:
            second.rewind(first.snapshot())
        expected.append(arm.step(stage.step(volts ** 2), 30.0))
    np.testing.assert_allclose(found[:3], expected[:3], atol=1e-9)
    np.testing.assert_allclose(found[4:], expected[4:], atol=1e-9)


def test_trials_after_it_begin_with_the_broken_arm():
    model, run = broken(30.0 * 40), runs(MODEL, trials=3, rows=30)
    found, with_all, fewer = (angles(one, run) for one in (model, MODEL, FEWER))
    np.testing.assert_allclose(found[:40], with_all[:40], atol=1e-9)
    np.testing.assert_allclose(found[60:], fewer[60:], atol=1e-9)
    assert np.max(np.abs(fewer[60:] - with_all[60:])) > 0.05


def test_the_angle_is_a_continuous_function_of_its_time():
    run = arm_run(np.full(6, 4.0), 30.0)
    found = np.array([angles(broken(time), run) for time in (90.0, 97.5, 105.0, 120.0)])
    whole = found[0, 3] - found[3, 3]
    assert whole > 0.03
    np.testing.assert_allclose(found[:, 3] - found[3, 3], [whole, 0.75 * whole, 0.5 * whole, 0.0],
                               atol=1e-9)
    np.testing.assert_array_equal(found[:3, 4], found[0, 4])


@pytest.mark.parametrize('names', [(), ('latent_heat', 'backlash'), ('inertia',)])
@pytest.mark.parametrize('time', [0.05, 3.33, 4.0])
def test_observer_and_simulation_agree(names, time):
    model = broken(time, *names)
    run = arm_run(wandering_voltage(80, 5), 0.1, first=0.1)
    observer = model.observer()
    observer.reset(0.0)
    stepped = [observer.step(t, v) for t, v in zip(run.time, run.columns['voltage'])]
    np.testing.assert_allclose(stepped, model.predict(run), atol=math.radians(0.01))


def test_an_observer_that_is_reset_keeps_the_broken_muscle():
    observer, whole, fewer = (model.observer() for model in (broken(50.0), MODEL, FEWER))
    for time in (30.0, 60.0):
        observer.step(time, 4.0)
    observer.reset()
    again, intact, lacking = (one.step(90.0, 4.0) for one in (observer, whole, fewer))
    assert again == pytest.approx(lacking, abs=1e-9) and again > intact + 0.01


def test_what_is_judged_does_not_depend_on_what_is_interpolated():
    model, run = broken(700.0, 'coulomb_friction'), runs(MODEL, trials=2, rows=60)
    judged = np.arange(0, run.rows, 5)
    np.testing.assert_allclose(Simulator(model, run, judged).run(model.effects)[judged],
                               angles(model, run)[judged], atol=1e-9)


def test_an_arm_that_rings_does_so_when_the_muscle_breaks():
    run = arm_run(np.full(160, 4.2), 0.05)
    model = broken(4.0, 'inertia')
    found = angles(model, run)
    rest = found[-1]
    after = found[80:]
    assert np.max(after) > rest + 0.02 and np.count_nonzero(np.diff(np.sign(after - rest))) >= 3


def test_a_single_muscle_does_not_break():
    alone = bicep_model(geometry=dataclasses.replace(GEOMETRY, muscle_count=1))
    kind = catalogue()['wire_break']
    assert kind.available(MODEL.surroundings) and not kind.available(alone.surroundings)
    run = arm_run(wandering_voltage(20), 30.0)
    model = alone.with_effects([effect_of(alone, 'wire_break', time=100.0)])
    np.testing.assert_allclose(model.predict(run), alone.predict(run), atol=1e-9)


@pytest.mark.parametrize('row', [30, 100, 180])
def test_a_fit_starts_where_the_residual_changes(row):
    rng = np.random.default_rng(row)
    residual = 0.01 * rng.standard_normal(200)
    # The arm sinks by as much as its angle lets it.
    residual[row:] += 0.05 * (1.0 + np.sin(np.arange(200 - row)))
    clock = 30.0 * np.arange(1.0, 201.0)
    start, *others = effect_of(MODEL, 'wire_break').moments(residual, 0.0 * residual, clock)
    assert clock[row - 1] <= start['time'] < clock[row] < 1.02 * start['time']
    # Others lie before and after it.
    assert sorted([*(other['time'] < start['time'] for other in others)]) == [False, True]
    assert effect_of(MODEL, 'wire_break').moments(residual[:5], clock[:5], clock[:5]) == []


def test_a_fit_starts_at_the_break_although_the_arm_falls_later():
    """Then the residual changes most, but that is no break."""
    rng = np.random.default_rng(4)
    residual = 0.01 * rng.standard_normal(200)
    residual[80:] += 0.03 * rng.standard_normal(120)
    residual[170:] += 0.6
    clock = 5.0 * np.arange(1.0, 201.0)
    starts = [start['time'] for start in effect_of(MODEL, 'wire_break').moments(
        residual, 0.0 * residual, clock)]
    assert clock[168] <= starts[0] < clock[171]
    assert any(clock[78] <= start < clock[81] for start in starts)


@pytest.mark.parametrize('names', [['wire_break'], ['payload_error', 'wire_break'],
                                   ['wire_break', 'payload_error']])
def test_added_where_nothing_broke_it_makes_nothing_worse(names):
    """The fit says so: it breaks after the last row, at a time that nothing determines."""
    heavy = MODEL.with_effects([effect_of(MODEL, 'payload_error', dm=20.0)])
    run = runs(heavy, trials=3, rows=30)
    extended = extend(MODEL, names, [run])
    assert rmse(extended.model, [run]) <= 1.001 * rmse(MODEL, [run])
    assert 'wire_break.time spans its physical range' in ' '.join(extended.warnings)
    made = {effect.id: effect for effect in extended.model.effects}
    assert made['wire_break'].time > 2700.0
    if len(names) > 1:
        assert made['payload_error'].dm == pytest.approx(20.0, abs=0.5)


def test_it_is_named_with_its_time_and_not_where_it_did_not_happen():
    tried = ['wire_break', 'fatigue', 'payload_error', 'slack', 'ambient_drift']
    found = diagnose(MODEL, [runs(broken(1300.0), trials=3, rows=30)], tried)
    assert found.missing == ['wire_break']
    assert found.effects[0].time == pytest.approx(1300.0, abs=30.0)
    heavy = MODEL.with_effects([effect_of(MODEL, 'payload_error', **STRENGTHS['payload_error'])])
    assert 'wire_break' not in diagnose(MODEL, [runs(heavy, trials=3, rows=30)], tried).missing


def test_the_laboratorys_wires_bear_half_as_much_again():
    linkage = Linkage()
    arm = Arm(Conditions(air=Air(turbulence=0.0), break_time=50.0))
    for count in (3.0, 2.0):
        arm.settle(40.0, 4.2)
        assert count * arm.tensions[0] * linkage.moment_arm(arm.angle) == pytest.approx(
            linkage.moment(arm.angle), rel=1e-6)
    arm.heat_and_cool()
    assert 2.0 * arm.tensions[0] * linkage.moment_arm(arm.angle) == pytest.approx(
        linkage.moment(arm.angle), rel=1e-6)


def test_a_weak_break_of_the_laboratory_is_one_that_comes_late():
    shares = [Plant(2, {'wire_break': strength}).arm.conditions.break_time / 900.0
              for strength in (1.0, 0.4)]
    assert 0.3 < shares[0] < 0.7 < shares[1] < 1.0


@pytest.mark.slow
def test_it_is_found_on_an_arm_of_the_laboratory():
    tried = ['wire_break', 'fatigue', 'payload_error', 'slack', 'ambient_drift', 'airflow']
    found = found_in({'wire_break': 1.0}, 4, tried, 'arm-steps')
    assert found.missing == ['wire_break'], found.sets[:4]
    assert 0.3 * 7200.0 < found.effects[0].time < 0.7 * 7200.0
