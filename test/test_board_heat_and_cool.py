# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The heat and cool cycle that wipes the memory."""

from hysteresis_ros.bridge.heat_and_cool import HeatAndCool
from hysteresis_ros.errors import BoardError, ParameterError
import pytest


def run(cycle, apply=lambda voltage: voltage, angle=lambda time: 1.0, limit=10_000):
    """Run a cycle at 10 Hz; return (voltage, duration) pieces and the time it took."""
    pieces = []
    applied = 0.0
    for i in range(limit):
        phase = cycle.update(0.1 * i, angle(0.1 * i), applied)
        if not pieces or pieces[-1][0] != phase.voltage:
            pieces.append([phase.voltage, 0])
        pieces[-1][1] += 1
        if phase.done:
            return pieces, 0.1 * i
        applied = apply(phase.voltage)
    raise AssertionError('never done')


def test_heats_then_cools_for_the_times_asked():
    pieces, time = run(HeatAndCool(6.0, 30.0, 60.0))
    assert [voltage for voltage, _ in pieces] == [6.0, 0.0]
    assert pieces[0][1] == pytest.approx(300, abs=3)
    assert time == pytest.approx(90.0, abs=0.5)


def test_waits_until_the_arm_is_still():
    _, time = run(HeatAndCool(6.0, 30.0, 60.0), angle=lambda time: min(time, 100.0))
    assert time == pytest.approx(105.0, abs=0.5)


def test_gives_up_on_an_arm_that_never_stops_moving():
    with pytest.raises(BoardError, match='still moves'):
        run(HeatAndCool(6.0, 30.0, 60.0), angle=lambda time: time)


def test_heating_counts_only_while_it_is_applied():
    times = iter(range(10_000))
    _, time = run(HeatAndCool(6.0, 10.0, 10.0),
                  apply=lambda voltage: 0.0 if next(times) < 50 else voltage)
    assert time == pytest.approx(25.0, abs=0.5)


def test_gives_up_on_a_board_that_does_not_heat():
    with pytest.raises(BoardError, match='6 V asked for, 3 V applied while heating'):
        run(HeatAndCool(6.0, 30.0, 60.0), apply=lambda voltage: 3.0)


def test_a_few_percent_of_the_voltage_do_not_matter():
    _, time = run(HeatAndCool(6.0, 30.0, 60.0), apply=lambda voltage: 0.96 * voltage)
    assert time == pytest.approx(90.0, abs=0.5)


def test_gives_up_on_a_board_that_does_not_stop():
    with pytest.raises(BoardError, match='0 V asked for, 6 V applied while cooling'):
        run(HeatAndCool(6.0, 30.0, 60.0), apply=lambda voltage: 6.0)


def test_progress_names_phase_and_seconds():
    cycle = HeatAndCool(6.0, 30.0, 60.0)
    cycle.update(0.0, 0.0, 0.0)
    assert cycle.update(12.0, 0.0, 6.0).progress == 'heating, 12 of 30 s'


@pytest.mark.parametrize('wrong', [(0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, -1.0)])
def test_parameters_that_make_no_sense(wrong):
    with pytest.raises(ParameterError):
        HeatAndCool(*wrong)
