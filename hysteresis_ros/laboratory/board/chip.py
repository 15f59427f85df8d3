# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The firmware's machine code in simavr with an arm on it, behind a cable and a pseudo-terminal."""

from __future__ import annotations

import collections
import threading
import time

from hysteresis_ros.laboratory.board.chip_board import ChipBoard
from hysteresis_ros.laboratory.board.port import CableUnplugged
from hysteresis_ros.laboratory.board.serial_cable import SerialCable
from hysteresis_ros.laboratory.board.simavr import Simavr
from hysteresis_ros.laboratory.board.simulated_board import TICK
from hysteresis_ros.laboratory.board.terminal import Terminal
from hysteresis_ros.laboratory.board.url import make_plant, parse_url

PAUSE = 0.002           # s of the wall between two looks at the chip


class Chip:
    """
    A simulated chip, an arm and a cable that live together, until this object is closed.

    Parameters
    ----------
    url : str
        ``avr://bicep?key=value&...``; see `hysteresis_ros.laboratory.board.url`.

    Attributes
    ----------
    cable : SerialCable
        With board and arm at its far end.
    arm : Arm
        Of the virtual laboratory.

    Raises
    ------
    ParameterError
        If the programs are missing or the URL makes no sense.

    """

    def __init__(self, url: str) -> None:
        simulation = parse_url(url)
        arm = make_plant(simulation).arm
        self._chip = Simavr(url, simulation.speed)
        board = ChipBoard(self._chip, arm, simulation)
        self.cable, self.arm = SerialCable(board, simulation), arm
        self._others: collections.deque[bytes] = collections.deque()
        self._changing = threading.Lock()   # of the terminal, which goes with the cable
        self._terminal: Terminal | None = None
        self._plug()
        self._thread = threading.Thread(target=self._live, name='arm of the chip', daemon=True)
        self._thread.start()

    @property
    def terminal(self) -> str:
        """
        Name of the device that its serial port is.

        Raises
        ------
        CableUnplugged
            If there is none, as the cable is unplugged.

        """
        with self._changing:
            if self._terminal is None:
                raise CableUnplugged('the cable is unplugged')
            return self._terminal.name

    def write(self, data: bytes) -> None:
        """Send bytes to the board as another program on the same port would."""
        self._others.append(data)

    def close(self) -> None:
        """Switch the chip off."""
        self._chip.close()
        self._thread.join()

    def _live(self) -> None:
        try:
            while self._chip.runs:
                self._follow()
                time.sleep(PAUSE)
        except OSError:
            pass        # the chip was switched off between two words
        self._unplug()
        self._chip.free()

    def _follow(self) -> None:
        """Let the arm live as long as the chip has, and carry what both sides say."""
        self.cable.write(self._heard())
        state = self._chip.state()
        if 'pwm1' not in state:
            return
        self.cable.board.look(state)
        while self.cable.time + TICK / 1000.0 <= state['ms'] / 1000.0:
            self.cable.tick()
        self.cable.board.turn(state)
        if not self.cable.plugged:
            self._unplug()
            return
        self._plug().write(bytes(self.cable.received))
        self.cable.received.clear()

    def _heard(self) -> bytes:
        data = b'' if self._terminal is None else self._terminal.read()
        while self._others:
            data += self._others.popleft()
        return data

    def _plug(self) -> Terminal:
        with self._changing:
            if self._terminal is None:
                self._terminal = Terminal()
            return self._terminal

    def _unplug(self) -> None:
        with self._changing:
            if self._terminal is not None:
                self._terminal.close()
                self._terminal = None
