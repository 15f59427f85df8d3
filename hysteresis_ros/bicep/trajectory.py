# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Trajectories of one joint: way points in time, and polynomials between them.

As ros2_control's joint trajectory controller has it: linear where the points give positions alone,
cubic with velocities, quintic with accelerations, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from hysteresis_ros.errors import RangeError

# Between two way points a polynomial is looked at here, too: it may leave what both respect.
BETWEEN = np.linspace(0.0, 1.0, 17)


class Trajectory:
    """
    Angle over time along way points; before the first and after the last it stands still.

    Parameters
    ----------
    times : array_like, shape (n,)
        Ascending times from the start [s], n at least 1.
    angles : array_like, shape (n,)
        Angles [rad].
    velocities, accelerations : array_like, shape (n,), optional
        Derivatives in the points [rad/s, rad/s^2]; accelerations only with velocities.

    Raises
    ------
    RangeError
        If there is no point, a number is not finite, or times are negative or do not ascend.
    """

    def __init__(self, times: ArrayLike, angles: ArrayLike, velocities: ArrayLike | None = None,
                 accelerations: ArrayLike | None = None) -> None:
        self._times = np.asarray(times, dtype=float)
        self._angles = np.asarray(angles, dtype=float)
        self._velocities = None if velocities is None else np.asarray(velocities, dtype=float)
        self._accelerations = (None if velocities is None or accelerations is None
                               else np.asarray(accelerations, dtype=float))
        self._check()
        self._polynomials = self._fit()

    def _check(self) -> None:
        if not self._times.size:
            raise RangeError('the trajectory has no points')
        for name, values in (('time', self._times), ('position', self._angles),
                             ('velocity', self._velocities),
                             ('acceleration', self._accelerations)):
            if values is None:
                continue
            if not np.all(np.isfinite(values)):
                index = int(np.argmin(np.isfinite(values)))
                raise RangeError(f'point {index + 1} of the trajectory has the {name} '
                                 f'{values[index]}; it has to be a finite number')
        if self._times[0] < 0.0:
            raise RangeError(f'the trajectory begins at {self._times[0]:g} s, before its start')
        falling = np.flatnonzero(np.diff(self._times) <= 0.0)
        if falling.size:
            index = int(falling[0]) + 1
            raise RangeError(f'point {index + 1} of the trajectory is at {self._times[index]:g} s, '
                             f'not after point {index} at {self._times[index - 1]:g} s')

    def _fit(self) -> np.ndarray:
        """Return the coefficients of each segment, shape (n - 1, 6), lowest power first."""
        duration, change = np.diff(self._times), np.diff(self._angles)
        fitted = np.zeros((duration.size, 6))
        fitted[:, 0] = self._angles[:-1]
        if self._velocities is None:
            fitted[:, 1] = change / duration
            return fitted
        v0, v1 = self._velocities[:-1], self._velocities[1:]
        fitted[:, 1] = v0
        if self._accelerations is None:
            fitted[:, 2] = (3.0 * change - (2.0 * v0 + v1) * duration) / duration ** 2
            fitted[:, 3] = (-2.0 * change + (v0 + v1) * duration) / duration ** 3
            return fitted
        a0 = self._accelerations[:-1] * duration ** 2
        a1 = self._accelerations[1:] * duration ** 2
        v0, v1 = v0 * duration, v1 * duration
        fitted[:, 2] = 0.5 * a0 / duration ** 2
        fitted[:, 3] = 0.5 * (20.0 * change - 8.0 * v1 - 12.0 * v0 - 3.0 * a0 + a1) / duration ** 3
        fitted[:, 4] = 0.5 * (-30.0 * change + 14.0 * v1 + 16.0 * v0 + 3.0 * a0 - 2.0 * a1
                              ) / duration ** 4
        fitted[:, 5] = 0.5 * (12.0 * change - 6.0 * (v1 + v0) + a1 - a0) / duration ** 5
        return fitted

    @property
    def end(self) -> float:
        """Time of the last point [s]."""
        return float(self._times[-1])

    def angle(self, time: float) -> float:
        """Return the angle [rad] at a time [s]."""
        if time >= self._times[-1]:
            return float(self._angles[-1])
        if time <= self._times[0]:
            return float(self._angles[0])
        index = int(np.searchsorted(self._times, time, side='right')) - 1
        x, value = time - self._times[index], 0.0
        for coefficient in self._polynomials[index, ::-1]:
            value = value * x + coefficient
        return float(value)

    def extent(self) -> tuple[float, float]:
        """Return the smallest and the largest angle [rad] on the way."""
        angles = np.concatenate([self._angles, self._along(self._polynomials).ravel()])
        return float(angles.min()), float(angles.max())

    def speed(self) -> float:
        """Return the largest speed on the way [rad/s]."""
        derivative = self._polynomials[:, 1:] * np.arange(1, 6)
        return float(np.abs(self._along(derivative)).max(initial=0.0))

    def _along(self, polynomials: np.ndarray) -> np.ndarray:
        x = np.diff(self._times)[:, np.newaxis] * BETWEEN
        values = np.zeros_like(x)
        for power in range(polynomials.shape[1] - 1, -1, -1):
            values = values * x + polynomials[:, power, np.newaxis]
        return values

    def begun_from(self, angle: float) -> Trajectory:
        """Return this trajectory with a way from `angle` [rad] at its start to its first point."""
        if self._times[0] <= 0.0:
            return self

        def before(values: np.ndarray | None, first: float) -> Sequence[float] | None:
            return None if values is None else [first, *values]
        return Trajectory([0.0, *self._times], [angle, *self._angles],
                          before(self._velocities, 0.0), before(self._accelerations, 0.0))
