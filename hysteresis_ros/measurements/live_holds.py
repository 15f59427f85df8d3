# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Settled states of an arm while it runs, one for each hold of the drive, as they end."""

from __future__ import annotations

from collections import deque
import math
from typing import NamedTuple

from hysteresis_ros.measurements.table import SETTLED_HOLD

# Seconds at the end of a hold that are averaged, and the most samples that are kept for it.
AVERAGE, MOST_SAMPLES = 1.0, 1000


class Hold(NamedTuple):
    """
    The end of a hold, with the way that led there.

    Attributes
    ----------
    time : float
        Of the last sample [s].
    voltage, angle, predicted, ambient : float
        Means over the last second of the hold [V], [rad], [rad], [degC].
    lowest, highest : float
        Angles [rad] between which the arm was since the hold before.
    least, most : float
        Voltages [V] between which the drive was since then.

    """

    time: float
    voltage: float
    angle: float
    predicted: float
    ambient: float
    lowest: float
    highest: float
    least: float
    most: float


class HoldDetector:
    """
    Find the holds in the samples of an arm.

    Parameters
    ----------
    tolerance : float
        Change of the voltage [V] that is none: a board rounds, and measures its supply.
    shortest : float
        Time [s] that a hold has to last.

    """

    def __init__(self, tolerance: float, shortest: float = SETTLED_HOLD) -> None:
        self._tolerance = tolerance
        self._shortest = shortest
        self.reset()

    def reset(self) -> None:
        """Forget what came before."""
        self._samples: deque[tuple[float, float, float, float, float]] = deque(
            maxlen=MOST_SAMPLES)
        self._level = math.nan
        self._begin = math.nan
        self._angles = self._voltages = (math.inf, -math.inf)

    def add(self, time: float, voltage: float, angle: float, predicted: float = math.nan,
            ambient: float = math.nan) -> Hold | None:
        """
        Take one sample.

        Parameters
        ----------
        time : float
            Time [s]; it does not go back.
        voltage : float
            Applied since the sample before [V].
        angle, predicted : float
            Measured, and predicted by the model [rad].
        ambient : float
            Temperature of the room [degC]; NaN if unknown.

        Returns
        -------
        Hold or None
            The hold that this sample ends, if it was long enough.

        """
        ended = None
        if not abs(voltage - self._level) <= self._tolerance:
            ended = self._end()
            self._level, self._begin = voltage, time
            self._samples.clear()
        self._angles = _with(self._angles, angle)
        self._voltages = _with(self._voltages, voltage)
        self._samples.append((time, voltage, angle, predicted, ambient))
        while self._samples[0][0] < time - AVERAGE:
            self._samples.popleft()
        return ended

    def _end(self) -> Hold | None:
        if not self._samples or self._samples[-1][0] - self._begin < self._shortest * (1 - 1e-3):
            return None
        time = self._samples[-1][0]
        voltage, angle, predicted, ambient = (
            math.fsum(column) / len(self._samples) for column in list(zip(*self._samples))[1:])
        hold = Hold(time, voltage, angle, predicted, ambient, *self._angles, *self._voltages)
        self._angles, self._voltages = (angle, angle), (voltage, voltage)
        return hold


def _with(between: tuple[float, float], value: float) -> tuple[float, float]:
    return min(between[0], value), max(between[1], value)
