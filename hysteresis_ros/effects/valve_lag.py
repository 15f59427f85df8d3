# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle whose air passes a valve: it fills and empties in times of their own."""

import math

from hysteresis_ros.effects.base import Effect, Parameter, Surroundings
from hysteresis_ros.effects.thermal import FirstOrderLag, LAGS


class ValveLag(FirstOrderLag):
    """
    The pressure inside follows the one that was set, faster or slower on its way up than down.

    It takes the place of the lags of heat, which a muscle driven by pressure does not have.
    """

    id = 'valve_lag'
    sentence = 'Air takes time through the valve: the muscle fills and vents in times of their own.'
    equation = 'dP/dt = (Ps - P) / tau, tau one for filling (Ps > P) and one for venting'
    source = ('filling and venting of a volume through an orifice, linearised: Tondu and Lopez, '
              'IEEE Control Systems Magazine 20 (2000) 15')
    shows_in = 'time since a step of the pressure, its sign'
    experiment = 'steps of the pressure up and down, recorded faster than they settle'
    confused_with = ('creep', 'latency')
    parameters = (
        Parameter('filling', 's', 'time constant while the pressure rises', *LAGS, 0.0,
                  (0.3, 1.5, 6.0), log=True),
        Parameter('venting', 's', 'time constant while it falls', *LAGS, 0.0, (0.3, 1.5, 6.0),
                  log=True),)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the muscle is driven by pressure."""
        return surroundings.drive == 'pressure'

    def rate(self, rising: bool) -> float:
        """Return the rate [1/s] at which the pressure follows, infinite without a lag."""
        time_constant = self.filling if rising else self.venting
        return self.speed / time_constant if time_constant > 0.0 else math.inf

    def extremes(self, margin: float) -> list[Effect]:
        """Return the same valve with both times at either end, the faster one first."""
        return self._extremes(('filling', 'venting'), margin)
