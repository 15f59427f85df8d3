# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A pseudo-terminal with a board behind it, for hosts that open a device."""

from __future__ import annotations

import os
import threading
import tty

from hysteresis_ros.laboratory.board.port import CableUnplugged, SimulatedPort

PAUSE = 0.01            # s of the wall for which one look at the board waits
LARGEST_READ = 4096


class Terminal:
    """
    A pseudo-terminal that nobody has to wait for; hosts may come and go.

    Attributes
    ----------
    name : str
        Of the device that a host opens.

    """

    def __init__(self) -> None:
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        os.set_blocking(self._far, False)
        self.name = os.ttyname(self._near)

    def read(self) -> bytes:
        """Return what the host has written since the last call."""
        try:
            return os.read(self._far, LARGEST_READ)
        except BlockingIOError:
            return b''

    def write(self, data: bytes) -> None:
        """Give bytes to the host; what nobody reads is lost, as on a line."""
        try:
            os.write(self._far, data)
        except BlockingIOError:
            pass

    def close(self) -> None:
        """Close it: a host that uses it finds it gone."""
        os.close(self._far)
        os.close(self._near)


class PortOnTerminal:
    """
    A simulated board behind a pseudo-terminal, until this object is closed.

    Parameters
    ----------
    port : SimulatedPort
        It is opened.

    Attributes
    ----------
    name : str
        Of the device that a host opens.

    """

    def __init__(self, port: SimulatedPort) -> None:
        self._port = port
        self._terminal = Terminal()
        self.name = self._terminal.name
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        port.open()
        self._thread.start()

    def close(self) -> None:
        """Close terminal and port."""
        self._ended.set()
        self._thread.join()
        self._port.close()
        self._terminal.close()

    def __enter__(self) -> PortOnTerminal:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _serve(self) -> None:
        while not self._ended.is_set():
            try:
                said = self._terminal.read()
                if said:
                    self._port.write(said)
                self._terminal.write(self._port.read(LARGEST_READ, PAUSE))
            except CableUnplugged:
                self._ended.wait(PAUSE)     # whoever listens hears nothing
