# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The cable between host and simulated board: it loses bytes, invents some, and can be pulled."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK

if TYPE_CHECKING:
    from hysteresis_ros.laboratory.board.url import Simulation


class Cable:
    """
    The way between host and board, with its faults.

    Parameters
    ----------
    board : SimulatedBoard
        At the far end.
    simulation : Simulation
        Which faults, and when.

    """

    def __init__(self, board: SimulatedBoard, simulation: Simulation) -> None:
        self.board = board
        self.received = bytearray()     # what the host can read
        self._simulation = simulation
        self._ticks = 0
        self._plugged = True
        self._to_board = random.Random(f'to board {simulation.seed}')
        self._to_host = random.Random(f'to host {simulation.seed}')

    @property
    def time(self) -> float:
        """Time in s since the arm began to live."""
        return self._ticks * TICK / 1000.0

    @property
    def plugged(self) -> bool:
        """Whether the cable is in."""
        return self._plugged

    def write(self, data: bytes) -> None:
        """Take bytes from the host."""
        if not self._plugged:
            return
        if not self._lasts('deaf'):
            self.board.receive(self._drop(data, self._to_board))
        self._fetch()

    def tick(self) -> None:
        """Let `TICK` ms pass."""
        plugged = not self._lasts('unplug')
        if plugged and not self._plugged:
            self.board.start()
        if self._plugged and not plugged:
            self.received.clear()
        self._plugged = plugged
        if plugged:
            self.board.advance()
        else:
            self.board.idle(1)
        self._ticks += 1
        self._fetch()

    def _lasts(self, fault: str) -> bool:
        begin = getattr(self._simulation, f'{fault}_after')
        return 0.0 <= self.time - begin < getattr(self._simulation, f'{fault}_for')

    def _fetch(self) -> None:
        data = self.board.transmit()
        if not data or not self._plugged or self._lasts('silent'):
            return
        if self._to_host.random() < self._simulation.garbage:
            self.received += self._to_host.randbytes(self._to_host.randint(1, 40))
        self.received += self._drop(data, self._to_host)

    def _drop(self, data: bytes, rng: random.Random) -> bytes:
        if not self._simulation.drop:
            return data
        return bytes(byte for byte in data if rng.random() >= self._simulation.drop)
