# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The target at each time, along a trajectory or behind a stream of commands."""

from __future__ import annotations

import math

from hysteresis_ros.bicep.trajectory import Trajectory

# Time that a target which stood still may make up for at once [s]: that between two commands.
HEAD_START = 0.1


class Follower:
    """
    The target of one joint, which moves no faster than the muscle can.

    What is asked for faster is reached later. The time is injected.

    Parameters
    ----------
    maximum_speed : float
        Largest speed of the target [rad/s].
    """

    def __init__(self, maximum_speed: float = math.inf) -> None:
        self.maximum_speed = maximum_speed
        self._target: float | None = None
        self._measured = False      # whether the target is only where the arm was found
        self._time = -math.inf
        self._trajectory: Trajectory | None = None
        self._start = 0.0
        self._late = 0.0

    @property
    def moving(self) -> bool:
        """Whether there is a trajectory whose end is not reached."""
        return self._trajectory is not None

    @property
    def late(self) -> float:
        """How long the target still needs to what was asked for at the last step [s]."""
        return self._late

    def stop(self, target: float | None = None) -> None:
        """Stand at `target` [rad]; None if nothing is asked of the arm."""
        self._target, self._trajectory, self._late = target, None, 0.0
        self._measured = False

    def follow(self, trajectory: Trajectory, start: float, now: float,
               measured: float | None = None) -> None:
        """
        Set out on a trajectory.

        Parameters
        ----------
        trajectory : Trajectory
            A single point at time 0 is a command.
        start, now : float
            When it begins, and the time now [s].
        measured : float, optional
            Where the arm is [rad]: it sets out from there if there was no target before.
        """
        if self._target is None and measured is not None and math.isfinite(measured):
            self._target, self._measured = measured, True
        if self._target is not None:
            trajectory = trajectory.begun_from(self._target)
        if self._trajectory is None:
            self._time = max(self._time, now - HEAD_START)
        self._trajectory, self._start = trajectory, start

    def step(self, now: float) -> float | None:
        """Return the target [rad] at the time `now` [s]; None as long as there is none."""
        trajectory = self._trajectory
        # A clock that was set back, as by a recording that begins anew, is no reason to wait.
        self._time = min(self._time, now)
        if trajectory is None or now < self._start:
            return None if self._measured else self._target
        wanted = trajectory.angle(now - self._start)
        self._late = 0.0
        if self._target is not None:
            reach = self.maximum_speed * (now - max(self._time, self._start - HEAD_START))
            change = wanted - self._target
            if abs(change) > reach:
                self._late = (abs(change) - reach) / self.maximum_speed
                wanted = self._target + math.copysign(reach, change)
        self._target, self._time, self._measured = wanted, now, False
        if not self._late and now - self._start >= trajectory.end:
            self._trajectory = None
        return wanted
