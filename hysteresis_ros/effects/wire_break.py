# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An event: one of the parallel muscles breaks, and the others carry its load from then on."""

import math

import numpy as np

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.change_point import change_points, NEVER
from hysteresis_ros.effects.stages import MechanismEffect


class WireBreak(MechanismEffect):
    """
    One of n parallel muscles breaks at a moment of the recording, and n - 1 bear the load.

    Until the muscle is replaced it is broken in all that follows, also after heating and cooling. A
    time counts in each recording from its own start. No controller undoes it: the others have to
    bear n / (n - 1) times the load that the bench was chosen for.
    """

    id = 'wire_break'
    sentence = 'One of the parallel muscles broke: from then on the others carry its load, too.'
    equation = 'F = tau / (n r) before t, tau / ((n - 1) r) from t on, r the moment arm'
    source = 'balance of moments, Eq. 16 of the paper, with n - 1 muscles'
    shows_in = 'everything from one moment on, in proportion to the load'
    experiment = 'look at the muscles, and measure the tension or the current of each'
    confused_with = ('fatigue', 'payload_error', 'slack')
    invertible = False
    parameters = (
        # From the first seconds of a recording to a whole day.
        Parameter('time', 's', 'when it broke, since the recording began', 1.0, 1e5, NEVER,
                  (1000.0,), log=True),)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether there is another muscle to carry the load."""
        return surroundings.muscles > 1

    @property
    def break_time(self) -> float:  # type: ignore[override]
        """Return when a muscle breaks [s]; infinite if none does."""
        return self.time if 0.0 < self.time < NEVER else math.inf

    def moments(self, residual: np.ndarray, response: np.ndarray, clock: np.ndarray
                ) -> list[dict[str, float]]:
        """Return moments at which the residual changes in its mean and size."""
        return [{'time': time} for time in change_points(residual, clock)]
