# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The bench of Fig. 6: one wire in its fan, held at its resting length or under a dead weight.

Voltages are held for 30 s, so that Eq. 1 has come to rest within a quarter of a percent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.laboratory import sensors
from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.parallel_wires import ParallelWires
from hysteresis_ros.laboratory.solve import RootFinder
from hysteresis_ros.laboratory.wire import (
    LARGEST_TENSION, LENGTH_TOLERANCE, steps_between, TYPICAL_COMPLIANCE)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# Stiffness of load cell, capstan and servo motor [N/m].
BENCH_STIFFNESS = 5e3
HOLD = 30.0
# dt [s] where something changes during a hold.
CREEPING_DT = 1.0


class Bench:
    """
    One wire on the bench; a new trial begins with a full heat and cool cycle.

    Parameters
    ----------
    conditions : Conditions
        Of which the wire's own, its air and its heat balance count.
    seed : int or sequence of int
        Of the sensors' noise and the air's fluctuations.

    Attributes
    ----------
    time : float
        Since the first trial began [s]; trials follow each other.
    """

    def __init__(self, conditions: Conditions, seed: int | Sequence[int] = 0) -> None:
        self.conditions, self.time = conditions, 0.0
        self._muscle = ParallelWires(conditions)
        self._rng = np.random.default_rng(seed)

    def force_trial(self, voltages: ArrayLike, hold: float = HOLD) -> np.ndarray:
        """
        Measure the force of the wire held at its resting length (Fig. 3a).

        Parameters
        ----------
        voltages : array_like, shape (n,)
            Each held for `hold` [V].
        hold : float
            Time [s].

        Returns
        -------
        ndarray, shape (n,)
            Readings of the load cell at the end of each step [N].
        """
        wire, pretension = self._muscle.wires[0], self.conditions.material.pretension
        find = RootFinder(TYPICAL_COMPLIANCE, LENGTH_TOLERANCE)

        def clamped(temperature: float, before: float) -> float:
            # The wire is clamped at the resting length under its pretension; the bench gives.
            return find(
                lambda force: wire.elongation(temperature, force)
                + (force - pretension) / BENCH_STIFFNESS,
                before, 0.0, LARGEST_TENSION)
        return np.array([sensors.load_cell(force, self._rng)
                         for force in self._hold(voltages, hold, clamped, pretension)])

    def length_trial(self, voltages: ArrayLike, load: float, hold: float = HOLD) -> np.ndarray:
        """
        Measure the elongation of the wire under a dead weight (Fig. 3b).

        Parameters
        ----------
        voltages : array_like, shape (n,)
            Each held for `hold` [V].
        load : float
            Weight of what hangs on the wire [N].
        hold : float
            Time [s].

        Returns
        -------
        ndarray, shape (n,)
            Readings of the position sensor at the end of each step [m].
        """
        wire, lengths = self._muscle.wires[0], []
        for _ in self._hold(voltages, hold, lambda temperature, before: load, load):
            lengths.append(wire.elongation(self._temperature, load))
        return np.array([sensors.position_sensor(length, self._rng) for length in lengths])

    def _hold(self, voltages: ArrayLike, hold: float, equilibrium: Callable[[float, float], float],
              tension: float) -> Iterator[float]:
        """Heat and cool, then hold each voltage and yield the tension at its end."""
        conditions, heat, muscle = self.conditions, self.conditions.heat, self._muscle
        temperature = conditions.air.at_wires(self.time)
        muscle.heat_and_cool(temperature, tension)
        muscle.commit(temperature, [tension])
        count = math.ceil(hold / CREEPING_DT) if conditions.creep > 0.0 else 1
        for voltage in np.asarray(voltages, dtype=float).tolist():
            fluctuation = conditions.air.turbulence * self._rng.standard_normal()
            for _ in range(count):
                self.time += hold / count
                balance = heat.balance(voltage * voltage, conditions.air.at_wires(self.time))
                before = temperature
                temperature = heat.advance(before, balance + fluctuation, hold / count)
                muscle.age(voltage, hold / count)
                for one in steps_between(before, temperature, conditions.material.temperature_step):
                    tension = equilibrium(one, tension)
                    muscle.commit(one, [tension])
            self._temperature = temperature
            yield tension
