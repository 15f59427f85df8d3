# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle expands or contracts with its temperature, whether it transforms or not."""

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings
from hysteresis_ros.effects.material import HEATING
from hysteresis_ros.effects.stages import MaterialEffect

# Thermal expansion of metals [1e-6/K]: 6.6 and 11 in the phases of Ni-Ti, 22 of a common model.
LEAST, LARGEST = 4.0, 25.0
# Where the drive is no temperature: by how much the largest drive heats a muscle [K].
HEATED = 40.0, 130.0
SIGN = Parameter('sign', '1', '1 for a muscle that expands with its temperature, -1 for one that '
                 'contracts', -1.0, 1.0, 1.0, (1.0, -1.0), choices=(1.0, -1.0))


class ThermalExpansion(MaterialEffect):
    """
    The muscle gets longer or shorter with its temperature, in both phases and under any load.

    Metals get longer. The equations of Tanaka, of Liang and Rogers and of Brinson have a stress
    Theta that grows with the temperature instead, 0.55 MPa/K, which shortens a wire under a load.

    The weights of H2 have one sign: of a muscle that contracts when heated no relay lengthens it.
    What expands the hot and the cold muscle makes the loop smaller at both ends instead. Relays
    without a loop contract the muscle evenly, too, and can undo more expansion than there is: the
    rows of a bench tell the least that explains them.
    """

    id = 'thermal_expansion'
    sentence = ('The muscle expands or contracts with its temperature, whether it transforms or '
                'not.')
    equation = ('L += sign alpha l0 T; where V^2 stands for T in a heated wire: '
                'L += sign alpha l0 V^2 / Vm^2, Vm the largest drive of the bench')
    source = ('Brinson, J. Intell. Mater. Syst. Struct. 4 (1993) 229; Lagoudas and others, Int. J. '
              'Plasticity 32-33 (2012) 155: strain = S sigma + alpha (T - T0) + transformation '
              'strain')
    shows_in = 'both ends of the loop, which are not flat under any load'
    experiment = ('heat the hot muscle further, and cool the cold one; a dozen steps of the drive '
                  'at either end of the loop, under two loads')
    confused_with = ('series_compliance', 'fatigue')
    kinds = ('bench',)
    parameters = (
        Parameter('alpha', '% of l0', 'change of length at the largest drive of the bench',
                  1e-4 * LEAST * HEATED[0], 1e-4 * LARGEST * HEATED[1], 0.0, (0.06,), log=True,
                  one_sided=True), SIGN)

    @classmethod
    def describe(cls, surroundings: Surroundings | None) -> tuple[Parameter, ...]:
        """Give alpha the unit and range of this muscle's drive."""
        if surroundings is None or surroundings.drive != 'temperature':
            return cls.parameters
        return (Parameter('alpha', '1e-6/K', 'coefficient of thermal expansion', LEAST, LARGEST,
                          0.0, (10.0,), log=True, one_sided=True), SIGN)

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the expansion of each row, and no factor."""
        if surroundings.drive == 'temperature':
            strain = 1e-6 * self.sign * self.alpha * drive_squared
        else:
            strain = (0.01 * self.sign * self.alpha * drive_squared
                      / surroundings.full_drive_squared)
        return surroundings.length * strain, np.ones(len(drive_squared))

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether heat contracts the muscle; the weights of one that it lengthens expand, too."""
        return surroundings.drive in HEATING and surroundings.sign < 0
