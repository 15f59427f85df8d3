# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The board's clock and the stamps that are made from it."""

import random

from hypothesis import given, strategies as st
from hysteresis_ros.bridge.board_clock import BoardClock
from hysteresis_ros.bridge.stamps import RealStamps, SimulatedStamps
import pytest

WRAP = 2 ** 32


@given(st.integers(0, WRAP - 1), st.lists(st.integers(0, 10 ** 6), max_size=20))
def test_wrapping_never_shows(start, steps):
    clock = BoardClock()
    clock.begin(start)
    total = 0
    for step in steps:
        total += step
        reading = (start + total) % WRAP
        assert not clock.back(reading)
        assert clock.follow(reading) == clock.time == total / 1000.0


def test_restart_is_noticed_and_time_goes_on():
    clock = BoardClock()
    clock.begin(5000)
    clock.follow(9000)
    assert clock.back(8999) and clock.back(0) and not clock.back(9000)
    clock.begin(20, gap=1.5)
    assert clock.time == 5.5
    assert clock.follow(120) == 5.6


def test_stamps_of_a_real_board_take_the_jitter_out():
    stamps, rng = RealStamps(), random.Random(1)
    errors = []
    for i in range(1, 2000):
        time = 0.1 * i
        late = 0.002 + rng.expovariate(100.0)
        stamp = stamps.stamp(time, 1000.0 + 1.0001 * time + late)
        assert stamp <= 1000.0 + 1.0001 * time + late + 1e-9
        errors.append(stamp - (1000.0 + 1.0001 * time))
    assert max(errors[100:]) < 0.012 and min(errors[100:]) > 0.0


def test_stamps_of_a_real_board_only_grow():
    stamps = RealStamps()
    times = [(0.0, 100.5), (0.1, 100.2), (0.1, 100.2), (0.2, 100.3), (0.3, 100.9)]
    found = [stamps.stamp(*pair) for pair in times]
    assert found == sorted(set(found))
    assert found[3] == pytest.approx(100.501, abs=0.01)


def test_clock_that_somebody_sets_is_followed():
    stamps = RealStamps()
    stamps.stamp(0.0, 1000.0)
    assert stamps.stamp(1.0, 5.0) == 5.0
    assert stamps.stamp(2.0, 2000.0) == 2000.0


def test_simulated_stamps_follow_the_board():
    stamps = SimulatedStamps(1000.0, 60.0)
    assert stamps.stamp(0.1, 5.0) == pytest.approx(1000.1)
    assert stamps.stamp(0.2, 9.0) == pytest.approx(1000.2)


def test_simulated_clock_goes_on_without_the_board():
    stamps = SimulatedStamps(1000.0, 60.0)
    stamps.stamp(1.0, 5.0)
    assert stamps.idle(5.5) == pytest.approx(1031.0)
    assert stamps.idle(6.0) == pytest.approx(1061.0)
    late = stamps.stamp(50.0, 6.1)      # the board was slower than that: time waits for it
    assert late == pytest.approx(1061.0, abs=1e-3) and late > 1061.0
    assert stamps.stamp(62.0, 6.2) == pytest.approx(1062.0)
