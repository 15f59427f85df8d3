# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The statistics and the bookkeeping that a diagnosis is made of, each against its definition."""

import dataclasses

from model_support import (
    arm_run, autoregressive, bicep_model, effect_of, GEOMETRY, ROWS, runs)
import numpy as np
import pytest

from hysteresis_ros.diagnosis import discrepancy
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.load_history import load_history
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.diagnosis.residual import (
    heteroscedasticity_p_value, predictable, shares, unexplained_signal)
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.diagnosis.significance import (
    autocorrelation, block_sums, cosines, gain_interval, paired_p_values, residualise)
from hysteresis_ros.diagnosis.verdict import add_signatures, in_order, next_experiment
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement


@pytest.fixture(scope='module')
def problem():
    """Return rows of a model without any error."""
    model = bicep_model()
    return problem_for(model, [runs(model)])


@pytest.mark.parametrize('rho', [0.0, 0.5, 0.9])
def test_autocorrelation_is_that_of_each_trial(rho):
    noise = autoregressive(np.random.default_rng(1), 40, 200, rho)
    trial = np.repeat(np.arange(40), 200)
    assert autocorrelation(noise, trial) == pytest.approx(rho, abs=0.02)
    assert autocorrelation(-noise, trial) == autocorrelation(noise, trial)
    # A trial of one row has none before it.
    assert autocorrelation(noise, np.arange(8000)) == 0.0
    assert autocorrelation(np.where(np.arange(10) % 2, 1.0, -1.0), np.zeros(10)) == 0.0


def test_paired_p_values_tell_a_steady_gain_from_one_lucky_block():
    """The same sum in every block counts, in a single one it does not."""
    rng = np.random.default_rng(2)
    steady = 1.0 + 0.3 * rng.standard_normal(24)
    lucky = np.r_[24.0, np.zeros(23)]
    values = paired_p_values(np.stack([steady, lucky, -steady]), rng)
    assert values[0] < 0.02 and values[1] > 0.2 and values[2] > 0.9


def test_no_p_value_is_smaller_than_the_draws_can_give():
    """None of 99 draws was as good: one in a hundred, not none."""
    gains = np.ones((1, 200)) + 1e-3 * np.arange(200.0)
    assert paired_p_values(gains, np.random.default_rng(0), 99) == pytest.approx([0.01])


def test_the_interval_of_a_gain_holds_its_value():
    """Half of every residual gone is a gain of exactly one half."""
    rng = np.random.default_rng(3)
    before, block = rng.standard_normal(240), np.arange(240) // 10
    assert gain_interval(before, 0.5 * before, block, rng) == pytest.approx((0.5, 0.5))
    low, high = gain_interval(before, rng.standard_normal(240), block, rng)
    assert low < 0.0 < high
    assert block_sums(np.ones(240), block).tolist() == [10.0] * 24


def test_cosines_and_the_residual_of_columns():
    """Opposite directions are the same signature; projections are orthogonal."""
    vectors = np.array([[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    expected = [[1, 1, 0.5 ** 0.5, 0], [1, 1, 0.5 ** 0.5, 0], [0.5 ** 0.5, 0.5 ** 0.5, 1, 0],
                [0, 0, 0, 0]]
    assert cosines(vectors) == pytest.approx(np.array(expected))
    columns = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, 0.0]])
    residual = residualise(columns, vectors)
    assert np.abs(residual @ columns).max() < 1e-12
    assert residual[2] == pytest.approx([0.0, 0.0, 0.0])
    assert residual[0] == pytest.approx([0.5, -0.5, 0.0])
    assert residualise(np.zeros((3, 0)), vectors) is vectors


def test_effects_that_the_bench_has_shown_may_differ_on_the_arm():
    """Those of the wire are tried again, those of the arm are not."""
    model = bicep_model(['series_compliance', 'payload_error'])
    names, unobservable = observable(problem_for(model, [runs(model, dt=0.1)]))
    assert 'series_compliance' in names and 'encoder_offset' in names
    assert 'payload_error' not in {*names, *unobservable}


def test_what_needs_transients_is_unobservable_in_settled_rows(problem):
    """With the reason; and what was not asked for is not mentioned."""
    names, unobservable = observable(problem)
    assert unobservable['thermal_lag'] == 'every row is settled'
    assert 'was not recorded' in unobservable['ambient_temperature']
    assert not set(names) & set(unobservable)
    few = problem_for(problem.model, problem.measurements, ['thermal_lag', 'payload_error'])
    assert observable(few) == (['payload_error'], {'thermal_lag': 'every row is settled'})
    moving = problem_for(problem.model, [runs(problem.model, dt=0.1)])
    assert 'thermal_lag' in observable(moving)[0]


def test_a_flexible_regression_finds_smooth_dependence_and_leaves_noise():
    """The share on held-out rows is that of the planted part."""
    rng = np.random.default_rng(6)
    signals = {'drive': rng.uniform(0.0, 6.0, 400), 'load': rng.standard_normal(400)}
    fold, noise = np.arange(400) // 50 % 4, rng.standard_normal(400)
    planted = 3.0 * np.sin(signals['drive'])
    truth = np.var(planted) / np.var(planted + noise)
    assert predictable(signals, planted + noise, fold) == pytest.approx(truth, abs=0.12)
    assert predictable(signals, noise, fold) < 0.03
    assert predictable({}, noise, fold) == 0.0


def test_noise_that_comes_and_goes_is_told_from_noise():
    """P values of noise are even between 0 and 1; rows without neighbours say nothing."""
    rng = np.random.default_rng(4)
    trial = np.repeat([0, 1], 60)
    p_values = np.array([heteroscedasticity_p_value(rng.standard_normal(120), trial, rng, 99)
                         for _ in range(200)])
    assert np.mean(p_values) == pytest.approx(0.5, abs=0.07)
    assert np.mean(p_values <= 0.05) == pytest.approx(0.05, abs=0.05)
    gusts = rng.standard_normal(120) * (1.0 + 4.0 * (np.arange(120) // 10 % 2))
    assert heteroscedasticity_p_value(gusts, trial, rng, 399) == 1.0 / 400.0
    assert heteroscedasticity_p_value(gusts, np.arange(120), rng, 99) == 1.0


def test_a_residual_names_the_signal_in_which_it_shows(problem):
    """One that follows the drive says drive, and white noise says nothing."""
    drive = problem.signals['drive']
    residual = np.cos(0.5 * drive)
    assert unexplained_signal(problem, residual) == 'drive'
    assert shares(problem, residual)['all'] > 0.8
    noise = np.random.default_rng(7).standard_normal(len(drive))
    assert unexplained_signal(problem, noise) == ''
    assert max(shares(problem, noise).values()) < 0.1


def test_one_signal_alone_may_show_what_all_together_do_not():
    """Few rows and many signals: the regression on all of them learns little."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[20, 20, 20])])
    rng = np.random.default_rng(9)
    problem.signals.update({f'noise{n}': rng.standard_normal(60) for n in range(12)})
    residual = np.sin(problem.signals['drive']) + 0.2 * rng.standard_normal(60)
    assert unexplained_signal(problem, residual) == 'drive'
    found = shares(problem, residual)
    assert found['drive'] > 0.5 and found['drive'] > found['all']


def test_the_clock_runs_on_over_trials_and_recordings():
    """An event has one time, whatever the files are divided into."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, 2), runs(model, 1, seed=4)])
    assert np.all(np.diff(problem.clock) > 0.0)
    assert problem.clock[-1] == pytest.approx(3 * ROWS * 30.0)


def test_the_discrepancy_has_the_size_that_the_bench_found(problem):
    """In the angle it is the error of the length times the arm's sensitivity, and the path's."""
    gain = discrepancy.sensitivity(problem, [])
    predicted = problem.simulate([])
    history = load_history(problem, [])
    found = discrepancy.discrepancy_along(problem, [], predicted, Settings()).matrix()
    assert np.diag(found) == pytest.approx(
        (0.0004 * gain) ** 2 + history.path ** 2 + (gain * history.formation) ** 2)
    assert found == pytest.approx(found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9 * np.max(found)


def test_the_way_done_counts_only_drives_that_the_response_follows():
    drive = np.array([0.0, 1.0, 2.0, 4.0, 2.0, 1.0, 0.0])
    trial = np.zeros(7, dtype=int)
    flat_to_one = np.array([5.0, 5.0, 8.0, 14.0, 8.0, 5.0, 5.0])
    found = discrepancy.way_done(drive, flat_to_one, trial)
    assert found == pytest.approx(np.array([0.0, 0.0, 3.0, 9.0, 3.0, 0.0, 0.0]) / 9.0)
    # Where it follows everywhere alike, it is the drive itself.
    even = discrepancy.way_done(drive, -3.0 * drive, trial)
    assert even == pytest.approx(drive / 4.0)
    # Both branches of a loop count: here one moves below 2 and one above.
    loop = discrepancy.way_done(np.array([0.0, 2.0, 4.0, 2.0, 0.0]),
                                np.array([0.0, 0.0, 6.0, 6.0, 0.0]), np.zeros(5, dtype=int))
    assert loop == pytest.approx([0.0, 0.5, 1.0, 0.5, 0.0])


def test_the_way_of_a_held_drive_lies_beside_it_and_none_between_trials():
    drive, trial = np.array([0.0, 1.0, 1.0, 2.0, 3.0]), np.zeros(5, dtype=int)
    late = discrepancy.way_done(drive, np.array([0.0, 0.0, 4.0, 4.0, 4.0]), trial)
    assert late == pytest.approx([0.0, 0.5, 0.5, 1.0, 1.0])
    apart = discrepancy.way_done(np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 9.0, 10.0]),
                                 np.array([0, 0, 1, 1]))
    assert apart == pytest.approx([0.0, 0.5, 0.5, 1.0])
    still = np.zeros(4, dtype=int)
    for drive, response in ((np.arange(4.0), np.ones(4)), (np.ones(4), np.arange(4.0))):
        assert not np.any(discrepancy.way_done(drive, response, still))


def test_drives_that_differ_by_rounding_are_one_on_the_way():
    drive = np.array([0.0, 1.0, 2.0, np.nextafter(2.0, 3.0), 3.0])
    response, trial = np.array([0.0, 1.0, 3.0, 6.0, 7.0]), np.zeros(5, dtype=int)
    assert discrepancy.way_done(drive, response, trial) == pytest.approx(
        discrepancy.way_done(np.round(drive, 3), response, trial))


def test_what_martensite_may_keep_of_its_load_is_part_of_the_discrepancy():
    """As an error of the length, where the strain grows with a load that moves."""
    model = bicep_model()
    growth = effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)
    problem = problem_for(model.with_effects([growth]), [runs(model)])
    gain, history = discrepancy.sensitivity(problem, [growth]), load_history(problem, [growth])
    kept = (gain * history.formation) ** 2
    found = np.diag(discrepancy.discrepancy_along(
        problem, [growth], problem.simulate([growth]), Settings()).matrix())
    assert np.mean(kept) > 0.01 * np.mean(found)
    assert found == pytest.approx((0.0004 * gain) ** 2 + history.path ** 2 + kept)


@pytest.mark.parametrize('fitted', [True, False])
def test_what_may_be_kept_is_no_discrepancy_where_it_is_an_effect(fitted):
    """In a set, or tried together with it, its own parameter says how much is kept."""
    model = bicep_model()
    effects = [effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)]
    if fitted:
        effects.append(effect_of(model, 'formation_memory', kept=0.4))
    problem = problem_for(model.with_effects(effects), [runs(model)])
    gain, history = discrepancy.sensitivity(problem, effects), load_history(problem, effects)
    found = discrepancy.discrepancy_along(
        problem, effects, problem.simulate(effects), Settings(),
        () if fitted else ('slack', 'formation_memory'))
    assert np.diag(found.matrix()) == pytest.approx((0.0004 * gain) ** 2 + history.path ** 2)


def test_errors_of_rows_that_are_near_on_the_way_and_in_response_are_alike(problem):
    """More so on the same way of the drive than on the way back."""
    predicted, settings = problem.simulate([]), Settings()
    found = discrepancy.discrepancy_along(problem, [], predicted, settings).matrix()
    size = np.sqrt(np.diag(found))
    drive, direction = problem.signals['drive'], problem.signals['direction'] > 0.0
    way = discrepancy.way_done(drive, predicted, problem.trial)
    gap = np.hypot(way[:, None] - way,
                   (predicted[:, None] - predicted) / np.ptp(predicted)) / settings.correlation
    # The part that differs between the directions is half of the common one: 1 - 1/4 to 1 + 1/4.
    same = np.where(direction[:, None] == direction[None, :], 1.0, 0.6)
    np.testing.assert_allclose(found / np.outer(size, size), same / np.sqrt(1.0 + gap ** 2),
                               atol=0.03)


def test_the_sensitivity_is_the_slope_of_the_arm(problem):
    """A longer muscle raises the angle by the inverse of dL/dtheta, less what the load gives."""
    gain = discrepancy.sensitivity(problem, [])
    theta = problem.measured
    step = 1e-5
    length = problem.model.geometry.length
    slope = (length(theta + step) - length(theta - step)) / (2.0 * step)
    assert np.all(gain * slope > 0.0)
    assert np.median(gain * slope) == pytest.approx(1.0, abs=0.3)


def test_the_largest_error_that_the_bench_has_shown_counts():
    """Of trials and of loads that were left out; else that of the fitted trials, else none."""
    def error(**length):
        return discrepancy.length_error(bicep_model(metrics={
            'length': {part: {'rmse': value} for part, value in length.items()}}))
    assert error(verification=0.0004) == 0.0004
    assert error(verification=0.0004, left_out=0.0015) == 0.0015
    assert error(verification=0.0004, left_out=0.0001) == 0.0004
    assert error(identification=0.001) == 0.001
    assert error(identification=0.001, verification=0.0004) == 0.0004
    assert error(left_out=None, verification=float('nan')) == 0.0
    assert discrepancy.length_error(bicep_model(metrics={})) == 0.0


def test_weight_columns_of_a_trial_do_not_depend_on_the_others():
    """Each begins with the memory wiped."""
    model = bicep_model()
    measured = runs(model, 3)
    together = problem_for(model, [measured])
    columns = together.weight_columns([])
    for trial in range(3):
        own = problem_for(model, [measured.select([trial])]).weight_columns([])
        assert np.ptp(own) > 0.0
        np.testing.assert_allclose(columns[together.trial == trial], own, rtol=1e-6, atol=1e-12)


def by_load(loads, **parts):
    """Return metrics of a bench with an error [m] under each load [N], of each part."""
    return {'length': {part: {'rmse': max(errors), 'loads': list(loads), 'rmse_by_load': errors}
                       for part, errors in parts.items()}}


def test_the_error_of_the_length_is_that_under_the_load_of_the_arm():
    """And of the loads near it; outer ones were extrapolated to, which counts beyond them."""
    loads, places = (1.0, 3.0, 5.0, 7.0), np.array([-1.0, 1.0, 3.0, 5.0, 7.0, 9.0])
    asked = np.array([-9.0, -1.0, 1.0, 2.5, 5.0, 9.0, 20.0])

    def error(**parts):
        return discrepancy.length_errors(bicep_model(metrics=by_load(loads, **parts)), asked)
    found = error(left_out=[8e-4, 2e-4, 1e-4, 6e-4], identification=[4e-4, 1e-5, 1e-5, 3e-4])
    squares = 1e-8 * np.array([8.0, 4.0, 2.0, 1.0, 3.0, 6.0]) ** 2
    for load, one in zip(np.clip(asked, -1.0, 9.0), found):
        near = np.exp(-0.5 * ((load - places) / 2.0) ** 2)
        assert one == pytest.approx(np.sqrt(near @ squares / near.sum()))
    assert found[0] == found[1] > found[2] > found[4] and found[-1] == found[-2]
    same = error(left_out=4 * [1e-4], identification=4 * [1e-5], verification=4 * [3e-4])
    assert same == pytest.approx(len(asked) * [3e-4], rel=0.02)


@pytest.mark.parametrize('metrics', [
    by_load((1.0, 7.0), left_out=[8e-4, 2e-4], identification=[1e-5, 1e-5]),
    {'length': {'left_out': {'rmse': 8e-4}}}])
def test_two_loads_have_none_between_them_that_could_tell(metrics):
    found = discrepancy.length_errors(bicep_model(metrics=metrics), np.array([1.0, 4.0, 7.0]))
    assert found == pytest.approx(3 * [8e-4])


def test_the_discrepancy_follows_the_load(problem):
    """Where the bench was hardly right under a small load, an arm is less certain there."""
    load = load_history(problem, []).load
    middle = float(np.median(load))
    model = dataclasses.replace(problem.model, metrics=by_load(
        (0.5 * middle, middle, 2.0 * middle), left_out=[9e-4, 1e-4, 1e-4],
        identification=[9e-4, 1e-5, 1e-4]))
    problem = problem_for(model, [runs(model)])
    gain, history = discrepancy.sensitivity(problem, []), load_history(problem, [])
    found = np.diag(discrepancy.discrepancy_along(
        problem, [], problem.simulate([]), Settings()).matrix())
    error = discrepancy.length_errors(model, load)
    assert np.ptp(error) > 1e-5
    assert found == pytest.approx(
        (error * gain) ** 2 + history.path ** 2 + (gain * history.formation) ** 2)


def path_of(model, measured):
    """Return the difference between a load that moves and one that acted all along."""
    return load_history(problem_for(model, [measured]), []).path


@pytest.mark.parametrize('voltage', [0.0, 2.0, 4.0, 6.0])
def test_a_load_that_holds_still_leaves_nothing_that_the_bench_cannot_tell(voltage):
    """An arm at rest is as on the bench: the load that acts has acted all along."""
    model = bicep_model()
    measured = arm_run(np.full(20, voltage))
    assert np.abs(path_of(model, measured)).max() < 1e-6


def test_a_load_that_moves_with_the_arm_leaves_a_difference():
    """Largest in the middle of the transformation, none at its ends, and less for a light arm."""
    model = bicep_model()
    both_ways = np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)])
    path = np.abs(path_of(model, arm_run(both_ways)))
    assert 1e-3 < path.max() < 0.02
    assert max(path[0], path[-1]) < 0.1 * path.max()
    assert path.max() == max(path[5:35])
    light = bicep_model(geometry=dataclasses.replace(
        GEOMETRY, payload_mass=1e-4, forearm_mass=1e-4))
    assert np.abs(path_of(light, arm_run(both_ways))).max() < 0.02 * path.max()


@pytest.mark.parametrize('g', [0.4, -0.5])
def test_loops_that_the_load_widens_are_part_of_both_models(g):
    """Else the difference would be that of other loops, seven times as large."""
    model = bicep_model()
    slopes = effect_of(model, 'transformation_slopes', g=g)
    both_ways = arm_run(np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)]))
    plain = np.abs(path_of(model, both_ways)).max()
    problem = problem_for(model.with_effects([slopes]), [both_ways])
    assert np.abs(load_history(problem, [slopes]).path).max() == pytest.approx(plain, rel=0.3)


def test_cold_ends_are_part_of_both_models():
    """Else the difference would be that of warm ends, six times as large."""
    model = bicep_model()
    ends = effect_of(model, 'cold_clamps', share=0.3)
    both_ways = arm_run(np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)]))
    plain = np.abs(path_of(model, both_ways)).max()
    problem = problem_for(model.with_effects([ends]), [both_ways])
    assert np.abs(load_history(problem, [ends]).path).max() == pytest.approx(plain, rel=0.3)


def test_where_the_strain_does_not_grow_with_the_load_nothing_is_kept():
    """Nor where the load holds still: the bench shows all that there is."""
    model = bicep_model()
    growth = effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)
    moving = arm_run(np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)]))
    still = arm_run(np.full(20, 4.0))
    grown = model.with_effects([growth])
    assert np.abs(load_history(problem_for(model, [moving]), []).formation).max() < 1e-15
    kept = np.abs(load_history(problem_for(grown, [moving]), [growth]).formation).max()
    assert kept > 1e-5
    assert np.abs(load_history(
        problem_for(grown, [still]), [growth]).formation).max() < 0.02 * kept


def test_what_the_sensor_adds_is_no_way_of_the_arm():
    """The same arm takes the same way, whatever its encoder says."""
    model = bicep_model()
    problem = problem_for(model, [arm_run(np.linspace(0.0, 6.0, 20))])
    clean = load_history(problem, []).path
    offset = effect_of(model, 'encoder_offset', offset=5.0)
    assert np.abs(clean).max() > 1e-3
    np.testing.assert_array_equal(load_history(problem, [offset]).path, clean)


@pytest.mark.parametrize('verdict, names, alternatives, unobservable, words', [
    ('unknown', ['backlash'], [], {}, ['repeat the recording', 'like backlash shows best']),
    ('missing', ['payload_error'], [['encoder_offset']], {},
     ['to tell payload_error from encoder_offset']),
    ('missing', ['payload_error', 'slack'], [[], []], {}, ['--add payload_error,slack']),
    ('adequate', [], [], {'thermal_lag': 'every row is settled'}, ['to see thermal_lag, too']),
    ('adequate', [], [], {}, ['nothing'])])
def test_the_next_experiment_follows_from_the_verdict(
        verdict, names, alternatives, unobservable, words):
    """What a person would do: tell apart, repeat, add, or look for what could not show."""
    text = next_experiment(verdict, names, alternatives, unobservable)
    assert all(word in text for word in words)


def test_ranked_effects_say_with_what_they_are_confused_and_what_weights_absorb():
    """Signatures along each other are confused; one along a weight's column is absorbed."""
    rows = [{'effect': name} for name in ('one', 'twin', 'other')]
    signatures = np.array([[1.0, 0.0, 0.0], [-2.0, 0.1, 0.0], [0.0, 0.0, 1.0]])
    add_signatures(rows, signatures, np.array([[0.0], [0.0], [3.0]]))
    assert [row['confused_with'] for row in rows] == [['twin'], ['one'], []]
    assert [row['absorbed'] for row in rows] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize('cosine, confused', [(0.95, True), (-0.95, True), (0.85, False)])
def test_signatures_that_nearly_agree_are_confused(cosine, confused):
    """Nine tenths is the border; opposite signatures are the same one."""
    rows = [{'effect': name} for name in ('one', 'other')]
    signatures = np.array([[1.0, 0.0], [cosine, np.sqrt(1.0 - cosine ** 2)]])
    add_signatures(rows, signatures, np.zeros((2, 0)))
    assert [row['confused_with'] for row in rows] == (
        [['other'], ['one']] if confused else [[], []])


def test_the_ranking_begins_with_the_answer_and_ends_with_what_is_not_physical():
    """In between the error on rows that were not fitted decides."""
    rows = [{'effect': name, 'plausible': name != 'odd', 'rmse_after': after} for name, after in (
        ('odd', 0.1), ('second', 0.5), ('weak', 0.9), ('good', 0.3), ('first', 0.7))]
    assert [row['effect'] for row in in_order(rows, ['first', 'second'])] == [
        'first', 'second', 'good', 'weak', 'odd']


def test_whole_trials_are_held_out_together():
    """Memory leaks across random splits, so a trial is never divided."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, 3), runs(model, 3, seed=9)])
    assert np.unique(problem.trial).tolist() == list(range(6))
    for trial in range(6):
        assert len(np.unique(problem.fold[problem.trial == trial])) == 1
    for block in np.unique(problem.block):
        assert len(np.unique(problem.trial[problem.block == block])) == 1
    assert problem.folds.tolist() == [0, 1, 2, 3]


def test_one_trial_is_held_out_in_blocks_of_time():
    """Every fold is some stretches of the recording, and all rows are in one."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, 1, rows=80)])
    assert problem.folds.tolist() == [0, 1, 2, 3]
    assert np.count_nonzero(np.diff(problem.fold)) == 7


def test_the_noise_of_a_sensor_comes_from_its_steps():
    """Counts of an encoder are uniform in their step."""
    angle = 0.001 * np.round(np.random.default_rng(0).uniform(1.0, 2.0, 500) / 0.001)
    data = Measurement.from_columns({
        'time': 30.0 * np.arange(500.0), 'trial': np.zeros(500), 'voltage': angle,
        'angle': angle})
    assert problem_for(bicep_model(), [data]).noise == pytest.approx(0.001 / 12 ** 0.5, rel=1e-6)


def test_a_long_recording_is_judged_on_some_rows_of_each_trial():
    """In equal steps, so that what is slow is seen."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[400, 400])])
    assert (problem.stride, len(problem.measured)) == (2, 400)
    assert np.bincount(problem.trial).tolist() == [200, 200]


def test_short_trials_have_no_empty_blocks():
    """Three rows make a block at least."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[10, 40])])
    sizes = np.bincount(problem.block)
    assert sizes.min() >= 3
    assert len(np.unique(problem.block[problem.trial == 0])) == 3
    assert len(np.unique(problem.block[problem.trial == 1])) == 12


def test_of_several_recordings_the_noisiest_counts():
    """Of two sensors nobody knows which rows are right."""
    model, rng = bicep_model(), np.random.default_rng(0)
    coarse, fine = (Measurement.from_columns({
        'time': 30.0 * np.arange(300.0), 'trial': np.zeros(300), 'voltage': np.ones(300),
        'angle': 1.5 + step * np.round(rng.standard_normal(300) * 0.003 / step)})
        for step in (0.001, 0.0001))
    for order in ((coarse, fine), (fine, coarse)):
        problem = problem_for(model, list(order))
        assert problem.noise == pytest.approx(0.001 / 12 ** 0.5, rel=1e-6)
    loud = Measurement.from_columns({**fine.columns, 'angle': 1.5 + 0.1 * rng.standard_normal(300)})
    for order in ((loud, fine), (fine, loud)):
        assert problem_for(model, list(order)).largest_noise > 0.1


@pytest.mark.parametrize('change, seen', [(0.3, False), (3.0, True)])
def test_a_temperature_that_hardly_changes_shows_nothing(change, seen):
    """Half a degree is the thermometer's noise."""
    model = bicep_model()
    clean = runs(model)
    ambient = 22.0 + change * np.linspace(0.0, 1.0, clean.rows)
    problem = problem_for(model, [Measurement.from_columns(
        {**clean.columns, 'ambient_temperature': ambient})])
    assert ('ambient_temperature' in observable(problem)[0]) == seen


def test_recordings_that_do_not_go_together_are_refused():
    """One line says which kinds there are, or what to give instead."""
    model = bicep_model()
    bench = Measurement.from_columns({
        'trial': np.zeros(5), 'step': np.arange(5.0), 'voltage': np.arange(5.0),
        'force': np.ones(5), 'length': np.linspace(0.0, -0.01, 5)})
    force = Measurement.from_columns({
        'trial': np.zeros(5), 'step': np.arange(5.0), 'voltage': np.arange(5.0),
        'force': np.ones(5)})
    for given_, words in (([], 'no measurement'), ([force], 'length table'),
                          ([bench, runs(model, 1)], 'several kinds')):
        with pytest.raises(MeasurementError, match=words):
            problem_for(model, given_)
