# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The simulated board, byte for byte and tick for tick, without any clock."""

import math

from hypothesis import given, settings, strategies as st
from hysteresis_ros.bridge.messages import Identity, Telemetry
from hysteresis_ros.bridge.protocol import Decoder, encode, Frame, Remark
from hysteresis_ros.laboratory.board.simulated_board import PERIOD, SimulatedBoard, TICK, WATCHDOG
import pytest


class StillArm:
    """An arm that notes what it gets and stays where it is put."""

    def __init__(self, counts=3000):
        self.encoder_counts = counts
        self.ambient_temperature = 21.5
        self.voltages = []

    def advance(self, dt, voltage):
        """Let it live."""
        assert dt == TICK / 1000.0
        self.voltages.append(voltage)


class Bench:
    """A board with a host at its other end that has all the time of the world."""

    def __init__(self, **options):
        self.arm = StillArm()
        self.board = SimulatedBoard(self.arm, **options)
        self.decoder = Decoder()
        self.sequence = 0

    def lines(self):
        """Return what the board has written."""
        return self.decoder.feed(self.board.transmit())

    def frames(self, kind):
        """Return the frames of one kind that the board has written."""
        return [line for line in self.lines() if isinstance(line, Frame) and line.kind == kind]

    def ask(self, kind, **fields):
        """Send a frame and return the frames that answer it."""
        self.lines()
        self.sequence += 1
        self.board.receive(encode(kind, self.sequence, fields))
        return [line for line in self.lines() if isinstance(line, Frame)]

    def advance(self, milliseconds):
        """Let time pass."""
        self.board.advance(milliseconds // TICK)

    def telemetry(self):
        """Return the next frame of telemetry."""
        self.lines()
        while True:
            self.board.advance()
            for frame in self.frames('tele'):
                return Telemetry.from_frame(frame)


def test_hello_is_answered_with_the_identity():
    bench = Bench(speed=60.0)
    assert isinstance(bench.lines()[0], Remark)
    bench.advance(500)
    answer, = bench.ask('hello')
    assert Identity.from_frame(answer) == Identity(1, 'simulated', '1', 1, 500, 32, 60.0)


def test_first_remark_is_a_line_that_can_be_typed_back():
    bench = Bench()
    remark, = bench.lines()
    bench.board.receive(remark.text.split('"')[1].encode('ascii') + b'\r\n')
    assert bench.frames('board')


def test_sends_telemetry_on_its_own():
    bench = Bench()
    bench.advance(10 * PERIOD)
    frames = bench.frames('tele')
    assert [int(frame.fields['time']) for frame in frames] == [PERIOD * i for i in range(1, 11)]
    assert [frame.sequence for frame in frames] == list(range(10))
    telemetry = Telemetry.from_frame(frames[0])
    assert telemetry.counts == 3000 and telemetry.supply == pytest.approx(12.0, abs=0.1)
    assert not telemetry.enabled and telemetry.duty == 0.0 and telemetry.faults == ()
    assert [frame.fields.get('ambient') for frame in frames] == ['21.50'] + [None] * 9


def test_telemetry_period_is_configurable():
    bench = Bench()
    answer, = bench.ask('config', period=250, watchdog=500)
    assert answer.kind == 'ok' and answer.fields['re'] == str(bench.sequence)
    bench.advance(1000)
    assert [frame.fields['time'] for frame in bench.frames('tele')] == ['260', '520', '780']


def test_heats_with_the_root_of_the_duty():
    bench = Bench(supply=10.0)
    bench.ask('enable')
    assert bench.ask('set', duty=0.25) == []
    bench.advance(5 * TICK)
    assert bench.arm.voltages[-1] == pytest.approx(5.0, abs=1e-3)
    telemetry = bench.telemetry()
    assert telemetry.duty == pytest.approx(0.25, abs=1e-5)
    assert telemetry.accepted == bench.sequence and telemetry.enabled


def test_watchdog_counts_in_board_time_and_only_setpoints_feed_it():
    bench = Bench()
    bench.ask('enable')
    bench.ask('set', duty=0.5)
    for _ in range(WATCHDOG // TICK):
        bench.ask('hello')
        bench.advance(TICK)
        assert bench.arm.voltages[-1] > 0.0
    bench.advance(2 * TICK)
    assert bench.arm.voltages[-1] == 0.0
    telemetry = bench.telemetry()
    assert telemetry.faults == ('watchdog',) and telemetry.duty == 0.0
    bench.ask('set', duty=0.5)
    bench.advance(TICK)
    assert bench.arm.voltages[-1] > 0.0
    assert bench.telemetry().faults == ()


def test_watchdog_time_is_configurable():
    bench = Bench()
    bench.ask('config', period=100, watchdog=200)
    bench.ask('enable')
    bench.ask('set', duty=0.5)
    bench.advance(1000)
    assert sum(voltage > 0.0 for voltage in bench.arm.voltages) == 200 // TICK + 1


@pytest.mark.parametrize('kind, fields, reason', [
    ('set', {'duty': 0.5}, 'disabled'), ('set', {}, 'field_missing_or_no_number'),
    ('set', {'duty': 'nan'}, 'field_missing_or_no_number'), ('set', {'duty': 1.01}, 'out_of_range'),
    ('set', {'duty': -0.01}, 'out_of_range'), ('config', {'period': 0, 'watchdog': 100},
                                               'out_of_range'),
    ('config', {'period': 100}, 'field_missing_or_no_number'), ('dance', {}, 'unknown_command')])
def test_refusals_have_a_reason_and_change_nothing(kind, fields, reason):
    bench = Bench()
    answer, = bench.ask(kind, **fields)
    assert (answer.kind, answer.fields) == ('no', {'re': '1', 'reason': reason})
    bench.advance(200)
    assert set(bench.arm.voltages) == {0.0}


def test_disabling_switches_off_at_once():
    bench = Bench()
    bench.ask('enable')
    bench.ask('set', duty=1.0)
    bench.advance(TICK)
    assert bench.arm.voltages[-1] == pytest.approx(12.0)
    assert bench.ask('disable')[0].kind == 'ok'
    bench.advance(TICK)
    assert bench.arm.voltages[-1] == 0.0 and not bench.telemetry().enabled


def test_enabling_twice_does_not_touch_the_output():
    bench = Bench()
    bench.ask('enable')
    bench.ask('set', duty=1.0)
    bench.ask('enable')
    bench.advance(TICK)
    assert bench.arm.voltages[-1] > 0.0


def test_zero_sets_the_counter_to_zero():
    bench = Bench()
    assert bench.telemetry().counts == 3000
    bench.ask('zero')
    assert bench.telemetry().counts == 0
    bench.arm.encoder_counts = 2990
    assert bench.telemetry().counts == -10


def test_latch_counts_from_the_same_zero():
    bench = Bench()
    bench.arm.encoder_counts = bench.board._last_counts = 2700
    bench.ask('zero')
    bench.arm.encoder_counts = 2740
    telemetry = bench.telemetry()
    assert (telemetry.counts, telemetry.latch) == (40, 31)


def test_full_and_no_duty_are_both_in_range():
    bench = Bench()
    bench.ask('enable')
    assert bench.ask('set', duty=1.0) == bench.ask('set', duty=0.0) == []


def test_arm_cools_on_without_power():
    bench = Bench()
    bench.ask('enable')
    bench.ask('set', duty=1.0)
    bench.board.idle(3)
    assert bench.arm.voltages == [0.0, 0.0, 0.0] and bench.lines() == []


@pytest.mark.parametrize('path', [(2700, 2740), (2760, 2720), (2700, 2740, 2720)])
def test_index_pulse_is_latched_wherever_it_comes_from(path):
    bench = Bench()
    bench.arm.encoder_counts = bench.board._last_counts = path[0]
    assert bench.telemetry()[6:8] == (0, None)
    for counts in path[1:]:
        bench.arm.encoder_counts = counts
        telemetry = bench.telemetry()
    assert (telemetry.index, telemetry.latch) == (len(path) - 1, 2731)


def test_line_typed_by_hand_is_explained_and_not_obeyed():
    bench = Bench()
    bench.advance(1000)
    bench.lines()
    bench.board.receive(b'enable 4\n')
    remark, = bench.lines()
    assert isinstance(remark, Remark)
    right = encode('enable', 4).decode('ascii').strip()
    assert 'nothing done' in remark.text and f'*{right[-4:]}' in remark.text
    assert not bench.board.enabled
    bench.board.receive(right.encode('ascii') + b'\n')
    assert bench.board.enabled


def test_explanations_do_not_flood():
    bench = Bench()
    bench.lines()
    bench.board.receive(b'x\n' * 1000)
    assert len(bench.lines()) == 1


@given(st.lists(st.binary(max_size=100), max_size=10))
@settings(max_examples=50)
def test_any_bytes_are_survived(chunks):
    bench = Bench()
    for chunk in chunks:
        bench.board.receive(chunk)
        bench.board.advance()
        assert set(bench.arm.voltages) == {0.0}
    bench.board.receive(b'\n')
    assert [frame.kind for frame in bench.ask('hello')] == ['board']


def test_same_bytes_same_answer():
    def run(seed):
        bench = Bench(seed=seed)
        bench.ask('enable')
        out = b''
        for i in range(100):
            bench.board.receive(encode('set', i, {'duty': i / 200}))
            bench.board.advance()
            out += bench.board.transmit()
        return out

    assert run(3) == run(3) != run(4)


def test_brownout_starts_the_board_anew():
    bench = Bench(brownout=1.0)
    bench.ask('enable')
    for _ in range(0, 1000, TICK):
        bench.ask('set', duty=0.5)
        bench.advance(TICK)
    assert bench.arm.voltages[-1] > 0.0
    low = bench.telemetry()
    assert low.faults == ('supply',) and low.supply < 4.0 and bench.arm.voltages[-1] == 0.0
    answer, = bench.ask('set', duty=0.5)
    assert answer.fields['reason'] == 'supply'
    bench.advance(400)
    answer, = bench.ask('hello')
    identity = Identity.from_frame(answer)
    assert identity.boot == 2 and identity.time < 400
    telemetry = bench.telemetry()
    assert telemetry.counts == 0 and not telemetry.enabled and telemetry.faults == ()
    assert bench.arm.voltages[-1] == 0.0


def test_clock_wraps():
    bench = Bench()
    bench.board.time = 2 ** 32 - 3 * PERIOD
    bench.board.next_telemetry = bench.board.time + PERIOD
    bench.advance(5 * PERIOD)
    times = [int(frame.fields['time']) for frame in bench.frames('tele')]
    assert times == [2 ** 32 - 2 * PERIOD, 2 ** 32 - PERIOD, 0, PERIOD, 2 * PERIOD]


def test_nothing_is_sent_that_is_not_finite():
    bench = Bench()
    bench.arm.ambient_temperature = math.inf
    with pytest.raises(ValueError, match='finite'):
        bench.advance(PERIOD)
