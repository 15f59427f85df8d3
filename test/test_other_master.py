# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Setpoints of somebody else on the same line, told from ours, lost ones and late ones."""

from hypothesis import given, strategies as st
from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.messages import Telemetry
from hysteresis_ros.bridge.other_master import FOREIGN_LIMIT, OtherMaster
from hysteresis_ros.bridge.protocol import encode
import pytest

OURS, THEIRS = 0.3, 0.9


class Line:
    """A board that obeys both masters, and what our side makes of it."""

    def __init__(self, counts=True, sequence=65500):
        self.ours = OtherMaster()
        self._counts = counts
        self._sequence = sequence
        self._obeyed, self._accepted, self._duty = 65530, None, 0.0

    def send(self, lost=False):
        """Send one of ours; its sequence number passes zero before long."""
        self.ours.ask(0.0, OURS)
        self.ours.sent(self._sequence)
        if not lost:
            self._obey(self._sequence, OURS)
        self._sequence = (self._sequence + 1) % 65536

    def intrude(self):
        """Let the other one send."""
        self._obey(40000, THEIRS)

    def sample(self):
        """Return what is said of the next telemetry."""
        return self.ours.observe(Telemetry(
            0, 0, 12.0, self._duty, True, accepted=self._accepted,
            obeyed=self._obeyed if self._counts else None), -1.0)

    def _obey(self, sequence, duty):
        self._obeyed = (self._obeyed + 1) % 65536
        self._accepted, self._duty = sequence, duty


def test_a_setpoint_that_stood_between_two_samples_only_is_found():
    """Its duty never shows: ours always comes last before the telemetry."""
    line = Line()
    line.send()
    assert not line.sample()
    said = []
    for _ in range(2):
        line.intrude()
        line.send()
        said.append(line.sample())
    assert not said[0] and 'another one talks to it' in said[1]


@pytest.mark.parametrize('counts', [True, False])
def test_one_that_always_comes_last_is_found_by_its_duty(counts):
    line = Line(counts)
    line.send()
    assert not line.sample()
    said = []
    for _ in range(2):
        line.send()
        line.intrude()
        said.append(line.sample())
    assert not said[0] and f'{THEIRS:.3f}' in said[1]


@given(st.lists(st.sampled_from(['send', 'lose', 'sample']), max_size=200))
def test_what_the_line_loses_is_nobody_else(actions):
    line = Line()
    for action in actions:
        if action == 'sample':
            assert not line.sample()
        else:
            line.send(lost=action == 'lose')


@given(st.lists(st.sampled_from(['send', 'intrude', 'sample']), max_size=60))
def test_two_setpoints_of_somebody_else_are_found_at_the_next_of_ours(actions):
    line = Line()
    line.send()
    line.sample()
    intruders = 0
    for action in actions:
        if action == 'sample':
            line.sample()
        else:
            getattr(line, action)()
            intruders += action == 'intrude'
    line.send()
    assert bool(line.sample()) or intruders < FOREIGN_LIMIT


def test_after_it_was_checked_the_count_begins_anew():
    line = Line()
    for _ in range(3):
        line.intrude()
        line.send()
        line.sample()
    assert line.sample()
    line.ours.clear()
    line.send()
    assert not line.sample() and not line.sample()


def test_the_board_is_switched_off_by_a_master_whose_duty_no_sample_shows():
    """Each of its setpoints is followed by one of ours at once."""
    board = Board('sim://bicep?speed=1')
    rig = board._link._serial
    sent = rig.write

    def write(data):
        if data.startswith(b'set ') and b'duty=0.00000' not in data:
            sent(encode('set', 40000, {'duty': THEIRS}))
        return sent(data)

    rig.write = write
    with board:
        board.enable(True)
        for _ in range(200):
            board.set_voltage(4.0)
            if board.status.fault:
                break
            board._stopping.wait(0.02)
        assert 'another one talks to it' in board.status.fault
