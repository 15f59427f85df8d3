# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An event: one of the parallel muscles breaks, and the others carry its load from then on."""

import math

import numpy as np

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.stages import MechanismEffect

# On each side of the event at least so many rows, and this share of all, are needed.
LEAST_ROWS, MARGIN = 3, 0.04
# How far before the first row after the event, as a share of its time, a fit starts.
BEFORE = 0.01
# A time [s] at which no recording goes on any more, the last one that a fit can come to: no break.
NEVER = 5e5


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

    def moments(self, residual: np.ndarray, clock: np.ndarray) -> list[dict[str, float]]:
        """
        Return moments at which the residual changes in its mean and size.

        The largest change, and that of the rows before and after it: where the load throws the arm
        from one end to the other, that may come long after the break.
        """
        found, parts = [], [(0, len(residual))]
        change = _change(residual)
        if change is not None:
            parts += [(0, change), (change, len(residual))]
        for first, end in parts:
            change = _change(residual[first:end])
            if change is not None:
                last, row = clock[first + change - 1:first + change + 1].tolist()
                time = (1.0 - BEFORE) * row
                found.append({'time': time if time > last else 0.5 * (last + row)})
        return found


def _change(residual: np.ndarray) -> int | None:
    """Return the first row (n,) of another mean and size than before; None where n is small."""
    count = len(residual)
    margin = max(LEAST_ROWS, int(MARGIN * count))
    if count < 2 * margin + 1:
        return None
    before = np.arange(margin, count - margin + 1)
    logs = np.zeros(len(before))
    # Gaussian noise of another mean and size on each side (a change point's likelihood).
    for values, rows in ((residual, before), (residual[::-1], count - before)):
        sums, squares = np.cumsum(values), np.cumsum(values ** 2)
        variance = squares[rows - 1] / rows - (sums[rows - 1] / rows) ** 2
        logs += rows * np.log(np.maximum(variance, 1e-12 * squares[-1] + 1e-300))
    return int(before[np.argmin(logs)])
