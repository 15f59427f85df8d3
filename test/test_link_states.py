# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The states and timeouts of the link, as a model, beside both boards: simulated, and firmware."""

import math

from firmware_support import build_library, HostBoard, PWM_STEPS
from hypothesis import settings, strategies as st
from hypothesis.stateful import initialize, invariant, rule, RuleBasedStateMachine
from hysteresis_ros.bridge.protocol import Decoder, encode, Frame
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK
import pytest


class StillArm:
    """An arm whose encoder stands where it was put."""

    encoder_counts = 0
    ambient_temperature = 22.0

    def advance(self, dt, voltage):
        """Nothing moves by itself."""


class Simulated:
    """The simulated board, with the methods that the machine needs."""

    def __init__(self):
        self.board = SimulatedBoard(StillArm())
        self.board.troubled = lambda trouble: (trouble == 'supply_off' and self.off
                                               or trouble == 'stop' and self.pressed)
        self.off = self.pressed = False
        self.start()

    def start(self):
        self.board.start()
        self.board.transmit()

    def tell(self, data):
        """Send bytes and return the answers, (kind, reason) each."""
        self.board.receive(data)
        return answers(self.board.transmit())

    def advance(self, milliseconds):
        self.board.advance(milliseconds // TICK)
        return [frame for frame in frames(self.board.transmit()) if frame.kind == 'tele']

    @property
    def duty(self):
        return self.board.duty


class Firmware:
    """The firmware's code, likewise."""

    def __init__(self, library):
        self.board = HostBoard(library)
        self.off = self.pressed = False
        self.start()

    def start(self):
        self.board.library.host_start()
        self.board.advance(20)      # the supply is measured first
        self.board.transmit()

    def tell(self, data):
        self.board.receive(data)
        return answers(self.board.transmit())

    def advance(self, milliseconds):
        self.board.library.host_set_supply(0 if self.off else 12000)
        self.board.library.host_open_stop(self.pressed)
        self.board.advance(milliseconds)
        return [frame for frame in frames(self.board.transmit()) if frame.kind == 'tele']

    @property
    def duty(self):
        return self.board.pwm / PWM_STEPS


def frames(data):
    return [line for line in Decoder().feed(data) if isinstance(line, Frame)]


def answers(data):
    return [(frame.kind, frame.fields.get('reason')) for frame in frames(data)
            if frame.kind in ('ok', 'no', 'board')]


@pytest.fixture(scope='module')
def firmware_library(tmp_path_factory):
    """Build the firmware for this computer."""
    return build_library(tmp_path_factory.mktemp('firmware'))


class Link(RuleBasedStateMachine):
    """
    What docs/protocol.md says of a board, in a few lines.

    Times are no multiples of the simulated board's tick where a timeout is, so that both boards
    are past it or before it.
    """

    library = None

    @initialize()
    def begin(self):
        self.boards = [Simulated(), Firmware(self.library)]
        self.sequence = 0
        self.switch_on()

    @rule()
    def start_anew(self):
        """The power comes back, or somebody has pressed reset."""
        for board in self.boards:
            board.start()
        self.switch_on()

    def switch_on(self):
        self.time = self.fed = 0
        self.watchdog = 490
        self.enabled = False
        self.duty = 0.0
        self.bitten = self.stopped = False
        self.weak = self.boards[0].off
        self.say('config', 'ok', period=100, watchdog=490)
        self.pass_time(40)

    def say(self, kind, *expected, **fields):
        """Send a frame to both; they have to answer as the model does."""
        self.sequence += 1
        line = encode(kind, self.sequence % 65536, fields)
        wanted = [tuple(expected[:2]) if len(expected) > 1 else (expected[0], None)] \
            if expected else []
        for board in self.boards:
            assert board.tell(line) == wanted, (board, line)

    @rule(milliseconds=st.integers(1, 40).map(lambda ticks: ticks * TICK))
    def pass_time(self, milliseconds):
        """Let time pass, and compare the telemetry that came at its end."""
        self.time += milliseconds
        self.weak = self.boards[0].off
        if self.boards[0].pressed:
            self.stopped, self.enabled, self.duty = True, False, 0.0
        late = self.enabled and self.time - self.fed > self.watchdog
        self.bitten = self.bitten or late
        if self.weak or late:
            self.duty = 0.0
        for board in self.boards:
            telemetry = board.advance(milliseconds)
            if milliseconds >= 240:
                fields = telemetry[-1].fields
                assert fields['on'] == str(int(self.enabled))
                assert ('supply' in fields['faults']) == self.weak
                assert ('stop' in fields['faults']) == self.stopped
                if self.time - self.fed > self.watchdog + 240 or not self.bitten:
                    assert ('watchdog' in fields['faults']) == self.bitten

    @rule(milliseconds=st.sampled_from([110, 290, 490]))
    def configure(self, milliseconds):
        self.watchdog = milliseconds
        self.say('config', 'ok', period=100, watchdog=milliseconds)
        self.pass_time(TICK)

    @rule()
    def greet(self):
        self.say('hello', 'board', protocol=1)

    @rule()
    def enable(self):
        if self.stopped:
            self.say('enable', 'no', 'stop')
            return
        if not self.enabled:
            self.fed = self.time
        self.enabled = True
        self.say('enable', 'ok')

    @rule()
    def disable(self):
        self.enabled, self.duty, self.bitten = False, 0.0, False
        self.stopped = self.boards[0].pressed
        self.say('disable', 'ok')

    @rule(duty=st.floats(0.0, 1.0))
    def ask(self, duty):
        if not self.enabled:
            self.say('set', 'no', 'disabled', duty=duty)
        elif self.weak:
            self.say('set', 'no', 'supply', duty=duty)
        else:
            self.say('set', duty=duty)
            self.duty, self.fed, self.bitten = duty, self.time, False

    @rule(duty=st.sampled_from([-0.5, 1.5, 1e9]))
    def ask_nonsense(self, duty):
        self.say('set', 'no', 'out_of_range', duty=duty)

    @rule(kind=st.sampled_from(['set', 'jump']))
    def ask_in_vain(self, kind):
        self.say(kind, 'no', 'field_missing_or_no_number' if kind == 'set' else 'unknown_command')

    @rule(duty=st.floats(0.0, 1.0), bit=st.integers(0, 1000))
    def ask_with_a_wrong_bit(self, duty, bit):
        """Nothing comes of it, and the next line counts again."""
        line = bytearray(encode('set', 7, {'duty': duty}))[:-1]
        line[bit // 8 % len(line)] ^= 1 << bit % 8
        for board in self.boards:
            assert board.tell(bytes(line) + b'\n') == []

    @rule(data=st.binary(max_size=60))
    def garble(self, data):
        for board in self.boards:
            board.tell(data.replace(b'#', b'') + b'\n')

    @rule(off=st.booleans())
    def switch_supply(self, off):
        for board in self.boards:
            board.off = off
        self.pass_time(2 * TICK)

    @rule(pressed=st.booleans())
    def press_stop(self, pressed):
        for board in self.boards:
            board.pressed = pressed
        self.pass_time(2 * TICK)

    @invariant()
    def duties_agree(self):
        for board in getattr(self, 'boards', ()):
            assert math.isclose(board.duty, self.duty, abs_tol=1.01 / PWM_STEPS), (
                board, board.duty, self.duty)


def test_both_boards_keep_to_the_model_of_the_link(firmware_library):
    """Whatever is said, in whatever order, with whatever pauses."""
    Link.library = firmware_library
    Link.TestCase.settings = settings(max_examples=60, stateful_step_count=30)
    Link.TestCase('runTest').runTest()
