# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The cable between host and simulated board: it spoils bytes, is late, and can be pulled."""

from __future__ import annotations

import collections
from collections.abc import Callable
import random
from typing import Generic, Protocol, TYPE_CHECKING, TypeVar

from hysteresis_ros.laboratory.board.simulated_board import TICK

LATE = 0.5      # s by which bytes are late, where that is asked for
FLOOD = 20      # random bytes in each tick of a flood, twice what the line can carry

if TYPE_CHECKING:
    from hysteresis_ros.laboratory.board.url import Simulation


class CabledBoard(Protocol):
    """
    What a cable needs of the board at its far end.

    Attributes
    ----------
    troubled : callable
        Whether a trouble is there now, by its name; the cable sets it.

    """

    troubled: Callable[[str], bool]

    def receive(self, data: bytes) -> None:
        """Take bytes from the host."""

    def transmit(self) -> bytes:
        """Give the bytes that go to the host."""

    def advance(self, ticks: int = 1) -> None:
        """Let so many `TICK` ms pass."""

    def idle(self, ticks: int) -> None:
        """Let them pass while the cable is pulled."""

    def start(self) -> None:
        """Start anew, as the cable is put back."""


Board = TypeVar('Board', bound=CabledBoard)


class SerialCable(Generic[Board]):
    """
    The way between host and board, with its faults.

    Parameters
    ----------
    board : CabledBoard
        At the far end.
    simulation : Simulation
        Which faults, and when.

    """

    def __init__(self, board: Board, simulation: Simulation) -> None:
        self.board = board
        self.received = bytearray()     # what the host can read
        self._simulation = simulation
        self._ticks = 0
        self._plugged = True
        self._to_board = random.Random(f'to board {simulation.seed}')
        self._to_host = random.Random(f'to host {simulation.seed}')
        # What is on its way: (time in s at which it arrives, bytes).
        self._inward: collections.deque[tuple[float, bytes]] = collections.deque()
        self._outward: collections.deque[tuple[float, bytes]] = collections.deque()
        board.troubled = self._lasts

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
        if not self._lasts('deaf') and not self._lasts('mad'):
            self._inward.append((self._arrival(), self._spoil(data, self._to_board)))
        self._deliver()
        self._fetch()

    def tick(self) -> None:
        """Let `TICK` ms pass."""
        plugged = not self._lasts('unplug')
        if plugged and not self._plugged:
            self.board.start()
        if self._plugged and not plugged:
            self.received.clear()
            self._inward.clear()
            self._outward.clear()
        self._plugged = plugged
        if plugged:
            if self._lasts('mad'):
                self.board.receive(self._to_board.randbytes(FLOOD))
            self._deliver()
            self.board.advance()
        else:
            self.board.idle(1)
        self._ticks += 1
        self._fetch()

    def _lasts(self, trouble: str) -> bool:
        return self._simulation.lasts(trouble, self.time)

    def _arrival(self) -> float:
        """Return when bytes arrive that are sent now."""
        return self.time + (LATE if self._lasts('late') else 0.0)

    def _deliver(self) -> None:
        while self._inward and self._inward[0][0] <= self.time:
            self.board.receive(self._inward.popleft()[1])

    def _fetch(self) -> None:
        data = self.board.transmit()
        if self._plugged and self._lasts('mad'):
            data = self._to_host.randbytes(FLOOD)
        if data and self._plugged and not self._lasts('silent'):
            if self._to_host.random() < self._simulation.garbage:
                data = self._to_host.randbytes(self._to_host.randint(1, 40)) + data
            self._outward.append((self._arrival(), self._spoil(data, self._to_host)))
        while self._outward and self._outward[0][0] <= self.time:
            self.received += self._outward.popleft()[1]

    def _spoil(self, data: bytes, rng: random.Random) -> bytes:
        """Return bytes as they arrive: some are lost, some have a bit wrong, some come twice."""
        simulation = self._simulation
        if simulation.drop:
            data = bytes(byte for byte in data if rng.random() >= simulation.drop)
        if simulation.flip:
            data = bytes(byte ^ 1 << rng.randrange(8) if rng.random() < simulation.flip else byte
                         for byte in data)
        if simulation.double:
            data = b''.join(bytes([byte]) * (1 + (rng.random() < simulation.double))
                            for byte in data)
        return data
