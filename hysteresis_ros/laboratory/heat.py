# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Eq. 1 of the paper, ``dT/dt = -d1 (T - T0) + d2 V^2``, for wires in the air of a fan.

At rest T = T0 + (d2/d1) V^2. The gain d2/d1 is such that 6 V bring the wire to about 119 degC.
"""

import dataclasses
import math
from collections.abc import Callable

from hysteresis_ros.laboratory.solve import RootFinder
from hysteresis_ros.laboratory.still_air import StillAir

# d2 / d1 with the bench's fan [K/V^2], and the room's temperature [degC].
GAIN = 2.7
ROOM = 22.0
# Specific heat of the wire [J/(kg K)].
SPECIFIC_HEAT = 500.0
# Heat counts as shared out when the residual is below this, over the specific heat [K].
HEAT_TOLERANCE = 1e-4


@dataclasses.dataclass
class HeatBalance:
    """
    What warms and cools the wire.

    Parameters
    ----------
    time_constant : float
        1 / d1 with the bench's fan [s].
    gain : float
        d2 / d1 with the bench's fan [K/V^2].
    airflow : float
        Heat transfer over that of the bench: gain and time constant are divided by it.
    heating_ratio : float
        d1 while heating over d1 while cooling, for the way to the balance, not for the balance.
    latent : float
        Heat that the whole transformation takes up, over the specific heat [K].
    air : StillAir or None
        Loses the heat, where the heat transfer depends on the temperature.
    """

    time_constant: float = 5.0
    gain: float = GAIN
    airflow: float = 1.0
    heating_ratio: float = 1.0
    latent: float = 0.0
    air: StillAir | None = None

    def balance(self, drive_squared: float, room: float, airflow: float = 1.0) -> float:
        """
        Return the temperature [degC] at which heating and cooling are equal.

        Parameters
        ----------
        drive_squared : float
            Square of the heating voltage [V^2].
        room : float
            Temperature of the air [degC].
        airflow : float
            Momentary heat transfer over that of the bench.
        """
        return room + self.gain * drive_squared / (self.airflow * airflow)

    def advance(self, temperature: float, balance: float, dt: float, airflow: float = 1.0,
                share: Callable[[float], float] | None = None, before: float = 0.0) -> float:
        """
        Return the temperature [degC] after `dt` of a constant balance.

        Parameters
        ----------
        temperature, balance : float
            Temperature now, and that at which it would stay [degC].
        dt : float
            Time [s].
        airflow : float
            Momentary heat transfer over that of the bench.
        share : callable or None
            Martensite share that the wire has at a temperature, where latent heat counts.
        before : float
            Martensite share now.
        """
        rate = self.airflow * airflow / self.time_constant
        if balance > temperature:
            rate *= self.heating_ratio
        change = (balance - temperature) * (1.0 - math.exp(-rate * dt))
        if self.air is not None:
            change = self.air.change(temperature - ROOM, balance - ROOM, rate, dt)
        if self.latent == 0.0 or share is None or abs(change) < 1e-9:
            return temperature + change
        # The heat that came in is shared by warming and transforming: the temperature gets the part
        # of the change with which the heat balance has no residual.
        sign = math.copysign(1.0, change)
        part = RootFinder(2.0 * abs(change), HEAT_TOLERANCE)(
            lambda part: abs(change) * (part - 1.0) + sign * self.latent * (
                before - share(temperature + part * change)), 0.5, 0.0, 1.0)
        return temperature + part * change
