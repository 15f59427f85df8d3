# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Every fault of docs/safety.md, injected into a heated arm: voltage over time, what is said."""

import math

from firmware_support import make, without_simavr
from hysteresis_ros.bridge.board import Board
import pytest
from tools.faults import processes
from tools.faults.catalogue import FAULTS
from tools.faults.fault import BEGIN, LIMIT, VOLTAGE
from tools.faults.run import run_all
from tools.faults.table import BOARDS, committed

# Speeds of the arm's clock against the wall's, by which its times are: what a busy machine makes
# late at one of them, it does not at a slower one, and what our code does late stays late.
SLOWER = (0.3, 0.1)


def check(fault, outcome):
    """Hot before it, off in time after it, and never more than was asked for."""
    assert any(fault.words in text for text in outcome.said), outcome.said
    volts = [voltage for when, voltage, _ in outcome.trace if 0.6 < when < BEGIN - 0.1]
    after = [voltage for when, voltage, _ in outcome.trace if when > BEGIN]
    assert sorted(volts)[len(volts) // 2] == pytest.approx(VOLTAGE, abs=0.05)
    if fault.goes_on:
        assert math.isnan(outcome.zero_after)
        assert max(after) < VOLTAGE + 0.1
        assert sum(voltage > 5.4 for voltage in after) > 0.8 * len(after)
        return
    assert outcome.zero_after <= LIMIT
    if fault.name not in ('two masters on one port', 'supply doubles'):
        assert max(volts + after) < VOLTAGE + 0.1


def passes(fault, outcome):
    """Return whether `check` does."""
    try:
        check(fault, outcome)
    except AssertionError:
        return False
    return True


def outcomes_of(faults, scheme):
    """Run them side by side; those that a busy machine made late again, on ever slower arms."""
    made = run_all(faults, scheme)
    for speed in SLOWER:
        late = [fault for fault in faults if not passes(fault, made[fault.name])]
        made.update(run_all(late, scheme, speed))
    return made


@pytest.fixture(scope='module')
def simulated():
    """Return what came of all faults on the simulated board."""
    return outcomes_of(FAULTS, 'sim')


@pytest.fixture(scope='module')
def machine_code(tmp_path_factory):
    """Build what runs the machine code, and let everybody find it."""
    folder = tmp_path_factory.mktemp('machine')
    make('machine', f'BUILD={folder}')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('HYSTERESIS_ROS_AVR', str(folder))
        yield


@pytest.fixture(scope='module')
def on_machine_code(machine_code, request):
    """Return what came on the machine code of those faults that this run tests."""
    wanted = [item.callspec.params['fault'] for item in request.session.items
              if getattr(item, 'originalname', '') == 'test_fault_on_the_machine_code']
    return outcomes_of(wanted, 'avr')


@pytest.mark.parametrize('fault', FAULTS, ids=lambda fault: fault.name)
def test_fault(simulated, fault):
    check(fault, simulated[fault.name])


@without_simavr()
@pytest.mark.parametrize('fault', FAULTS, ids=lambda fault: fault.name)
def test_fault_on_the_machine_code(on_machine_code, fault):
    check(fault, on_machine_code[fault.name])


def test_a_pulled_cable_that_is_put_back_heats_only_when_enabled_again():
    """The host finds the board again by itself, and waits."""
    heats_only_when_enabled_again(Board('sim://bicep?unplug_after=1&unplug_for=0.5'))


@without_simavr()
def test_a_pulled_cable_of_the_machine_code_likewise(machine_code):
    """Its board has a supply of its own, and is switched off by its own watchdog."""
    board = Board('avr://bicep?speed=0.5&unplug_after=1&unplug_for=0.8')
    try:
        heats_only_when_enabled_again(board)
    finally:
        board._link._serial.chip.close()


def heats_only_when_enabled_again(board):
    with board:
        board.enable(True)
        heated = []

        def ask():
            board.set_voltage(4.0)
            sample = board.status.sample
            heated.append(sample.voltage if sample and board.status.online else None)
            return board.status

        processes.wait_for(lambda: ask().connections == 2 and ask().online, 'the cable')
        before = len(heated)
        processes.wait_for(lambda: ask() and len(heated) > before + 500, 'nothing')
        assert set(heated[before:]) == {0.0} and not board.status.sample.enabled
        board.clear_fault()
        board.enable(True)
        processes.wait_for(lambda: ask() and (heated[-1] or 0.0) > 3.9, 'the voltage')


@pytest.mark.parametrize('number', processes.HOSTS)
def test_a_host_that_dies_leaves_the_muscle_off(number):
    """Without a last word."""
    for speed in (1.0, *SLOWER):
        seconds = processes.silence_host(number, speed=speed)
        if seconds <= LIMIT:
            break
    assert 0.0 < seconds <= LIMIT


@pytest.mark.parametrize('name', processes.NODES)
def test_a_node_that_dies_switches_the_muscle_off(name, domain_id):
    """Long before any setpoint expires."""
    dies_and_switches_off(name, 'sim')


@without_simavr()
@pytest.mark.long
@pytest.mark.parametrize('name', processes.NODES)
def test_a_node_that_dies_switches_the_machine_code_off(name, domain_id, machine_code):
    """The same bridge drives it."""
    dies_and_switches_off(name, 'avr')


def dies_and_switches_off(name, scheme):
    pytest.importorskip('rclpy', reason='the nodes need ROS 2')
    for speed in (None, *SLOWER):
        seconds, said = processes.kill_node(name, scheme, speed)
        if seconds <= LIMIT:
            break
    assert seconds <= LIMIT
    assert name.partition('_')[0] in said


def test_the_page_has_the_table_of_these_faults(root):
    """Each fault once, with times that were measured on both boards and are short enough."""
    rows = committed((root / 'docs' / 'safety.md').read_text(encoding='utf-8'))
    assert sorted(row[0] for row in rows) == sorted(
        [fault.name for fault in FAULTS] + list(processes.NODES.values())
        + list(processes.HOSTS.values()))
    hows = {fault.name: fault.how for fault in FAULTS}
    for name, how, *times, said in rows:
        assert how == hows.get(name, how) and len(said) > 10 and len(times) == len(BOARDS)
        for when in times:
            assert when == 'goes on' or 0.0 < float(when.partition(',')[0]) <= LIMIT
    for column in range(2, 2 + len(BOARDS)):
        assert {row[0] for row in rows if row[column] == 'goes on'} == {
            fault.name for fault in FAULTS if fault.goes_on}
