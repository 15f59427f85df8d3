# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Counts to angle: direction, zero, wrapping, index, and jumps that no arm can make."""

import math

from hypothesis import given, strategies as st
from hysteresis_ros.bridge.encoder import AMT103_COUNTS, Encoder
from hysteresis_ros.errors import ParameterError
import pytest

COUNT = 2.0 * math.pi / 8192


def test_amt103_has_four_counts_a_pulse():
    assert AMT103_COUNTS == 8192


@pytest.mark.parametrize('direction, zero, counts, angle', [
    (1, 0.0, 2048, math.pi / 2), (-1, 0.0, 2048, -math.pi / 2), (1, 0.5, 0, 0.5),
    (-1, 0.5, 8192, 0.5 - 2.0 * math.pi), (1, 0.0, 1, math.radians(360 / 8192))])
def test_angle(direction, zero, counts, angle):
    encoder = Encoder(direction=direction, zero=zero)
    assert encoder.angle is None
    reading = encoder.update(0.0, counts)
    assert reading.angle == pytest.approx(angle, abs=1e-12) == encoder.angle
    assert reading.fresh and reading.fault == '' and reading.velocity == 0.0


def test_other_encoders():
    assert Encoder(400).update(0.0, 100).angle == pytest.approx(math.pi / 2)


@given(st.sampled_from([16, 32]), st.integers(-2 ** 40, 2 ** 40),
       st.lists(st.integers(-3000, 3000), max_size=30))
def test_wrapping_never_shows(bits, start, steps):
    def counter(total):
        return (total + 2 ** (bits - 1)) % 2 ** bits - 2 ** (bits - 1)

    encoder = Encoder(counter_bits=bits)
    total = counter(start)
    encoder.update(0.0, total)
    for i, step in enumerate(steps, 1):
        total += step
        reading = encoder.update(0.1 * i, counter(total))
        assert reading.fault == ''
        assert reading.angle == pytest.approx(total * COUNT, abs=1e-9 * abs(total) + 1e-9)


def test_unsigned_counter_is_taken_as_signed():
    assert Encoder(counter_bits=16).update(0.0, 65535).angle == pytest.approx(-COUNT)


def test_velocity_of_a_steady_turn():
    encoder = Encoder(direction=-1, velocity_window=0.2)
    for i in range(10):
        reading = encoder.update(0.05 * i, 100 * i)
    assert reading.velocity == pytest.approx(-100 * COUNT / 0.05)


def test_velocity_is_the_mean_over_the_window():
    encoder = Encoder(velocity_window=0.2)
    for time, counts in [(0.0, 0), (0.1, 0), (0.2, 0), (0.3, 30), (0.4, 30)]:
        reading = encoder.update(time, counts)
    assert reading.velocity == pytest.approx(30 * COUNT / 0.2)
    for time in (0.5, 0.6):
        reading = encoder.update(time, 30)
    assert reading.velocity == 0.0


def test_window_shorter_than_the_period_uses_two_samples():
    encoder = Encoder(velocity_window=0.0)
    encoder.update(0.0, 0)
    assert encoder.update(0.1, 10).velocity == pytest.approx(10 * COUNT / 0.1)


def test_single_outlier_is_rejected():
    encoder = Encoder(maximum_speed=10.0)
    encoder.update(0.0, 100)
    wild = encoder.update(0.1, 5000)
    assert not wild.fresh and wild.angle == pytest.approx(100 * COUNT)
    assert 'jumped by 4900' in wild.fault and 'check' in wild.fault
    back = encoder.update(0.2, 110)
    assert back.fresh and back.fault == '' and back.angle == pytest.approx(110 * COUNT)


def test_lasting_jump_is_accepted_as_a_standing_fault():
    encoder = Encoder(maximum_speed=10.0)
    encoder.update(0.0, 100)
    encoder.update(0.1, 5000)
    reading = encoder.update(0.2, 5010)
    assert reading.fresh and reading.angle == pytest.approx(5010 * COUNT)
    assert reading.velocity == 0.0
    assert 'stayed there' in encoder.update(0.3, 5010).fault
    encoder.clear_fault()
    assert encoder.update(0.4, 5010).fault == ''


def test_two_different_outliers_are_both_rejected():
    encoder = Encoder(maximum_speed=10.0)
    encoder.update(10.0, 100)
    encoder.update(10.1, 5000)
    assert not encoder.update(10.2, 8000).fresh
    assert not encoder.update(10.3, 8000 + int(10.0 * 0.1 / COUNT) + 3).fresh
    assert encoder.update(10.4, 110).fault == ''


def test_fastest_possible_turn_is_no_fault():
    encoder = Encoder(maximum_speed=10.0)
    most = int(10.0 * 0.1 / COUNT)
    encoder.update(0.0, 0)
    assert encoder.update(0.1, most).fresh
    assert not encoder.update(0.2, 2 * most + 3).fresh


def test_lost_frames_give_the_arm_more_time():
    encoder = Encoder(maximum_speed=10.0)
    encoder.update(0.0, 0)
    assert encoder.update(1.0, 5000).fresh


def test_restart_of_the_board_carries_the_angle_on():
    encoder = Encoder()
    encoder.restart()   # before the first sample there is nothing to carry on
    assert encoder.update(0.0, 500).fault == ''
    encoder.restart()
    reading = encoder.update(0.1, 0)
    assert reading.angle == pytest.approx(500 * COUNT) and 'started anew' in reading.fault
    assert encoder.update(0.2, -10).angle == pytest.approx(490 * COUNT)


def test_index_checks_for_lost_counts():
    encoder = Encoder(index='check')
    encoder.update(0.0, 0)
    assert encoder.update(0.1, 60, 1, 50).fault == ''
    assert encoder.update(0.2, 40, 2, 50 + 4).fault == ''      # other direction, other edge
    reading = encoder.update(0.3, 60, 3, 50 + 8192 - 20)
    assert 'index pulse came -20 counts off' in reading.fault
    assert reading.angle == pytest.approx(60 * COUNT)


def test_index_corrects_the_angle_when_homing():
    encoder = Encoder(index='home', index_angle=1.0)
    encoder.update(0.0, 0)
    reading = encoder.update(0.1, 60, 1, 50)
    assert reading.fault == ''
    assert reading.angle == pytest.approx(1.0 + 10 * COUNT, abs=COUNT)
    assert reading.velocity == pytest.approx(60 * COUNT / 0.1)
    assert encoder.update(0.15, 80, 1, 50).velocity == pytest.approx(80 * COUNT / 0.15)
    reading = encoder.update(0.2, 100, 2, 30)
    assert 'put right' in reading.fault
    assert reading.angle == pytest.approx(1.0 + 70 * COUNT, abs=COUNT)


def test_angle_at_the_index_holds_whatever_the_zero():
    for direction in (1, -1):
        encoder = Encoder(direction=direction, zero=0.7, index='home', index_angle=1.0)
        encoder.update(0.0, 0)
        assert encoder.update(0.1, 50, 1, 50).angle == pytest.approx(1.0, abs=COUNT)


def test_index_clears_the_fault_after_a_restart():
    encoder = Encoder(index='home', index_angle=1.0, direction=-1)
    encoder.update(0.0, 500)
    encoder.restart()
    assert encoder.update(0.1, 0).fault
    reading = encoder.update(0.2, 60, 1, 50)
    assert reading.fault == ''
    assert reading.angle == pytest.approx(1.0 - 10 * COUNT, abs=COUNT)


def test_index_seen_before_the_first_sample_counts():
    reading = Encoder(index='home', index_angle=0.0).update(0.0, 300, 4, 100)
    assert reading.angle == pytest.approx(200 * COUNT)


def test_index_is_ignored_by_default():
    encoder = Encoder()
    encoder.update(0.0, 0, 1, 0)
    assert encoder.update(0.1, 100, 2, 50).fault == ''


@pytest.mark.parametrize('wrong', [
    {'direction': 0}, {'direction': 2}, {'counts_per_revolution': 0}, {'counter_bits': 24},
    {'index': 'use'}, {'maximum_speed': 0.0}, {'zero': math.nan}, {'index_angle': math.inf},
    {'velocity_window': -1.0}])
def test_parameters_that_make_no_sense(wrong):
    with pytest.raises(ParameterError, match='encoder|counts_per_revolution'):
        Encoder(**wrong)
