# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The forward model that runs along with the arm, one sample at a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hysteresis_ros.effects import Inputs
from hysteresis_ros.model.stepper import Stepper

if TYPE_CHECKING:
    from hysteresis_ros.model.muscle import MuscleModel

# Beyond, in any unit, it is no drive: its square would overflow what the lags remember.
LARGEST_DRIVE = 1e12


class Observer:
    """
    Predict the measured angle from the applied drive.

    It gives what `Simulator` gives for the same samples. Effects that depend on the phase take the
    one that each sample ends with, which is found within the sample.

    Parameters
    ----------
    model : MuscleModel
        With a geometry.

    Raises
    ------
    ParameterError
        If the model has no arm, or a muscle that cannot lift it.
    ModelFileError
        If it has no length stage.
    """

    def __init__(self, model: MuscleModel) -> None:
        self.model = model
        self._chain = model.chain()
        self._arm = Stepper(
            model, self._chain, model.first_stage(self._chain), model.lifting(self._chain))
        self._travel = 0.0
        self._time: float | None = None
        self.reset()

    def reset(self, time: float | None = None) -> None:
        """
        Forget the history: the muscle was heated and cooled. What has worn it stays.

        Parameters
        ----------
        time : float, optional
            When it begins [s]; by default with the first sample.
        """
        rest = self._arm.start((self._time or 0.0) if time is None else time)
        for effect in self._chain.sensor:
            rest = effect.start_from(rest)
        self._time = time
        self._drive = self.model.cold_drive

    def step(self, time: float, drive: float, ambient: float = math.nan,
             supply: float = math.nan) -> float:
        """
        Advance to the next sample.

        Parameters
        ----------
        time : float
            Time [s]. One that does not grow counts as no time.
        drive : float
            Drive since the sample before. No number, or one beyond all reason, counts as the one
            before.
        ambient : float
            Ambient temperature [degC], NaN if unknown.
        supply : float
            Voltage of the supply [V], NaN if unknown, or if `drive` is what was applied.

        Returns
        -------
        float
            Predicted angle [rad] as the sensor would give it.
        """
        if not abs(drive) < LARGEST_DRIVE:
            drive = self._drive
        before = time if self._time is None else self._time
        if not time >= before:
            time = before
        dt = time - before
        self._travel += abs(drive - self._drive)
        self._time, self._drive = time, drive
        inputs = Inputs(time, time, dt, ambient, math.nan,
                        self._travel / (2.0 * self.model.drive_range), supply)
        angle = self._arm.step(drive, inputs)
        for effect in self._chain.sensor:
            angle = effect.step(angle, dt)
        return angle
