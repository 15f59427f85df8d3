# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The wires of the arm: side by side on one clamp, with what time and use do to them."""

import math
from collections.abc import Callable

from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.heat import ROOM

# A setpoint that changes by less than this [V] within one dt is held.
HELD = 6e-3
# Time constant with which the creep of earlier setpoints fades: later ones overtake its grains [s].
FADING = 1.0


class ParallelWires:
    """
    Parallel wires; those that are alike are computed once.

    Parameters
    ----------
    conditions : Conditions
        Of the arm.

    Attributes
    ----------
    wires : list of Wire
        One, standing for all, or each of them.
    cycles : float
        Full transformations there and back since the muscle was new.
    """

    def __init__(self, conditions: Conditions) -> None:
        self._conditions = conditions
        self.wires = [conditions.material.wire() for _ in conditions.wire_offsets]
        self.count = conditions.linkage.muscle_count
        self.cycles = 0.0
        self._largest = 0.0
        for wire in self.wires:
            wire.compliance = conditions.compliance
            wire.expansion = conditions.expansion
        self.heat_and_cool()

    def heat_and_cool(self, temperature: float = ROOM, tension: float | None = None) -> None:
        """
        Wipe the memory by a full heat and cool cycle; what use has done stays.

        Parameters
        ----------
        temperature : float
            Temperature at the end [degC].
        tension : float or None
            Tension of each wire meanwhile [N]; the pretension by default.
        """
        for wire in self.wires:
            wire.heat_and_cool(temperature, tension)
        self._begin()

    def cool_down(self, temperatures: list, balance: Callable[[float], None]) -> None:
        """
        Let the wires cool in balance with their load; not counted as use.

        Parameters
        ----------
        temperatures : list of float
            From hot to cold [degC].
        balance : callable
            Brings the wires to rest at a temperature.
        """
        cycles, largest = self.cycles, self._largest
        for temperature in temperatures:
            balance(temperature)
        self.cycles, self._largest = cycles, largest
        self._begin()

    def _begin(self) -> None:
        self._share = self.martensite
        self._run_share = self._share
        self._voltage = 0.0
        self._direction = 0.0
        self._since = 0.0
        self._creep = self._left_creep = 0.0
        self._extra = 0.0
        self._set_excess()

    @property
    def martensite(self) -> float:
        """Mean share of martensite."""
        return sum(wire.martensite for wire in self.wires) / len(self.wires)

    def share(self, tensions: list, temperature: float) -> float:
        """Return the mean share of martensite at tensions [N] and a temperature [degC]."""
        return sum(wire.peek_martensite(temperature, tension)
                   for wire, tension in zip(self.wires, tensions)) / len(self.wires)

    def commit(self, temperature: float, tensions: list) -> None:
        """Bring the wires to a temperature [degC] and tensions [N], and count the travel."""
        for wire, tension in zip(self.wires, tensions):
            wire.commit(temperature, tension)
        self._largest = max(self._largest, *tensions)
        share = self.martensite
        self.cycles += 0.5 * abs(share - self._share)
        self._share = share

    def age(self, voltage: float, dt: float, extra: float = 0.0) -> None:
        """
        Let time and use act on the wires' length.

        Parameters
        ----------
        voltage : float
            Setpoint [V]: creep counts from when it last moved.
        dt : float
            Time that passes [s].
        extra : float
            Length that something else has added to each wire [m].
        """
        conditions = self._conditions
        if conditions.creep > 0.0:
            self._creep_on(voltage, dt)
        if conditions.tiring != 0.0:
            for wire in self.wires:
                retained = conditions.tiring * math.log1p(self.cycles)
                wire.retained = min(max(retained, -0.8), 0.8)
        self._extra = extra
        self._set_excess()

    def _creep_on(self, voltage: float, dt: float) -> None:
        change = voltage - self._voltage
        self._left_creep *= math.exp(-dt / FADING)
        if abs(change) > HELD:
            direction = math.copysign(1.0, change)
            if self._since > 0.0 or direction != self._direction:
                # A ramp is one run; a hold or a reversal ends it.
                self._left_creep += self._creep
                self._run_share = self._share
            self._direction = direction
            self._since = 0.0
        else:
            self._since += dt
        self._voltage = voltage
        self._creep = self._conditions.creep * self._conditions.material.resting_length * (
            self._share - self._run_share) * math.log1p(self._since / self._conditions.creep_time)

    def _set_excess(self) -> None:
        conditions = self._conditions
        common = conditions.dead_length + self._creep + self._left_creep + self._extra
        common -= (conditions.shrinkage * conditions.material.resting_length
                   * math.log1p(self.cycles))
        common += conditions.yield_compliance * max(
            self._largest - conditions.yield_tension, 0.0)
        for wire, offset in zip(self.wires, conditions.wire_offsets):
            wire.excess = common + offset
