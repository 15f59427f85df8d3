# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The firmware's machine code in simavr, with an arm of the virtual laboratory on its pins.

The chip is another program, ``simavr_board``, which is built from the checkout's ``test`` folder
(`make -C firmware machine`) and found in the folder that ``HYSTERESIS_ROS_AVR`` names. It reads
commands and answers them; its serial port is a pseudo-terminal. What its gates get heats the arm,
and its encoder pins are turned as the arm turns.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
import re
import subprocess
import threading
import time

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.board.url import make_plant, parse_url

FOLDER = 'HYSTERESIS_ROS_AVR'
PROGRAM, FIRMWARE = 'simavr_board', 'firmware.elf'
TICK = 0.02             # s; dt of the arm
PWM_STEPS = 1020        # of the firmware
SUPPLY = 12.0           # V, that of simavr_board
PAUSE = 0.004           # s of the wall between two looks at the chip
SLOWEST_EDGES = 2000.0  # edges a second with which the encoder is turned, at least


class Chip:
    """
    A simulated chip and an arm that live together, as long as this object.

    Parameters
    ----------
    url : str
        ``avr://bicep?key=value&...``; see `hysteresis_ros.laboratory.board.url`.

    Attributes
    ----------
    arm : Arm
        Of the virtual laboratory.
    terminal : str
        Name of the device that its serial port is.

    Raises
    ------
    ParameterError
        If the programs are missing or the URL makes no sense.

    """

    def __init__(self, url: str) -> None:
        simulation = parse_url(url)
        folder = Path(os.environ.get(FOLDER, ''))
        programs = [folder / PROGRAM, folder / FIRMWARE]
        if not os.environ.get(FOLDER) or not all(path.exists() for path in programs):
            raise ParameterError(
                f'port {url}: {FOLDER} has to name the folder with {PROGRAM} and {FIRMWARE}; '
                "`make demo DEMO_ARGS='--port avr://'` sees to that in a checkout")
        self.arm = make_plant(simulation).arm
        self._start = self.arm.encoder_counts
        self._process = subprocess.Popen(
            [*map(str, programs), f'{simulation.speed:g}'], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self._process.stdin is not None and self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        # simavr talks about what it loads first.
        self.terminal = next((line.split()[1] for line in self._out if line.startswith('port ')),
                             'a simulated chip that did not start')
        self._lived = 0.0       # s of the arm
        self._thread = threading.Thread(target=self._live, name='arm of the chip', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Switch the chip off."""
        self._process.kill()
        self._process.wait()
        self._thread.join()

    def _tell(self, command: str) -> str:
        self._in.write(command + '\n')
        return self._out.readline()

    def _live(self) -> None:
        try:
            while self._process.poll() is None:
                self._follow()
                time.sleep(PAUSE)
        except OSError:
            pass        # the chip was switched off between two words

    def _follow(self) -> None:
        """Let the arm live as long as the chip has, and turn the encoder to where it is then."""
        state = {key: float(value) for key, value in
                 re.findall(r'(\w+)=(-?[0-9.]+)', self._tell('state'))}
        if 'pwm1' not in state or state['ms'] / 1000.0 < self._lived + TICK:
            return
        voltage = SUPPLY * math.sqrt(state['connected'] * state['pwm1'] / PWM_STEPS)
        while self._lived + TICK <= state['ms'] / 1000.0:
            self.arm.advance(TICK, voltage)
            self._lived += TICK
        edges = self.arm.encoder_counts - self._start - int(state['counts'])
        if edges:
            self._tell(f'turn {edges} {max(abs(edges) / TICK, SLOWEST_EDGES):.0f}')
