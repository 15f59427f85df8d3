# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Every fault of docs/safety.md, injected into a heated arm: voltage over time, what is said."""

import math
from pathlib import Path
import signal
import sys

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'tools'))
import faults       # noqa: E402, I100, I201

KILLED = {'compensator_node': 'compensator node dies in mid-run',
          'geometry_node': 'geometry node dies in mid-run'}
HOSTS = {signal.SIGKILL: 'host killed while hot', signal.SIGSTOP: 'host stopped while hot'}


@pytest.fixture(scope='module')
def outcomes():
    """Run them all, side by side; one that a busy machine made late gets another try alone."""
    made = faults.run_simulated()
    late = tuple(fault for fault in faults.SIMULATED
                 if made[fault.name].zero_after > faults.LIMIT)
    for fault in late:
        made.update(faults.run_simulated((fault,)))
    return made


@pytest.mark.parametrize('fault', faults.SIMULATED, ids=lambda fault: fault.name)
def test_fault(outcomes, fault):
    """Hot before it, off in time after it, and never more than was asked for."""
    outcome = outcomes[fault.name]
    assert any(fault.words in text for text in outcome.said), outcome.said
    volts = [voltage for when, voltage, _ in outcome.trace if 0.6 < when < faults.BEGIN - 0.1]
    after = [voltage for when, voltage, _ in outcome.trace if when > faults.BEGIN]
    assert sorted(volts)[len(volts) // 2] == pytest.approx(faults.VOLTAGE, abs=0.05)
    if fault.goes_on:
        assert math.isnan(outcome.zero_after)
        assert max(after) < faults.VOLTAGE + 0.1
        assert sum(voltage > 5.4 for voltage in after) > 0.8 * len(after)
        return
    assert outcome.zero_after <= faults.LIMIT
    if fault.name not in ('two masters on one port', 'supply doubles'):
        assert max(volts + after) < faults.VOLTAGE + 0.1


def test_a_pulled_cable_that_is_put_back_heats_only_when_enabled_again():
    """The host finds the board again by itself, and waits."""
    board = faults.Board('sim://bicep?unplug_after=1&unplug_for=0.5')
    with board:
        board.enable(True)
        heated = []

        def ask():
            board.set_voltage(4.0)
            sample = board.status.sample
            heated.append(sample.voltage if sample and board.status.online else None)
            return board.status

        faults._wait(lambda: ask().connections == 2 and ask().online, 'the cable')
        before = len(heated)
        faults._wait(lambda: ask() and len(heated) > before + 500, 'nothing')
        assert set(heated[before:]) == {0.0} and not board.status.sample.enabled
        board.clear_fault()
        board.enable(True)
        faults._wait(lambda: ask() and (heated[-1] or 0.0) > 3.9, 'the voltage')


@pytest.mark.parametrize('number', HOSTS)
def test_a_host_that_dies_leaves_the_muscle_off(number):
    """Without a last word."""
    assert 0.0 < faults.silence_host(number) <= faults.LIMIT


@pytest.mark.parametrize('name', KILLED)
def test_a_node_that_dies_switches_the_muscle_off(name, domain_id):
    """Long before any setpoint expires."""
    pytest.importorskip('rclpy', reason='the nodes need ROS 2')
    for _ in range(3):      # a machine with other work may keep a live process waiting, too
        seconds, said = faults.kill_node(name)
        if seconds <= faults.LIMIT:
            break
    assert seconds <= faults.LIMIT
    assert name.partition('_')[0] in said


def test_the_page_has_the_table_of_these_faults(root):
    """Each fault once, with a time that was measured and is short enough."""
    rows = faults.committed((root / 'docs' / 'safety.md').read_text(encoding='utf-8'))
    assert sorted(row[0] for row in rows) == sorted(
        [fault.name for fault in faults.SIMULATED] + list(KILLED.values()) + list(HOSTS.values()))
    hows = {fault.name: fault.how for fault in faults.SIMULATED}
    for name, how, when, said in rows:
        assert how == hows.get(name, how) and len(said) > 10
        if when != 'goes on':
            assert 0.0 < float(when.partition(',')[0]) <= faults.LIMIT
    assert {row[0] for row in rows if row[2] == 'goes on'} == {
        fault.name for fault in faults.SIMULATED if fault.goes_on}
