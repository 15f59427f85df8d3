# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A simulated board on a simulated cable, as a port that runs by the wall's clock.

The arm lives as long as the port object, also while the port is closed, as a real arm would. Its
time is the wall's times the chosen speed, caught up whenever somebody opens, reads or writes. A
host that was itself held up or reads too slowly finds the arm waiting: more than `LARGEST_LAG` is
not made up for, nor is a speed that this machine cannot compute.
"""

import collections
import threading
import time
from collections.abc import Callable

from hysteresis_ros.laboratory.board.serial_cable import SerialCable
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK
from hysteresis_ros.laboratory.board.url import make_plant, parse_url

LARGEST_LAG = 0.25      # s of the wall
LARGEST_ABSENCE = 10.0  # s of the wall that are made up for when the port is opened
LONGEST_WORK = 0.01     # s of the wall that one call computes at most
LARGEST_BACKLOG = 4096  # bytes that wait to be read
LONGEST_WAIT = 0.02     # s of the wall between two looks at the clock


class PortClosed(OSError):
    """The port is not open."""


class CableUnplugged(OSError):
    """The simulated cable is unplugged."""


class SimulatedPort:
    """
    Bytes to and from a simulated board; any number of threads may use it.

    Parameters
    ----------
    url : str
        ``sim://bicep?key=value&...``; see `hysteresis_ros.laboratory.board.url`.
    clock : callable
        The wall's clock in s.

    Attributes
    ----------
    cable : SerialCable
        With the board and the arm at its far end.
    is_open : bool
        Whether somebody has opened the port.

    Raises
    ------
    ParameterError
        If the URL makes no sense.

    """

    def __init__(self, url: str, clock: Callable[[], float] = time.monotonic) -> None:
        simulation = parse_url(url)
        arm = make_plant(simulation).arm
        board = SimulatedBoard(arm, supply=simulation.supply,
                               seed=simulation.seed, speed=simulation.speed,
                               brownout=simulation.brownout, clock_back=simulation.clock_back,
                               encoder_jump=simulation.encoder_jump,
                               battery=lambda: arm.conditions.supply.share(arm.time))
        self.cable = SerialCable(board, simulation)
        self.is_open = False
        self._clock = clock
        self._speed = simulation.speed
        self._origin = clock()  # wall time at which the arm's time was, or would have been, 0
        self._ticks = 0
        # What the host wrote, on its way to the board.
        self._outbox: collections.deque[bytes] = collections.deque()
        self._changed = threading.Condition()
        self._cancelled = False

    def open(self) -> None:
        """
        Open the port and catch up with the time that has passed.

        Raises
        ------
        CableUnplugged
            If the simulated cable is unplugged.

        """
        with self._changed:
            self._catch_up(LARGEST_ABSENCE, LARGEST_ABSENCE)
            if not self.cable.plugged:
                raise CableUnplugged('the cable is unplugged')
            self.cable.received.clear()
            self._outbox.clear()
            self.is_open = True

    def close(self) -> None:
        """Close the port. The arm goes on living; the board's watchdog looks after it."""
        with self._changed:
            if self.is_open:
                self._deliver()
            self.is_open = False
            self._changed.notify_all()

    def read(self, size: int, timeout: float | None) -> bytes:
        """
        Read up to `size` bytes.

        Parameters
        ----------
        size : int
            Number of bytes to wait for.
        timeout : float or None
            Longest time to wait for them in s; None waits for ever.

        Returns
        -------
        bytes
            Fewer than `size` where the time ran out or `cancel_read` was called.

        Raises
        ------
        PortClosed
            If the port is closed, also while waiting.
        CableUnplugged
            If the simulated cable is unplugged.

        """
        deadline = None if timeout is None else self._clock() + timeout
        with self._changed:
            while True:
                self._update()
                received = self.cable.received
                now = self._clock()
                late = deadline is not None and now >= deadline
                if len(received) >= size or late or self._cancelled:
                    self._cancelled = False
                    data = bytes(received[:size])
                    del received[:size]
                    return data
                remaining = LONGEST_WAIT if deadline is None else deadline - now
                self._changed.wait(min(remaining, LONGEST_WAIT, self._until_telemetry(now)))

    def write(self, data: bytes) -> None:
        """
        Write bytes to the board, which gets them at once.

        Parameters
        ----------
        data : bytes
            Any bytes.

        Raises
        ------
        PortClosed
            If the port is closed.
        CableUnplugged
            If the simulated cable is unplugged.

        """
        if not self.is_open:
            raise PortClosed('the port is not open')
        self._outbox.append(data)
        # A reader that is busy with the arm delivers it at the arm's next tick; waiting for its
        # lock could take for ever on a machine that cannot keep up with the speed.
        if self._changed.acquire(blocking=False):
            try:
                self._update()
                self._changed.notify_all()
            finally:
                self._changed.release()

    def cancel_read(self) -> None:
        """Let a waiting `read` return with what it has."""
        with self._changed:
            self._cancelled = True
            self._changed.notify_all()

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        with self._changed:
            self._update()
            return len(self.cable.received)

    def discard_input(self) -> None:
        """Throw away what has not been read."""
        with self._changed:
            self._update()
            self.cable.received.clear()

    def _update(self) -> None:
        """Bring the arm to the present and deliver what was written."""
        if not self.is_open:
            raise PortClosed('the port is not open')
        self._catch_up(LARGEST_LAG, LONGEST_WORK)
        self._deliver()
        if not self.cable.plugged:
            raise CableUnplugged('the cable was unplugged')

    def _deliver(self) -> None:
        while self._outbox:
            self.cable.write(self._outbox.popleft())

    def _catch_up(self, largest_lag: float, longest_work: float) -> None:
        now = self._clock()
        rate = 1000.0 * self._speed / TICK
        due = int((now - self._origin) * rate) - self._ticks
        excess = due - max(1, int(largest_lag * rate))
        if excess > 0:
            self._origin += excess / rate
            due -= excess
        while due > 0 and len(self.cable.received) < LARGEST_BACKLOG:
            self._deliver()
            self.cable.tick()
            self._ticks += 1
            due -= 1
            if self._clock() - now > longest_work:
                return

    def _until_telemetry(self, now: float) -> float:
        """Return the wall's time in s from `now` until the board will send again."""
        board = self.cable.board
        ahead = (self._ticks * TICK + board.next_telemetry - board.time) / 1000.0 / self._speed
        return max(ahead - (now - self._origin), 0.0)
