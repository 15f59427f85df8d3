# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An encoder whose disc does not turn about its own centre."""

import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Values
from hysteresis_ros.effects.stages import SensorEffect

# Newton's method ends at this change of the angle [rad], or after so many steps.
EXACT, STEPS = 1e-14, 50


class EncoderEccentricity(SensorEffect):
    """
    The disc's centre is off the shaft, so the reading is off by one wave a turn.

    A centre off by d on a track of radius R gives e = d / R. Over the narrow range of an arm the
    wave is little more than an offset and a scale of the angle.
    """

    id = 'encoder_eccentricity'
    rowwise = True
    sentence = "The encoder's disc sits off the shaft's centre: its error is one wave a turn."
    equation = 'theta_m = theta + e sin(theta + phi)'
    source = 'geometry of an eccentric disc with one reading head, to first order in e'
    shows_in = 'theta, as an offset and a scale'
    experiment = 'turn the arm without its muscles by known angles, as far round as it goes'
    confused_with = ('encoder_offset', 'geometry_error')
    kinds = ('arm',)
    parameters = (
        # A centre off by 0.04 to 2 mm on the 11 mm of a small modular encoder's disc.
        Parameter('e', 'deg', 'largest error of the angle', 0.2, 10.0, 0.0, (1.0, 4.0), log=True,
                  limits=(0.04, 40.0)),
        Parameter('phi', 'rad', 'direction in which the centre is off, at theta = 0', 0.0,
                  2.0 * math.pi, 0.0, (-2.4, -0.8, 0.8, 2.4), both_signs=True,
                  limits=(-2.0 * math.pi, 2.0 * math.pi)),)

    def forward(self, response: Values, inputs: Inputs) -> Values:
        """Add the wave."""
        return response + math.radians(self.e) * np.sin(response + self.phi)

    def step(self, value: float, dt: float) -> float:
        """Add the wave."""
        return value + math.radians(self.e) * math.sin(value + self.phi)

    def inverse(self, response: float) -> float:
        """Return the angle at which the wave makes it the measured one."""
        size, angle = math.radians(self.e), response
        for _ in range(STEPS):
            change = (response - self.step(angle, 0.0)) / (
                1.0 + size * math.cos(angle + self.phi))
            angle += change
            if abs(change) < EXACT:
                break
        return angle
