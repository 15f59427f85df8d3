# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The host's side of the board, on real ports, simulated ones, and ports that misbehave."""

from dataclasses import replace
import math
import os
import select
import socket
import threading
import time
import tty

from hysteresis_ros.bridge import board as board_module
from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.board_link import BoardLink, Timeouts
from hysteresis_ros.bridge.encoder import Encoder
from hysteresis_ros.bridge.protocol import Decoder, encode, Frame
from hysteresis_ros.bridge.pwm import Pwm
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK
from hysteresis_ros.errors import BoardError, ParameterError, RangeError
from hysteresis_ros.laboratory.plant import Plant
import pytest

QUICK = Timeouts(setpoint=0.4, telemetry=0.3, watchdog=0.4, keepalive=0.03, greeting=0.5,
                 answer=0.1, write=0.2, first_retry=0.05, last_retry=0.2)
DEADLINE = 10.0


def until(condition, what):
    """Wait until something is so; fail when it does not become so."""
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end, f'waited {DEADLINE} s for {what}'
        time.sleep(0.005)


class Terminal:
    """
    A real serial device, a pseudo-terminal, with something at its far end.

    `answer(data)` gets the bytes that the host sends and returns those that go back; it is called
    every 10 ms, also with nothing.
    """

    def __init__(self, answer):
        self._answer = answer
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        os.close(slave)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self):
        while not self._ended.is_set():
            ready, _, _ = select.select([self._master], [], [], 0.01)
            try:
                data = os.read(self._master, 4096) if ready else b''
            except OSError:     # nobody has the port open
                time.sleep(0.01)
                continue
            answer = self._answer(data)
            if answer:
                os.write(self._master, answer)

    def close(self):
        """Pull the device."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            os.close(self._master)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()


class BoardOnTerminal:
    """A simulated board for the far end of a terminal, four times as fast as the wall's clock."""

    def __init__(self):
        self.arm = Plant(0).arm
        self.board = SimulatedBoard(self.arm, speed=4.0)
        self.talks = True
        self.heard = bytearray()

    def __call__(self, data):
        self.heard += data
        self.board.receive(data)
        self.board.advance(40 // TICK)
        out = self.board.transmit()
        return out if self.talks else b''


def kinds(data):
    return [line for line in Decoder().feed(bytes(data)) if isinstance(line, Frame)]


@pytest.fixture
def boards():
    """Make boards that are stopped at the end."""
    made = []

    def make(port, **options):
        made.append(Board(port, timeouts=options.pop('timeouts', QUICK), **options))
        made[-1].start()
        return made[-1]

    yield make
    for one in made:
        one.stop()


def online(board):
    until(lambda: board.status.online, 'the board')
    return board


def problem(board):
    until(lambda: board.status.problem, 'a problem')
    text = board.status.problem
    assert '\n' not in text and not board.status.online
    return text


def heated(board):
    """Ask for 5 V until they are there, and return what is."""
    volts = [0.0]

    def ask():
        board.set_voltage(5.0)
        volts.append(board.status.sample.voltage)
        return volts[-1] > 4.9

    until(ask, 'the voltage')
    return volts[-1]


def test_drives_the_arm_over_a_real_terminal():
    far, samples = BoardOnTerminal(), []
    with Terminal(far) as terminal:
        with Board(terminal.port, timeouts=QUICK, on_sample=samples.append) as board:
            board.enable(True)
            until(lambda: board.status.online and board.status.sample.enabled, 'enabling')
            cold = board.status.sample
            assert cold.voltage == 0.0 and cold.angle == pytest.approx(far.arm.angle, abs=1e-3)
            assert cold.supply == pytest.approx(12.0, abs=0.1)
            assert heated(board) == pytest.approx(5.0, abs=0.05)
            deadline = time.monotonic() + DEADLINE
            while far.arm.angle > cold.angle - 0.1:
                board.set_voltage(5.0)
                time.sleep(0.02)
                assert time.monotonic() < deadline
            assert board.status.sample.angle < cold.angle - 0.05
        assert far.board.duty == 0.0 and not far.board.enabled
    times = [sample.time for sample in samples]
    assert times == sorted(times) and len(set(times)) == len(times)
    assert board.status.bad_lines == 0 and board.status.lost_frames == 0


def test_speaks_over_the_network(boards):
    far = BoardOnTerminal()
    with socket.create_server(('127.0.0.1', 0)) as server:
        def serve():
            connection, _ = server.accept()
            connection.settimeout(0.01)
            while far.talks:
                try:
                    data = connection.recv(4096)
                except TimeoutError:
                    data = b''
                connection.sendall(far(data))
            connection.close()

        thread = threading.Thread(target=serve)
        thread.start()
        board = online(boards(f'socket://127.0.0.1:{server.getsockname()[1]}'))
        board.enable(True)
        board.set_voltage(3.0)
        until(lambda: far.board.duty > 0.0, 'the voltage')
        far.talks = False
        thread.join()
        assert 'is lost' in problem(board) or 'takes no bytes' in problem(board)


def test_a_port_that_is_closed_meanwhile_is_lost():
    """Another thread may close it between any two steps of a write or a read."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        link = BoardLink(f'socket://127.0.0.1:{server.getsockname()[1]}', 115200, QUICK)
        link._make()
        link._serial.open()
        link._serial._socket.close()
        link._serial._socket = None
        with pytest.raises(BoardError, match='takes no bytes'):
            link.send('hello')
        with pytest.raises(BoardError, match='is lost'):
            link.read()


def test_stop_writes_zero_and_disable_before_closing():
    far = BoardOnTerminal()
    with Terminal(far) as terminal:
        with Board(terminal.port, timeouts=QUICK) as board:
            board.enable(True)
            until(lambda: board.status.online and board.status.sample.enabled, 'enabling')
            board.set_voltage(6.0)
            until(lambda: far.board.duty > 0.2, 'the voltage')
            said = len(far.heard)
        until(lambda: not far.board.enabled, 'the end')
        board.stop()
        last = [(frame.kind, frame.fields.get('duty')) for frame in kinds(far.heard[said:])]
        zero = last.index(('set', '0.00000'))
        assert last[zero:].count(('disable', None)) >= 1
        assert all(duty in (None, '0.00000') for _, duty in last[zero:])


def test_setpoint_that_is_not_repeated_expires(boards):
    # Long enough for a busy machine to see the voltage before it goes.
    board = online(boards('sim://bicep', timeouts=replace(QUICK, setpoint=2.0)))
    board.enable(True)
    board.set_voltage(4.0)
    until(lambda: board.status.sample.voltage > 3.9, 'the voltage')
    assert not board.status.expired
    until(lambda: board.status.sample.voltage == 0.0, 'the end of the setpoint')
    assert board.status.expired and board.status.online
    board.set_voltage(4.0)
    until(lambda: board.status.sample.voltage > 3.9, 'the voltage')


def test_setpoint_is_not_held_for_a_board_that_was_switched_off(boards):
    board = online(boards('sim://bicep?speed=5', timeouts=Timeouts(keepalive=0.03)))
    board.enable(True)
    board.set_voltage(4.0)
    until(lambda: board.status.sample.voltage > 3.9, 'the voltage')
    board.enable(False)
    until(lambda: not board.status.sample.enabled, 'the end')
    assert board.status.sample.voltage == 0.0
    board.enable(True)
    until(lambda: board.status.sample.enabled, 'enabling')
    time.sleep(0.1)
    assert board.status.sample.voltage == 0.0


@pytest.mark.parametrize('voltage', [math.nan, math.inf, -0.1, 6.01])
def test_setpoints_out_of_bounds_never_reach_the_board(voltage):
    far = BoardOnTerminal()
    with Terminal(far) as terminal, Board(terminal.port, timeouts=QUICK) as board:
        board.enable(True)
        until(lambda: board.status.online and board.status.sample.enabled, 'enabling')
        with pytest.raises(RangeError, match='refused'):
            board.set_voltage(voltage)
        board.set_voltage(2.0)
        until(lambda: far.board.duty > 0.0, 'the voltage')
        with pytest.raises(RangeError):
            board.set_voltage(voltage)
        time.sleep(0.1)
    duties = {float(frame.fields['duty']) for frame in kinds(far.heard) if frame.kind == 'set'}
    assert max(duties) == pytest.approx((2.0 / 12.0) ** 2, rel=0.01)
    assert all(duty == 0.0 or duty > 0.02 for duty in duties)


def test_port_that_does_not_exist(boards):
    board = boards('/dev/tty_that_is_not_there')
    assert 'no such device' in problem(board) and 'tty_that_is_not_there' in problem(board)
    board.set_voltage(1.0)      # nobody has to know


def test_port_that_appears_later(boards, tmp_path):
    path = tmp_path / 'port'
    board = boards(str(path))
    assert 'no such device' in problem(board)
    with Terminal(BoardOnTerminal()) as terminal:
        path.symlink_to(terminal.port)
        online(board)


def test_port_that_is_taken(boards):
    with Terminal(BoardOnTerminal()) as terminal:
        online(boards(terminal.port))
        assert 'another program uses it' in problem(boards(terminal.port))


def test_device_that_is_to_be_found_by_its_name(boards):
    assert 'no ports found' in problem(boards('hwgrep://a_board_that_nobody_has'))


def test_plain_file_as_port_is_reported(boards, tmp_path):
    path = tmp_path / 'file'
    path.write_text('x')
    assert 'cannot be opened' in problem(boards(str(path)))


@pytest.mark.parametrize('port', ['foo://x', 'sim://leg', 'sim://bicep?sped=2'])
def test_malformed_port_is_refused_at_once(port):
    with pytest.raises(ParameterError, match=port.split(':')[0]):
        Board(port)


def test_port_that_echoes(boards):
    assert 'no answer to' in problem(boards('loop://'))


def test_port_that_is_silent(boards):
    with Terminal(lambda data: b'') as terminal:
        assert 'silent' in problem(boards(terminal.port))


def test_port_with_garbage(boards):
    with Terminal(lambda data: b'\xf3\x00\x81 $GPGGA,1*47\r\n') as terminal:
        text = problem(boards(terminal.port))
        assert 'wrong baud rate, or another device' in text and 'GPGGA' in text


def test_board_of_another_version(boards):
    def answer(data):
        return encode('board', 1, {'protocol': 2, 'boot': 1, 'time': 0}) if data else b''

    with Terminal(answer) as terminal:
        assert 'version 2' in problem(boards(terminal.port))


def test_board_that_refuses(boards):
    def answer(data):
        out = b''
        for frame in kinds(data):
            if frame.kind == 'hello':
                out += encode('board', 1, {'protocol': 1, 'boot': 1, 'time': 0})
            if frame.kind == 'config':
                out += encode('no', 2, {'re': frame.sequence, 'reason': 'busy'})
        return out

    with Terminal(answer) as terminal:
        assert "refuses 'config', it says busy" in problem(boards(terminal.port))


def test_board_with_nonsense_in_its_telemetry(boards):
    def answer(data):
        return far(data) + encode('tele', 1, {'time': far.board.time, 'counts': 0, 'supply': 12,
                                              'duty': 7, 'on': 1})

    far = BoardOnTerminal()
    with Terminal(answer) as terminal:
        assert 'no board can' in problem(boards(terminal.port))


def test_board_that_goes_silent_and_comes_back():
    far = BoardOnTerminal()
    with Terminal(far) as terminal, Board(terminal.port, timeouts=QUICK) as board:
        board.enable(True)
        until(lambda: board.status.online and board.status.sample.enabled, 'enabling')
        board.set_voltage(5.0)
        until(lambda: far.board.duty > 0.0, 'the voltage')
        far.talks = False
        until(lambda: 'the board is silent' in board.status.problem, 'the silence')
        until(lambda: far.board.duty == 0.0, 'the output to go off')
        far.talks = True
        until(lambda: board.status.online, 'the board')
        assert board.status.connections >= 2 and board.status.problem == ''
        assert board.status.sample.encoder_fault == ''      # it kept its counter
        assert 'was lost while it was enabled' in board.status.fault
        for _ in range(10):
            board.set_voltage(5.0)
            time.sleep(0.02)
        assert not board.status.sample.enabled and far.board.duty == 0.0
        board.enable(True)      # somebody has to look first
        assert not board.wanted
        board.clear_fault()
        board.enable(True)
        until(lambda: board.status.sample.enabled, 'enabling')
        time.sleep(0.1)
        assert board.status.sample.voltage == 0.0           # until a new setpoint comes
        board.set_voltage(5.0)
        until(lambda: far.board.duty > 0.0, 'the voltage')


def test_a_host_that_was_held_up_listens_before_it_calls_a_board_silent(monkeypatch):
    """What it read before it was held up says nothing of the time since."""
    far = BoardOnTerminal()
    read, held_up = BoardLink.read, []

    def read_late(link):
        frames = read(link)
        if held_up:
            time.sleep(held_up.pop())
            return []
        return frames

    monkeypatch.setattr(BoardLink, 'read', read_late)
    with Terminal(far) as terminal, Board(terminal.port, timeouts=QUICK) as board:
        until(lambda: board.status.online, 'the board')
        held_up.append(2.0 * QUICK.telemetry)
        until(lambda: not held_up, 'the delay')
        before = board.status.sample.time
        until(lambda: board.status.sample.time > before, 'telemetry after it')
        assert board.status.online and board.status.connections == 1


def test_board_watchdog_switches_off_when_the_host_is_silent(boards, monkeypatch):
    far = BoardOnTerminal()
    with Terminal(far) as terminal:
        board = online(boards(terminal.port))
        board.enable(True)
        board.set_voltage(5.0)
        until(lambda: far.board.duty > 0.0, 'the voltage')
        monkeypatch.setattr(BoardLink, 'send', lambda *args: 0)
        until(lambda: 'watchdog' in far.board.faults, "the board's watchdog")
        assert far.board.duty == 0.0
        until(lambda: 'watchdog: no setpoint came' in board.status.faults, 'the fault')


def test_device_that_is_pulled(boards):
    far = BoardOnTerminal()
    with Terminal(far) as terminal:
        board = online(boards(terminal.port))
        terminal.close()
        assert 'is lost' in problem(board) or 'takes no bytes' in problem(board)
    until(lambda: 'no such device' in board.status.problem, 'the device to be gone')


def test_board_that_starts_anew_is_greeted_and_stays_off():
    far = BoardOnTerminal()
    with Terminal(far) as terminal, Board(terminal.port, timeouts=QUICK) as board:
        board.enable(True)
        until(lambda: board.status.online and board.status.sample.enabled, 'enabling')
        before = board.status.sample
        far.board.start()
        until(lambda: board.status.connections == 2 and board.status.online, 'the board')
        after = board.status.sample
        assert not after.enabled and not board.wanted
        assert 'started anew' in after.encoder_fault
        assert after.angle == pytest.approx(before.angle, abs=0.01)
        assert after.time > before.time
        board.clear_fault()
        until(lambda: board.status.sample.encoder_fault == '', 'the doubt to go')


def test_cable_that_loses_and_invents_bytes(boards):
    samples = []
    board = boards('sim://bicep?speed=20&drop=0.002&garbage=0.1', on_sample=samples.append)
    online(board)
    board.enable(True)
    end = time.monotonic() + DEADLINE
    while len(samples) < 200:
        board.set_voltage(4.0)
        time.sleep(0.01)
        assert time.monotonic() < end
    status = board.status
    assert status.bad_lines > 0 and status.lost_frames > 0 and status.last_bad_line
    assert {round(sample.voltage, 1) for sample in samples[100:]} <= {0.0, 4.0}
    assert all(math.isfinite(sample.angle) for sample in samples)


def test_supply_that_is_not_what_was_agreed_switches_off(boards):
    board = online(boards('sim://bicep?speed=5&supply=24'))
    board.enable(True)
    for _ in range(30):
        board.set_voltage(5.0)
        time.sleep(0.01)
    until(lambda: '24 V, 12 V expected: output off' in board.status.limit, 'the reason')
    assert board.status.sample.voltage == 0.0


def test_supply_that_is_known_is_compensated(boards):
    board = online(boards('sim://bicep?speed=5&supply=24', supply=24.0))
    board.enable(True)
    board.set_voltage(5.0)
    until(lambda: board.status.sample.voltage == pytest.approx(5.0, abs=0.02), 'the voltage')


def test_limits_can_change_while_it_runs(boards):
    board = online(boards('sim://bicep?speed=5'))
    board.pwm = Pwm(maximum_voltage=3.0)
    with pytest.raises(RangeError, match='0 to 3 V'):
        board.set_voltage(4.0)


def test_limit_below_the_voltage_that_is_held_lowers_it(boards):
    board = online(boards('sim://bicep?speed=5'))
    board.enable(True)
    board.set_voltage(5.0)
    until(lambda: board.status.sample.voltage == pytest.approx(5.0, abs=0.02), 'the voltage')
    board.pwm = Pwm(maximum_voltage=3.0)
    board.set_voltage(3.0)
    until(lambda: board.status.sample.voltage == pytest.approx(3.0, abs=0.02), 'the new limit')
    board.pwm = Pwm(maximum_voltage=2.0)
    until(lambda: board.status.sample.voltage == pytest.approx(2.0, abs=0.02), 'the lower limit')
    assert 'maximum_voltage was lowered' in board.status.limit


def test_error_in_the_writing_thread_switches_off_and_reconnects(boards, monkeypatch):
    board = online(boards('sim://bicep?speed=5'))
    connections = board.status.connections
    with monkeypatch.context() as broken:
        broken.setattr(Board, '_commands', lambda _: 1 / 0)
        board.set_voltage(1.0)
        until(lambda: 'unexpected ZeroDivisionError' in board.status.problem, 'the problem')
    until(lambda: board.status.connections > connections and board.status.online, 'the board')
    board.enable(True)
    board.set_voltage(2.0)
    until(lambda: board.status.sample.voltage == pytest.approx(2.0, abs=0.02), 'the voltage')


def test_counter_of_16_bits_is_what_the_board_says(boards):
    def answer(data):
        out = b''
        for frame in kinds(data):
            if frame.kind == 'hello':
                out += encode('board', 1, {'protocol': 1, 'boot': 1, 'time': 0, 'bits': 16})
            if frame.kind == 'config':
                out += encode('ok', 2, {'re': frame.sequence})
        count[0] += 100
        return out + encode('tele', 3, {
            'time': count[0] // 10, 'counts': count[0] % 65536, 'supply': 12, 'duty': 0, 'on': 0})

    count = [65000]
    with Terminal(answer) as terminal:
        board = online(boards(terminal.port))
        until(lambda: count[0] > 67000, 'the counter to wrap')
        until(lambda: board.status.sample.angle > 0.0, 'the angle')
        assert board.status.sample.encoder_fault == ''


def test_error_in_the_sample_callback_switches_off_and_reconnects():
    def listen(sample):
        samples.append(sample)
        if len(samples) == 3:
            raise KeyError('mine')

    samples = []
    with Board('sim://bicep?speed=5', timeouts=QUICK, on_sample=listen) as board:
        until(lambda: len(samples) >= 3, 'the error')
        until(lambda: "unexpected KeyError('mine')" in board.status.problem
              or board.status.connections > 1, 'the problem')
        until(lambda: len(samples) > 5, 'more samples')


def test_hanging_port_blocks_no_caller(monkeypatch):
    hangs = threading.Event()
    monkeypatch.setattr(BoardLink, 'open', lambda link: hangs.wait(DEADLINE) and None)
    board = Board('sim://bicep', timeouts=QUICK)
    board.start()
    before = time.monotonic()
    board.enable(True)
    board.set_voltage(3.0)
    assert not board.status.online
    assert time.monotonic() - before < 0.5 * DEADLINE
    hangs.set()
    board.stop()


def test_stop_before_start_does_nothing():
    Board('sim://bicep').stop()


def test_timeouts_count_by_the_slower_clock(boards):
    board = online(boards('sim://bicep?speed=0.5'))
    assert board.speed == 0.5 and board.slowness == 2.0


def test_angle_is_read_with_the_given_encoder(boards):
    board = online(boards('sim://bicep', encoder=Encoder(direction=-1, zero=4.0)))
    assert board.status.sample.angle == pytest.approx(4.0 - Plant(0).arm.angle, abs=2e-3)


def test_supply_is_averaged_but_a_jump_is_taken_at_once():
    board = Board('sim://bicep')
    for supply in (12.0, 12.1, 11.9, 12.2):
        board._smooth(supply)
    assert board._supply == pytest.approx(12.05)
    for _ in range(1000):
        board._smooth(12.3)
    assert board._supply == pytest.approx(12.3)
    board._smooth(12.0)
    assert board._supply == pytest.approx(12.3 - 0.3 / board_module.SUPPLY_SAMPLES)
    board._smooth(11.0)
    assert board._supply == 11.0
    board._smooth(11.2)
    assert board._supply == pytest.approx(11.1)
