# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects of the material: what load, time and use do to ``L = H2[s (x - c F)]``."""

import math

from hypothesis import given, strategies as st
import numpy as np
import pytest

from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.effects import catalogue, Inputs, Surroundings
from hysteresis_ros.effects.base import PAPER
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model.chain import Chain
from model_support import bicep_model, effect_of, STRENGTHS

WIRE = Surroundings(0.27, 3.0, 36.0, 0.02, drive_range=6.0)
LOADS = np.array([0.0, 1.5, 3.0, 9.0])
DRIFTS = ('r_phase', 'creep', 'fatigue')


def effect(name, surroundings=WIRE, **values):
    return catalogue()[name](surroundings, **values)


def inputs(time, cycles=None, phase=None):
    """Rows of one trial at these times."""
    time = np.asarray(time, dtype=float)
    none = np.full(len(time), np.nan)
    return Inputs(time, time, np.diff(time, prepend=0.0), none,
                  none if phase is None else np.asarray(phase, dtype=float),
                  np.zeros(len(time)) if cycles is None else np.asarray(cycles, dtype=float),
                  none, none)


def test_stress_dependence_weighs_the_load_more_about_the_bench_mean():
    made = effect('stress_dependence', shift=0.2)
    np.testing.assert_allclose(LOADS + made.shift_load(LOADS, WIRE), 1.2 * LOADS - 0.6)


def test_another_shift_than_on_the_bench_leaves_the_unloaded_muscle_as_it_is():
    made = effect('stress_dependence', C=0.5, shift=0.2)
    np.testing.assert_allclose(LOADS + made.shift_load(LOADS, WIRE), 1.2 * LOADS)


@pytest.mark.parametrize('r, there', [(0.0, 3.0), (0.5, 0.0)])
def test_growth_of_the_stroke_on_the_arm_counts_from_where_the_bench_model_is_right(r, there):
    plain, grown = (effect('stress_dependent_strain', r=r, F0=1.2, growth=growth)
                    for growth in (0.0, 0.2))
    at = np.array([there])
    np.testing.assert_allclose(grown.scale(at, WIRE), plain.scale(at, WIRE))
    more = grown.scale(LOADS, WIRE) - plain.scale(LOADS, WIRE)
    assert np.all(np.diff(more) > 0.0) and np.all((more > 0.0) == (LOADS > there))


@pytest.mark.parametrize('values', [{}, {'r': 0.5, 'F0': 1.2}])
def test_growth_of_the_stroke_on_the_arm_keeps_the_cold_muscle_at_its_resting_length(values):
    """The resting length is measured cold, whatever the strain of the wire that was mounted."""
    around = WIRE._replace(rest_load=0.6, least=-0.012)
    plain, grown = (effect('stress_dependent_strain', around, **values, growth=growth)
                    for growth in (0.0, 0.3))
    rest = np.array([0.6])
    # On the bench's model the elongation of the cold muscle under the load at rest is zero.
    output = around.least - around.least / plain.scale(rest, around)
    length = around.least + grown.scale(rest, around) * (output - around.least)
    np.testing.assert_allclose(length + grown.stretch(rest, around), 0.0, atol=1e-12)
    assert plain.stretch(LOADS, around).tolist() == [0.0] * 4
    assert np.ptp(grown.stretch(LOADS, around)) == 0.0 != grown.stretch(0.0, around)


@pytest.mark.parametrize('drive, load, unit, low, high, expected', [
    # Of a bench with other loads than the paper's.
    ('voltage', 'force', 'N/V^2', 0.2 * 3.0 / 4.116, 6.0 * 3.0 / 4.116, 2.0),
    ('current', 'force', 'N/A^2', 1.0, 1e3, 2.0),
    ('temperature', 'stress', 'MPa/K', 5.0, 15.0, 2e6),
    ('temperature', 'force', 'N/K', 0.01, 100.0, 2.0),
    ('pressure', 'force', 'load/drive squared', 1e-3 / 12, 1e3 / 12, 2.0)])
def test_clausius_clapeyron_has_the_units_of_the_table(drive, load, unit, low, high, expected):
    made = effect('stress_dependence', WIRE._replace(drive=drive, load_name=load), C=2.0)
    parameter = made.parameters[0]
    assert (parameter.unit, parameter.low, parameter.high) == (
        unit, pytest.approx(low), pytest.approx(high))
    assert made.load_per_drive_squared == expected
    assert parameter.kinds == ('bench',)
    assert effect('stress_dependence', shift=0.5).load_per_drive_squared == 0.0


def test_range_of_clausius_clapeyron_covers_the_wire():
    # 5 to 15 MPa/K on a 0.203 mm wire, which warms by 2 to 12 K/V^2.
    area = math.pi / 4.0 * 0.203e-3 ** 2
    parameter = effect('stress_dependence', PAPER).parameters[0]
    assert parameter.low < 5e6 * area * 2.0 < 15e6 * area * 12.0 < parameter.high * 1.01


def test_transformation_strain_grows_with_the_load_and_saturates():
    made = effect('stress_dependent_strain', r=0.6, F0=1.5)
    expected = [(1.0 - 0.6 * math.exp(-load / 4.5)) / (1.0 - 0.6 * math.exp(-1.0 / 1.5))
                for load in LOADS]
    np.testing.assert_allclose(made.scale(LOADS, WIRE), expected)
    assert made.scale(3.0, WIRE) == pytest.approx(1.0)
    assert np.all(np.diff(made.scale(LOADS, WIRE)) > 0.0)


@given(st.floats(-0.5, 1.5), st.floats(0.02, 15.0), st.floats(0.0, 1e3))
def test_stroke_never_vanishes_within_the_bounds_of_a_fit(r, scale, load):
    value = effect('stress_dependent_strain', r=r, F0=scale).scale(np.float64(load), WIRE)
    assert 0.0 < value < 1e3


@pytest.mark.parametrize('response, load, unit, factor', [
    ('length', 'force', 'mm/N', 1e-3), ('strain', 'stress', '1/GPa', 1e-9),
    ('strain', 'force', '%/N', 1e-2), ('length', 'stress', 'mm/MPa', 1e-9)])
def test_compliance_stretches_in_proportion_to_the_load(response, load, unit, factor):
    surroundings = WIRE._replace(response=response, load_name=load)
    made = effect('series_compliance', surroundings, compliance=0.1)
    assert made.parameters[0].unit == unit
    np.testing.assert_allclose(made.stretch(LOADS, surroundings), 0.1 * factor * LOADS)


def test_compliance_is_the_same_wire_in_every_unit():
    length, area = 0.27, math.pi / 4.0 * 0.203e-3 ** 2
    limits = {}
    for response, load in (('length', 'force'), ('strain', 'force'), ('length', 'stress')):
        made = effect('series_compliance', WIRE._replace(response=response, load_name=load))
        parameter = made.parameters[0]
        per = made.UNITS[parameter.unit]
        per *= length if response == 'strain' else 1.0
        per /= area if load == 'stress' else 1.0
        limits[response, load] = np.array([parameter.low, parameter.high]) * per
    for limit in limits.values():
        np.testing.assert_allclose(limit, limits['length', 'force'], rtol=0.35)
    modulus = effect('series_compliance', WIRE._replace(
        response='strain', load_name='stress')).parameters[0]
    assert modulus.plausible(1.0 / 20.0) and modulus.plausible(1.0 / 80.0)


def test_slack_is_the_same_under_any_load():
    np.testing.assert_array_equal(effect('slack', Ls=1.5).stretch(LOADS, WIRE), 1.5e-3)


def test_fatigue_drifts_and_shrinks_with_the_logarithm_of_the_cycles():
    offset, factor = effect('fatigue', b=0.2, a=0.1).drift(
        np.zeros(3), np.zeros(3), inputs([1, 2, 3], [0.0, 1.0, 9.0]), WIRE)
    np.testing.assert_allclose(offset, -0.002 * 0.27 * np.log([1.0, 2.0, 10.0]))
    np.testing.assert_allclose(factor, 1.0 - 0.1 * np.log([1.0, 2.0, 10.0]))


def test_an_old_muscle_wears_more_slowly_than_a_new_one():
    """Cycles before the recording: ln(1 + (N + N0) / N1) against its start."""
    time, cycles = np.arange(3.0), np.array([0.0, 10.0, 100.0])
    drive = np.zeros(3)
    for before in (1.0, 50.0):
        worn = effect('fatigue', b=0.1, a=0.02, N0=before)
        offset, factor = worn.drift(drive, drive, inputs(time, cycles=cycles), WIRE)
        logarithm = np.log((cycles + before) / before)
        np.testing.assert_allclose(offset, -0.001 * WIRE.length * logarithm)
        np.testing.assert_allclose(factor, 1.0 - 0.02 * logarithm)


def test_training_makes_the_stroke_grow():
    made = effect('fatigue', b=-0.1, a=-0.05)
    offset, factor = made.drift(np.zeros(2), np.zeros(2), inputs([1, 2], [0.0, 9.0]), WIRE)
    assert factor[1] == pytest.approx(1.0 + 0.05 * np.log(10.0)) and offset[1] > 0.0
    assert made.implausible() == []


def test_cycles_move_the_transformation():
    """Behind all that heats; its inverse adds what it takes off, for the cycles of that moment."""
    given = inputs([1, 2, 3], [0.0, 1.0, 9.0])
    chain = Chain([effect('fatigue', c=0.5), effect('airflow', beta=1.5)], WIRE)
    felt = chain.drive_squared(np.full(3, 3.0), given)
    np.testing.assert_allclose(felt, 6.0 - 0.5 * np.log([1.0, 2.0, 10.0]))
    for row in range(3):
        moment = Inputs(*(float(column[row]) for column in given))
        assert chain.step(3.0, moment) == pytest.approx(felt[row])
        assert chain.inverse(float(felt[row]), moment) == pytest.approx(3.0)
    assert [one.id for one in Chain([effect('fatigue', b=0.1)], WIRE).thermal] == []
    assert [one.id for one in chain.thermal] == ['airflow', 'fatigue']


@pytest.mark.parametrize('drive, kinds', [
    ('voltage', ('arm',)), ('current', ('arm',)), ('power', ('arm',)), ('temperature', ()),
    ('pressure', ())])
def test_cycles_move_only_a_transformation_that_the_drive_heats(drive, kinds):
    worn = {one.name: one for one in catalogue()['fatigue'].describe(WIRE._replace(drive=drive))}
    assert worn['c'].kinds == kinds and worn['b'].kinds == ('arm', 'bench')


def test_what_moves_the_transformation_is_no_effect_by_itself():
    assert sum(kind.__module__.endswith('.fatigue') for kind in catalogue().values()) == 1
    assert effect('fatigue', c=0.5).within_trials().parameters[2].kinds == ('arm',)


def test_wear_is_not_carried_over_where_it_could_be_the_load():
    worn = effect('fatigue', b=0.1).within_trials()
    kept = next(parameter for parameter in worn.parameters if parameter.name == 'kept')
    assert worn.kept == 0.0 and kept.choices == (0.0,)
    # All starts of a fit, too.
    assert {start.kept for start in starts_of(worn, 'bench')} == {0.0}
    assert {start.kept for start in starts_of(effect('fatigue'), 'bench')} == {0.0, 1.0}


def test_pressure_has_no_r_phase():
    assert catalogue()['r_phase'].available(WIRE)
    assert not catalogue()['r_phase'].available(WIRE._replace(drive='pressure'))


def test_fatigue_of_another_specimen_begins_anew():
    """Where nothing is kept, cycles count from the first row after a start, as in a trial."""
    made = effect('fatigue', b=0.2, a=0.1, kept=0.0)
    trial = inputs([1, 2, 3], [7.0, 8.0, 16.0])
    offset, factor = made.drift(np.zeros(3), np.zeros(3), trial, WIRE)
    np.testing.assert_allclose(offset, -0.002 * 0.27 * np.log([1.0, 2.0, 10.0]))
    for _ in range(2):
        made.start()
        rows = [Inputs(*(float(column[n]) for column in trial)) for n in range(3)]
        added = []
        for row in rows:
            added.append(made.advance(0.0, 0.0, row, WIRE))
            made.restore(made.save())
        np.testing.assert_allclose(np.transpose(added), [offset, factor])
        trial = trial._replace(cycles=trial.cycles + 40.0)


def logistic(x):
    return 1.0 / (1.0 + math.exp(-x))


def test_r_phase_is_a_step_with_a_narrow_loop():
    made = effect('r_phase', strain=0.5, position=0.3, width=0.05)
    drive_squared = np.array([0.0, 12.0, 36.0, 12.0, 0.0])
    offset, factor = made.drift(np.sqrt(drive_squared), drive_squared, inputs(range(5)), WIRE)
    half = 0.5 * 0.03 * 36.0
    # The play lags behind the drive squared by half the loop's width, on both ways.
    played = [0.0, 12.0 - half, 36.0 - half, 12.0 + half, half]
    expected = [-0.005 * 0.27 * logistic((q / 36.0 - 0.3) / 0.05) for q in played]
    np.testing.assert_allclose(offset, expected, rtol=1e-12)
    assert np.all(factor == 1.0)
    assert offset[3] < offset[1]


def test_creep_goes_on_with_the_logarithm_of_time_in_the_direction_of_the_step():
    made = effect('creep', c=0.1, t0=2.0)
    volts = np.array([3.0, 3.0, 3.0, 1.0, 1.0])
    trial = inputs([1.0, 2.0, 7.0, 8.0, 12.0], phase=[0.4, 0.4, 0.4, 0.7, 0.7])
    offset, factor = made.drift(volts, volts ** 2, trial, WIRE)
    unit = 0.001 * 0.27
    first = -unit * 0.6 * np.log1p(np.array([1.0, 2.0, 7.0]) / 2.0)
    # The strain of the first step fades while the second creeps.
    second = first[2] * np.exp(-2.0 * np.array([1.0, 5.0]) / 2.0) + unit * 0.3 * np.log1p(
        np.array([1.0, 5.0]) / 2.0)
    np.testing.assert_allclose(offset, [*first, *second], atol=1e-18)
    assert np.all(factor == 1.0)


def test_a_ramp_of_small_steps_creeps_like_its_whole():
    made = effect('creep', c=0.1, t0=2.0)
    volts = np.array([0.5, 1.0, 1.5, 2.0, 2.0])
    trial = inputs([1, 2, 3, 4, 9], phase=[1.0, 0.9, 0.7, 0.6, 0.6])
    offset, _ = made.drift(volts, volts ** 2, trial, WIRE)
    assert offset[-1] == pytest.approx(-0.001 * 0.27 * 0.4 * math.log1p(6.0 / 2.0))


def test_settled_rows_creep_each_from_its_own_step():
    """Ends of holds of 30 s, between which the drive goes up and up, is held once, and falls."""
    made = effect('creep', c=0.1, t0=2.0)
    volts = np.array([2.0, 3.0, 4.0, 4.0, 1.0])
    phase = np.array([1.0, 0.7, 0.2, 0.2, 0.9])
    offset, _ = made.drift(volts, volts ** 2, inputs(30.0 * np.arange(1, 6), phase=phase), WIRE)
    held = np.array([30.0, 30.0, 30.0, 60.0, 30.0])
    change = np.array([0.0, -0.3, -0.5, -0.5, 0.7])
    np.testing.assert_allclose(offset, 0.001 * 0.27 * change * np.log1p(held / 2.0), atol=1e-15)
    made.start()
    for n, volt in enumerate(volts.tolist()):
        row = Inputs(30.0 * (n + 1), 30.0 * (n + 1), 30.0, math.nan, float(phase[n]), 0.0)
        assert made.advance(volt, volt ** 2, row, WIRE)[0] == pytest.approx(offset[n], abs=1e-15)


def test_creep_may_be_as_large_after_a_small_step():
    volts = np.array([2.0, 3.0, 4.0])
    trial = inputs(30.0 * np.arange(1, 4), phase=np.array([0.9, 0.8, 0.0]))
    in_proportion, even = (effect('creep', c=0.1, t0=2.0, s=s).drift(
        volts, volts ** 2, trial, WIRE)[0] for s in (0.0, 0.1))
    assert in_proportion[0] == pytest.approx(in_proportion[2] / 8.0)
    assert even[0] == pytest.approx(math.tanh(1.0) * even[2], rel=1e-4)
    # A full transformation creeps alike.
    one = inputs([30.0], phase=np.array([0.0]))
    for s in (0.0, 0.1):
        crept, _ = effect('creep', c=0.1, t0=2.0, s=s).drift(volts[:1], volts[:1] ** 2, one, WIRE)
        assert crept[0] == pytest.approx(-0.001 * 0.27 * math.log1p(15.0))


def test_creep_that_is_kept_is_the_sum_over_all_steps():
    made = effect('creep', c=0.1, t0=2.0, kept=1.0)
    time = 0.5 * np.arange(1, 801)
    phase = np.where(time <= 100.0, 0.4, 0.8)
    offset, _ = made.drift(np.full(800, 4.0), np.full(800, 16.0), inputs(time, phase=phase), WIRE)
    begun = -0.6 * np.log1p((time - 0.25) / 2.0) + 0.4 * np.log1p(
        np.maximum(time - 100.25, 0.0) / 2.0)
    np.testing.assert_allclose(offset, 0.001 * 0.27 * begun, atol=0.3 * 0.001 * 0.27)
    # Row by row it is the same.
    made.start()
    trial = inputs(time, phase=phase)
    for n in range(0, 40):
        row = Inputs(*(float(column[n]) for column in trial))
        assert made.advance(4.0, 16.0, row, WIRE)[0] == pytest.approx(offset[n], abs=1e-15)
        made.restore(made.save())


def test_a_growing_strain_keeps_the_length_of_the_cold_muscle_or_of_the_hot_one():
    """On the arm; what is longer when cold is what a larger transformation strain says."""
    around = WIRE._replace(rest_load=0.6, least=-0.012)
    cold, hot = (effect('stress_dependent_strain', around, growth=0.2, hot=value)
                 for value in (0.0, 1.0))
    np.testing.assert_array_equal(cold.scale(LOADS, around), hot.scale(LOADS, around))
    assert np.all(hot.stretch(LOADS, around) == 0.0)
    assert np.all(cold.stretch(LOADS, around) != 0.0)


@pytest.mark.parametrize('rested', [0.0, 1.0])
def test_one_relaxation_follows_the_martensite(rested):
    """Kelvin and Voigt: within a hold it nears the share of it, from all or from nothing."""
    made = effect('creep', c=0.1, t0=90.0, kept=2.0, rested=rested)
    trial = inputs(30.0 * np.arange(1, 5), phase=np.array([1.0, 0.4, 0.4, 0.9]))
    offset, _ = made.drift(np.full(4, 4.0), np.full(4, 16.0), trial, WIRE)
    relaxed, expected = 1.0 - rested, []
    for phase in trial.phase:
        relaxed = phase + (relaxed - phase) * math.exp(-30.0 / 90.0)
        expected.append(0.001 * 0.27 * math.log(10.0) * (relaxed - 1.0 + rested))
    np.testing.assert_allclose(offset, expected, atol=1e-15)
    made.start()
    for n in range(4):
        row = Inputs(*(float(column[n]) for column in trial))
        assert made.advance(4.0, 16.0, row, WIRE)[0] == pytest.approx(offset[n], abs=1e-15)
        made.restore(made.save())


@pytest.mark.parametrize('kept', [1.0, 2.0])
def test_settled_creep_ends_at_the_response_of_the_bench(kept):
    """At once a step does the less, by all that its relaxations are to do."""
    time = np.array([0.1, 0.2, 1.0, 1e6, 1e6 + 0.1])
    trial = inputs(time, phase=np.array([1.0, 0.4, 0.4, 0.4, np.nan]))
    made, begun = (effect('creep', c=0.1, t0=3.0, kept=kept, settled=value)
                   for value in (1.0, 0.0))
    offset, before = (one.drift(np.full(5, 4.0), np.full(5, 16.0), trial, WIRE)[0]
                      for one in (made, begun))
    whole = before[3]
    np.testing.assert_allclose(offset, before - whole * np.array([0, 1, 1, 1, 1]), atol=1e-9)
    assert np.all(np.diff(np.abs(offset[1:4])) < 0.0) and abs(offset[3]) < 1e-6 * abs(whole)
    # Also where the trial's rows go on one by one.
    after, _ = made.advance(4.0, 16.0, Inputs(*(float(column[4]) for column in trial)), WIRE)
    assert after == pytest.approx(offset[4], abs=1e-15)
    made.start()
    for n in range(5):
        row = Inputs(*(float(column[n]) for column in trial))
        assert made.advance(4.0, 16.0, row, WIRE)[0] == pytest.approx(offset[n], abs=1e-15)
        state, made = made.save(), effect('creep', c=0.1, t0=3.0, kept=kept, settled=1.0)
        made.restore(state)
    # From which it has begun to creep no longer matters in the end.
    rested = effect('creep', c=0.1, t0=3.0, kept=kept, settled=1.0, rested=1.0)
    late, _ = rested.drift(np.full(5, 4.0), np.full(5, 16.0), trial, WIRE)
    assert late[3] == pytest.approx(offset[3], abs=1e-9) and abs(late[1] - offset[1]) > 1e-5


def test_nothing_creeps_before_the_first_step_or_where_the_phase_is_not_known():
    made = effect('creep', c=0.1)
    offset, _ = made.drift(np.zeros(3), np.zeros(3), inputs([1, 9, 99], phase=[1, 1, 1]), WIRE)
    assert np.all(offset == 0.0)
    offset, _ = made.drift(np.full(3, 4.0), np.full(3, 16.0), inputs([1, 9, 99]), WIRE)
    assert np.all(offset == 0.0)


@pytest.mark.parametrize('name', ['creep', 'r_phase'])
def test_a_muscle_that_extends_goes_the_other_way(name):
    volts = np.array([4.0, 4.0, 1.0, 1.0])
    trial = inputs([1, 5, 6, 20], phase=[0.3, 0.3, 0.8, 0.8])
    contracts, extends = (
        effect(name, WIRE._replace(sign=sign), **STRENGTHS[name]).drift(
            volts, volts ** 2, trial, WIRE._replace(sign=sign))[0]
        for sign in (-1, 1))
    np.testing.assert_allclose(extends, -contracts)
    assert contracts[1] < 0.0


@given(st.lists(st.tuples(st.floats(0.0, 6.0), st.floats(0.1, 50.0), st.booleans()),
                min_size=1, max_size=12), st.sampled_from(DRIFTS))
def test_row_by_row_is_the_same_as_the_whole_trial(rows, name):
    volts, times = [0.0], []
    for value, dt, held in rows:
        volts.append(volts[-1] if held else value)
        times.append(dt)
    volts = np.array(volts[1:])
    trial = inputs(np.cumsum(times), np.cumsum(np.abs(np.diff(volts, prepend=0.0))) / 12.0,
                   1.0 - volts / 6.0)
    made = effect(name, **STRENGTHS[name])
    offset, factor = made.drift(volts, volts ** 2, trial, WIRE)
    made.start()
    for n, value in enumerate(volts.tolist()):
        row = Inputs(*(float(column[n]) for column in trial))
        np.testing.assert_allclose(made.advance(value, value ** 2, row, WIRE),
                                   (offset[n], factor[n]), rtol=1e-12, atol=1e-15)
        made.restore(made.save())


@pytest.mark.parametrize('name', [*DRIFTS, 'slack'])
def test_chain_knows_what_drifts(name):
    assert Chain([effect(name, **STRENGTHS[name])], WIRE).drifts == (name != 'slack')


def test_effects_of_the_load_add_up_and_strokes_multiply():
    chain = Chain([effect('stress_dependence', shift=0.1),
                   effect('stress_dependent_strain', r=0.6, F0=1.5),
                   effect('series_compliance', compliance=0.1), effect('slack', Ls=1.0)], WIRE)
    np.testing.assert_allclose(chain.load_inside(LOADS), 1.1 * LOADS - 0.3)
    np.testing.assert_allclose(chain.stretch(LOADS), 1e-3 + 1e-4 * LOADS)
    np.testing.assert_allclose(
        chain.scale(LOADS), effect('stress_dependent_strain', r=0.6, F0=1.5).scale(LOADS, WIRE))
    assert chain.load_per_drive_squared() == 0.0
    assert chain.offsets == (0.0,)


def test_unequal_muscles_have_a_longer_and_a_shorter_one():
    made = effect('unequal_muscles', shorter=2.0, longer=3.0)
    assert made.offsets == pytest.approx((-2e-3, 0.0, 3e-3))
    assert Chain([made], WIRE).offsets == made.offsets


def bench(voltage, force):
    """A length table of one trial."""
    count = len(voltage)
    return Measurement.from_columns({
        'trial': np.zeros(count), 'step': np.arange(count), 'voltage': np.asarray(voltage),
        'force': np.full(count, force), 'length': np.zeros(count)})


def test_length_table_follows_the_relation_of_the_material():
    model = bicep_model()
    effects = [effect_of(model, name) for name in (
        'stress_dependence', 'stress_dependent_strain', 'series_compliance', 'slack', 'fatigue')]
    voltage, force = np.array([1.0, 4.0, 2.0, 5.0, 0.0]), 4.0
    predicted = model.with_effects(effects).predict(bench(voltage, force))

    first, stage = model.force_stage, model.require_length_stage()
    first.reset()
    stage.reset()
    inside = force + 0.15 * (force - 3.0)
    stage.step(inside - first.step(0.0))
    base = stage.output_range[0]
    share = ((1.0 - 0.5 * math.exp(-force / 3.6)) / (1.0 - 0.5 * math.exp(-1.0 / 1.2)))
    travel, before = 0.0, 0.0
    for n, value in enumerate(voltage):
        travel, before = travel + abs(value - before), value
        worn = math.log1p(travel / 12.0)
        length = (base + share * (1.0 - 0.02 * worn)
                  * (stage.step(inside - first.step(value)) - base)
                  + 0.05e-3 * force + 0.5e-3 - 0.0005 * 0.27 * worn)
        assert predicted[n] == pytest.approx(length, abs=1e-12)


def test_clausius_clapeyron_takes_the_place_of_the_first_stage():
    model = bicep_model()
    voltage = np.array([1.0, 4.0, 2.0])
    predicted = model.with_effects(
        [effect_of(model, 'stress_dependence', C=0.4)]).predict(bench(voltage, 4.0))
    stage = model.require_length_stage()
    stage.step(4.0)
    np.testing.assert_allclose(
        predicted, [stage.step(4.0 - 0.4 * value ** 2) for value in voltage], atol=1e-15)
