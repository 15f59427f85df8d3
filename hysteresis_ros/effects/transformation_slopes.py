# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The loop's width against the load: the two directions of the transformation shift differently."""

import numpy as np

from hysteresis_ros.effects.base import Parameter, Surroundings, Values
from hysteresis_ros.effects.stages import MaterialEffect


class TransformationSlopes(MaterialEffect):
    """
    The load shifts the transformation on heating and on cooling by different amounts.

    With the drive in units of the load, ``x = C_A T``, a part of the muscle turns to austenite
    where ``x > x_A + F`` and to martensite where ``x < x_M + (1 - g) F``, with
    ``1 - g = C_A / C_M``; so its loop is wider by ``g F`` than without load. A loop that gets
    narrower is counted from twice the bench's mean load, beyond which it keeps its width.
    """

    id = 'transformation_slopes'
    sentence = 'The load shifts heating and cooling by different amounts: loops widen or narrow.'
    equation = ('T_A = T_A0 + sigma / C_A, T_M = T_M0 + sigma / C_M: the input of H2 stays between '
                'F - x - w and F - x, w = g F for g > 0, -g max(2 Fm - F, 0) for g < 0, '
                "g = 1 - C_A / C_M, Fm the bench's mean load; where stress_dependence has a shift, "
                'w (1 + shift)')
    source = ('Brinson, J. Intell. Mater. Syst. Struct. 4 (1993) 229; Lagoudas (ed.), Shape Memory '
              'Alloys, Springer 2008, ch. 3')
    shows_in = "load, by the loop's width"
    experiment = 'full loops under three or more loads'
    confused_with = ('stress_dependence', 'r_phase')
    kinds = ('bench',)
    parameters = (
        # A fiftieth would be named on benches of grains whose slopes are alike.
        Parameter('g', '1', "growth of the loop's width with the load, 1 - C_A / C_M", 0.05, 1.3,
                  0.0, (-0.3, 0.2), both_signs=True, limits=(-2.0, 0.9)),)

    def loop_width(self, load: Values, surroundings: Surroundings) -> Values:
        """Return w in units of the load."""
        if self.g >= 0.0:
            return self.g * np.maximum(load, 0.0)
        return -self.g * np.maximum(2.0 * surroundings.load - np.maximum(load, 0.0), 0.0)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all, on a muscle that contracts when driven."""
        return surroundings.load > 0.0 and surroundings.sign < 0
