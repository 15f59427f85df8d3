# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the board forbids by itself, the emergency stop and too much power, as the host sees it."""

import dataclasses
import math
import threading
import time

from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.board_link import BoardLink
from hysteresis_ros.bridge.protection import Limits, Protection
from hysteresis_ros.bridge.pwm import Pwm
import pytest

FAST = 'sim://bicep?speed=20'


def until(condition, what):
    """Wait until something is so."""
    deadline = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline, f'waited for {what}'
        time.sleep(0.005)


class Heater:
    """Somebody who asks for a voltage again and again, whatever comes."""

    def __init__(self, board, voltage):
        self._ended = threading.Event()
        self._board, self.voltage = board, voltage
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self):
        while not self._ended.wait(0.02):
            self._board.set_voltage(self.voltage)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._ended.set()
        self._thread.join()


def enable(board):
    board.clear_fault()
    board.enable(True)


def test_after_the_emergency_stop_only_a_person_heats_again():
    """Releasing it does not; ~/enable does, but not while it is pressed."""
    with Board(f'{FAST}&stop_after=20&stop_for=40') as board, Heater(board, 4.0):
        enable(board)
        until(lambda: board.status.fault, 'the stop')
        assert 'emergency stop was pressed' in board.status.fault
        assert board.status.sample.time < 60.0
        enable(board)
        until(lambda: board.status.fault or board.status.sample.time > 55.0, 'its refusal')
        assert board.status.fault and not board.status.sample.enabled
        until(lambda: not board.status.sample.faults, 'its release')
        released = board.status.sample.time
        until(lambda: board.status.sample.time > released + 10.0, 'ten seconds')
        assert board.status.sample.voltage == 0.0 and not board.status.sample.enabled
        enable(board)
        until(lambda: board.status.sample.voltage > 3.9, 'heat')
        assert not board.status.fault


def without_protection(board):
    """Let what limits the host's voltage fail."""
    board.protection.limit = lambda voltage, *_: (voltage, '', False)
    board.protection.observe = lambda sample: ''


@pytest.mark.parametrize('law', ['rms', 'mean'])
def test_the_board_keeps_the_hosts_limit_of_the_rms_where_the_host_does_not(law):
    """Within a tenth, whatever the law of the voltage; it stays off until somebody enables."""
    limits = Limits(rms_voltage=3.0, rms_window=10.0, encoder_check=False)
    applied = []
    with Board(FAST, pwm=Pwm(law=law), protection=Protection(limits),
               on_sample=applied.append) as board:
        without_protection(board)
        with Heater(board, 5.0):
            enable(board)
            until(lambda: board.status.fault, 'the limit')
        assert 'above what the board allows' in board.status.fault
        until(lambda: not board.status.sample.faults, 'the mean to fall')
        assert not board.status.sample.enabled
        square, before = 0.0, applied[0].time
        highest = 0.0
        for sample in applied:
            share = -math.expm1((before - sample.time) / limits.rms_window)
            power = sample.voltage ** 2 if law == 'rms' else sample.voltage * sample.supply
            square += share * (power - square)
            before, highest = sample.time, max(highest, square)
        allowed = 1.1 * (3.0 if law == 'rms' else math.sqrt(3.0 * 15.0))
        assert math.sqrt(highest) == pytest.approx(allowed, rel=0.05)
        with Heater(board, 2.0):
            enable(board)
            until(lambda: board.status.sample.voltage > 1.9, 'heat')


def test_the_board_does_not_disturb_a_host_that_keeps_its_limit():
    """The voltage is lowered so that neither the mean nor the board's limit is passed."""
    limits = Limits(rms_voltage=3.0, rms_window=2.0, encoder_check=False)
    with Board(FAST, protection=Protection(limits)) as board, Heater(board, 6.0) as heater:
        enable(board)
        until(lambda: board.protection.rms > 2.9, 'the limit')
        since = board.status.sample.time
        while board.status.sample.time < since + 60.0:
            time.sleep(0.01)
            heater.voltage = 6.0 if board.status.sample.time % 4.0 < 2.0 else 0.5
        assert not board.status.fault and board.status.sample.enabled


def test_a_limit_that_changes_reaches_the_board_even_when_words_are_lost(monkeypatch):
    """It is said again until the board has answered."""
    lost = []
    send = BoardLink.send

    def send_but_lose(link, kind, fields=None):
        if kind == 'config' and 'rms' in fields and len(lost) < 2:
            lost.append(fields)
            return -1
        return send(link, kind, fields)

    limits = Limits(rms_voltage=0.0, rms_window=1.0, encoder_check=False)
    with Board(FAST, protection=Protection(limits)) as board:
        until(lambda: board.status.online, 'the board')
        without_protection(board)
        monkeypatch.setattr(BoardLink, 'send', send_but_lose)
        with Heater(board, 5.0):
            enable(board)
            until(lambda: board.status.sample.voltage > 4.9, 'heat')
            since = board.status.sample.time
            until(lambda: board.status.sample.time > since + 5.0, 'five seconds')
            assert not board.status.fault
            board.protection.limits = dataclasses.replace(limits, rms_voltage=2.0)
            until(lambda: board.status.fault, 'the limit')
    assert len(lost) == 2
