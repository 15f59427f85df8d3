# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A supply whose voltage was recorded, and that no board makes up for."""

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.electrical import ElectricalEffect


class MeasuredSupply(ElectricalEffect):
    """
    A board that finds its duty with the nominal supply applies more or less than was set.

    A duty D of pulses as high as the supply heats as the constant voltage ``Vs sqrt(D)``, so what
    was set is off by the same share as the supply. Where it was not recorded, it counts as nominal,
    as it should with a voltage that is what was applied, such as the bridge's.
    """

    id = 'measured_supply'
    sentence = 'The recorded supply voltage changes, and with it the voltage that arrives.'
    equation = 'Ve = V Vs / Vn, Vs the recorded supply, Vn the one that the board counts on'
    source = 'RMS voltage of PWM, Vs sqrt(duty), with duty = (V / Vn)^2'
    shows_in = 'the recorded supply voltage'
    experiment = 'log the supply voltage while the battery runs down, or at two settings of it'
    confused_with = ('supply_sag', 'ambient_drift')
    needs_column = 'supply_voltage'
    # Two steps of a board's converter, which resolves 10 to 50 mV.
    smallest_change = 0.1
    parameters = (
        # From one cell of a lithium battery to four lead batteries.
        Parameter('nominal', 'V', 'supply voltage Vn at which what is set arrives', 3.0, 60.0, 0.0,
                  (3.7, 5.0, 6.0, 7.4, 9.0, 12.0, 15.0, 24.0, 36.0), log=True),)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive is a voltage: a source of current makes up for its supply."""
        return surroundings.drive == 'voltage'

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Scale the voltage with the supply."""
        return signal * self._share(inputs.supply)

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Ask for more from a weaker supply; for nothing new from one that is off."""
        share = float(self._share(inputs.supply))
        return signal / share if share > 0.0 else signal

    def _share(self, supply: Values) -> Values:
        """Return the supply over the nominal one; 1 where either is not known."""
        if self.nominal <= 0.0:
            return 1.0
        return np.where(np.isfinite(supply), np.maximum(supply, 0.0) / self.nominal, 1.0)
