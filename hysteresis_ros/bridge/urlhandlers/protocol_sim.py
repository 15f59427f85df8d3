# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The port ``sim://bicep`` of pyserial: a thin coat over the laboratory's simulated port."""

from collections.abc import Iterator
import contextlib
from typing import Any

from serial.serialutil import PortNotOpenError, SerialBase, SerialException, to_bytes

from hysteresis_ros.laboratory.board.port import CableUnplugged, PortClosed, SimulatedPort


@contextlib.contextmanager
def _pyserial_errors() -> Iterator[None]:
    """Turn the errors of the simulated port into those that pyserial's users expect."""
    try:
        yield
    except PortClosed:
        raise PortNotOpenError() from None
    except CableUnplugged as error:
        raise SerialException(str(error)) from None


class Serial(SerialBase):
    """
    The simulated board as a port; made by `serial.serial_for_url`.

    Attributes
    ----------
    simulation : SimulatedPort or None
        What stands behind it, from the first `open` on.

    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.simulation: SimulatedPort | None = None
        self.is_open = False
        super().__init__(*args, **kwargs)

    def open(self) -> None:
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
        if self.simulation is None:
            self.simulation = SimulatedPort(self.port)
        with _pyserial_errors():
            self.simulation.open()
        self.is_open = True

    def close(self) -> None:
        """Close the port. The arm goes on living; the board's watchdog looks after it."""
        if self.simulation is not None:
            self.simulation.close()
        self.is_open = False

    def read(self, size: int = 1) -> bytes:
        """
        Read up to `size` bytes, waiting for them no longer than ``timeout``.

        Raises
        ------
        SerialException
            If the port is closed or the simulated cable is pulled.

        """
        with self._opened() as port:
            return port.read(size, self._timeout)

    def write(self, data: bytes | bytearray | memoryview) -> int:
        """
        Write bytes to the board, which gets them at once.

        Raises
        ------
        SerialException
            If the port is closed or the simulated cable is pulled.

        """
        content = bytes(to_bytes(data))
        with self._opened() as port:
            port.write(content)
        return len(content)

    def cancel_read(self) -> None:
        """Let a waiting `read` return with what it has."""
        with self._opened() as port:
            port.cancel_read()

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        with self._opened() as port:
            return port.in_waiting

    @property
    def out_waiting(self) -> int:
        """Number of bytes still to be sent: none, ever."""
        return 0

    def flush(self) -> None:
        """Wait until everything is sent: it is."""

    def reset_input_buffer(self) -> None:
        """Throw away what has not been read."""
        with self._opened() as port:
            port.discard_input()

    def reset_output_buffer(self) -> None:
        """Throw away what has not been sent: nothing."""

    @contextlib.contextmanager
    def _opened(self) -> Iterator[SimulatedPort]:
        if self.simulation is None:
            raise PortNotOpenError()
        with _pyserial_errors():
            yield self.simulation

    def _reconfigure_port(self) -> None:
        """Take new settings: baud rate and the like mean nothing here."""

    def _update_break_state(self) -> None:
        """Set the break condition: means nothing here."""

    def _update_rts_state(self) -> None:
        """Set a line: means nothing here."""

    def _update_dtr_state(self) -> None:
        """Set a line: means nothing here."""
