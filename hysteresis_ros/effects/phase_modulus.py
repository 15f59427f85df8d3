# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The elastic modulus of martensite against that of austenite: the stroke grows with the load."""

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.material import HEATING
from hysteresis_ros.effects.stages import MaterialEffect


class PhaseModulus(MaterialEffect):
    """
    Martensite is softer than austenite, so that a load stretches the cold muscle further.

    With the section A and the length l0, a load F stretches austenite by ``F l0 / (E_A A)``, which
    is a part of what `series_compliance` says, and what has transformed by so much more as the
    moduli differ. That grows the stroke in proportion to the load, without an end, whereas the
    growth by orientation (`stress_dependent_strain`) saturates; it is elastic, so that it neither
    stays after unloading nor shifts the transformation.
    """

    id = 'phase_modulus'
    sentence = 'Martensite is softer than austenite: the load stretches the cold muscle further.'
    equation = ('1 / E = xi / E_M + (1 - xi) / E_A, xi the martensite share: S(F) -> (1 - m) S(F) '
                "+ m F / Fm, Fm the bench's mean load, m = (1 / E_M - 1 / E_A) Fm l0 / (A Y), Y "
                'the stroke under Fm')
    source = 'Brinson, J. Intell. Mater. Syst. Struct. 4 (1993) 229, Eq. 4 with Reuss mixing'
    shows_in = 'load, cold side'
    experiment = 'the same loop under four or more loads; pull the cold and the hot muscle'
    confused_with = ('stress_dependent_strain', 'series_compliance')
    kinds = ('bench',)
    universal = True
    parameters = (
        # Moduli of 10 to 40 GPa against 30 to 90, 50 to 250 MPa, and 2 to 6 % of stroke. Less than
        # a fiftieth of the stroke is no more than what is told apart on a bench.
        Parameter('m', '1', "share of the stroke under the bench's mean load that is elastic",
                  0.02, 0.4, 0.0, (0.05, 0.15), limits=(0.0, 0.6)),)

    def elastic_share(self, surroundings: Surroundings) -> float:
        """Return m."""
        return self.m

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all, on a muscle that heat transforms."""
        return surroundings.load > 0.0 and surroundings.drive in HEATING
