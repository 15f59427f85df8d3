# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A port with the protocol on it: open, greet, send, read. No threads, no retries of its own."""

from collections.abc import Callable
import dataclasses
import errno
import importlib
import os
import threading
import time
from typing import Any

import serial

from hysteresis_ros.bridge.messages import BOARD, CONFIG, HELLO, Identity, NO, OK
from hysteresis_ros.bridge.protocol import Decoder, encode, Fields, Frame, SEQUENCE_LIMIT, VERSION
from hysteresis_ros.errors import BoardError, ParameterError

HANDLERS = 'hysteresis_ros.bridge.urlhandlers'
if HANDLERS not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append(HANDLERS)

# Ports that end at the virtual laboratory's arm.
SIMULATED = ('sim', 'avr')
READ_TIMEOUT = 0.05     # s; how late the reader notices that it is to stop
LARGEST_READ = 4096
LARGEST_GAP = 1000      # frames; a larger one is a board that started anew
# What pyserial raises on a port that is gone; TypeError and AttributeError if it was closed by
# another thread meanwhile.
LOST = (OSError, TypeError, AttributeError)

_HINTS = {
    errno.ENOENT: 'there is no such device; check the cable and the parameter port',
    errno.EACCES: 'no permission; add your user to the group of the device (dialout on Ubuntu)',
    errno.EBUSY: 'another program uses it', errno.EAGAIN: 'another program uses it'}


@dataclasses.dataclass(frozen=True)
class Timeouts:
    """
    Every time limit between host and board, in s.

    With a simulated board that does not live at real time they count by the slower of the two
    clocks, the wall's and the board's: what they guard against is a program or cable that died,
    and programs die by the wall's clock.

    Attributes
    ----------
    setpoint : float
        Without `Board.set_voltage` for so long, the output goes to zero.
    refused : float
        A setpoint that a refused one follows is held for so long, unless a good one comes.
    telemetry : float
        Without telemetry while the host listened for so long, the board counts as lost.
    late : float
        Without telemetry for so long, nothing is heated; with telemetry slower than that, 2.5
        periods. A board that runs faster than the wall's clock burns nothing: there `telemetry`
        counts alone.
    watchdog : float
        Without a frame from the host for so long, the board switches off on its own.
    keepalive : float
        How often the setpoint is repeated; well below `watchdog`.
    greeting : float
        How long a board may take to start after its port was opened.
    answer : float
        After which a question without an answer is asked again.
    write : float
        After which a port that takes no bytes counts as lost.
    first_retry, last_retry : float
        Waiting times before the port is opened again; doubled each time.

    """

    setpoint: float = 2.0
    refused: float = 0.3
    telemetry: float = 1.0
    late: float = 0.4
    watchdog: float = 0.5
    keepalive: float = 0.1
    greeting: float = 3.0
    answer: float = 0.3
    write: float = 0.5
    first_retry: float = 0.2
    last_retry: float = 5.0


class BoardLink:
    """
    One port, opened and closed any number of times.

    Parameters
    ----------
    port : str
        Device or pyserial URL.
    baud : int
        Bits per second.
    timeouts : Timeouts
        Time limits.

    Attributes
    ----------
    port : str
        As given.
    decoder : Decoder
        With its counters of frames and bad lines.
    lost_frames : int
        Frames of the board that never arrived, by their sequence numbers.

    Raises
    ------
    ParameterError
        If no port can have this name or URL.

    """

    def __init__(self, port: str, baud: int, timeouts: Timeouts) -> None:
        self.port = port
        self.decoder = Decoder()
        self.lost_frames = 0
        self._timeouts = timeouts
        self._expected: int | None = None   # sequence number of the board's next frame
        self._sequence = 0
        self._bytes = 0
        self._writing = threading.Lock()
        scheme = port.lower().partition('://')[0]
        if scheme in SIMULATED:
            # pyserial takes a handler that fails to import for one that is not there, and reads
            # the URL only when the port is opened.
            importlib.import_module(f'{HANDLERS}.protocol_{scheme}')
            from hysteresis_ros.laboratory.board.url import check_url
            check_url(port)
        self._settings = {'baudrate': baud, 'timeout': READ_TIMEOUT,
                          'write_timeout': timeouts.write, 'exclusive': True}
        self._serial: Any = None    # pyserial has no type hints
        try:
            self._make()
        except serial.SerialException:
            pass    # hwgrep:// finds nothing yet; open says so
        except ValueError as error:
            raise ParameterError(f'port {port}: {error}') from None

    def open(self) -> None:
        """
        Open the port.

        Raises
        ------
        BoardError
            If it is not there, taken, or not allowed to us.

        """
        try:
            self._make()
            self._serial.open()
        except (OSError, ValueError) as error:
            number = getattr(error, 'errno', None)
            reason = _HINTS.get(number or 0) or (os.strerror(number) if number else str(error))
            reason = reason.replace(f'Could not open port {self.port}: ', '')
            raise BoardError(f'port {self.port} cannot be opened: {reason}') from None
        self.decoder.begin()
        self._expected = None

    def close(self) -> None:
        """Close the port, whatever state it is in."""
        try:
            if self._serial is not None:
                self._serial.close()
        except OSError:
            pass    # a device that is gone cannot be closed any better

    def greet(self, config: Callable[[Identity], Fields], stopping: threading.Event) -> Identity:
        """
        Find out who is there and tell the board its periods and limits.

        Parameters
        ----------
        config : callable
            Gives the fields of ``config`` for a board.
        stopping : threading.Event
            Ends the greeting early.

        Returns
        -------
        Identity

        Raises
        ------
        BoardError
            If nobody answers, or not in this protocol.

        """
        self._bytes = 0
        self._write(b'\n')
        identity = Identity.from_frame(self._ask(HELLO, {'protocol': VERSION}, stopping))
        if identity.protocol != VERSION:
            raise BoardError(f'port {self.port}: the board speaks version {identity.protocol} of '
                             f'the protocol, this host version {VERSION}: update one of them')
        self._ask(CONFIG, config(identity), stopping)
        return identity

    def send(self, kind: str, fields: Fields | None = None) -> int:
        """
        Send one frame.

        Parameters
        ----------
        kind : str
            Kind of frame.
        fields : Mapping, optional
            Its fields.

        Returns
        -------
        int
            Its sequence number.

        Raises
        ------
        BoardError
            If the port does not take it.

        """
        with self._writing:
            sequence = self._sequence
            self._sequence = (sequence + 1) % SEQUENCE_LIMIT
            self._write(encode(kind, sequence, fields))
        return sequence

    def read(self) -> list[Frame]:
        """
        Wait a moment for frames.

        Returns
        -------
        list of Frame
            What came within `READ_TIMEOUT`, perhaps nothing.

        Raises
        ------
        BoardError
            If the port is gone.

        """
        try:
            data = self._serial.read(min(max(self._serial.in_waiting, 1), LARGEST_READ))
        except LOST as error:
            raise BoardError(f'port {self.port} is lost: {error}') from None
        self._bytes += len(data)
        frames = [line for line in self.decoder.feed(data) if isinstance(line, Frame)]
        for frame in frames:
            if self._expected is not None:
                gap = (frame.sequence - self._expected) % SEQUENCE_LIMIT
                self.lost_frames += gap if gap < LARGEST_GAP else 0
            self._expected = (frame.sequence + 1) % SEQUENCE_LIMIT
        return frames

    def _make(self) -> None:
        if self._serial is None:
            self._serial = serial.serial_for_url(self.port, do_not_open=True, **self._settings)

    def _ask(self, kind: str, fields: Fields | None, stopping: threading.Event) -> Frame:
        asked = set()
        now = time.monotonic()
        give_up = now + self._timeouts.greeting
        ask_again = now
        while now < give_up and not stopping.is_set():
            if now >= ask_again:
                asked.add(str(self.send(kind, fields)))
                ask_again = now + self._timeouts.answer
            for frame in self.read():
                if kind == HELLO and frame.kind == BOARD:
                    return frame
                if frame.kind in (OK, NO) and frame.fields.get('re') in asked:
                    if frame.kind == OK:
                        return frame
                    raise BoardError(f'port {self.port}: the board refuses {kind!r}, it says '
                                     f'{frame.fields.get("reason", "nothing")}')
            now = time.monotonic()
        raise BoardError(self._no_answer(kind))

    def _no_answer(self, kind: str) -> str:
        within = f'within {self._timeouts.greeting:g} s'
        if self.decoder.last_bad is not None and self._bytes:
            return (f'port {self.port}: no answer to {kind!r} {within}, but {self._bytes} bytes '
                    f'came, the latest bad line is "{self.decoder.last_bad.text}": wrong baud '
                    'rate, or another device?')
        if self._bytes:
            return f'port {self.port}: no answer to {kind!r} {within}; is the board listening?'
        return f'port {self.port}: silent, no answer to {kind!r} {within}; is the board on?'

    def _write(self, data: bytes) -> None:
        if self._serial is None:
            raise BoardError(f'port {self.port} is not open')
        try:
            self._serial.write(data)
        except LOST as error:
            raise BoardError(f'port {self.port} takes no bytes: {error}') from None
