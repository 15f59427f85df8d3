# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Friction of the cables between muscles and arm: it is in proportion to the load."""

from hysteresis_ros.effects.base import Parameter
from hysteresis_ros.effects.stages import MechanismEffect


class CableFriction(MechanismEffect):
    """
    A cable that bends around guides, or runs in a sheath, loses a share of its tension.

    Where it slides it has ``F exp(-mu phi)`` at the end that follows: at the arm while the arm
    rises, at the muscle while it sinks. In between it sticks. Other than that of a bearing, this
    friction vanishes with the load.
    """

    id = 'cable_friction'
    sentence = 'Cables rub on their guides, so a share of the tension is lost on the way.'
    equation = ('F_arm = F exp(-mu phi) where the arm rises, F exp(mu phi) where it sinks, '
                'sticking inside')
    source = 'capstan equation (Euler, Eytelwein)'
    shows_in = 'reversals, in proportion to the load'
    experiment = 'run the same loop with another payload: this friction grows with it'
    confused_with = ('coulomb_friction', 'backlash')
    parameters = (
        # From a lined sheath (mu 0.05) bent by 10 degrees to bare wire (mu 0.2) around most of a
        # turn, by which the muscle has to pull with 2.7 times the load.
        Parameter('mu_phi', '1', 'coefficient of friction times the angle of all bends [rad]',
                  0.005, 1.0, 0.0, (0.03, 0.15), log=True),)

    def capstan(self) -> float:
        """Return mu phi."""
        return self.mu_phi
