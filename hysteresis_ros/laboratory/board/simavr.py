# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The firmware's machine code in simavr, as a process: bytes, commands, and what its pins do.

The chip is another program, ``simavr_board``, which is built from the checkout's ``test`` folder
(`make -C firmware machine`) and found in the folder that ``HYSTERESIS_ROS_AVR`` names. Its serial
port is a pseudo-terminal; commands and their answers go over its standard input and output.
"""

from __future__ import annotations

import os
from pathlib import Path
import re
import subprocess

from hysteresis_ros.errors import ParameterError

FOLDER = 'HYSTERESIS_ROS_AVR'
PROGRAM, FIRMWARE = 'simavr_board', 'firmware.elf'


class Simavr:
    """
    A simulated chip that runs by the wall's clock, as long as this object is not closed.

    Parameters
    ----------
    url : str
        Who asks for it, for messages.
    speed : float
        Of its clock against the wall's.

    Raises
    ------
    ParameterError
        If the programs are missing.
    """

    def __init__(self, url: str, speed: float) -> None:
        folder = Path(os.environ.get(FOLDER, ''))
        programs = [folder / PROGRAM, folder / FIRMWARE]
        if not os.environ.get(FOLDER) or not all(path.exists() for path in programs):
            raise ParameterError(
                f'port {url}: {FOLDER} has to name the folder with {PROGRAM} and {FIRMWARE}; '
                "`make demo DEMO_ARGS='--port avr://'` sees to that in a checkout")
        self._process = subprocess.Popen(
            [*map(str, programs), f'{speed:g}'], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self._process.stdin is not None and self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        # simavr talks about what it loads first.
        name = next((line.split()[1] for line in self._out if line.startswith('port ')), '')
        if not name:
            raise ParameterError(f'port {url}: {PROGRAM} did not start; build it anew, '
                                 '`make -C firmware clean machine`')
        self._terminal = os.open(name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    @property
    def runs(self) -> bool:
        """Whether the program runs."""
        return self._process.poll() is None

    def tell(self, command: str) -> str:
        """Give a command and return the answer, one line."""
        self._in.write(command + '\n')
        return self._out.readline()

    def state(self) -> dict[str, float]:
        """Return what ``simavr_board.c`` says of the chip; nothing while it ends."""
        return {key: float(value) for key, value in
                re.findall(r'(\w+)=(-?[0-9.]+)', self.tell('state'))}

    def read(self) -> bytes:
        """Return the bytes that the chip has sent since the last call."""
        try:
            return os.read(self._terminal, 4096)
        except BlockingIOError:
            return b''

    def write(self, data: bytes) -> None:
        """Send bytes to the chip; what its port does not take is lost, as on a line."""
        try:
            os.write(self._terminal, data)
        except BlockingIOError:
            pass

    def close(self) -> None:
        """Switch the chip off."""
        self._process.kill()
        self._process.wait()

    def free(self) -> None:
        """Close what is left of it, once nobody uses it any more."""
        os.close(self._terminal)
        self._in.close()
        self._out.close()
