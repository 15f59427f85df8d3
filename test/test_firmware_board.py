# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the firmware does, compiled for this computer: beside the simulated board, and alone."""

import math
import re

from firmware_support import build_library, FIRMWARE, HostBoard, PWM_STEPS
from hypothesis import example, given, strategies as st
from hysteresis_ros.bridge.messages import Identity, Telemetry
from hysteresis_ros.bridge.protocol import BadLine, Decoder, encode, Frame, parse_line, Remark
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK
import pytest

WATCHDOG = 500              # ms; config may ask for less only


class StillArm:
    """An arm for the simulated board whose encoder stands where it was put."""

    encoder_counts = 0
    ambient_temperature = 22.0

    def advance(self, dt, voltage):
        """Nothing moves by itself."""


@pytest.fixture(scope='module')
def firmware_library(tmp_path_factory):
    """Build the firmware for this computer."""
    return build_library(tmp_path_factory.mktemp('firmware'))


@pytest.fixture
def board(firmware_library):
    """Return a board that has just been switched on."""
    return HostBoard(firmware_library)


def enabled(board, duty='0.5'):
    assert board.ask('enable') == ('ok', {'re': str(board.sequence)})
    assert board.ask('set', duty=duty) is None
    return board


def test_the_first_line_says_how_to_begin(board):
    """A person at a terminal can go on by copying."""
    remark = parse_line(board.transmit().rstrip(b'\n'))
    assert isinstance(remark, Remark)
    hello = re.search('"(.+)"', remark.text).group(1)
    assert isinstance(parse_line(hello.encode('ascii')), Frame)


def test_greeting(board):
    """The host reads who is there, and which firmware."""
    kind, fields = board.ask('hello', protocol=1)
    identity = Identity.from_frame(Frame(kind, 0, fields))
    assert (identity.protocol, identity.name) == (1, 'atmega328p')
    assert identity.firmware == re.search('FIRMWARE_VERSION "(.+)"',
                                          (FIRMWARE / 'config.h').read_text()).group(1)
    assert (identity.counter_bits, identity.speed) == (32, 1.0)
    board.library.host_start()
    assert int(board.ask('hello', protocol=1)[1]['boot']) == identity.boot + 1


# Limits of the mean heating power, right and wrong; none is that of a simple duty, where rounding
# would decide.
POWER = st.fixed_dictionaries({}, optional={
    'rms': st.sampled_from(['5.123', '0.51', '8.77', '100', '9999999999.5', '0', '-1', '0.0',
                            'x']),
    'rms_window': st.sampled_from([100, 150, 1000, 9999999999, 0, -1, '1.0', 'x'])})

# What a host may send, to both boards at once; time passes between.
COMMANDS = st.one_of(
    st.builds(lambda duty: ('set', {'duty': duty}), st.one_of(
        st.floats(-0.2, 1.2), st.sampled_from(['1.0000000001', '-0', '0', '1', 'x', '1.', '-1']))),
    st.builds(lambda period, watchdog, power: (
                  'config', {'period': period, 'watchdog': watchdog, **power}),
              st.integers(1, 20).map(lambda n: n * TICK) | st.sampled_from([0, -5, '1.0', 'x']),
              st.integers(1, WATCHDOG) | st.sampled_from([0, -1]), POWER),
    st.sampled_from([('enable', {}), ('disable', {}), ('zero', {}), ('config', {'period': 100}),
                     ('set', {}), ('reboot', {'now': 1}), ('tele', {})]))
ACTIONS = st.lists(st.one_of(COMMANDS, st.just(('enable', {})), st.integers(1, 40),
                             st.binary(max_size=40)), max_size=25)


@given(ACTIONS)
@example([('enable', {}), ('set', {'duty': 0.5}), 24, 1, 1, ('set', {'duty': 0.25}), 6])
@example([('config', {'period': 20, 'watchdog': 500, 'rms': '5.123', 'rms_window': 1000}),
          ('enable', {}), ('set', {'duty': 0.5}), 20, ('set', {'duty': 0.5}), ('disable', {}), 1,
          ('enable', {}), ('set', {'duty': 0.15}), 20])
def test_it_answers_as_the_simulated_board_does(firmware_library, actions):
    """Answers, refusals, explanations and telemetry are the same, byte for byte where they can."""
    firmware, simulated = HostBoard(firmware_library), SimulatedBoard(StillArm())
    for both in (firmware, simulated):
        both.receive(encode('config', 0, {'period': 100, 'watchdog': WATCHDOG}))
        both.transmit()
    decoders = Decoder(), Decoder()
    for number, action in enumerate(actions):
        if isinstance(action, int):
            firmware.advance(action * TICK)
            simulated.advance(action)
        else:
            data = encode(action[0], number, action[1]) if isinstance(action, tuple) else action
            firmware.receive(data)
            simulated.receive(data)
        ours, theirs = (decoder.feed(one.transmit())
                        for decoder, one in zip(decoders, (firmware, simulated)))
        assert [comparable(line) for line in ours] == [comparable(line) for line in theirs]
        assert firmware.pwm == round(simulated.duty * PWM_STEPS)


def comparable(line):
    """Return a line without what differs between two boards: noise, and steps of the duty."""
    assert not isinstance(line, BadLine), line
    if isinstance(line, Remark):
        return line
    if line.kind != 'tele':
        return line.kind, line.sequence, line.fields if line.kind != 'board' else None
    telemetry = Telemetry.from_frame(line)
    return line.sequence, telemetry._replace(
        supply=0.0, ambient=None, duty=round(telemetry.duty * PWM_STEPS))


def test_it_answers_as_the_example_of_the_protocol_says(board, root):
    """The page's host gets the page's answers."""
    page = (root / 'docs' / 'protocol.md').read_text(encoding='utf-8')
    said = []
    for line in re.findall(r'^    > (.+)$', page, re.MULTILINE):
        board.receive(line.encode('ascii') + b'\n')
        board.advance(100 if line.startswith('set 4') else 0)
        said += [(frame.kind, frame.fields.get('re'), frame.fields.get('reason'))
                 for frame in board.frames()]
    shown = [parse_line(line.encode('ascii'))
             for line in re.findall(r'^    < (.+)$', page, re.MULTILINE)]
    wanted = [(frame.kind, frame.fields.get('re'), frame.fields.get('reason'))
              for frame in shown if isinstance(frame, Frame)]
    assert said == wanted[:-1]      # the last comes 1.4 s later


@pytest.mark.parametrize('steps', [0, 1, 300, 700, PWM_STEPS - 1, PWM_STEPS])
def test_a_setpoint_reaches_the_gates_exactly(board, steps):
    """Five decimals are enough for each step, and telemetry says the same duty."""
    enabled(board, round(steps / PWM_STEPS, 5))
    assert board.pwm == steps
    assert float(board.telemetry()['duty']) == round(steps / PWM_STEPS, 5)


def test_nothing_is_heated_before_it_is_enabled(board):
    """Not even by good setpoints."""
    assert board.pwm == 0
    assert board.ask('set', duty=0.5)[1]['reason'] == 'disabled'
    assert board.pwm == 0
    assert board.ask('enable')[0] == 'ok'
    assert board.pwm == 0


@pytest.mark.parametrize('asked, milliseconds', [(None, 500), (200, 200), (1000, 500)])
def test_no_setpoint_in_time_switches_off(board, asked, milliseconds):
    """The host may ask for a shorter time, never for a longer one than half a second."""
    if asked:
        assert board.ask('config', period=100, watchdog=asked)[0] == 'ok'
    enabled(board)
    board.advance(milliseconds)
    assert board.pwm == PWM_STEPS // 2
    board.advance(1)
    assert board.pwm == 0
    assert board.telemetry()['faults'] == 'watchdog'
    assert board.ask('set', duty=0.25) is None
    assert board.pwm == PWM_STEPS // 4
    assert board.telemetry()['faults'] == 'none'


def test_disabling_clears_the_watchdogs_fault(board):
    """Nobody has to send a setpoint to an arm that is to stay off."""
    enabled(board)
    board.advance(WATCHDOG + 2)
    assert board.telemetry()['faults'] == 'watchdog'
    assert board.ask('disable')[0] == 'ok'
    assert board.telemetry()['faults'] == 'none'


def test_refused_setpoints_do_not_feed_the_watchdog(board):
    """Nor do greetings, or lines that are broken."""
    enabled(board)
    for _ in range(12):
        board.ask('set', duty=1.5)
        board.ask('enable')
        board.ask('hello')
        board.receive(b'set 1 duty=0.5*0000\n')
        board.advance(50)
    assert board.pwm == 0


def test_a_flood_of_garbage_does_not_keep_the_watchdog_from_biting(board):
    """What does not end is read in pieces."""
    enabled(board)
    board.library.host_receive(b'\xff\n*' * 20000, 60000)
    board.advance(WATCHDOG + 2)
    assert board.pwm == 0
    assert board.library.host_fed() > WATCHDOG


def test_one_pass_takes_a_few_bytes_only(board):
    """However many wait: the rest of the loop has its turn."""
    board.transmit()
    board.library.host_receive(b'\n' * 32 + encode('hello', 1), 32 + len(encode('hello', 1)))
    board.library.host_step()
    assert board.frames() == []
    board.library.host_step()
    assert [frame.kind for frame in board.frames()] == ['board']


def test_a_broken_cable_does_not_flood_the_host_with_explanations(board):
    """Five a second, as the protocol says."""
    board.transmit()
    for _ in range(100):
        board.receive(b'set 1\n')
        board.advance(10)
    assert board.transmit().count(b'# nothing done') == 5


def test_bad_lines_are_explained_after_weeks_without_any(board):
    """Half of the range of the clock is 25 days."""
    def explained():
        board.transmit()
        board.receive(b'enable 2\n')
        return b'nothing done' in board.transmit()
    assert explained() and not explained()
    for days in (1, 25, 30, 49):
        board.library.host_leap(days * 86400000)
        assert explained(), days


def test_the_clock_may_wrap(board):
    """After 49 days telemetry keeps its period, and a setpoint its age."""
    board.library.host_leap(2 ** 32 - 400)
    assert board.ask('config', period=50, watchdog=500)[0] == 'ok'
    enabled(board)
    board.advance(500)
    assert board.pwm == PWM_STEPS // 2
    times = [int(frame.fields['time']) for frame in board.frames()]
    assert [time % 2 ** 32 for time in times] == [
        (2 ** 32 - 400 + 50 * number) % 2 ** 32 for number in range(1, 11)]
    board.advance(2)
    assert board.pwm == 0


def test_a_port_without_room_loses_whole_frames_only(board):
    """The host sees the gap in the numbers, and never half a frame."""
    board.telemetry()
    board.library.host_jam_port(True)
    board.advance(350)
    board.library.host_jam_port(False)
    board.transmit()
    before = board.telemetry()
    assert int(before['time']) == 500
    assert board.lines.bad_lines == 0


def test_the_chips_watchdog_is_fed_only_while_the_clock_runs(board):
    """Without its clock no setpoint would be too old."""
    board.advance(10)
    fed = board.library.host_fed()
    for _ in range(50):
        board.library.host_step()
    assert board.library.host_fed() == fed
    board.advance(1)
    assert board.library.host_fed() == fed + 1


@pytest.mark.parametrize('supply, wanted', [(3999, 0), (4000, PWM_STEPS // 2)])
def test_a_low_supply_switches_off(board, supply, wanted):
    """It stays off until a setpoint comes while the supply is back."""
    enabled(board)
    board.library.host_set_supply(supply)
    board.advance(1)
    assert board.pwm == wanted
    if not wanted:
        assert board.telemetry()['faults'] == 'supply'
        assert board.ask('set', duty=0.5)[1]['reason'] == 'supply'
        board.library.host_set_supply(12000)
        board.advance(1)
        assert board.pwm == 0
        assert board.ask('set', duty=0.5) is None
        assert board.pwm == PWM_STEPS // 2


def test_the_emergency_stop_stays_until_the_host_has_disabled(board):
    """Releasing the button must not heat the muscle, though the host goes on asking."""
    enabled(board)
    board.library.host_open_stop(True)
    board.advance(6)
    assert board.pwm == 0
    assert board.telemetry()['faults'] == 'stop'
    assert board.telemetry()['on'] == '0'
    board.library.host_open_stop(False)
    assert board.ask('enable')[1]['reason'] == 'stop'
    assert board.ask('set', duty=0.5)[1]['reason'] == 'disabled'
    assert board.ask('disable')[0] == 'ok'
    enabled(board)
    assert board.pwm == PWM_STEPS // 2


def test_the_emergency_stop_cannot_be_cleared_while_it_is_pressed(board):
    """Disabling does not close the contact."""
    board.library.host_open_stop(True)
    board.advance(6)
    assert board.ask('disable')[0] == 'ok'
    assert board.ask('enable')[1]['reason'] == 'stop'


def test_a_pressed_stop_lets_nothing_through_in_one_pass(board):
    """Not even commands that come at once."""
    board.library.host_open_stop(True)
    board.advance(6)
    board.transmit()
    data = b''.join(encode(kind, number, fields) for number, (kind, fields) in enumerate(
        [('disable', {}), ('enable', {}), ('set', {'duty': 1})]))
    board.library.host_receive(data, len(data))
    heated = []
    for _ in range(8):
        board.library.host_step()
        heated.append(board.pwm)
    assert heated == [0] * 8
    assert [frame.fields.get('reason') for frame in board.frames()] == [None, 'stop', 'disabled']


def test_a_spark_on_the_stops_wire_is_no_stop(board):
    """Two milliseconds are no press."""
    enabled(board)
    board.library.host_open_stop(True)
    board.advance(2)
    board.library.host_open_stop(False)
    board.advance(1)
    assert board.pwm == PWM_STEPS // 2


@pytest.mark.parametrize('direction', [1, -1])
def test_every_edge_is_counted(board, direction):
    """100 edges in each ms, for longer than 16 bits last."""
    count = 0
    for _ in range(1000):
        count = board.turn(count, 100 * direction)
        board.advance(1)
    fields = board.telemetry()
    assert int(fields['counts']) == count == 100000 * direction
    assert fields['faults'] == 'none'


@given(st.lists(st.integers(-300, 300).filter(bool), max_size=20))
def test_counts_follow_any_motion(firmware_library, moves):
    """To and fro, with one count left or right of each turn."""
    board = HostBoard(firmware_library)
    board.turn(1, -1)
    board.ask('zero')
    count = 0
    for move in moves:
        count = board.turn(count, move)
        board.advance(1)
    assert int(board.telemetry()['counts']) == sum(moves)
    board.turn(count, (-count) or 4)


def test_index_pulses_latch_the_counter(board):
    """The host finds lost counts by them."""
    assert 'latch' not in board.telemetry()
    count = board.turn(0, 2731)
    board.library.host_index()
    board.turn(count, 1000)
    fields = board.telemetry()
    assert (fields['index'], fields['latch'], fields['counts']) == ('1', '2731', '3731')
    assert board.ask('zero')[0] == 'ok'
    fields = board.telemetry()
    assert (fields['index'], fields['counts']) == ('0', '0')
    assert 'latch' not in fields


def test_index_pulses_latch_more_than_16_bits(board):
    """Far from where it was switched on, and after more pulses than 16 bits count."""
    board.turn(1, -1)
    board.ask('zero')
    count = 0
    for _ in range(4):
        count = board.turn(count, -20000)
        board.advance(1)
    for _ in range(65535):
        board.library.host_index()
    board.advance(1)
    for _ in range(3):
        board.library.host_index()
    board.turn(count, 500)
    fields = board.telemetry()
    assert (fields['index'], fields['latch'], fields['counts']) == ('2', '-80000', '-79500')


def test_edges_too_fast_to_follow_are_a_fault(board):
    """Both tracks at once: a count was lost, and nobody knows which way."""
    board.library.host_tracks(False, False)
    board.library.host_tracks(True, True)
    assert board.telemetry()['faults'] == 'counts_lost'
    assert board.ask('zero')[0] == 'ok'
    assert board.telemetry()['faults'] == 'none'
    board.library.host_tracks(False, True)
    board.library.host_tracks(False, False)


def test_telemetry_comes_in_its_period(board):
    """A shorter one than a frame takes is rounded up."""
    for asked, period in ((50, 50), (1, 20), (9999999999, None)):
        assert board.ask('config', period=asked, watchdog=500)[0] == 'ok'
        board.advance(1000)
        times = [int(frame.fields['time']) for frame in board.frames()]
        assert len(times) == (1000 // period if period else 0)
        assert {late - early for early, late in zip(times, times[1:])} <= {period}


def test_telemetry_that_is_late_once_keeps_its_times(board):
    """A host may count on the period."""
    assert board.ask('config', period=100, watchdog=500)[0] == 'ok'
    board.library.host_leap(130)
    board.advance(170)
    assert [int(frame.fields['time']) for frame in board.frames()] == [131, 200, 300]


def heat(board, seconds, duty='0.5'):
    """Repeat a setpoint and return the time in s at which the gates went off; None if not."""
    for tenth in range(round(10.0 * seconds)):
        answer = board.ask('set', duty=duty)
        if answer is not None:
            return tenth / 10.0
        board.advance(100)
    return None


def test_the_mean_power_is_limited_as_the_host_asks(board):
    """By a lag of the square; the time is that of the equation, within two of its ticks."""
    rms, window = 6.0, 10.0
    assert board.ask('config', period=100, watchdog=500, rms=rms, rms_window=10000)[0] == 'ok'
    assert board.ask('enable')[0] == 'ok'
    share = rms ** 2 / (0.5 * 12.0 ** 2)
    assert heat(board, 20.0) == pytest.approx(-window * math.log(1.0 - share), abs=0.2)
    assert board.pwm == 0
    assert board.telemetry()['faults'] == 'power'


def test_what_the_power_limit_switched_off_stays_so_until_the_host_has_disabled(board):
    """And what the wires have had already counts on."""
    board.ask('config', period=100, watchdog=500, rms=6.0, rms_window=10000)
    board.ask('enable')
    first = heat(board, 20.0)
    assert board.ask('enable')[1]['reason'] == 'power'
    board.advance(2000)
    assert board.telemetry()['faults'] == 'power'
    assert board.ask('disable')[0] == 'ok'
    assert board.telemetry()['faults'] == 'none'
    assert board.ask('enable')[0] == 'ok'
    assert 0.0 < heat(board, 20.0) < first / 2.0


def test_the_power_limit_lets_pass_what_is_below_it(board):
    """For ever, at 99 % of it; and without one, everything."""
    board.ask('config', period=100, watchdog=500, rms=6.0, rms_window=1000)
    board.ask('enable')
    assert heat(board, 100.0, round(0.98 * 0.25, 5)) is None
    board.ask('config', period=100, watchdog=500)
    assert heat(board, 200.0, 1.0) is None


def test_a_power_limit_is_kept_that_the_host_does_not_know(tmp_path):
    """A board for a thin wire is built with one, and says so; the host may ask for less only."""
    library = build_library(tmp_path, 'CONFIG=-DRMS_LIMIT=3000 -DRMS_WINDOW=2000')
    for asked in ({}, {'rms': 8.0}, {'rms': 3.0}, {'rms': 3.0004}):
        limited = HostBoard(library)
        assert limited.ask('hello')[1]['rms'] == '3.000'
        assert limited.ask('config', period=100, watchdog=500, **asked)[0] == 'ok'
        limited.ask('enable')
        assert heat(limited, 20.0, 0.07) == pytest.approx(
            -2.0 * math.log(1.0 - 9.0 / (0.07 * 144.0)), abs=0.3)
    assert limited.ask('config', period=100, watchdog=500, rms=2.0)[0] == 'ok'
    limited.advance(20000)
    limited.ask('disable')
    limited.ask('enable')
    assert heat(limited, 20.0, 0.035) is not None


def test_a_duty_limit_is_kept(tmp_path):
    """A board for a thin wire is built with one, and says so."""
    library = build_library(tmp_path, 'CONFIG=-DDUTY_LIMIT_PERCENT=40')
    limited = HostBoard(library)
    assert limited.ask('hello')[1]['limit'] == '0.40'
    enabled(limited, 0.4)
    assert limited.ask('set', duty=0.402)[1]['reason'] == 'out_of_range'
    assert limited.pwm == 0.4 * PWM_STEPS
