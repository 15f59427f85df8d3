# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An encoder with another number of counts per revolution than assumed."""

import math

from hysteresis_ros.effects.base import Inputs, Parameter, Values
from hysteresis_ros.effects.stages import SensorEffect


class EncoderScale(SensorEffect):
    """
    A turn of the arm gives more or fewer counts than assumed.

    The AMT103's switches set its pulses per revolution, from 48 to 2048; and a belt or a gear
    between shaft and encoder has a ratio. The counts are right where they were set to an angle.
    A few per cent are no switch's, and an arm moves too little to tell them from an eccentric disc.
    """

    id = 'encoder_scale'
    rowwise = True
    sentence = 'A turn of the arm gives more or fewer counts than counts_per_revolution says.'
    equation = 'theta_m = theta_0 + k (theta - theta_0)'
    source = 'incremental encoder: angle = 2 pi counts / counts per revolution'
    shows_in = 'theta, as a straight line through the angle where the counts are right'
    experiment = 'turn the arm without its muscles by a known angle, and read the switches'
    confused_with = ('encoder_eccentricity', 'encoder_offset', 'geometry_error')
    kinds = ('arm',)
    # Whoever sets an encoder up turns it by a right angle: what is left of a wrong number of counts
    # is rarer than a disc that is off. Ties of both go to the disc; a scale of 1.2 needs no help.
    RARE = 0.2
    parameters = (
        # 2000 for 2048 pulses are 2.4 %, the next switch is a factor of two.
        Parameter('k', '1', 'measured over true change of the angle', 0.25, 4.0, 1.0,
                  (0.5, 0.9, 1.1, 2.0), log=True),
        # Set by eye against the upright or the hanging arm, and estimated.
        Parameter('theta_0', 'deg', 'angle where the counts are right', -20.0, 200.0, 90.0,
                  (45.0, 135.0), limits=(-360.0, 360.0)),)

    @property
    def prior_odds(self) -> float:
        """Return lower odds than those of another effect."""
        return self.RARE

    def forward(self, response: Values, inputs: Inputs) -> Values:
        """Scale the angle about the one where the counts are right."""
        middle = math.radians(self.theta_0)
        return middle + self.k * (response - middle)

    def step(self, value: float, dt: float) -> float:
        """Scale the angle about the one where the counts are right."""
        middle = math.radians(self.theta_0)
        return middle + self.k * (value - middle)

    def inverse(self, response: float) -> float:
        """Return the angle that the encoder shows so."""
        middle = math.radians(self.theta_0)
        return middle + (response - middle) / self.k
