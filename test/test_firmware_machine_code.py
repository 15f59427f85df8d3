# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The firmware's machine code, in simavr, on a pseudo-terminal, spoken to by the host's `Board`."""

import functools
import math
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from firmware_support import FIRMWARE, make, PWM_STEPS, without_simavr
from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.board_link import Timeouts
from hysteresis_ros.bridge.encoder import AMT103_COUNTS, Encoder
from hysteresis_ros.bridge.protection import Limits, Protection
from hysteresis_ros.bridge.protocol import encode
from hysteresis_ros.bridge.pwm import Pwm
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.plant import Plant
import pytest

DEADLINE = 20.0             # s of the wall, for what the board does by its own clock
SAFE = 600.0                # ms of the board's clock from a fault to duty 0
HARNESS = Path(__file__).with_name('simavr_board.c')
pytestmark = without_simavr()

# By the wall's clock, which a busy machine lets run far ahead of the simulated chip's.
PATIENT = Timeouts(setpoint=60.0, telemetry=10.0, late=10.0, greeting=10.0)

# A host that heats until it is killed.
HOST = """
import sys, time
from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.pwm import Pwm
board = Board(sys.argv[1], pwm=Pwm('mean', maximum_voltage=12.0))
board.start()
board.enable(True)
while True:
    if board.status.sample and board.status.sample.enabled:
        board.set_voltage(6.0)
    time.sleep(0.02)
"""


def until(condition, what):
    """Wait until something is so; fail when it does not become so."""
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end, f'waited {DEADLINE} s for {what}'
        time.sleep(0.01)


class Machine:
    """The chip with all that is connected to it: another process."""

    def __init__(self, program, elf):
        self._process = subprocess.Popen([str(program), str(elf)], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, text=True, bufsize=1)
        self.port = self._answer('port').split()[1]

    def _answer(self, *starts):
        for line in self._process.stdout:
            if not starts or line.startswith(starts):
                return line
        raise AssertionError('the simulated chip has ended')

    def tell(self, command):
        """Give a command and return the answer."""
        self._process.stdin.write(command + '\n')
        return self._answer()

    @property
    def state(self):
        """What `simavr_board.c` says of the chip."""
        return {key: float(value) for key, value in
                re.findall(r'(\w+)=(-?[0-9.a-z]+)', self.tell('state'))}

    @property
    def pwm(self):
        """Steps of the three channels; 0 also while no timer drives the pins, after a reset."""
        state = self.state
        return [int(state['connected'] * state[f'pwm{channel}']) for channel in (1, 2, 3)]

    def zero_after(self, since):
        """Wait for duty 0 and return how many ms after `since` it came, by the chip's clock."""
        until(lambda: self.pwm == [0, 0, 0], 'duty 0')
        changes = [text.split(':') for text in self.tell('history').split()[1:]]
        when, steps = changes[-1]
        assert steps == '0', changes
        return float(when) - since

    def close(self):
        """Switch it off."""
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()


@pytest.fixture(scope='module')
def programs(tmp_path_factory):
    """Build the firmware and what simulates the chip."""
    folder = tmp_path_factory.mktemp('machine')
    report = make('all', f'BUILD={folder}', f'PYTHON={sys.executable}')
    program = folder / 'simavr_board'
    subprocess.run(['gcc', '-std=gnu11', '-Wall', '-Wextra', '-Werror', '-O2', str(HARNESS),
                    '-o', str(program), '-lsimavr'], check=True)
    return program, folder / 'firmware.elf', report


@pytest.fixture
def machine(programs):
    """Return a chip that has just been switched on."""
    chip = Machine(*programs[:2])
    until(lambda: chip.state['ms'] > 20.0, 'its first line, which nobody reads')
    yield chip
    chip.close()


@pytest.fixture
def host(machine):
    """Return a host that has greeted the chip."""
    with host_of(machine) as board:
        until(lambda: board.status.online, 'the board')
        yield board


def host_of(machine):
    return Board(machine.port, pwm=Pwm('mean', maximum_voltage=12.0), timeouts=PATIENT,
                 encoder=Encoder(maximum_speed=200.0, index='check'),
                 protection=Protection(Limits(maximum_voltage=12.0, encoder_check=False)))


def drive(host, machine, steps):
    """Ask for a duty, through all that lies between a voltage and the gates."""
    if not host.status.sample.enabled:
        host.enable(True)
        until(lambda: host.status.sample.enabled, 'enabling')
    host.set_voltage(steps / PWM_STEPS * host.status.sample.supply)
    until(lambda: machine.pwm == [steps] * 3, f'{steps} steps, it is {machine.pwm}')


def shows_duty(host, duty):
    """Return whether the latest telemetry is of this duty."""
    sample = host.status.sample
    return sample.voltage == pytest.approx(duty * sample.supply, abs=1e-4)


def counts(sample):
    return round(sample.angle / (2.0 * math.pi) * AMT103_COUNTS)


def test_greeting_and_telemetry(host, machine):
    """The host finds the board, its supply within a step of the converter, and no fault."""
    identity = host.status.identity
    assert (identity.protocol, identity.name, identity.counter_bits) == (1, 'atmega328p', 32)
    sample = host.status.sample
    assert abs(sample.supply - 12.0) < 0.04
    assert not sample.enabled and not sample.faults
    assert machine.pwm == [0, 0, 0] and machine.state['connected'] == 1
    assert host.status.bad_lines == 0


def test_setpoints_reach_all_three_gates_exactly(host, machine):
    """Off is off; on the third channel it is the mean over four ms."""
    for steps in (0, 300, 700, PWM_STEPS, 1, 0):
        drive(host, machine, steps)
        until(functools.partial(shows_duty, host, steps / PWM_STEPS), 'telemetry')


@pytest.mark.parametrize('rate', [26000, 60000, 100000])
def test_no_edge_is_lost(host, machine, rate):
    """Also while the board listens and talks; the index pulses are where they should be."""
    drive(host, machine, 300)
    machine.tell(f'turn {rate} {rate}')
    until(lambda: machine.state['edges_left'] == 0, 'the encoder')
    until(lambda: counts(host.status.sample) == rate, f'{rate} counts')
    machine.tell(f'turn {-2 * rate} {rate}')
    until(lambda: machine.state['edges_left'] == 0, 'the encoder')
    until(lambda: counts(host.status.sample) == -rate, f'{-rate} counts')
    assert machine.state['counts'] == -rate
    assert not host.status.sample.faults and not host.status.sample.encoder_fault
    assert host.status.bad_lines == 0 and host.status.lost_frames == 0


@pytest.mark.parametrize('silence', [signal.SIGKILL, signal.SIGSTOP])
def test_a_host_that_dies_while_hot_leaves_the_muscle_off(machine, silence):
    """Killed or stopped, without a word: the board's watchdog does it."""
    process = subprocess.Popen([sys.executable, '-c', HOST, machine.port],
                               env={**os.environ, 'PYTHONPATH': str(FIRMWARE.parent)})
    try:
        until(lambda: min(machine.pwm) > 400, 'heating')
        process.send_signal(silence)
        assert machine.zero_after(machine.state['ms']) < SAFE
    finally:
        process.kill()
        process.wait()


def test_a_loop_that_hangs_starts_the_chip_anew(host, machine):
    """The chip's own watchdog; the host greets again and enables nothing until it is told."""
    drive(host, machine, 700)
    since = machine.state['ms']
    machine.tell('hang')
    assert machine.zero_after(since) < SAFE
    assert machine.state['resets'] == 1
    boot = host.status.identity.boot
    until(lambda: host.status.connections == 2, 'the second greeting')
    assert host.status.identity.boot == boot + 1
    assert machine.pwm == [0, 0, 0] and not host.wanted
    until(lambda: 'started anew' in host.status.sample.encoder_fault, 'the fault of the angle')


def test_a_reset_switches_off(host, machine):
    """The gates are low at once, and stay so."""
    drive(host, machine, 700)
    since = machine.state['ms']
    machine.tell('reset')
    assert machine.zero_after(since) < 50.0
    until(lambda: host.status.connections == 2, 'the second greeting')
    assert machine.pwm == [0, 0, 0]


@pytest.mark.parametrize('fault, name', [('stop 1', 'stop'), ('supply 3500', 'supply')])
def test_faults_switch_off(host, machine, fault, name):
    """At once, and telemetry says why."""
    drive(host, machine, 700)
    since = machine.state['ms']
    machine.tell(fault)
    assert machine.zero_after(since) < 50.0
    until(lambda: host.status.sample.faults == (name,), name)


def test_a_flood_of_garbage_feeds_no_watchdog_and_loses_no_edge(machine):
    """A cable that went mad, while the arm swings: off in time, and all is counted."""
    with host_of(machine) as host:
        until(lambda: host.status.online, 'the board')
        drive(host, machine, 700)
        host._link._write = lambda data: None       # its words no longer arrive, but these do:
        machine.tell('turn 60000 60000')
        since = machine.state['ms']
        for _ in range(8):
            os.write(host._link._serial.fileno(), b'set 1 duty=0.9*0000\n\xff\x00garbage*\n' * 40)
            time.sleep(0.12)
        assert machine.zero_after(since) < SAFE
        until(lambda: machine.state['edges_left'] == 0, 'the encoder')
        until(lambda: counts(host.status.sample) == 60000, '60000 counts')
        assert host.status.sample.faults == ('watchdog',)
        assert host.status.bad_lines == 0


def test_the_stack_is_no_deeper_than_was_computed(programs, host, machine):
    """What make prints bounds what happens, with all kinds of lines and interrupts."""
    stack, interrupt = (int(re.search(pattern, programs[2]).group(1))
                        for pattern in (r'Stack: (\d+) bytes', r'(\d+) in an interrupt'))
    drive(host, machine, 300)
    machine.tell('turn 50000 100000')
    os.write(host._link._serial.fileno(), b'config 1 period=x\n\xff\xff\n' * 10)
    until(lambda: machine.state['edges_left'] == 0, 'the encoder')
    assert 40 < machine.state['stack'] <= stack + interrupt


def test_the_port_avr_is_the_chip_with_an_arm_on_it(programs, monkeypatch):
    """Heated through machine code, the arm lifts; the greeting states the speed."""
    monkeypatch.setenv('HYSTERESIS_ROS_AVR', str(programs[1].parent))
    zero = Plant(2).arm.angle
    with Board('avr://bicep?speed=0.5&seed=2', timeouts=PATIENT,
               encoder=Encoder(zero=zero)) as host:
        until(lambda: host.status.online, 'the board')
        chip = host._link._serial.chip
        try:
            assert host.speed == 0.5 and host.status.identity.name == 'atmega328p'
            host.enable(True)
            until(lambda: host.status.sample.enabled, 'enabling')
            host.set_voltage(6.0)
            until(lambda: host.status.sample.voltage == pytest.approx(6.0, abs=0.05), 'the voltage')
            until(lambda: host.status.sample.angle < zero - 0.1, 'the arm')
            host.set_zero()
            assert chip.arm.angle < zero - 0.1 and not host.status.fault
            assert host.status.sample.angle == pytest.approx(chip.arm.angle, abs=0.1)
        finally:
            chip.close()


def test_the_port_avr_says_what_it_needs(monkeypatch):
    """In one line, in the place of a port that cannot be opened."""
    monkeypatch.setenv('HYSTERESIS_ROS_AVR', '/nowhere')
    with Board('avr://bicep') as host:
        until(lambda: "make demo DEMO_ARGS='--port avr://'" in host.status.problem, 'the reason')
    with pytest.raises(ParameterError, match='avr:// has a supply of 12 V'):
        Board('avr://bicep?supply=24')


def test_a_reset_in_the_middle_of_a_frame_obeys_neither_half(machine):
    """A brown-out in a frame: what is left of the line after it is not one."""
    with host_of(machine) as host:
        until(lambda: host.status.online, 'the board')
        drive(host, machine, 300)
        host._link._write = lambda data: None
        line = encode('set', 7, {'duty': 0.9})
        os.write(host._link._serial.fileno(), line[:9])
        until(lambda: machine.state['waiting'] == 0, 'the first half')
        since = machine.state['ms']
        machine.tell('reset')
        os.write(host._link._serial.fileno(), line[9:])
        assert machine.zero_after(since) < 50.0
        time.sleep(0.5)
        assert machine.pwm == [0, 0, 0]
