# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A simulated arm that is disturbed at random, and watched for heat for which nobody asked."""

from collections.abc import Callable
import math
from pathlib import Path
import random

from hysteresis_ros.laboratory.board.serial_cable import SerialCable
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK

TROUBLES = ('unplug', 'silent', 'deaf', 'late', 'mad', 'frozen', 'supply_low', 'supply_off',
            'supply_double', 'encoder_still')
GAP, DURATION = (20.0, 60.0), (1.0, 60.0)           # s of the arm, between faults and of one
FIRST = 10.0                # s of the arm from its first heat to the first of them
# Bytes that are spoiled in both directions, all the time.
CABLE = 'drop=0.0005&flip=0.0005&double=0.0005&garbage=0.01'


class WatchedArm:
    """
    A cable with a simulated board, in which faults come, and whose every tick is looked at.

    Parameters
    ----------
    cable : SerialCable
        Of a simulated port.
    watchdog : float
        Time in s of the arm for which it may be heated without a setpoint.
    rng : random.Random
        For the faults.

    Attributes
    ----------
    faults, missed : int
        How many faults have begun, and how many ticks of the arm were heated without a setpoint for
        longer than the watchdog.
    """

    def __init__(self, cable: SerialCable[SimulatedBoard], watchdog: float, rng: random.Random
                 ) -> None:
        self.faults = self.missed = 0
        self._cable = cable
        self._rng = rng
        self._next_fault = math.inf
        self._heated = 0        # ticks
        self._heard = 0.0       # when a setpoint last reached the board [s of the arm]
        self._longest = watchdog + 2.0 * TICK / 1000.0
        self._watch(cable.board)

    @property
    def time(self) -> float:
        """Time of the arm [s]."""
        return self._cable.time

    @property
    def heated(self) -> float:
        """Share of the time in which it was heated."""
        return self._heated * TICK / 1000.0 / max(self.time, TICK / 1000.0)

    def disturb(self) -> None:
        """Begin a fault if one is due."""
        if self.time > self._next_fault:
            trouble, duration = self._rng.choice(TROUBLES), self._rng.uniform(*DURATION)
            self._cable._simulation.troubles[trouble] = self.time, duration
            self.faults += 1
            self._next_fault = self.time + duration + self._rng.uniform(*GAP)

    def _watch(self, board: SimulatedBoard) -> None:
        receive: Callable[[bytes], None] = board.receive
        advance: Callable[[float, float], None] = board.arm.advance

        def hear(data: bytes) -> None:
            if b'set ' in data:
                self._heard = self.time
            receive(data)

        def live(dt: float, voltage: float) -> None:
            # Not by the duty, which a board without power keeps.
            if voltage > 0.0 and not self._heated:
                self._next_fault = self.time + FIRST
            self._heated += voltage > 0.0
            self.missed += voltage > 0.0 and self.time - self._heard > self._longest
            advance(dt, voltage)

        board.receive, board.arm.advance = hear, live   # type: ignore[method-assign]


def memory(process: int | str = 'self') -> int:
    """Return how much memory a process has, in bytes."""
    pages = int(Path(f'/proc/{process}/statm').read_text(encoding='ascii').split()[1])
    return pages * 4096
