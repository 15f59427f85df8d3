# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A supply that changes and was recorded: the model, its inverse, and the laboratory's battery."""

import numpy as np
import pytest

from hysteresis_ros.cli.invert import invert
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.laboratory import Plant
from hysteresis_ros.laboratory.board.port import SimulatedPort
from hysteresis_ros.laboratory.supply import Supply
from hysteresis_ros.measurements import Measurement
from model_support import arm_run, bicep_model, effect_of, runs, wandering_voltage

PLAIN = bicep_model()
MODEL = PLAIN.with_effects([effect_of(PLAIN, 'measured_supply', nominal=12.0)])
BATTERY = np.linspace(12.6, 9.6, 60)


def with_supply(run, supply):
    """Return a recording with a column of the supply [V]."""
    return Measurement.from_columns({**run.columns, 'supply_voltage': supply})


def test_the_arm_does_what_it_would_with_the_voltage_that_arrives():
    voltage = wandering_voltage(60)
    set_point = arm_run(voltage, supply_voltage=BATTERY)
    arrived = arm_run(voltage * BATTERY / 12.0)
    np.testing.assert_allclose(MODEL.predict(set_point), PLAIN.predict(arrived), atol=1e-12)
    assert np.max(np.abs(MODEL.predict(set_point) - PLAIN.predict(set_point))) > 0.05
    np.testing.assert_array_equal(MODEL.predict(arrived), PLAIN.predict(arrived))


def test_the_observer_takes_the_supply_sample_by_sample():
    run = arm_run(wandering_voltage(60), supply_voltage=BATTERY)
    observer = MODEL.observer()
    observer.reset(0.0)
    angles = [observer.step(*sample, supply=supply) for *sample, supply in zip(
        run.time, run.column('voltage'), BATTERY)]
    np.testing.assert_allclose(angles, MODEL.predict(run), atol=1e-9)


def test_the_controller_asks_for_more_from_a_weak_supply():
    made, plain = MODEL.controller(), PLAIN.controller()
    asked = plain.setpoint(*plain.reference(1.5)).voltage
    assert made.setpoint(*made.reference(1.5), supply=10.0).voltage == pytest.approx(asked * 1.2)
    assert made.hold(1.0) == pytest.approx(asked * 1.2)
    saved = made.save()
    assert made.hold(2.0, supply=12.5) == pytest.approx(asked * 12.0 / 12.5)
    other = MODEL.controller()
    other.restore(saved)
    assert other.hold(2.0, supply=10.0) == pytest.approx(asked * 1.2)
    assert other.setpoint(*other.reference(1.5), supply=0.0).voltage <= 6.0


def test_a_reference_may_have_a_column_of_the_supply():
    reference = {'trial': np.zeros(3), 'angle': np.array([1.5, 1.6, 1.45])}
    asked, _ = invert(PLAIN, reference)
    given, _ = invert(MODEL, {**reference, 'supply_voltage': np.array([11.0, 10.0, 12.0])})
    np.testing.assert_allclose(given, asked * 12.0 / np.array([11.0, 10.0, 12.0]), rtol=1e-9)


def test_memories_that_were_saved_without_a_supply_are_taken():
    made = MODEL.controller()
    saved = made.save()
    del saved['supply']
    made.restore(saved)


@pytest.mark.parametrize('supply, reason', [
    (None, 'not recorded'), (12.0 + 0.01 * np.sin(np.arange(90.0)), 'did not change'),
    (np.linspace(12.0, 11.0, 90), None)])
def test_it_is_tried_only_where_the_supply_was_recorded_and_changed(supply, reason):
    run = runs(PLAIN, trials=3, rows=30)
    if supply is not None:
        run = with_supply(run, supply)
    names, unobservable = observable(problem_for(PLAIN, [run]))
    assert ('measured_supply' in names) == (reason is None)
    assert reason is None or reason in unobservable['measured_supply']
    # What a settled recording lacks comes first: it is what to measure next.
    assert next(iter(unobservable)) == 'thermal_lag'
    names, unobservable = observable(problem_for(PLAIN, [run], ['backlash']))
    assert names == ['backlash'] and not unobservable


@pytest.mark.parametrize('nominal', [12.0, 4.2])
def test_it_is_named_where_the_recorded_supply_counts(nominal):
    arm = PLAIN.with_effects([effect_of(PLAIN, 'measured_supply', nominal=nominal)])
    run = with_supply(runs(PLAIN, trials=4, rows=30, seed=4), np.linspace(1.05, 0.8, 120) * nominal)
    run = Measurement.from_columns({**run.columns, 'angle': arm.predict(run)})
    found = diagnose(PLAIN, [run], ['measured_supply', 'supply_sag', 'airflow', 'ambient_drift',
                                    'payload_error', 'fatigue'])
    assert (found.verdict, found.missing, found.alternatives) == (
        'missing', ['measured_supply'], [[]])
    assert found.effects[0].nominal == pytest.approx(nominal, rel=0.02)


@pytest.mark.parametrize('change, shows', [(0.05, False), (0.15, True)])
def test_a_supply_that_changes_by_two_steps_of_a_converter_is_looked_at(change, shows):
    run = with_supply(runs(PLAIN, trials=4, rows=30, seed=4), np.linspace(12.0, 12.0 - change, 120))
    names, _ = observable(problem_for(PLAIN, [run], ['measured_supply', 'supply_sag']))
    assert ('measured_supply' in names) == shows


def test_a_supply_that_changes_without_effect_is_not_named():
    run = with_supply(runs(PLAIN, trials=4, rows=30, seed=4), np.linspace(12.6, 10.0, 120))
    found = diagnose(PLAIN, [run], ['measured_supply', 'supply_sag', 'payload_error'])
    assert found.verdict == 'adequate'


def test_the_laboratorys_battery_runs_down_and_dips():
    battery = Supply(drain=0.2, dip=0.1, duration=100.0, begin=0.5)
    share = np.array([battery.share(time) for time in np.linspace(0.0, 100.0, 1001)])
    assert share.max() == pytest.approx(1.04, abs=1e-3)
    assert share[-1] == pytest.approx(0.84, abs=1e-3)
    assert np.sum(np.diff(share) < -0.09) == np.sum(np.diff(share) > 0.09) == 7
    assert battery.voltage(0.0) == pytest.approx(12.0 * share[0])
    assert Supply().share(50.0) == 1.0


def test_the_laboratorys_arm_sinks_with_its_battery_and_the_meter_says_so():
    tables = [Plant(3, effects, recording_time=900.0).arm_trial(np.full(30, 4.1))
              for effects in ({}, {'measured_supply': 1.0})]
    supply = tables[1]['supply_voltage']
    assert np.ptp(tables[0]['supply_voltage']) < 0.1 and np.ptp(supply) > 1.5
    sunk = tables[1]['angle'] - tables[0]['angle']
    assert np.corrcoef(supply, sunk)[0, 1] < -0.8 and np.ptp(sunk) > 0.1


def test_a_board_measures_the_battery():
    board = SimulatedPort('sim://bicep?measured_supply=1&recording_time=60').cable.board
    before = board.supply
    board.advance(3000)
    supply = board.arm.conditions.supply
    assert board.supply == pytest.approx(supply.voltage(board.arm.time))
    assert abs(board.supply - before) > 0.2
