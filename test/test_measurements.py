# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables: what their columns make them, their trials, settled rows, and what they refuse."""

from dataclasses import replace
import re

from hypothesis import given, settings, strategies
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement, settled_rows
from hysteresis_ros.measurements.holds import not_held_since
from hysteresis_ros.measurements.holds import holds
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.measurements.units import UNITS
import numpy as np
import pytest


def arm(**changes):
    columns = {'time': [0, 30, 60, 0, 30, 60], 'trial': [0, 0, 0, 3, 3, 3],
               'voltage': [0, 1, 2, 0, 2, 1], 'angle': [1.0, 0.9, 0.8, 1.0, 0.8, 0.9]}
    columns.update(changes)
    return {name: values for name, values in columns.items() if values is not None}


@pytest.mark.parametrize('names, kind, response, drive, load', [
    ('trial step voltage force', 'bench', 'force', 'voltage', None),
    ('trial step voltage force length', 'bench', 'length', 'voltage', 'force'),
    ('time trial voltage angle', 'arm', 'angle', 'voltage', None),
    ('trial step temperature stress strain', 'bench', 'strain', 'temperature', 'stress'),
    ('time trial voltage length', 'bench', 'length', 'voltage', None),
    ('step pressure length force', 'bench', 'length', 'pressure', 'force'),
    ('step current force voltage', 'bench', 'force', 'voltage', None)])
def test_columns_say_what_a_table_is(names, kind, response, drive, load):
    values = {name: [0.0, 1.0] if name != 'trial' else [0, 0] for name in names.split()}
    table = Measurement.from_columns(values)
    assert (table.kind, table.response, table.drive, table.load) == (kind, response, drive, load)
    assert table.rows == 2
    assert list(table.trials) == [0]


def test_trials_are_split_in_the_order_of_the_file():
    table = Measurement.from_columns(arm(trial=[5, 5, 5, 2, 2, 2]))
    assert list(table.trials) == [5, 2]
    assert table.split() == [(5.0, slice(0, 3)), (2.0, slice(3, 6))]
    chosen = table.select([2])
    assert chosen.rows == 3
    assert list(chosen.column('voltage')) == [0, 2, 1]
    assert chosen.source == table.source


def test_selected_trials_know_the_recording_that_they_are_part_of():
    table = Measurement.from_columns(arm(trial=[5, 5, 5, 2, 2, 2]))
    assert table.part_of is None
    assert table.select([2, 5]).part_of is None
    assert table.where(slice(1, None)).select([5, 2]).part_of is None
    chosen = table.select([2]).where(slice(1, None))
    chosen.columns['predicted_angle'] = np.zeros(2)
    assert chosen.part_of is table
    whole, taken = chosen.whole()
    assert whole.part_of is None
    assert list(whole.column('trial')) == [5, 5, 5, 2, 2]
    assert list(whole.column('voltage')[taken]) == [2, 1] == list(chosen.column('voltage'))
    assert list(taken) == [False, False, False, True, True]
    again = Measurement.from_columns(arm(
        trial=[5, 5, 1, 2, 2, 2], time=[0, 30, 0, 0, 30, 60])).select([1, 2]).select([2])
    assert list(again.part_of.trials) == [5, 1, 2]


def test_selecting_a_trial_that_is_not_there_names_those_that_are():
    table = Measurement.from_columns(arm())
    with pytest.raises(MeasurementError, match='no trial 7; the table has trials 0, 3'):
        table.select([0, 7])


def test_settled_needs_twenty_seconds_between_all_rows_of_a_trial():
    assert Measurement.from_columns(arm()).settled
    assert not Measurement.from_columns(arm(time=[0, 30, 60, 0, 19, 60])).settled
    assert Measurement.from_columns(arm(time=[0, 20, 40, 0, 20, 40])).settled
    assert Measurement.from_columns({'voltage': [0, 1], 'force': [0, 1]}).settled
    slower = replace(Measurement.from_columns(arm(time=[0, 30, 60, 0, 30, 60])), settled_time=31.0)
    assert not slower.settled and replace(slower, settled_time=30.0).settled
    assert Measurement.from_columns(
        {'time': [0, 0], 'trial': [0, 1], 'voltage': [0, 1], 'angle': [1, 1]}).settled


@pytest.mark.parametrize('columns, message', [
    ({'voltage': [1, 2]}, 'no column with the response'),
    ({'angle': [1, 2], 'time': [0, 1]}, 'no column with the drive'),
    ({'angle': [1, 2], 'time': [0, 1], 'Voltage': [1, 2]}, "is 'Voltage' meant to be 'voltage'"),
    ({'angel': [1, 2], 'time': [0, 1], 'voltage': [1, 2]}, "is 'angel' meant to be 'angle'"),
    (arm(time=None, Time=[0, 1, 2, 3, 4, 5]), "column 'time' in s; is 'Time' meant"),
    (arm(voltage=[1, 2]), 'has shape'),
    (arm(angle=[1, 2, np.nan, 1, 1, 1]), "row 2, column 'angle' is nan"),
    (arm(time=[0, 30, 20, 0, 30, 60]), r'time goes backwards from row 1 \(30\) to row 2'),
    (arm(trial=[0, 0, 1, 1, 0, 0]), 'rows of trial 0 are not together'),
    ({'voltage': [], 'force': []}, 'no rows'),
    ({'step': [0, 1, 1], 'voltage': [0, 1, 1], 'force': [0, 1, 1]}, 'step is repeated'),
    ({'step': [0, 1, 0], 'voltage': [0, 1, 1], 'force': [0, 1, 1]}, 'step goes backwards')])
def test_a_table_that_makes_no_sense_is_refused_in_one_line(columns, message):
    with pytest.raises(MeasurementError, match=message) as refused:
        Measurement.from_columns(columns, 'run.csv')
    assert '\n' not in str(refused.value)
    assert str(refused.value).startswith('run.csv: ')


def test_a_step_may_take_several_rows_of_a_sampled_run():
    columns = arm(step=[0, 0, 1, 0, 0, 1])
    assert Measurement.from_columns(columns).rows == 6


@pytest.mark.parametrize('columns, words', [
    ({'voltage': [0, 6000], 'force': [0.5, 15]}, 'voltage reaches 6000 V, .* is it in mV'),
    ({'voltage': [0, 6], 'force': [500, 15000]}, 'force reaches 1.5e[+]04 N, .* is it in mN'),
    ({'voltage': [0, 6], 'force': [3, 3], 'length': [0, -12]}, 'reaches 12 m, .* is it in mm'),
    ({'voltage': [0, 6], 'strain': [0, 4]}, 'strain reaches 4 as a ratio, .* is it in %'),
    (arm(angle=[90, 80, 70, 90, 70, 80]), 'angle reaches 90 rad, .* is it in deg'),
    (arm(ambient_temperature=[293.0] * 6), 'ambient_temperature reaches 293 degC, .* is it in K')])
def test_values_that_are_impossible_in_their_unit_are_refused(columns, words):
    with pytest.raises(MeasurementError, match=words):
        Measurement.from_columns(columns)


@pytest.mark.parametrize('columns, words', [
    ({'voltage': [0, 0.006], 'force': [0.5, 15]}, 'voltage reaches only 0.006 V; is it in kV'),
    ({'temperature': [20, 90], 'stress': [0, 400], 'strain': [0, 0.01]},
     'stress reaches only 400 Pa; is it in MPa'),
    # Days may be meant: an endurance test.
    (arm(time=[0, 1e5, 2e5, 0, 1e5, 2e5]), r'a trial takes 2e\+05 s; is it in ms')])
def test_values_that_are_unlikely_in_their_unit_are_warned_about(columns, words):
    found = Measurement.from_columns(columns).warnings
    assert len(found) == 1
    assert re.search(words, found[0])


def test_an_angle_that_jumps_by_a_turn_is_warned_about():
    """Between trials an arm may have been turned by hand."""
    found = Measurement.from_columns(arm(angle=[0.1, 6.2, 0.1, 0.1, 0.2, 6.3])).warnings
    assert len(found) == 1
    assert re.search('jumps by a turn from row 0 to row 1, and 2 times more: .*unwrap', found[0])
    assert Measurement.from_columns(arm(angle=[0.1, 0.2, 0.1, 6.3, 6.2, 6.4])).warnings == ()


def test_all_problems_of_a_table_are_said_at_once():
    columns = arm(angle=[90, 80, 70, 90, 70, 80], time=[0, 30, 20, 0, 30, 60], voltage=[6000] * 6)
    with pytest.raises(MeasurementError) as refused:
        Measurement.from_columns(columns, 'run.csv')
    text = str(refused.value)
    assert text.startswith('run.csv: 3 problems: (1) time goes backwards') and '\n' not in text
    assert '(2) ' in text and 'is it in deg' in text and 'is it in mV' in text
    with pytest.raises(MeasurementError, match='2 problems: .*the drive.*the response'):
        Measurement.from_columns({'speed': [1, 2]})


def test_usual_values_and_a_name_that_is_almost_right():
    assert Measurement.from_columns(arm()).warnings == ()
    found = Measurement.from_columns(
        {'voltage': [0, 6], 'Force': [3, 3], 'length': [0, 0.01]}).warnings
    assert len(found) == 1 and "'Force' is not used; is 'force' meant" in found[0]


@pytest.mark.parametrize('name, meant', [
    ('supply', 'supply_voltage'), ('Supply_V', 'supply_voltage'),
    ('ambient', 'ambient_temperature'), ('ambient_temp', 'ambient_temperature')])
def test_a_column_with_the_first_word_of_a_known_name_is_asked_about(name, meant):
    """It would be left out without a word, and with it what the supply or the room did."""
    rows = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    found = Measurement.from_columns({**arm(), name: rows}).warnings
    assert len(found) == 1 and f"{name!r} is not used; is '{meant}' meant" in found[0]


@pytest.mark.parametrize('name', ['volts', 'note', 'am', ''])
def test_other_columns_are_the_users_own(name):
    assert not Measurement.from_columns({**arm(), name: [1.0] * 6}).warnings


def test_a_missing_column_is_named_with_the_closest_one():
    table = Measurement.from_columns(arm(supply_volt=[1] * 6))
    with pytest.raises(MeasurementError, match="no column 'supply_voltage'; is 'supply_volt'"):
        table.column('supply_voltage')


def staircase(levels, hold, rate=10, noise=0.0):
    """Voltages that are held, and a response that lags; rows at `rate` Hz."""
    time = np.arange(0, hold * len(levels), 1 / rate)
    step = np.minimum((time / hold + 1e-9).astype(int), len(levels) - 1)
    voltage = np.array(levels, dtype=float)[step] + noise * np.sin(time)
    response = np.array(levels, dtype=float)[step] + np.exp(-(time - step * hold))
    return {'time': time, 'trial': np.zeros(len(time)), 'voltage': voltage, 'angle': response}


def test_settled_rows_take_the_end_of_every_hold():
    table = Measurement.from_columns(staircase([1, 3, 2, 2.5], 30.0))
    assert not table.settled
    ends = settled_rows(table)
    assert ends.settled
    assert list(ends.column('voltage')) == [1, 3, 2, 2.5]
    assert list(ends.time) == pytest.approx([29.9, 59.9, 89.9, 119.9])
    np.testing.assert_allclose(ends.column('angle'), [1, 3, 2, 2.5], atol=1e-10)


def test_settled_rows_average_noise_and_ignore_the_rounding_of_the_voltage():
    table = Measurement.from_columns(staircase([1, 3, 2, 2.5], 30.0, noise=5e-4))
    assert settled_rows(table).rows == 4


def test_a_trial_without_holds_has_been_before_the_settled_rows():
    first, second = staircase([1, 3], 5.0), staircase([1, 3, 2], 30.0)
    table = Measurement.from_columns({
        **{name: np.concatenate((first[name], second[name])) for name in first},
        'trial': np.repeat([0.0, 1.0], [len(first['time']), len(second['time'])])})
    for ends in (settled_rows(table), settled_rows(table.select([1]))):
        assert list(ends.column('voltage')) == [1, 3, 2]
        assert ends.part_of is table
        assert ends.whole()[0].rows == len(first['time']) + 3


def test_a_fast_wire_settles_sooner():
    """Of a short hold no more is averaged than its last fifth."""
    table = Measurement.from_columns(staircase([1, 3, 2, 2.5], 2.0))
    assert settled_rows(replace(table, settled_time=2.1)) is None
    ends = settled_rows(replace(table, settled_time=1.8))
    assert ends.settled and list(ends.time) == pytest.approx([1.9, 3.9, 5.9, 7.9])
    expected = np.array([1, 3, 2, 2.5]) + np.mean(np.exp(-np.arange(1.6, 1.95, 0.1)))
    np.testing.assert_allclose(ends.column('angle'), expected, rtol=1e-9)


@pytest.mark.parametrize('levels, hold', [([1, 3, 2, 2.5], 15.0), (np.linspace(0, 5, 3000), 0.1)])
def test_a_run_without_holds_has_no_settled_rows(levels, hold):
    assert settled_rows(Measurement.from_columns(staircase(levels, hold))) is None


def test_a_short_hold_between_long_ones_means_that_the_run_is_not_settled():
    columns = staircase([1, 3, 2], 30.0)
    columns['voltage'][350:400] = 5.0
    assert settled_rows(Measurement.from_columns(columns)) is None


def test_short_holds_on_the_way_from_one_long_hold_to_the_next_are_passed_over():
    """As with a limited rate, also where they go back and forth: hysteresis forgets it."""
    columns = staircase([1, 3, 2], 30.0)
    columns['voltage'][300:350] = np.linspace(1.0, 3.0, 52)[1:-1]
    columns['voltage'][600:620] = [2.5] * 10 + [2.8] * 10
    ends = settled_rows(Measurement.from_columns(columns))
    assert list(ends.column('voltage')) == [1, 3, 2]
    assert list(ends.time) == pytest.approx([29.9, 59.9, 89.9])


@pytest.mark.parametrize('rows, level', [
    (slice(600, 620), 1.9), (slice(600, 620), 3.1), (slice(5, 20), 0.9), (slice(870, 880), 2.5)])
def test_a_short_hold_off_the_way_means_that_the_run_is_not_settled(rows, level):
    """Beyond the hold before or after it, or where no hold comes after it."""
    columns = staircase([1, 3, 2], 30.0)
    columns['voltage'][rows] = level
    table = Measurement.from_columns(columns)
    assert settled_rows(table) is None
    # The hold before ends where the drive leaves it.
    since = 0.1 * (rows.start if rows.start >= 200 else 0)
    assert not_held_since(table) == (0.0, pytest.approx(since))


def test_it_is_said_in_which_trial_the_drive_is_not_held():
    held, moving = staircase([1, 3], 30.0), staircase([1, 3, 2, 4, 1, 2], 10.0)
    moving['trial'] = moving['trial'] + 7.0
    table = Measurement.from_columns({
        name: np.concatenate((held[name], moving[name])) for name in held})
    assert settled_rows(table) is None and not_held_since(table) == (7.0, 0.0)


def test_a_settled_table_stays_as_it_is():
    table = Measurement.from_columns(arm())
    assert settled_rows(table) is table


@settings(max_examples=50, deadline=None)
@given(strategies.lists(strategies.sampled_from([0.0, 1.0, 2.0]), min_size=1, max_size=40))
def test_holds_cover_a_trial_and_change_at_every_boundary(levels):
    drive = np.array(levels)
    found = holds(drive, slice(0, len(drive)))
    assert found[0][0] == 0 and found[-1][1] == len(drive)
    for (low, high), (after, _) in zip(found, found[1:]):
        assert high == after and drive[after] != drive[low]
    for low, high in found:
        assert np.all(drive[low:high] == drive[low])


def test_units_for_people():
    assert shown('length') == ('mm', 1000.0)
    assert shown('angle')[1] * np.pi == pytest.approx(180.0)
    assert shown('step') == ('', 1.0)


@pytest.mark.parametrize('name, unit, written, value', [
    ('voltage', 'mV', 1500.0, 1.5), ('supply_voltage', 'kV', 0.012, 12.0),
    ('temperature', 'K', 300.0, 26.85), ('temperature', 'degF', 212.0, 100.0),
    ('ambient_temperature', '°F', 32.0, 0.0), ('pressure', 'kPa', 3.0, 3e3),
    ('pressure', 'bar', 2.0, 2e5), ('pressure', 'MPa', 0.2, 2e5), ('pressure', 'hPa', 5.0, 500.0),
    ('pressure', 'mbar', 1013.25, 101325.0), ('pressure', 'psi', 14.5037737730, 1e5),
    ('stress', 'MPa', 3.0, 3e6), ('stress', 'kPa', 3.0, 3e3), ('stress', 'GPa', 0.1, 1e8),
    ('current', 'mA', 700.0, 0.7), ('current', 'uA', 7.0, 7e-6), ('power', 'mW', 3.0, 3e-3),
    ('power', 'kW', 0.1, 100.0), ('force', 'mN', 20.0, 0.02), ('force', 'kN', 0.02, 20.0),
    ('force', 'gf', 100.0, 0.980665), ('force', 'kgf', 1.0, 9.80665), ('length', 'mm', 7.0, 7e-3),
    ('length', 'cm', 7.0, 0.07), ('length', 'um', 7.0, 7e-6), ('length', 'µm', 7.0, 7e-6),
    ('length', 'nm', 7.0, 7e-9), ('strain', '%', 4.0, 0.04), ('strain', 'percent', 4.0, 0.04),
    ('angle', 'deg', 180.0, np.pi), ('angle', '°', 90.0, np.pi / 2), ('angle', 'mrad', 5.0, 5e-3),
    ('angle', 'degrees', 90.0, np.pi / 2), ('time', 'ms', 1500.0, 1.5), ('time', 'us', 2.0, 2e-6),
    ('time', 'ns', 2.0, 2e-9), ('time', 'min', 2.0, 120.0), ('time', 'h', 1.0, 3600.0)])
def test_units_become_those_of_files(name, unit, written, value):
    """Each against a value that a person knows."""
    found = UNITS[name][unit].convert(np.array([written]))
    assert found == pytest.approx([value], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize('trial, time, expected', [
    ([0, 0, 1, 1], [30, 60, 90, 120], [30, 60, 30, 60]),
    ([0, 0, 1, 1], [0.0, 0.1, 95.0, 95.1], [0.0, 0.1, 0.1, 0.2]),
    ([0, 0, 1, 1], [60.1, 60.2, 95.0, 95.1], [0.1, 0.2, 0.1, 0.2]),
    ([0, 0, 1, 1], [1.7e9, 1.7e9 + 2, 1.7e9 + 50, 1.7e9 + 52], [0, 2, 2, 4]),
    ([0, 0, 0, 0], [1.7e9, 1.7e9 + 2, 1.7e9 + 4, 1.7e9 + 6], [0, 2, 4, 6])])
def test_a_clock_that_runs_on_is_counted_from_the_start_of_each_trial(trial, time, expected):
    """Pauses between trials are not known to be anything; no row begins later than usual."""
    table = Measurement.from_columns({
        'trial': trial, 'time': time, 'voltage': [1, 2, 1, 2], 'angle': [2.0, 1.5, 2.0, 1.6]})
    assert table.time == pytest.approx(expected)
    assert 'it is counted from' in table.warnings[0]


@pytest.mark.parametrize('trial, time', [
    ([0, 0, 1, 1], [30, 60, 30, 60]), ([0, 0, 1, 1], [0, 10, 5, 20]), ([0, 1, 2, 3], [1, 2, 3, 4]),
    ([0, 0, 0, 0], [30, 60, 90, 120]), ([0, 0, 0, 0], [2e6, 2e6 + 30, 2e6 + 60, 2e6 + 90])])
def test_a_time_that_begins_with_each_trial_stays(trial, time):
    table = Measurement.from_columns({
        'trial': trial, 'time': time, 'voltage': [1, 2, 1, 2], 'angle': [2.0, 1.5, 2.0, 1.6]})
    assert table.time == pytest.approx(time) and table.warnings == ()
