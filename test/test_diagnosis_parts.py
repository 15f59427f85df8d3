# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The statistics and the bookkeeping that a diagnosis is made of, each against its definition."""

from hypothesis import given, strategies as st
from model_support import bicep_model, effect_of, ROWS, runs
import numpy as np
import pytest

from hysteresis_ros.diagnosis import discrepancy
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.diagnosis.problem import sensor_resolution
from hysteresis_ros.diagnosis.residual import predictable, shares, unexplained_signal
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.diagnosis.significance import (
    block_sums, cosines, gain_interval, paired_p_values, residualise)
from hysteresis_ros.diagnosis.verdict import add_signatures, in_order, next_experiment
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement


@pytest.fixture(scope='module')
def problem():
    """Return rows of a model without any error."""
    model = bicep_model()
    return problem_for(model, [runs(model)])


def test_paired_p_values_tell_a_steady_gain_from_one_lucky_block():
    """The same sum in every block counts, in a single one it does not."""
    rng = np.random.default_rng(2)
    steady = 1.0 + 0.3 * rng.standard_normal(24)
    lucky = np.r_[24.0, np.zeros(23)]
    values = paired_p_values(np.stack([steady, lucky, -steady]), rng)
    assert values[0] < 0.02 and values[1] > 0.2 and values[2] > 0.9


def test_the_interval_of_a_gain_holds_its_value():
    """Half of every residual gone is a gain of exactly one half."""
    rng = np.random.default_rng(3)
    before, block = rng.standard_normal(240), np.arange(240) // 10
    assert gain_interval(before, 0.5 * before, block, rng) == pytest.approx((0.5, 0.5))
    low, high = gain_interval(before, rng.standard_normal(240), block, rng)
    assert low < 0.0 < high
    assert block_sums(np.ones(240), block).tolist() == [10.0] * 24


def test_cosines_and_what_is_left_beside_columns():
    """Opposite directions are the same signature; projections are orthogonal."""
    vectors = np.array([[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    expected = [[1, 1, 0.5 ** 0.5, 0], [1, 1, 0.5 ** 0.5, 0], [0.5 ** 0.5, 0.5 ** 0.5, 1, 0],
                [0, 0, 0, 0]]
    assert cosines(vectors) == pytest.approx(np.array(expected))
    columns = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, 0.0]])
    left = residualise(columns, vectors)
    assert np.abs(left @ columns).max() < 1e-12
    assert left[2] == pytest.approx([0.0, 0.0, 0.0])
    assert left[0] == pytest.approx([0.5, -0.5, 0.0])
    assert residualise(np.zeros((3, 0)), vectors) is vectors


def test_effects_that_the_bench_has_shown_may_differ_on_the_arm():
    """Those of the wire are tried again, those of the arm are not."""
    model = bicep_model(['series_compliance', 'payload_error', 'heating_cooling_asymmetry'])
    names, _ = possible(problem_for(model, [runs(model, step=0.1)]), [])
    assert 'series_compliance' in names
    assert 'payload_error' not in names
    # A lag is a part of the asymmetry, so it cannot be missing beside it.
    effect = effect_of(model, 'heating_cooling_asymmetry')
    names, _ = possible(problem_for(bicep_model(), [runs(model, step=0.1)]), [effect])
    assert not {'thermal_lag', 'heating_cooling_asymmetry'} & set(names)


def test_a_flexible_regression_finds_smooth_dependence_and_leaves_noise():
    """The share on held-out rows is that of the planted part."""
    rng = np.random.default_rng(6)
    signals = {'drive': rng.uniform(0.0, 6.0, 400), 'load': rng.standard_normal(400)}
    fold, noise = np.arange(400) // 50 % 4, rng.standard_normal(400)
    planted = 3.0 * np.sin(signals['drive'])
    truth = np.var(planted) / np.var(planted + noise)
    assert flexible(signals, planted + noise, fold) == pytest.approx(truth, abs=0.12)
    assert flexible(signals, noise, fold) < 0.03
    assert flexible({}, noise, fold) == 0.0


def test_what_is_left_names_the_signal_in_which_it_shows(problem):
    """A residual that follows the drive says drive, and white noise says nothing."""
    drive = problem.signals['drive']
    left = examine(problem, np.cos(0.5 * drive))
    assert left.explained > 0.8 and left.signal == 'drive'
    noise = examine(problem, np.random.default_rng(7).standard_normal(len(drive)))
    assert noise.explained < 0.1 and noise.signal == ''


def test_an_event_has_the_time_since_the_recording_began():
    """Trials follow each other, and the clock runs on."""
    model = bicep_model()
    problem = problem_for(model, [runs(model)])
    row = 2 * ROWS - 20
    left = examine(problem, (np.arange(3 * ROWS) >= row).astype(float))
    assert left.event_share > 0.99
    assert left.event == problem.clock[row]
    assert np.all(np.diff(problem.clock) > 0.0)


def test_one_signal_alone_may_show_what_all_together_do_not():
    """Few rows and many signals: the regression on all of them learns little."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[20, 20, 20])])
    rng = np.random.default_rng(9)
    problem.signals.update({f'noise{n}': rng.standard_normal(60) for n in range(12)})
    drive = problem.signals['drive']
    left = examine(problem, np.sin(drive) + 0.2 * rng.standard_normal(60))
    assert left.signal == 'drive' and left.explained > 0.5


def test_decoys_have_the_size_that_the_bench_found_and_the_noise(problem):
    """In the angle they are the error of the length times the arm's sensitivity."""
    model = problem.model
    assert structure.length_error(model) == 0.0004
    rng = np.random.default_rng(8)
    predicted = problem.simulate([])
    draws = structure.decoys(problem, [], predicted, rng, 800)
    assert draws.shape == (800, len(predicted))
    gain = structure.sensitivity(problem, [])
    expected = np.sqrt(np.mean((0.0004 * gain) ** 2) + problem.noise ** 2)
    assert np.sqrt(np.mean(draws ** 2)) == pytest.approx(expected, rel=0.08)
    assert abs(np.mean(draws)) < 0.1 * expected


def test_the_sensitivity_is_the_slope_of_the_arm(problem):
    """A longer muscle raises the angle by the inverse of dL/dtheta, less what the load gives."""
    gain = structure.sensitivity(problem, [])
    theta = problem.measured
    step = 1e-5
    length = problem.model.geometry.length
    slope = (length(theta + step) - length(theta - step)) / (2.0 * step)
    assert np.all(gain * slope > 0.0)
    assert np.median(gain * slope) == pytest.approx(1.0, abs=0.3)


def test_a_model_without_verification_falls_back_on_what_it_has():
    """The error of the fitted trials counts where no others are, and none is zero."""
    model = bicep_model(metrics={'length': {'identification': {'rmse': 0.001}}})
    assert structure.length_error(model) == 0.001
    assert structure.length_error(bicep_model(metrics={})) == 0.0


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
    assert sensor_resolution(data) == pytest.approx(0.001 / 12 ** 0.5, rel=1e-6)


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
