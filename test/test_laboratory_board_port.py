# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The simulated board's port: its URL, its cable's faults, and the wall's clock."""

import contextlib
import threading
import time

import math

from hysteresis_ros.bridge.protocol import Decoder, encode, Frame
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.board.port import (
    CableUnplugged, LARGEST_BACKLOG, LARGEST_LAG, PortClosed, SimulatedPort)
from hysteresis_ros.laboratory.board.serial_cable import SerialCable
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK
from hysteresis_ros.laboratory.board.url import check_url, make_plant, parse_url, Simulation
from hysteresis_ros.laboratory.plant import Plant
import pytest


class Clock:
    """The wall's clock, moved by hand."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        """Return the time in s."""
        return self.now


@contextlib.contextmanager
def open_port(url, clock=time.monotonic):
    """Open a simulated port, and close it again."""
    port = SimulatedPort(url, clock)
    port.open()
    yield port
    port.close()


def cable(**options):
    simulation = parse_url('sim://bicep?' + '&'.join(
        f'{key}={value}' for key, value in options.items()))
    return SerialCable(SimulatedBoard(Plant(0).arm, brownout=simulation.brownout), simulation)


def frames(data):
    return [line for line in Decoder().feed(bytes(data)) if isinstance(line, Frame)]


def test_url_without_keys_is_a_perfect_arm_at_real_time():
    assert parse_url('sim://bicep') == Simulation()
    assert parse_url('SIM://Bicep/') == Simulation()
    assert parse_url('sim://bicep?muscle=brinson') == Simulation(muscle='brinson')


def test_url_with_every_key_is_read():
    simulation = parse_url(
        'sim://bicep?speed=60&seed=3&recording=2&recording_time=100&time_constant=2&supply=24'
        '&drop=0.01&garbage=0.1&brownout=5&unplug_after=1&unplug_for=2&silent_after=3'
        '&silent_for=4&deaf_for=6&deaf_after=5&supply_sag=0.4&payload_error=-1&flip=0.02'
        '&double=0.03&clock_back=7&encoder_jump=8&muscle=grains&late_after=9&effects_after=7')
    assert simulation == Simulation(
        60.0, 3, 2, 100.0, 2.0, 24.0, 0.01, 0.02, 0.03, 0.1, 5.0, 7.0, 8.0,
        {'unplug': (1.0, 2.0), 'silent': (3.0, 4.0), 'deaf': (5.0, 6.0), 'late': (9.0, math.inf)},
        {'supply_sag': 0.4, 'payload_error': -1.0}, 'grains', 7.0)
    assert not simulation.lasts('unplug', 0.99) and simulation.lasts('unplug', 2.99)
    assert not simulation.lasts('unplug', 3.0) and not simulation.lasts('mad', 5.0)


@pytest.mark.parametrize('url, words', [
    ('sim://leg', 'sim://bicep'), ('sim://', 'sim://bicep'), ('sim://bicep/x', 'sim://bicep'),
    ('sim://bicep?sped=60', "no 'sped'; keys are speed, seed"), ('sim://bicep?speed', 'speed'),
    ('sim://bicep?speed=', 'a number from 0.01'), ('sim://bicep?speed=fast', 'speed=fast'),
    ('sim://bicep?speed=0', 'from 0.01 to 1000'), ('sim://bicep?speed=nan', 'speed=nan'),
    ('sim://bicep?late_at=1', 'NAME_after'), ('sim://bicep?deaf_for=x', 'deaf_for=x'),
    ('sim://bicep?drop=0.9', 'from 0 to 0.5'), ('sim://bicep?seed=1.5', 'a whole number'),
    ('sim://bicep?seed=1&seed=2', 'seed is given twice'),
    ('sim://bicep?unplug_after=-1', 'from 0 to inf'), ('sim://bicep?supply_sag=x', 'supply_sag=x')])
def test_urls_that_make_no_sense_say_so_in_one_line(url, words):
    with pytest.raises(ParameterError) as error:
        parse_url(url)
    assert words in str(error.value) and '\n' not in str(error.value)


def test_strengths_that_no_effect_has_are_refused_before_opening():
    with pytest.raises(ParameterError, match='supply_sag'):
        check_url('sim://bicep?supply_sag=50')


def test_the_muscle_of_the_url_is_the_arms():
    plant = make_plant(parse_url('sim://bicep?muscle=lagoudas'))
    assert plant.material.name == 'lagoudas'
    with pytest.raises(ParameterError, match='there are grains, brinson, lagoudas, tanaka'):
        check_url('sim://bicep?muscle=auricchio')


def test_effects_reach_the_arm():
    clean, heavy = (make_plant(parse_url(url)).arm
                    for url in ('sim://bicep', 'sim://bicep?payload_error=1'))
    for arm in (clean, heavy):
        arm.advance(30.0, 4.0)
    assert heavy.angle > clean.angle + 0.01


def test_effects_can_begin_while_the_arm_runs():
    """Until then it is the clean one; what belongs to the wires as they were built cannot."""
    clean, heavy, later, loose = (make_plant(parse_url(f'sim://bicep?{keys}')).arm for keys in (
        'seed=1', 'payload_error=1', 'seed=1&payload_error=1&effects_after=30',
        'seed=1&series_compliance=1&effects_after=30'))
    for arm in (clean, later, loose):
        arm.advance(30.0, 4.0)
    assert later.angle == loose.angle == clean.angle != heavy.angle
    for arm in (clean, later, loose):
        arm.advance(30.0, 4.0)
    assert later.angle > clean.angle + 0.01 and loose.angle != clean.angle
    for name in ('stress_dependence', 'unequal_muscles'):
        with pytest.raises(ParameterError, match='cannot begin while the arm runs'):
            check_url(f'sim://bicep?{name}=1&effects_after=30')


def test_perfect_cable_delivers_every_byte():
    wire = cable()
    for _ in range(100):
        wire.tick()
    assert [frame.sequence for frame in frames(wire.received)] == list(range(2000 // 100))
    assert wire.time == pytest.approx(2.0)


def test_drop_loses_the_given_share_in_both_directions():
    wire = cable(drop=0.1)
    for _ in range(1000):
        wire.tick()
    whole = cable()
    for _ in range(1000):
        whole.tick()
    assert 0.87 < len(wire.received) / len(whole.received) < 0.93
    for i in range(500):
        wire.write(encode('hello', i))
    heard = wire.board._decoder.frames
    assert 500 * 0.9 ** 13 * 0.6 < heard < 500 * 0.9 ** 13 * 1.5


def test_garbage_comes_between_frames():
    wire = cable(garbage=1.0)
    for _ in range(200):
        wire.tick()
    decoder = Decoder()
    decoder.feed(bytes(wire.received))
    assert decoder.bad_lines > 20


def test_faults_repeat_with_the_seed():
    def received(seed):
        wire = cable(seed=seed, drop=0.05, garbage=0.3)
        for _ in range(100):
            wire.tick()
        return bytes(wire.received)

    assert received(1) == received(1) != received(2)


def test_silence_begins_and_ends():
    wire = cable(silent_after=1.0, silent_for=2.0)
    for _ in range(4000 // TICK):
        wire.tick()
    times = [int(frame.fields['time']) for frame in frames(wire.received)]
    assert 900 in times and 3100 in times
    assert not [time for time in times if 1000 < time < 3000]


def test_watchdog_of_a_deaf_board_switches_off():
    wire = cable(deaf_after=1.0)
    wire.write(encode('enable', 1))
    for _ in range(3000 // TICK):
        wire.write(encode('set', 2, {'duty': 0.1}))
        wire.tick()
    assert wire.board.duty == 0.0 and 'watchdog' in wire.board.faults


def test_unplugged_board_loses_its_power():
    wire = cable(unplug_after=1.0, unplug_for=1.0)
    wire.write(encode('enable', 1))
    for _ in range(1000 // TICK + 1):
        wire.write(encode('set', 2, {'duty': 0.25}))
        wire.tick()
    assert not wire.plugged and not wire.received
    for _ in range(1000 // TICK):
        wire.tick()
    assert wire.plugged and wire.board.duty == 0.0 and not wire.board.enabled
    assert wire.board.time <= 2 * TICK


def test_waiting_read_can_be_ended():
    with open_port('sim://bicep?silent_after=0') as port:
        thread = threading.Timer(0.1, port.cancel_read)
        thread.start()
        assert port.read(10 ** 6, None) == b''
        thread.join()


def test_closing_the_port_ends_a_waiting_read():
    port = SimulatedPort('sim://bicep?silent_after=0')
    port.open()
    thread = threading.Timer(0.1, port.close)
    thread.start()
    with pytest.raises(PortClosed):
        port.read(10 ** 6, None)
    thread.join()


def test_closed_port_takes_no_bytes():
    port = SimulatedPort('sim://bicep')
    with pytest.raises(PortClosed):
        port.write(b'hello')
    with pytest.raises(PortClosed):
        port.read(1, 0.0)


def test_writer_never_waits_for_a_reader_that_is_busy():
    with open_port('sim://bicep?speed=1000') as port:
        with port._changed:
            thread = threading.Thread(target=port.write, args=(b'\n' + encode('enable', 1),))
            thread.start()
            thread.join(5.0)
            assert not thread.is_alive() and not port.cable.board.enabled
        port.read(1, 0.0)
        assert port.cable.board.enabled
        with port._changed:
            thread = threading.Thread(target=port.write, args=(encode('disable', 1),))
            thread.start()
            thread.join(5.0)
    assert not port.cable.board.enabled


def test_read_waits_no_longer_than_its_timeout():
    with open_port('sim://bicep?silent_after=0') as port:
        before = time.monotonic()
        assert port.read(10, 0.05) == b''
        assert time.monotonic() - before >= 0.05


def test_time_follows_the_speed():
    clock = Clock()
    with open_port('sim://bicep?speed=50', clock) as port:
        for _ in range(20):
            clock.now += 0.05
            assert port.read(10 ** 6, 0.0)
        assert port.cable.time == pytest.approx(50.0, abs=2 * TICK / 1000.0)


def test_host_that_was_held_up_finds_the_arm_waiting():
    clock = Clock()
    with open_port('sim://bicep', clock) as port:
        clock.now += 60.0
        assert port.in_waiting
        assert port.cable.time == pytest.approx(LARGEST_LAG, abs=TICK / 1000.0)


def test_arm_does_not_run_ahead_of_a_host_that_reads_slowly():
    clock = Clock()
    with open_port('sim://bicep?speed=1000', clock) as port:
        for _ in range(1000):
            clock.now += 0.01
            assert port.in_waiting < LARGEST_BACKLOG + 200
        waiting = port.in_waiting
        assert waiting >= LARGEST_BACKLOG and len(port.read(10 ** 6, 0.0)) == waiting


def test_arm_lives_on_while_the_port_is_closed():
    clock = Clock()
    port = SimulatedPort('sim://bicep?unplug_after=1&unplug_for=3', clock)
    port.open()
    for _ in range(8):
        clock.now += 0.1
        port.read(100, 0.0)
    clock.now += 0.24
    with pytest.raises(CableUnplugged):
        port.read(100, 0.0)
    port.close()
    clock.now += 1.0
    with pytest.raises(CableUnplugged):
        port.open()
    clock.now += 2.5
    port.open()
    assert port.cable.board.time < 1000
