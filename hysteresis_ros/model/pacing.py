# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Overdriving a muscle that lags, so that it gets to a temperature within a given time."""

from collections.abc import Callable
import math
from typing import Any

from hysteresis_ros.effects import Inputs
from hysteresis_ros.model.chain import Chain

# What a longer time between two calls of `hold` counts in the next one.
FADING = 0.9


class Pacing:
    """
    What is applied to a lagging muscle on the way to a temperature.

    Parameters
    ----------
    chain : Chain
        Effects of the model; its lags follow what is applied.
    clip : callable
        Brings a drive within the limits.
    inputs : callable
        Gives the `Inputs` for a dt [s] and a phase.
    horizon : float
        Time [s] within which it is to be reached; infinite: never overdriven.
    """

    def __init__(self, chain: Chain, clip: Callable[[float], tuple[float, bool]],
                 inputs: Callable[..., Inputs], horizon: float) -> None:
        self._chain = chain
        self._clip = clip
        self._inputs = inputs
        self.horizon = horizon
        # How far the drive has gone up and down; heating and cooling does not undo that.
        self.travel = 0.0

    def reset(self, drive: float, drive_squared: float) -> None:
        """Start from the cold muscle with this drive and drive squared."""
        self.drive = drive
        self._time: float | None = None
        self._period = self._deadline = 0.0
        self._drive_squared = drive_squared
        self._phase = 1.0

    def save(self) -> dict[str, Any]:
        """Return what is remembered, as plain types."""
        return {'drive': self.drive, 'travel': self.travel, 'time': self._time,
                'period': self._period, 'deadline': self._deadline,
                'drive_squared': self._drive_squared, 'phase': self._phase}

    def restore(self, drive: float, travel: float, time: float | None, period: float,
                deadline: float, drive_squared: float, phase: float) -> None:
        """Take back what `save` returned."""
        self.drive, self.travel, self._time = drive, travel, time
        self._period, self._deadline = period, deadline
        self._drive_squared, self._phase = drive_squared, phase

    def advance(self, time: float | None) -> float:
        """Let the muscle feel what was applied until now, and return for how long [s]."""
        if time is None or not math.isfinite(time):
            return 0.0
        if self._time is None:
            self._chain.step(self.drive, self._inputs(0.0, self._phase))
            self._time = time
        elapsed = time - self._time
        if elapsed <= 0.0:
            return 0.0
        self._chain.step(self.drive, self._inputs(elapsed, self._phase))
        self._time = time
        return elapsed

    def apply(self, drive: float) -> None:
        """Apply a drive."""
        self.travel += abs(drive - self.drive)
        self.drive = drive

    def begin(self, drive: float, drive_squared: float, phase: float,
              time: float | None) -> None:
        """Set out for what `drive` keeps in the end; `advance` has to come before."""
        self._drive_squared, self._phase = drive_squared, phase
        if time is not None and math.isfinite(time) and math.isfinite(self.horizon):
            self._deadline, self._period = time + self.horizon, 0.0
            drive = self._towards(self.horizon)
        self.apply(drive)

    def hold(self, time: float) -> None:
        """Go on towards it; the first call at the horizon or after it ends overdriving."""
        # The next call may be late: longer than a period overdriven, the muscle would swing.
        self._period = max(self.advance(time), FADING * self._period)
        if math.isfinite(self.horizon) and self._time is not None:
            self.apply(self._towards(max(self._deadline - self._time, self._period)))

    def _towards(self, duration: float) -> float:
        """Return the drive that gets the muscle there within a time [s], as the limits let."""
        inputs = self._inputs(duration, self._phase)
        return self._clip(self._chain.inverse(self._drive_squared, inputs))[0]
