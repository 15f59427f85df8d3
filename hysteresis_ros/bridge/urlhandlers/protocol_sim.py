# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The port ``sim://bicep``: a simulated board on a simulated cable, to pyserial's interface.

The arm lives as long as the port object, also while the port is closed, as a real arm would. Its
time is the wall's times the chosen speed, taken up whenever somebody opens, reads or writes. A host
that was itself held up or reads too slowly finds the arm waiting: more than `LARGEST_LAG` is not
made up for, nor is a speed that this machine cannot compute.
"""

import collections
import threading
import time

from serial.serialutil import PortNotOpenError, SerialBase, SerialException, to_bytes

from hysteresis_ros.bridge.simulated_board import SimulatedBoard, TICK
from hysteresis_ros.bridge.simulated_cable import Cable
from hysteresis_ros.bridge.simulation_url import parse_url
from hysteresis_ros.laboratory.effects import EFFECTS
from hysteresis_ros.laboratory.plant import Plant

LARGEST_LAG = 0.25      # s of the wall
LARGEST_ABSENCE = 10.0  # s of the wall that are made up for when the port is opened
LONGEST_WORK = 0.01     # s of the wall that one call computes at most
LARGEST_BACKLOG = 4096  # bytes that wait to be read
LONGEST_WAIT = 0.02     # s of the wall between two looks at the clock


def check_url(url):
    """
    Refuse a URL that makes no sense, before anybody opens it.

    Parameters
    ----------
    url : str
        As given for the parameter ``port``.

    Raises
    ------
    ParameterError
        If the arm, a key or a value is not known.

    """
    make_plant(parse_url(url, EFFECTS))


def make_plant(simulation):
    """
    Build the specimen of the virtual laboratory that a URL asks for.

    Parameters
    ----------
    simulation : Simulation
        As read from the URL.

    Returns
    -------
    Plant

    Raises
    ------
    ParameterError
        If an effect cannot have this strength, or there is no such muscle.

    """
    return Plant(simulation.seed, simulation.effects, simulation.time_constant,
                 simulation.recording, simulation.recording_time, simulation.muscle)


class Serial(SerialBase):
    """The simulated board as a port; made by `serial.serial_for_url`."""

    def __init__(self, *args, **kwargs):
        self._cable = None
        self._speed = 1.0
        self._origin = 0.0      # wall time at which the arm's time was, or would have been, 0
        self._ticks = 0
        self._outbox = collections.deque()      # what the host wrote, on its way to the board
        self._changed = threading.Condition()
        self._cancelled = False
        super().__init__(*args, **kwargs)

    def open(self):
        """
        Open the port; the first time, build board and arm.

        Raises
        ------
        ParameterError
            If the URL makes no sense.
        SerialException
            If the port is open, or the simulated cable is unplugged.

        """
        if self.is_open:
            raise SerialException('Port is already open.')
        with self._changed:
            if self._cable is None:
                self._build()
            self._catch_up(LARGEST_ABSENCE, LARGEST_ABSENCE)
            if not self._cable.plugged:
                raise SerialException('the cable is unplugged')
            self._cable.received.clear()
            self._outbox.clear()
            self.is_open = True

    def _build(self):
        simulation = parse_url(self.port, EFFECTS)
        arm = make_plant(simulation).arm
        board = SimulatedBoard(arm, supply=simulation.supply, seed=simulation.seed,
                               speed=simulation.speed, brownout=simulation.brownout)
        self._speed = simulation.speed
        self._cable = Cable(board, simulation)
        self._origin = time.monotonic()

    def close(self):
        """Close the port. The arm goes on living; the board's watchdog looks after it."""
        with self._changed:
            if self.is_open:
                self._deliver()
            self.is_open = False
            self._changed.notify_all()

    def read(self, size=1):
        """
        Read up to `size` bytes, waiting for them no longer than ``timeout``.

        Raises
        ------
        SerialException
            If the port is closed or the simulated cable is pulled.

        """
        deadline = None if self._timeout is None else time.monotonic() + self._timeout
        with self._changed:
            while True:
                self._live()
                received = self._cable.received
                now = time.monotonic()
                late = deadline is not None and now >= deadline
                if len(received) >= size or late or self._cancelled:
                    self._cancelled = False
                    data = bytes(received[:size])
                    del received[:size]
                    return data
                left = LONGEST_WAIT if deadline is None else deadline - now
                self._changed.wait(min(left, LONGEST_WAIT, self._until_telemetry(now)))

    def write(self, data):
        """
        Write bytes to the board, which gets them at once.

        Raises
        ------
        SerialException
            If the port is closed or the simulated cable is pulled.

        """
        data = to_bytes(data)
        if not self.is_open:
            raise PortNotOpenError()
        self._outbox.append(data)
        # A reader that is busy with the arm delivers it at the arm's next tick; waiting for its
        # lock could take for ever on a machine that cannot keep up with the speed.
        if self._changed.acquire(blocking=False):
            try:
                self._live()
                self._changed.notify_all()
            finally:
                self._changed.release()
        return len(data)

    def cancel_read(self):
        """Let a waiting `read` return with what it has."""
        with self._changed:
            self._cancelled = True
            self._changed.notify_all()

    @property
    def in_waiting(self):
        """Number of bytes that can be read without waiting."""
        with self._changed:
            self._live()
            return len(self._cable.received)

    @property
    def out_waiting(self):
        """Number of bytes still to be sent: none, ever."""
        return 0

    def flush(self):
        """Wait until everything is sent: it is."""

    def reset_input_buffer(self):
        """Throw away what has not been read."""
        with self._changed:
            self._live()
            self._cable.received.clear()

    def reset_output_buffer(self):
        """Throw away what has not been sent: nothing."""

    def _live(self):
        if not self.is_open:
            raise PortNotOpenError()
        self._catch_up(LARGEST_LAG, LONGEST_WORK)
        self._deliver()
        if not self._cable.plugged:
            raise SerialException('the cable was unplugged')

    def _deliver(self):
        while self._outbox:
            self._cable.write(self._outbox.popleft())

    def _catch_up(self, largest_lag, longest_work):
        now = time.monotonic()
        rate = 1000.0 * self._speed / TICK
        due = int((now - self._origin) * rate) - self._ticks
        excess = due - max(1, int(largest_lag * rate))
        if excess > 0:
            self._origin += excess / rate
            due -= excess
        while due > 0 and len(self._cable.received) < LARGEST_BACKLOG:
            self._deliver()
            self._cable.tick()
            self._ticks += 1
            due -= 1
            if time.monotonic() - now > longest_work:
                return

    def _until_telemetry(self, now):
        """Return the wall's time in s from `now` until the board will send again."""
        board = self._cable.board
        ahead = (self._ticks * TICK + board.next_telemetry - board.time) / 1000.0 / self._speed
        return max(ahead - (now - self._origin), 0.0)

    def _reconfigure_port(self):
        """Take new settings: baud rate and the like mean nothing here."""

    def _update_break_state(self):
        """Set the break condition: means nothing here."""

    def _update_rts_state(self):
        """Set a line: means nothing here."""

    def _update_dtr_state(self):
        """Set a line: means nothing here."""
