# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The forward model that runs along with the arm, one sample at a time."""

import math

import numpy as np

from hysteresis_ros.bicep.balance import ArmBalance
from hysteresis_ros.effects import Inputs


class Observer:
    """
    Predict the measured angle from the applied drive.

    Effects that need more of the past than a state (creep since the last step) are left out.

    Parameters
    ----------
    model : MuscleModel
        With a geometry.
    """

    def __init__(self, model):
        self.model = model
        self._chain = model.chain()
        offsets = next((e.offsets for e in model.effects if hasattr(e, 'offsets')), (0.0,))
        self._first = model.first_stage(self._chain)
        self._balance = ArmBalance(model.require_length_stage(), model.require_geometry(),
                                   self._chain, offsets)
        self.reset()

    def reset(self) -> None:
        """Forget the history: the muscle was heated and cooled."""
        cold = self.model.cold_drive
        self._chain.start()
        self._first.reset()
        self._balance.start()
        self._balance.settle(self._first.step(float(self._chain.to_heat(cold))))
        self._time = None
        self._drive = cold
        self._travel = 0.0
        self._phase = 1.0

    def step(self, time: float, drive: float, ambient: float = math.nan) -> float:
        """
        Advance to the next sample.

        Parameters
        ----------
        time : float
            Time [s]; it has to grow.
        drive : float
            Drive since the sample before. A value that is not finite counts as the one before.
        ambient : float
            Ambient temperature [degC], NaN if unknown.

        Returns
        -------
        float
            Predicted angle [rad] as the sensor would give it.
        """
        if not math.isfinite(drive):
            drive = self._drive
        dt = 0.0 if self._time is None else max(time - self._time, 0.0)
        self._travel += abs(drive - self._drive)
        low, high = self.model.ranges.get(self.model.drive, (0.0, 1.0))
        cycles = self._travel / (2.0 * max(high - low, 1e-12))
        inputs = Inputs(time, time, dt, ambient, self._phase, cycles)
        heat = self._chain.step(drive, inputs)
        one = np.array
        offset, factor = self._chain.drift(one([drive]), one([heat]), inputs._replace(
            time=one([time]), cycles=one([cycles])))
        angle = self._balance.step(self._first.step(heat), dt, float(offset[0]), float(factor[0]))
        if self._chain.needs_phase:
            low, high = self.model.length_stage.output_range
            length = float(self.model.geometry.length(angle))
            self._phase = min(max((length - low) / (high - low), 0.0), 1.0)
        self._time, self._drive = time, drive
        for effect in self._chain.sensor:
            angle = effect.step(angle, dt)
        return angle
