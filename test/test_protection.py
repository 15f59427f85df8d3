# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The limits of what a muscle stands, without a board."""

import dataclasses
import math

from hypothesis import given, settings, strategies
from hysteresis_ros.bridge.board_state import Sample
from hysteresis_ros.bridge.protection import AHEAD, Limits, Protection
from hysteresis_ros.errors import ParameterError
import pytest

OFF = Limits(maximum_voltage=12.0, rms_voltage=0.0, maximum_temperature=0.0, full_heat_time=0.0,
             soft_start_time=0.0, encoder_check=False)


def sample(time, voltage, angle=2.4, **others):
    values = {'velocity': 0.0, 'fresh': True, 'supply': 12.0, 'ambient': 22.0, 'enabled': True,
              'faults': (), 'encoder_fault': ''}
    return Sample(time=time, voltage=voltage, angle=angle, **{**values, **others})


def follow(protection, asked, seconds, start=0.0, angle=lambda time: 2.4):
    """Apply what is allowed of a voltage; return the voltages and what was wrong."""
    applied, wrong = [], ''
    for step in range(round(seconds / 0.1)):
        time = start + 0.1 * step
        voltage = 0.0 if wrong else protection.limit(asked, time)[0]
        applied.append(voltage)
        wrong = wrong or protection.observe(sample(time, voltage, angle(time)))
    return applied, wrong


def test_the_defaults_change_nothing_about_six_volts_for_an_hour_half():
    """But for the soft start, whatever the paper's muscle gets stays as it is."""
    applied, wrong = follow(Protection(dataclasses.replace(Limits(), encoder_check=False)),
                            6.0, 1790.0)
    assert not wrong and set(applied[3:]) == {6.0}


@pytest.mark.parametrize('ambient', [22.0, 35.0])
def test_estimated_temperature_never_passes_its_limit(ambient):
    protection = Protection(dataclasses.replace(OFF, maximum_temperature=100.0))
    for step in range(1000):
        voltage, reason, _ = protection.limit(12.0, 0.1 * step)
        protection.observe(sample(0.1 * step, voltage, ambient=ambient))
        assert protection.temperature <= 100.0
    assert voltage == pytest.approx(math.sqrt((100.0 - ambient) / 2.7), rel=0.02)
    assert '12 V asked' in reason and '100 degC allowed (maximum_temperature)' in reason


def test_limits_look_as_far_ahead_as_nobody_looks():
    """As where the board's clock runs faster than setpoints are corrected."""
    protection = Protection(dataclasses.replace(OFF, maximum_temperature=60.0))
    for step in range(50):
        voltage, _, _ = protection.limit(6.0, 2.0 * step, ahead=4.0)
        protection.observe(sample(2.0 * step, voltage))
        assert protection.temperature <= 60.0
    assert voltage == pytest.approx(math.sqrt(38.0 / 2.7), rel=0.02)


def test_rms_voltage_never_passes_its_limit():
    protection = Protection(dataclasses.replace(OFF, rms_voltage=4.0))
    applied, _ = follow(protection, 10.0, 300.0)
    assert applied[0] == 10.0 and protection.rms <= 4.0
    assert applied[-1] == pytest.approx(4.0, rel=0.02)
    assert '4 V allowed over 60 s (rms_voltage_limit)' in protection.limit(10.0, 300.0)[1]


@settings(max_examples=60)
@given(strategies.lists(strategies.tuples(
    strategies.floats(0.0, 12.0), strategies.floats(0.01, AHEAD)), max_size=120))
def test_no_sequence_of_setpoints_passes_a_limit(sequence):
    """Whatever is asked for, and however late the next look comes up to `AHEAD`."""
    protection = Protection(dataclasses.replace(OFF, maximum_temperature=90.0, rms_voltage=5.0))
    time = 0.0
    protection.observe(sample(time, 0.0))
    for asked, duration in sequence:
        voltage, _, _ = protection.limit(asked, time)
        assert 0.0 <= voltage <= asked
        time += duration
        protection.observe(sample(time, voltage))
        assert protection.temperature <= 90.0 + 1e-9 and protection.rms <= 5.0 + 1e-9


def test_full_heat_is_counted_and_cooler_times_count_it_down():
    protection = Protection(dataclasses.replace(OFF, maximum_voltage=6.0, full_heat_time=60.0))
    assert not follow(protection, 6.0, 50.0)[1]
    assert not follow(protection, 3.0, 40.0, 50.0)[1]
    assert protection.full_heat == pytest.approx(10.0, abs=0.3)
    applied, wrong = follow(protection, 6.0, 60.0, 90.0)
    assert '60 s are allowed (full_heat_time)' in wrong
    assert applied.count(6.0) == pytest.approx(500, abs=5)
    assert protection.observe(sample(150.0, 6.0))       # it stays
    protection.clear()
    assert not protection.observe(sample(150.1, 6.0))


def test_soft_start_rises_from_off_and_only_from_off():
    protection = Protection(dataclasses.replace(OFF, maximum_voltage=6.0, soft_start_time=0.3))
    voltages = [protection.limit(6.0, 10.0 + 0.1 * step)[0] for step in range(5)]
    assert voltages == pytest.approx([0.0, 2.0, 4.0, 6.0, 6.0])
    assert protection.limit(1.0, 10.5)[0] == 1.0 and protection.limit(6.0, 10.6)[0] == 6.0
    protection.begin_softly()
    assert protection.limit(6.0, 11.0, 0.05) == (pytest.approx(1.0), '', True)
    assert protection.limit(0.0, 11.1) == (0.0, '', False)
    assert protection.limit(6.0, 11.2)[0] == 0.0


def test_an_angle_in_doubt_ends_the_heating():
    """One sample alone may be wrong; two may not, nor an angle that may be off."""
    protection = Protection()
    assert not protection.observe(sample(0.0, 3.0, fresh=False, encoder_fault='jumped'))
    assert not protection.observe(sample(0.1, 3.0))
    assert not protection.observe(sample(0.2, 3.0, fresh=False, encoder_fault='jumped'))
    assert 'jumped' in protection.observe(sample(0.3, 3.0, fresh=False, encoder_fault='jumped'))
    assert 'may be off' in Protection().observe(sample(0.0, 3.0, encoder_fault='may be off'))
    assert 'not connected' in Protection().observe(sample(0.0, 3.0, faults=('encoder',)))
    assert not Protection(OFF).observe(sample(0.0, 3.0, encoder_fault='may be off'))


@pytest.mark.parametrize('angle, words', [
    (lambda time: 2.4, 'the angle stands still'), (lambda time: 2.4 + 0.05 * time, 'wrong way'),
    (lambda time: 2.4 - 0.05 * time, '')])
def test_the_angle_has_to_follow_the_heat(angle, words):
    protection = Protection(dataclasses.replace(OFF, encoder_check=True))
    follow(protection, 0.0, 1.0)
    assert words in follow(protection, 6.0, 8.0, 1.0, lambda time: angle(time - 1.0))[1]
    assert not follow(Protection(OFF), 6.0, 8.0, 0.0, angle)[1]


def test_what_stands_still_says_how_a_bench_is_heated():
    """In one line, by the name of the parameter."""
    words = 'set encoder_check to false where there is no arm'
    still = follow(Protection(dataclasses.replace(OFF, encoder_check=True)), 6.0, 8.0)[1]
    assert words in still and '\n' not in still
    assert words in Protection().observe(sample(0.0, 3.0, faults=('encoder',)))


def test_a_voltage_that_moves_nothing_needs_no_motion():
    """A tenth of the voltage, as for the first steps with a wire."""
    assert not follow(Protection(), 1.0, 60.0)[1]


def test_an_arm_that_lifts_while_it_is_off_is_told():
    """Within a minute of the heating; later, a hand may do it."""
    def lifted(after):
        protection = Protection(dataclasses.replace(OFF, encoder_check=True))
        follow(protection, 5.0, 2.0)
        return follow(protection, 0.0, after + 1.0, 2.0,
                      lambda time: 2.4 if time < 2.0 + after else 2.0)[1]

    assert 'MOSFET may be stuck on' in lifted(1.0)
    assert not lifted(70.0)


def test_an_angle_that_comes_late_is_no_stuck_mosfet():
    """Where its latency is stated: the arm was on its way up when the heat went off."""
    def late(latency):
        limits = dataclasses.replace(OFF, encoder_check=True, angle_latency=latency)
        protection = Protection(limits)
        follow(protection, 5.0, 2.0)
        return follow(protection, 0.0, 10.0, 2.0,
                      lambda time: 2.4 - 0.25 * min(time - 2.0, 2.0))[1]

    assert 'see angle_latency (encoder_check)' in late(0.0)
    assert not late(2.0)


def test_an_arm_that_does_not_come_down_again_is_told():
    protection = Protection(dataclasses.replace(OFF, encoder_check=True))
    follow(protection, 0.0, 1.0)
    assert not follow(protection, 6.0, 20.0, 1.0, lambda time: 2.4 - min(0.1 * time, 0.7))[1]
    assert 'cold place' in follow(protection, 0.0, 70.0, 21.0, lambda time: 1.7)[1]


@pytest.mark.parametrize('name, value', [
    ('rms_window', 0.0), ('thermal_gain', -1.0), ('maximum_temperature', 30.0),
    ('full_heat_time', math.nan)])
def test_limits_that_make_no_sense_are_refused(name, value):
    with pytest.raises(ParameterError, match=name):
        Limits(**{name: value})
