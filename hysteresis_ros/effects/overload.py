# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle that was loaded beyond its yield stress stays longer."""

import math

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.stages import MaterialEffect


class Overload(MaterialEffect):
    """
    Beyond a load the muscle yields, and keeps a residual strain of the largest load it has borne.

    One way: neither less load nor heating and cooling undo it, and a trial begins with what those
    before have left. What a recording does not make larger any more looks like `slack`. On a bench
    with constant loads it is a part of the elongation under each. No controller undoes it: the
    muscle has to be adjusted.
    """

    id = 'overload'
    sentence = 'Loads beyond the yield stress have lengthened the muscle for good.'
    equation = 'L += max(0, F - Fy) / K, F the largest load so far'
    source = 'plasticity with linear hardening: residual strain (sigma - sigma_y) / H'
    shows_in = 'the first time that the load rises beyond all before'
    experiment = 'raise the load step by step, and go back to a small one after each'
    confused_with = ('slack', 'series_compliance', 'fatigue')
    invertible = False
    parameters = (
        Parameter('Fy', 'loads', "load from which it yields over the bench's mean load", 0.2, 5.0,
                  1.0, (0.7, 1.1, 1.4), log=True),
        # Of 0.2 mm and 0.27 m with a hardening modulus of 0.4 to 80 GPa.
        Parameter('compliance', 'mm/N', 'residual elongation per load beyond, 1 / K', 0.1, 20.0,
                  0.0, (1.5, 6.0), log=True, scale='compliance'),)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all."""
        return surroundings.load > 0.0

    def yields(self, surroundings: Surroundings) -> tuple[float, float]:
        """Return Fy [N] and 1 / K [m/N]."""
        if self.compliance <= 0.0:
            return math.inf, 0.0
        return self.Fy * surroundings.load, 1e-3 * self.compliance
