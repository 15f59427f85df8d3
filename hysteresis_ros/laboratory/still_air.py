# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A wire in still air: natural convection ~ excess^(5/4), and radiation ~ T^4.

The wires' transformation temperatures are given on the scale of the bench's balance, on which the
heating is in proportion to the excess over the room. Still air does not change that balance, which
the bench has shown in the same air, but how fast the wire comes there::

    tau dy/dt = b - loss(y),      x = loss(y)

with y the excess as a thermometer would show it, x that on the bench's scale, and b the balance of
x. At full heat both scales agree.
"""

import dataclasses
import math

from hysteresis_ros.laboratory.solve import RootFinder

# Excess at full heat, and the room's temperature, as absolute temperature [K].
FULL_EXCESS, ROOM_KELVIN = 97.0, 295.0
# Share of radiation in what is lost at full heat, of an oxidised wire of half a millimetre.
RADIATED = 0.2
# Longest dt over the time constant, and tolerance of an excess [K].
LONGEST_SHARE, TOLERANCE = 0.1, 1e-8


@dataclasses.dataclass(frozen=True)
class StillAir:
    """
    How a wire in still air loses its heat.

    Parameters
    ----------
    share : float
        Share of still air, 0 to 1; the rest is the constant heat transfer of a fan.
    """

    share: float = 1.0

    def loss(self, excess: float) -> float:
        """Return the excess [K] on the bench's scale for one as a thermometer shows it [K]."""
        convected = math.copysign(
            FULL_EXCESS * abs(excess / FULL_EXCESS) ** 1.25, excess)
        full = (ROOM_KELVIN + FULL_EXCESS) ** 4 - ROOM_KELVIN ** 4
        radiated = FULL_EXCESS * ((ROOM_KELVIN + excess) ** 4 - ROOM_KELVIN ** 4) / full
        still = (1.0 - RADIATED) * convected + RADIATED * radiated
        return (1.0 - self.share) * excess + self.share * still

    def excess(self, lost: float) -> float:
        """Return the argument of `loss` for its value [K]."""
        return RootFinder(1.0, TOLERANCE)(
            lambda excess: self.loss(excess) - lost, lost, -100.0, 400.0)

    def change(self, excess: float, balance: float, rate: float, dt: float) -> float:
        """
        Return by how much the excess on the bench's scale changes [K].

        Parameters
        ----------
        excess, balance : float
            Excess now, and that of the balance, both on the bench's scale [K].
        rate : float
            One over the time constant at full heat in the bench's air [1/s].
        dt : float
            Time [s].
        """
        count = max(1, math.ceil(rate * dt / LONGEST_SHARE))
        part = rate * dt / count

        def slope(y: float) -> float:
            return part * (balance - self.loss(y))
        y = self.excess(excess)
        for _ in range(count):
            first = slope(y)
            second = slope(y + 0.5 * first)
            third = slope(y + 0.5 * second)
            y += (first + 2.0 * second + 2.0 * third + slope(y + third)) / 6.0
        return self.loss(y) - excess
