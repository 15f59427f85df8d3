# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A board whose chip runs the firmware's machine code, with an arm on it and troubles on its pins.

What its gates get heats the arm, and its encoder pins are turned as the arm turns.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import TYPE_CHECKING

from hysteresis_ros.laboratory.board.encoder_troubles import EncoderTroubles, INDEX_COUNTS
from hysteresis_ros.laboratory.board.simulated_board import (
    BROWNOUT_SUPPLY, BROWNOUT_TIME, CLOCK_JUMP, SUPPLY_TROUBLES, TICK)

if TYPE_CHECKING:
    from hysteresis_ros.laboratory.arm import Arm
    from hysteresis_ros.laboratory.board.simavr import Simavr
    from hysteresis_ros.laboratory.board.url import Simulation

PWM_STEPS = 1020        # of the firmware
SUPPLY = 12.0           # V, that of simavr_board
SLOWEST_EDGES = 2000.0  # edges a second with which the encoder is turned, at least
FASTEST_EDGES = 100e3   # likewise, at most; the firmware counts as many


class ChipBoard:
    """
    Chip, output stage, encoder and arm, in the time of the chip.

    Parameters
    ----------
    chip : Simavr
        It runs.
    arm : Arm
        Of the virtual laboratory.
    simulation : Simulation
        Which troubles, and when.

    Attributes
    ----------
    arm : Arm
        As given.
    troubled : callable
        Whether a trouble is there now, by its name.
    duty : float
        That the gates get, 0 to 1.

    """

    def __init__(self, chip: Simavr, arm: Arm, simulation: Simulation) -> None:
        self.arm = arm
        self.troubled: Callable[[str], bool] = lambda name: False
        self.duty = 0.0
        self._chip = chip
        self._start = arm.encoder_counts    # where the counter is 0
        self._encoder = EncoderTroubles(simulation.encoder_jump)
        self._time = 0                      # ms that the arm has lived
        self._brownout = 1000.0 * simulation.brownout
        self._clock_back = 1000.0 * simulation.clock_back
        self._said: dict[str, str] = {}     # command that was given last, by its first word
        self._line = b''                    # that the chip has not yet ended
        self._telemetry = b''               # the latest that was no copy

    @property
    def supply(self) -> float:
        """Supply voltage in V now."""
        share = BROWNOUT_SUPPLY if self._begun(self._brownout, BROWNOUT_TIME) else 1.0
        for trouble, its_share in SUPPLY_TROUBLES.items():
            share *= its_share if self.troubled(trouble) else 1.0
        return SUPPLY * share * self.arm.conditions.supply.share(self.arm.time)

    def receive(self, data: bytes) -> None:
        """Take bytes from the host."""
        self._chip.write(data)

    def transmit(self) -> bytes:
        """Give the lines that go to the host; the latest telemetry in their place if frozen."""
        *lines, self._line = (self._line + self._chip.read()).split(b'\n')
        frozen = self.troubled('frozen')
        for number, line in enumerate(lines):
            if line.startswith(b'tele '):
                if frozen and self._telemetry:
                    lines[number] = self._telemetry
                else:
                    self._telemetry = line
        return b''.join(line + b'\n' for line in lines)

    def start(self) -> None:
        """Start the chip anew, as opening the port of an Arduino does."""
        self._chip.tell('reset')

    def look(self, state: dict[str, float]) -> None:
        """Take note of what the gates get, by what the chip says of itself."""
        self.duty = state['connected'] * state['pwm1'] / PWM_STEPS

    def advance(self, ticks: int = 1) -> None:
        """Let the arm live for so many `TICK` ms."""
        for _ in range(ticks):
            duty = 1.0 if self.troubled('mosfet_stuck') else self.duty
            self.arm.advance(TICK / 1000.0, self.supply * math.sqrt(duty))
            self._time += TICK
            if self._begun(self._clock_back, TICK):
                self._chip.tell(f'clock {-CLOCK_JUMP}')
            if any(self._begun(self._brownout + after, TICK) for after in (0, BROWNOUT_TIME)):
                self.start()        # the chip's own brown-out detector, and the power that is back
        self._say('supply', f'{1000.0 * self.supply:.0f}')
        self._say('stop', str(int(self.troubled('stop'))))
        self._say('index', 'off' if self.troubled('index_missing')
                  else str(INDEX_COUNTS - self._start))

    def idle(self, ticks: int) -> None:
        """Let it live while the cable is pulled: the board has a supply of its own."""
        self.advance(ticks)

    def turn(self, state: dict[str, float]) -> None:
        """Turn the encoder to where the arm is now."""
        counts = self._encoder.counts(self.arm.encoder_counts, self._time / 1000.0, self.troubled)
        edges = counts - self._start - int(state['counts'])
        if edges:
            rate = min(max(1000.0 * abs(edges) / TICK, SLOWEST_EDGES), FASTEST_EDGES)
            self._chip.tell(f'turn {edges} {rate:.0f}')

    def _begun(self, since: float, duration: float) -> bool:
        return 0.0 <= self._time - since < duration

    def _say(self, command: str, value: str) -> None:
        """Give a command unless the chip was told the same before."""
        if self._said.get(command) != value:
            self._said[command] = value
            self._chip.tell(f'{command} {value}')
