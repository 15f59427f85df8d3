# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where along its drive a response goes its way."""

import numpy as np
import pytest

from hysteresis_ros.kernels.way import risen
from hysteresis_ros.measurements.way import way_done


def test_the_way_done_counts_only_drives_that_the_response_follows():
    drive = np.array([0.0, 1.0, 2.0, 4.0, 2.0, 1.0, 0.0])
    trial = np.zeros(7, dtype=int)
    flat_to_one = np.array([5.0, 5.0, 8.0, 14.0, 8.0, 5.0, 5.0])
    found = way_done(drive, flat_to_one, trial)
    assert found == pytest.approx(np.array([0.0, 0.0, 3.0, 9.0, 3.0, 0.0, 0.0]) / 9.0)
    # Where it follows everywhere alike, it is the drive itself.
    even = way_done(drive, -3.0 * drive, trial)
    assert even == pytest.approx(drive / 4.0)
    # Both branches of a loop count: here one moves below 2 and one above.
    loop = way_done(np.array([0.0, 2.0, 4.0, 2.0, 0.0]), np.array([0.0, 0.0, 6.0, 6.0, 0.0]),
                    np.zeros(5, dtype=int))
    assert loop == pytest.approx([0.0, 0.5, 1.0, 0.5, 0.0])


def test_the_way_of_a_held_drive_lies_beside_it_and_none_between_trials():
    drive, trial = np.array([0.0, 1.0, 1.0, 2.0, 3.0]), np.zeros(5, dtype=int)
    late = way_done(drive, np.array([0.0, 0.0, 4.0, 4.0, 4.0]), trial)
    assert late == pytest.approx([0.0, 0.5, 0.5, 1.0, 1.0])
    apart = way_done(np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 9.0, 10.0]),
                     np.array([0, 0, 1, 1]))
    assert apart == pytest.approx([0.0, 0.5, 0.5, 1.0])
    still = np.zeros(4, dtype=int)
    for drive, response in ((np.arange(4.0), np.ones(4)), (np.ones(4), np.arange(4.0))):
        assert not np.any(way_done(drive, response, still))


def test_drives_that_differ_by_rounding_are_one_on_the_way():
    drive = np.array([0.0, 1.0, 2.0, np.nextafter(2.0, 3.0), 3.0])
    response, trial = np.array([0.0, 1.0, 3.0, 6.0, 7.0]), np.zeros(5, dtype=int)
    assert way_done(drive, response, trial) == pytest.approx(
        way_done(np.round(drive, 3), response, trial))


def test_noise_goes_no_way():
    """Of 200 rows up and down it counts about as far as it goes once, not in each of them."""
    half = np.linspace(0.0, 1.0, 100)
    inputs, trial = np.concatenate((half, half[::-1])), np.zeros(200, dtype=int)
    noisy = inputs + 0.01 * np.random.default_rng(1).standard_normal(200)
    assert np.sum(np.abs(np.diff(noisy))) > 2.7
    assert np.sum(risen(inputs, noisy, trial)) == pytest.approx(2.0, abs=0.1)
    # Where it goes against its input it goes no way; a held input goes on as before.
    assert risen(np.array([0.0, 1.0, 1.0, 2.0, 1.0, 0.0]),
                 np.array([0.0, 2.0, 3.0, 1.0, 2.0, 0.5]), trial[:6]) == pytest.approx(
        [2.0, 1.0, 0.0, 0.0, 0.5])


def test_the_way_begins_anew_with_each_trial():
    inputs, response = np.array([0.0, 1.0, 0.5, 1.5, 2.0]), np.array([0.0, 4.0, 0.0, 1.0, 3.0])
    assert risen(inputs, response, np.array([0, 0, 1, 1, 1])) == pytest.approx(
        [4.0, 0.0, 1.0, 2.0])
    assert risen(inputs[:1], response[:1], np.zeros(1, dtype=int)).shape == (0,)
