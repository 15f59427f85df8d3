# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Long computations beside a program that must not wait: a process at low priority, on a budget."""

from __future__ import annotations

from collections.abc import Callable
import multiprocessing
import os
import signal
import time
from typing import Any, NamedTuple, TYPE_CHECKING

from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.workers import end_with

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

# What others on the machine are given before the process (nice), and seconds to wait at its end.
NICENESS = 10
END_PATIENCE = 2.0


class Outcome(NamedTuple):
    """
    What became of a task.

    Attributes
    ----------
    value : object
        What the function returned.
    problem : str
        Why it did not, in one line; '' if it did.
    cpu : float
        Time of a core that it took [s], with the start of the process.
    """

    value: Any
    problem: str
    cpu: float


class Background:
    """
    One process that does one task at a time, at low priority, and is started when there is one.

    The process is started anew, not forked: a fork would inherit half of what ROS needs.

    Parameters
    ----------
    patience : float
        Time [s] after which a task is given up.
    niceness : int
        How much priority it leaves to others.
    """

    def __init__(self, patience: float = 600.0, niceness: int = NICENESS) -> None:
        self._patience = patience
        self._niceness = niceness
        self._context = multiprocessing.get_context('spawn')
        self._process: Any = None
        self._pipe: Connection | None = None
        self._begun: float | None = None

    @property
    def busy(self) -> bool:
        """Whether a task is running."""
        return self._begun is not None

    def start(self, function: Callable, *args: Any) -> None:
        """
        Begin a task; returns at once.

        Parameters
        ----------
        function : callable
            Of a module, so that another process finds it.
        *args
            For it.
        """
        if self.busy:
            raise RuntimeError('a task is running already')
        if self._process is None or not self._process.is_alive():
            self._pipe, other = self._context.Pipe()
            self._process = self._context.Process(
                target=_serve, args=(other, os.getpid(), self._niceness), daemon=True,
                name='background')
            self._process.start()
            other.close()
        self._begun = time.monotonic()
        assert self._pipe is not None
        self._pipe.send((function, args))

    def poll(self) -> Outcome | None:
        """Return the outcome of the task, once; None while it is running or if there is none."""
        if self._begun is None or self._pipe is None:
            return None
        took = time.monotonic() - self._begun
        try:
            if self._pipe.poll():
                outcome = self._pipe.recv()
                self._begun = None
                return outcome
        except (EOFError, OSError):
            self.stop()
            return Outcome(None, 'the process that computed has died', took)
        if took > self._patience:
            self.stop()
            return Outcome(None, f'given up after {self._patience:g} s', took)
        return None

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._begun = None
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        if self._process is not None:
            self._process.kill()
            self._process.join(END_PATIENCE)
            self._process = None


class Budget:
    """
    How much of a core may be used: a share on average, which can be saved up.

    Parameters
    ----------
    share : float
        Of a core, on average.
    saved : float
        Time of a core [s] that can be saved up at most, and that there is at first.
    now : float
        Time [s].
    """

    def __init__(self, share: float, saved: float, now: float) -> None:
        self.share = share
        self._saved = self._left = saved
        self._then = self._start = now
        self.spent = 0.0

    def may_begin(self, now: float) -> bool:
        """Whether there is some left at a time [s]."""
        self._left = min(self._saved, self._left + self.share * (now - self._then))
        self._then = now
        return self._left > 0.0

    def spend(self, cpu: float) -> None:
        """Take off what was used [s]; it may leave a debt."""
        self._left -= cpu
        self.spent += cpu

    def used(self, now: float) -> float:
        """Return the share of a core that was used since the beginning."""
        return self.spent / max(now - self._start, 1.0)


def _serve(pipe: Connection, giver: int, niceness: int) -> None:
    """Do the tasks that come through a pipe, until the process that gave them ends."""
    end_with(giver)
    # Ctrl-C in a terminal is for the program, which ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        os.nice(niceness)
    except OSError:
        pass    # as low as it may be already
    before = 0.0
    while True:
        try:
            function, args = pipe.recv()
            value, problem = _tried(function, args)
            cpu = time.process_time()
            pipe.send(Outcome(value, problem, cpu - before))
            before = cpu
        except (EOFError, OSError):
            return


def _tried(function: Callable, args: tuple) -> tuple[Any, str]:
    try:
        return function(*args), ''
    except HysteresisError as error:
        return None, ' '.join(str(error).split())
    except Exception as error:      # whatever it is: whoever waits must hear of it
        return None, ' '.join(f'unexpected {error!r}'.split())
