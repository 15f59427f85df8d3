# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Slow integral feedback of the arm's angle, on top of the inverse model (Sec. VIII of the paper).

The inverse does the large and fast part of the work; the integral takes out the steady error, such
as that of a payload that is heavier than the model's. Its authority is limited, so that a broken
sensor can move the arm only that far.
"""

import math


class AngleFeedback:
    """
    Integral of the angle's error, as a correction of the target angle.

    Parameters
    ----------
    gain : float
        Correction rate per error [1/s].
    limit : float
        Largest correction in either direction [rad].
    rest_speed : float
        Speed [rad/s] above which the arm counts as moving; then the integral waits, because the
        error of a moving arm says nothing about where it will settle.
    dead_band : float
        Errors up to this [rad] are not corrected: an integral that chases the encoder's last count
        never settles on a muscle with hysteresis.
    period : float
        Time between two updates of the integral [s]; samples between them are passed over.
    delay : float
        Time after `begin` [s] in which samples do not count: they may be older than the new
        target, or of an arm that has not set out for it yet.
    """

    def __init__(self, gain: float = 0.0, limit: float = 0.0, rest_speed: float = 0.0,
                 dead_band: float = 0.0, period: float = 0.0, delay: float = 0.0) -> None:
        self.configure(gain, limit, rest_speed, dead_band, period, delay)
        self.reset()

    def configure(self, gain: float, limit: float, rest_speed: float, dead_band: float,
                  period: float, delay: float) -> None:
        """Change the settings and keep the correction."""
        self.gain = gain
        self.limit = limit
        self.rest_speed = rest_speed
        self.dead_band = dead_band
        self.period = period
        self.delay = delay

    def reset(self) -> None:
        """Forget the correction and the last sample."""
        self.correction = 0.0
        self.begin(-math.inf)

    def begin(self, time: float) -> None:
        """Take note of a new target at the time [s]; the correction stays."""
        self._begun = time
        self._time: float | None = None
        self._angle = math.nan

    def update(self, time: float, angle: float, target: float, saturated: int = 0) -> float:
        """
        Take one sample of the angle.

        Parameters
        ----------
        time : float
            Time of the sample [s].
        angle, target : float
            Measured and wanted angle [rad].
        saturated : int
            1 if the muscle is at the limit where a larger target changes nothing, -1 where a
            smaller one does not, 0 otherwise: the integral does not grow further in that
            direction (anti-windup).

        Returns
        -------
        float
            What has to be added to the target [rad]; between -limit and limit.
        """
        if not math.isfinite(angle) or time < self._begun + self.delay:
            return self.correction
        elapsed = math.inf if self._time is None else time - self._time
        if 0.0 <= elapsed < self.period:
            return self.correction
        last_angle = self._angle
        self._time, self._angle = time, angle
        # The first sample, or a clock that was set back, only starts the next period.
        if not 0.0 < elapsed < math.inf:
            return self.correction
        error = target - angle
        moving = abs(angle - last_angle) > self.rest_speed * elapsed
        if moving or abs(error) <= self.dead_band:
            return self.correction
        # A gap in the measurements counts as one time constant of the integral at most.
        change = min(self.gain * elapsed, 1.0) * error
        if change * saturated <= 0.0:
            self.correction = max(-self.limit, min(self.limit, self.correction + change))
        return self.correction
