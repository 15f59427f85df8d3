# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The forward model that runs along with the arm, one sample at a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hysteresis_ros.effects import Inputs

if TYPE_CHECKING:
    from hysteresis_ros.model.muscle import MuscleModel

# Beyond, in any unit, it is no drive: its square would overflow what the lags remember.
LARGEST_DRIVE = 1e12


class Observer:
    """
    Predict the measured angle from the applied drive.

    It gives what `Simulator` gives for the same samples, but for effects that depend on the phase:
    those take the phase of the sample before.

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
        self._first = model.first_stage(self._chain)
        self._balance = model.balance(self._chain)
        self._travel = 0.0
        self.reset()

    def reset(self, time: float | None = None) -> None:
        """
        Forget the history: the muscle was heated and cooled. What has worn it stays.

        Parameters
        ----------
        time : float, optional
            When it begins [s]; by default with the first sample.
        """
        cold = self.model.cold_drive
        self._chain.start()
        self._first.reset()
        self._balance.start()
        rest = self._balance.settle(self._first.step(float(self._chain.to_drive_squared(cold))))
        for effect in self._chain.sensor:
            effect.begin(rest)
        self._time = time
        self._drive = cold
        self._phase = 1.0

    def step(self, time: float, drive: float, ambient: float = math.nan) -> float:
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
        inputs = Inputs(time, time, dt, ambient, self._phase,
                        self._travel / (2.0 * self.model.drive_range))
        drive_squared = self._chain.step(drive, inputs)
        offset, factor = self._chain.advance(drive, drive_squared, inputs)
        angle = self._balance.step(self._first.step(drive_squared), dt, offset, factor)
        if self._chain.needs_phase:
            self._phase = float(self.model.martensite(self._balance.output))
        for effect in self._chain.sensor:
            angle = effect.step(angle, dt)
        return angle
