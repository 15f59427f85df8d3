# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Voltage to duty: heating follows the mean square, and nothing unsafe gets through."""

import math

from hypothesis import given, strategies as st
from hysteresis_ros.bridge.pwm import Pwm
from hysteresis_ros.errors import ParameterError, RangeError
import pytest


def test_rms_law():
    assert Pwm().drive(6.0, 12.0) == (0.25, 6.0, '')
    assert Pwm().voltage(0.25, 12.0) == 6.0


def test_mean_law():
    assert Pwm(law='mean').drive(6.0, 12.0) == (0.5, 6.0, '')
    assert Pwm(law='mean').voltage(0.5, 12.0) == 6.0


def test_pulses_with_this_duty_heat_as_much():
    voltage, supply, slots = 3.7, 11.3, 10 ** 6
    on = round(Pwm().drive(voltage, supply).duty * slots)
    mean_square = on * supply ** 2 / slots
    assert mean_square == pytest.approx(voltage ** 2, rel=1e-5)


@given(st.sampled_from(['rms', 'mean']), st.floats(0.0, 6.0), st.floats(6.0, 48.0))
def test_round_trip(law, voltage, supply):
    pwm = Pwm(law=law)
    drive = pwm.drive(voltage, supply)
    assert 0.0 <= drive.duty <= 1.0 and drive.limit == ''
    assert pwm.voltage(drive.duty, supply) == pytest.approx(voltage, abs=1e-9)


@given(st.floats(), st.floats())
def test_never_nan_and_never_out_of_bounds(voltage, supply):
    pwm = Pwm(maximum_duty=0.8)
    try:
        drive = pwm.drive(voltage, supply)
    except RangeError:
        return
    assert 0.0 <= drive.duty <= 0.8
    assert math.isfinite(drive.voltage) and drive.voltage <= 6.0 + 1e-9


@pytest.mark.parametrize('supply', [0.0, -1.0, math.nan, math.inf])
def test_no_supply_is_off_and_says_so(supply):
    duty, voltage, limit = Pwm().drive(5.0, supply)
    assert duty == 0.0 and voltage == 0.0 and 'no supply' in limit


def test_weak_supply_gives_what_it_can_and_says_so():
    duty, voltage, limit = Pwm().drive(6.0, 5.0)
    assert duty == 1.0 and voltage == 5.0 and '6 V asked' in limit
    assert Pwm(maximum_duty=0.5).drive(6.0, 6.0).voltage == pytest.approx(6.0 * math.sqrt(0.5))


@pytest.mark.parametrize('voltage', [math.nan, math.inf, -math.inf, -0.1, 6.1, 1e9])
def test_voltages_that_are_refused(voltage):
    with pytest.raises(RangeError, match='refused'):
        Pwm().check(voltage)
    with pytest.raises(RangeError):
        Pwm().drive(voltage, 12.0)


def test_off_is_always_possible():
    pwm = Pwm(minimum_voltage=1.0)
    assert pwm.drive(0.0, math.nan) == (0.0, 0.0, '')
    with pytest.raises(RangeError, match='1 to 6 V'):
        pwm.check(0.5)


@pytest.mark.parametrize('wrong', [
    {'law': 'RMS'}, {'minimum_voltage': 6.0}, {'minimum_voltage': -1.0},
    {'maximum_voltage': math.nan}, {'maximum_voltage': math.inf}, {'maximum_duty': 0.0},
    {'maximum_duty': 1.1}, {'maximum_duty': math.nan}])
def test_parameters_that_make_no_sense(wrong):
    with pytest.raises(ParameterError):
        Pwm(**wrong)
