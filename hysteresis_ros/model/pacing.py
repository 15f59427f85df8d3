# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Overdriving a muscle that lags, so that it gets to a temperature sooner.

An overshoot goes through the hysteresis and is never taken back, while a muscle that is still on
its way comes in the end. How far it has come nobody measures, and its time constant is known only
within an interval. So muscles with both ends of that interval are followed, too, and the drive is
the one that brings the most advanced of all to the temperature, none of them beyond.
"""

from collections.abc import Callable
import math
from typing import Any

from hysteresis_ros.effects import Inputs
from hysteresis_ros.effects.thermal import FirstOrderLag
from hysteresis_ros.model.chain import Chain

# What a longer time between two calls of `hold` counts in the next one.
FADING = 0.9
# Part of the horizon in which the most advanced muscle is brought there, and that in calls of
# `hold`: the sooner, the more time have the others to follow.
PULSE, CALLS = 0.2, 2.0
# Latent heat counts at most as this heat capacity: a change of the load transforms in no time.
SLOWEST = 20.0


class Pacing:
    """
    What is applied to a lagging muscle on the way to a temperature.

    Parameters
    ----------
    chains : sequence of Chain
        Effects of the model, and of muscles with other time constants; their lags follow what is
        applied.
    clip : callable
        Brings a drive within the limits.
    inputs : callable
        Gives the `Inputs` for a dt [s] and a phase.
    horizon : float
        Time [s] within which it is to be reached; infinite: never overdriven.
    rate_limit : float
        Largest change of the drive a second.
    latent : float
        Latent heat of the whole transformation, as drive squared.
    """

    def __init__(self, chains: list[Chain], clip: Callable[[float], tuple[float, bool]],
                 inputs: Callable[..., Inputs], horizon: float, rate_limit: float = math.inf,
                 latent: float = 0.0) -> None:
        self._chains = chains
        self._lags = [next((effect for effect in chain.thermal
                            if isinstance(effect, FirstOrderLag)), None) for chain in chains]
        self._clip = clip
        self._inputs = inputs
        self.horizon = horizon
        self.rate_limit = rate_limit
        self._latent = latent
        # How far the drive has gone up and down; heating and cooling does not undo that.
        self.travel = 0.0

    def reset(self, drive: float, drive_squared: float) -> None:
        """Start from the cold muscle with this drive and drive squared."""
        for chain in self._chains:
            chain.start()
        self.drive = self._steady = drive
        self._time: float | None = None
        self._applied: float | None = None
        self._period = self._deadline = 0.0
        self.drive_squared = drive_squared
        self.phase = 1.0
        # Where they go, as drive squared before the air adds to it; and of each muscle that drive
        # squared and the phase where it began, and how much latent heat slows it.
        self._goal = 0.0
        self._begun = [[0.0, 1.0, 1.0] for _ in self._chains]
        for lag in self._lags:
            if lag is not None:
                lag.slowing = 1.0

    def save(self) -> dict[str, Any]:
        """Return what is remembered, as plain types."""
        return {'drive': self.drive, 'steady': self._steady, 'travel': self.travel,
                'time': self._time, 'applied': self._applied, 'period': self._period,
                'deadline': self._deadline, 'drive_squared': self.drive_squared,
                'phase': self.phase, 'goal': self._goal,
                'begun': [list(entry) for entry in self._begun],
                'lags': [chain.save() for chain in self._chains[1:]]}

    def restore(self, drive: float, steady: float, travel: float, time: float | None,
                applied: float | None, period: float, deadline: float, drive_squared: float,
                phase: float, goal: float, begun: list[list[float]],
                lags: list[list[dict[str, Any]]]) -> None:
        """Take back what `save` returned."""
        numbers = [drive, steady, travel, period, deadline, drive_squared, phase, goal,
                   *(value for value in (time, applied) if value is not None),
                   *(value for entry in begun for value in entry)]
        if not all(math.isfinite(value) for value in numbers):
            raise ValueError('a number of the pacing is not finite')
        for chain, memory in zip(self._chains[1:], lags, strict=True):
            chain.restore(memory)
        self.drive, self._steady, self.travel = drive, steady, travel
        self._time, self._applied = time, applied
        self._period, self._deadline = period, deadline
        self.drive_squared, self.phase, self._goal = drive_squared, phase, goal
        for entry, lag, (start, before, slowing) in zip(
                self._begun, self._lags, begun, strict=True):
            entry[:] = start, before, slowing
            if lag is not None:
                lag.slowing = slowing

    def rest(self, phase: float) -> None:
        """Start from this phase: the cold muscle bears a load."""
        self.phase = phase
        for entry in self._begun:
            entry[1] = phase

    def advance(self, time: float | None) -> float:
        """Let the muscle feel what was applied until now, and return for how long [s]."""
        if time is None or not math.isfinite(time):
            return 0.0
        if self._time is None:
            self._feel(0.0)
            self._time = time
        elapsed = time - self._time
        if elapsed <= 0.0:
            return 0.0
        self._feel(elapsed)
        self._time = time
        return elapsed

    def _feel(self, elapsed: float) -> None:
        inputs = self._inputs(elapsed, self.phase)
        for chain in self._chains:
            chain.step(self.drive, inputs)

    def apply(self, drive: float, time: float | None = None) -> None:
        """Apply a drive, or go towards it as fast as the rate limit lets."""
        if time is not None and math.isfinite(time):
            if self.rate_limit < math.inf:
                since = 0.0 if self._applied is None else max(time - self._applied, 0.0)
                most = self.rate_limit * since
                drive = min(max(drive, self.drive - most), self.drive + most)
                drive = self._clip(drive)[0]
            self._applied = time if self._applied is None else max(time, self._applied)
        self.travel += abs(drive - self.drive)
        self.drive = drive

    def begin(self, drive: float, drive_squared: float, phase: float,
              time: float | None) -> None:
        """Set out for what `drive` keeps in the end; `advance` has to come before."""
        self.drive_squared, self._steady = drive_squared, drive
        if self._latent > 0.0:
            self._take_up_latent_heat(phase)
        self.phase = phase
        if time is not None and math.isfinite(time) and math.isfinite(self.horizon):
            self._deadline = time + self._pulse()
            drive = self._towards(self._deadline - time)
        self.apply(drive, time)

    def hold(self, time: float, steady: float | None = None) -> None:
        """Go on towards it; the first call at the horizon or after it ends overdriving."""
        # The next call may be late: longer than a period overdriven, the muscle would swing.
        self._period = max(self.advance(time), FADING * self._period)
        if steady is not None:
            self._steady = steady
        drive = self._steady
        if math.isfinite(self.horizon) and self._time is not None:
            self._deadline = min(self._deadline, self._time + self._pulse())
            drive = self._towards(max(self._deadline - self._time, self._period))
        self.apply(drive, time)

    def _pulse(self) -> float:
        """Return the time [s] in which the most advanced muscle is brought there."""
        if self._period == 0.0:
            # Nobody knows yet how often `hold` is called; at least so often.
            return self.horizon
        return min(max(PULSE * self.horizon, CALLS * self._period), self.horizon)

    def _towards(self, duration: float) -> float:
        """Return the drive that gets the first muscle there within a time [s], as limits let."""
        inputs = self._inputs(duration, self.phase)
        drives = [chain.inverse(self.drive_squared, inputs) for chain in self._chains]
        least, most = min(drives), max(drives)
        # One that is on its way up and one that is on its way down: neither is overdriven.
        drive = least if least > self._steady else most if most < self._steady else self._steady
        return self._clip(drive)[0]

    def _take_up_latent_heat(self, phase: float) -> None:
        """
        Slow the lags down by the latent heat on the way to a phase.

        The transformation counts as even along the way, so that latent heat is a larger heat
        capacity: ``1 + h qmax (xi0 - xi1) / (q1 - q0)``. A muscle that is not yet at the phase
        before has come as near to it as to its drive squared.
        """
        before, goal = self._goal, self.drive_squared
        for lag, begun in zip(self._lags, self._begun):
            if lag is None:
                continue
            start, was, _ = begun
            here = lag.present
            if lag is self._lags[0]:
                goal = self._chains[0].at_thermal(
                    self.drive_squared, lag, self._inputs(0.0, phase))
            way = before - start
            share = min(max((here - start) / way, 0.0), 1.0) if way != 0.0 else 1.0
            present = was + share * (self.phase - was)
            slowing = 1.0
            if goal != here:
                slowing += self._latent * max((present - phase) / (goal - here), 0.0)
            begun[:] = here, present, min(slowing, SLOWEST)
            lag.slowing = begun[2]
        self._goal = goal
