# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Tasks in a process at low priority, and the budget that they are done within."""

import os
import time

import pytest

from hysteresis_ros.background import Background, Budget, NICENESS
from hysteresis_ros.errors import RangeError


def outcome(background, patience=30.0):
    """Wait for what becomes of a task."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        found = background.poll()
        if found is not None:
            return found
        time.sleep(0.01)
    return pytest.fail('no outcome')


@pytest.fixture
def background():
    """Return a process that ends with the test."""
    made = Background()
    yield made
    made.stop()


def refuse(reason):
    """Raise what a computation may raise."""
    raise RangeError(reason)


def test_tasks_are_done_by_one_process_at_low_priority(background):
    """It stays for the next task; nobody waits meanwhile."""
    before = time.monotonic()
    background.start(os.getpid)
    assert time.monotonic() - before < 2.0 and background.busy
    with pytest.raises(RuntimeError, match='running already'):
        background.start(os.getpid)
    first = outcome(background)
    assert not background.busy and first.problem == '' and first.cpu > 0.0
    assert first.value != os.getpid()
    background.start(os.getpriority, os.PRIO_PROCESS, 0)
    here = os.getpriority(os.PRIO_PROCESS, 0)
    assert outcome(background).value == min(here + NICENESS, 19)
    background.start(os.getpid)
    assert outcome(background).value == first.value
    assert background.poll() is None


def test_errors_are_one_line(background):
    """Expected ones as they are, others with their name; the process lives on."""
    background.start(refuse, 'too\n far')
    assert outcome(background)[:2] == (None, 'too far')
    background.start(int, 'no number')
    assert outcome(background).problem.startswith('unexpected ValueError(')


def test_a_process_that_dies_is_started_anew(background):
    """Whoever waits hears of it."""
    background.start(os._exit, 3)
    assert outcome(background).problem == 'the process that computed has died'
    background.start(os.getpid)
    assert outcome(background).problem == ''


def test_a_task_that_takes_too_long_is_given_up():
    """With its process."""
    background = Background(patience=0.2)
    background.start(time.sleep, 60.0)
    assert outcome(background).problem == 'given up after 0.2 s'
    assert not background.busy and background._process is None


def test_the_budget_is_kept_on_average():
    """What was saved up may go at once; a debt has to be waited for."""
    budget = Budget(0.1, 6.0, 100.0)
    spent = 0.0
    for now in range(100, 3700):
        if budget.may_begin(float(now)):
            budget.spend(4.0)
            spent += 4.0
    assert 0.1 * 3600.0 <= spent <= 0.1 * 3600.0 + 6.0 + 4.0
    assert budget.used(3700.0) == pytest.approx(spent / 3600.0)
    idle = Budget(0.1, 6.0, 0.0)
    assert idle.may_begin(1e6)
    idle.spend(6.0)
    assert not idle.may_begin(1e6)
