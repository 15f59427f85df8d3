# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of Eqs. 23 and 24 as they have to be, and the noise that no model can remove."""

from hypothesis import given, strategies
from hypothesis.extra.numpy import arrays
from hysteresis_ros.measurements.metrics import (
    errors, largest_noise, noise_floor, relative_rmse, repeat_noise, resolution_noise,
    rmse_by_load, sample_noise)
from hysteresis_ros.measurements import Measurement
import numpy as np
import pytest


def test_errors_by_hand():
    found = errors(np.array([1.0, -1.0, 3.0, 1.0]), output_range=20.0)
    assert found.mean_abs == pytest.approx(6 / 4)
    assert found.std == pytest.approx(np.sqrt((0 + 4 + 4 + 0) / 4))
    assert found.rmse == pytest.approx(np.sqrt((1 + 1 + 9 + 1) / 4))
    assert found.mean_percent == pytest.approx(7.5)
    assert found.std_percent == pytest.approx(100 * np.sqrt(2) / 20)


@given(arrays(float, strategies.integers(1, 50), elements=strategies.floats(-1e3, 1e3)),
       strategies.integers(2, 5))
def test_repeating_the_rows_changes_no_error(residual, times):
    once, often = errors(residual, 10.0), errors(np.tile(residual, times), 10.0)
    np.testing.assert_allclose(often, once, rtol=1e-9, atol=1e-9)
    assert once.std <= once.rmse + 1e-9
    assert once.mean_abs <= once.rmse + 1e-9


def test_a_response_that_does_not_vary_has_no_percentage():
    found = errors(np.array([1.0, 1.0]), 0.0)
    assert np.isnan(found.mean_percent)
    assert found.to_dict() == {'mean_abs': 1.0, 'std': 0.0, 'rmse': 1.0, 'mean_percent': None,
                               'std_percent': None}


def table(trials, **columns):
    return Measurement.from_columns({'trial': trials, **columns})


def test_resolution_is_the_step_of_the_sensor():
    counts = np.array([0, 5, 17, 18, 40, 3])
    measured = table(np.zeros(6), voltage=np.arange(6.0), force=0.25 * counts)
    assert resolution_noise(measured) == pytest.approx(0.25 / np.sqrt(12))
    flat = table(np.zeros(3), voltage=np.arange(3.0), force=np.ones(3))
    assert resolution_noise(flat) == 0.0


def test_samples_show_white_noise_on_a_slow_motion():
    rng = np.random.default_rng(1)
    time = np.arange(20000) / 100
    angle = 1 + 0.3 * np.sin(time / 5) + 0.002 * rng.standard_normal(len(time))
    run = table(np.zeros(len(time)), time=time, voltage=np.sin(time), angle=angle)
    assert sample_noise(run) == pytest.approx(0.002, rel=0.05)
    assert noise_floor([run]).origin == 'samples'
    short = table(np.zeros(5), time=np.arange(5.0), voltage=np.arange(5.0), angle=np.arange(5.0))
    assert sample_noise(short) == 0.0


@pytest.mark.parametrize('noise', [0.002, 0.1])
def test_white_noise_cannot_be_larger_than_differences_of_rows(noise):
    """A ringing at a twentieth of the sampling does not count, the noise on it does."""
    rng = np.random.default_rng(1)
    time = np.arange(4000) / 100
    angle = 1.0 + 0.1 * np.sin(2.0 * np.pi * 5.0 * time) + noise * rng.standard_normal(4000)
    run = table(np.zeros(4000), time=time, voltage=np.sin(time), angle=angle)
    assert noise < largest_noise(run) < 1.3 * noise
    short = table(np.zeros(5), time=np.arange(5.0), voltage=np.arange(5.0), angle=np.arange(5.0))
    assert largest_noise(short) == np.inf


def test_the_bound_on_white_noise_by_hand():
    """Of rows that alternate on parabolas third differences say least; no trial meets another."""
    row = np.arange(40.0)
    trial = row ** 2 + 0.001 * (-1.0) ** row
    run = table(np.repeat([0, 1], 40), time=np.tile(row, 2), voltage=np.zeros(80),
                angle=np.concatenate([trial, 7.0 - trial]) / 1000.0)
    # Squared correlations of neighbouring third differences: 1 + 2 (15^2 + 6^2 + 1) / 20^2.
    error = np.sqrt(2.0 * 2.31 / (2 * (40 - 3)))
    assert largest_noise(run) == pytest.approx(8e-6 / np.sqrt(20.0 * (1.0 - 3.0 * error)))


@pytest.mark.parametrize('rows', [20, 60, 400])
def test_the_bound_on_white_noise_holds_for_nothing_but_noise(rows):
    """In 99 of a hundred recordings, short ones, too."""
    rng, time = np.random.default_rng(4), np.arange(float(rows))
    bounds = [largest_noise(table(np.zeros(rows), time=time, voltage=time,
                                  angle=1.0 + 0.01 * rng.standard_normal(rows)))
              for _ in range(300)]
    assert np.mean(np.array(bounds) > 0.01) >= 0.99


def test_repeats_show_what_differs_between_equal_trials():
    rng = np.random.default_rng(2)
    drive = np.tile(rng.uniform(0, 6, 200), 3)
    trials = np.repeat([0, 1, 2], 200)
    force = np.sin(drive) + 0.05 * rng.standard_normal(600)
    repeated = table(trials, voltage=drive, force=force)
    assert repeat_noise([repeated]) == pytest.approx(0.05, rel=0.1)
    floor = noise_floor([repeated])
    assert floor.origin == 'repeats' and floor.value == repeat_noise([repeated])
    other = table(trials, voltage=rng.uniform(0, 6, 600), force=force)
    assert repeat_noise([other]) is None
    assert noise_floor([other]).origin == 'resolution'


def test_trials_under_other_loads_are_no_repeats():
    drive = np.tile(np.linspace(0, 6, 20), 2)
    length = np.concatenate([np.linspace(0, 1e-3, 20), np.linspace(0, 2e-3, 20)])
    measured = table(np.repeat([0, 1], 20), voltage=drive, length=length,
                     force=np.repeat([1.0, 3.0], 20))
    assert repeat_noise([measured]) is None


def test_trials_under_the_same_load_are_one():
    """Which is measured, and so differs a little."""
    trial = np.repeat([0.0, 1.0, 2.0], 2)
    found = rmse_by_load(np.array([3.0, -3.0, 4.0, 4.0, 1.0, -1.0]),
                         np.array([7.0, 7.02, 1.0, 1.0, 7.1, 7.06]), trial)
    assert found['loads'] == pytest.approx([1.0, 7.045])
    assert found['rmse_by_load'] == pytest.approx([4.0, np.sqrt(5.0)])


def test_the_error_at_the_ends_and_halfway_is_over_that_of_its_trial():
    """So that a trial with large errors does not decide alone what their course is."""
    residual, response = np.array([1.0, 5.0, 1.0]), np.array([2.0, 3.0, 4.0])
    square = residual ** 2 / 9.0
    one = relative_rmse(residual, response, np.zeros(3))['relative_rmse']
    assert one == pytest.approx({'ends': np.sqrt((square[0] + square[2]) / 2.0),
                                 'halfway': np.sqrt(square[1])})
    # A quarter of the way up, 3/4 of the mean square is that halfway.
    four = relative_rmse(np.array([1.0, 2.0, 2.0, 1.0]), np.array([0.0, 1.0, 3.0, 4.0]),
                         np.zeros(4))['relative_rmse']
    assert four == pytest.approx({'ends': np.sqrt(1.0 / 2.5),
                                  'halfway': np.sqrt((4.0 - 0.25 * 1.0) / 0.75 / 2.5)})
    twice = relative_rmse(np.append(residual, -7.0 * residual), np.append(response, 3.0 * response),
                          np.repeat([0, 1], 3))['relative_rmse']
    assert twice == pytest.approx(one)


def parts_of(sizes, seed=0, rows=4000):
    """Return what errors of the ends, halfway and of the drive, of given sizes, are said to be."""
    rng = np.random.default_rng(seed)
    response, slope = rng.uniform(0.0, 1.0, rows), rng.exponential(2.0, rows)
    share = 4.0 * response * (1.0 - response)
    spread = np.sqrt(sizes[0] ** 2 * (1.0 - share) + sizes[1] ** 2 * share
                     + (sizes[2] * slope) ** 2)
    residual = spread * rng.standard_normal(rows)
    found = relative_rmse(residual, response, np.repeat([3, 7], rows // 2), slope)
    assert found['drive_slope'] == pytest.approx(np.sqrt(np.mean(slope ** 2)), rel=1e-9)
    size = np.sqrt(np.mean(residual ** 2))
    ends, between, drive = (size * found['relative_rmse'][name]
                            for name in ('ends', 'halfway', 'drive'))
    return ends, between, drive / found['drive_slope']


@pytest.mark.parametrize('sizes', [(1.0, 2.0, 0.5), (0.2, 0.5, 1.0), (0.5, 0.5, 0.0)])
def test_an_error_is_told_apart_into_that_of_the_ends_the_middle_and_the_drive(sizes):
    found = np.mean([parts_of(sizes, seed) for seed in range(4)], axis=0)
    assert found == pytest.approx(sizes, rel=0.15, abs=0.07)


def test_parts_add_up_to_the_error_where_the_steepest_rows_are_off_by_less_than_their_slope():
    # Most have turned and do not move, three are steep, and one far steeper.
    response = np.array([0.0, *[0.5] * 10, 1.0])
    slope = np.array([0.0, *[0.0] * 6, 1.0, 1.0, 1.0, 6.0, 0.0])
    residual = np.array([0.1, *[-0.1] * 6, 3.0, -3.0, 3.0, -3.0, 0.1])
    found = relative_rmse(residual, response, np.zeros(12), slope)['relative_rmse']
    share = np.mean(4.0 * response * (1.0 - response))
    assert found['drive'] == pytest.approx(1.0, abs=0.01)
    assert (found['ends'] ** 2 * (1.0 - share) + found['halfway'] ** 2 * share
            + found['drive'] ** 2) == pytest.approx(1.0)


def test_a_response_that_no_drive_moves_says_nothing_of_the_drive():
    residual, response = np.array([1.0, 5.0, 1.0]), np.array([2.0, 3.0, 4.0])
    assert relative_rmse(residual, response, np.zeros(3), np.zeros(3)) == relative_rmse(
        residual, response, np.zeros(3))
    # One trial whose error is none does not count, and no row is where the middle alone acts.
    both = relative_rmse(np.append(residual, np.zeros(3)), np.tile(response, 2),
                         np.repeat([0, 1], 3), np.array([0.0, 1.0, 2.0, 9.0, 9.0, 9.0]))
    one = relative_rmse(residual, response, np.zeros(3), np.array([0.0, 1.0, 2.0]))
    assert both == one and one['drive_slope'] == pytest.approx(np.sqrt(5.0 / 3.0))


def test_errors_alike_everywhere_are_one_and_trials_without_say_nothing():
    response, trial = np.tile(np.linspace(1.0, 2.0, 9), 2), np.repeat([0, 1], 9)
    alike = relative_rmse(np.full(18, 1e-4), response, trial)['relative_rmse']
    assert alike == pytest.approx({'ends': 1.0, 'halfway': 1.0})
    still = np.append(response[:9], np.ones(9))
    assert relative_rmse(np.full(18, 1e-4), still, trial)['relative_rmse'] == pytest.approx(alike)
    assert relative_rmse(np.zeros(18), response, trial) == {}
    assert relative_rmse(np.ones(9), np.ones(9), np.zeros(9)) == {}
