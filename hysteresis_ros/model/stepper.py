# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The arm of a model advanced one sample at a time, up to the sensor."""

from __future__ import annotations

import math
from typing import Any, TYPE_CHECKING

from hysteresis_ros.effects import Inputs
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.first_stage import FirstStage
from hysteresis_ros.model.phase import agree

if TYPE_CHECKING:
    from hysteresis_ros.model.muscle import Lifting, MuscleModel


class Stepper:
    """
    From the drive to the true angle, one sample at a time.

    Effects that depend on the phase take the one that each sample ends with. It is found within the
    sample, so that neither the rate of the samples nor noise of the drive make it swing.

    Parameters
    ----------
    model : MuscleModel
        Scales and limits of the muscle.
    chain : Chain
        Its effects.
    first : FirstStage
        Its first stage.
    balance : ArmBalance, BreakingBalance or YieldingBalance
        The arm.
    """

    def __init__(self, model: MuscleModel, chain: Chain, first: FirstStage,
                 balance: Lifting) -> None:
        self._model = model
        self._chain, self._first, self._balance = chain, first, balance

    def start(self, clock: float = 0.0) -> float:
        """Wipe the memory: full heat and cool cycle, at `clock` [s]; return the angle at rest."""
        self._chain.start()
        self._first.reset()
        self._phase = 1.0
        cold = float(self._chain.to_drive_squared(self._model.cold_drive))
        return self._balance.settle(self._first.step(cold), clock)

    def step(self, drive: float, inputs: Inputs) -> float:
        """Advance to the next sample and return the angle [rad]; `inputs.phase` does not count."""
        if self._chain.needs_phase:
            angle, drive_squared = self._agree(drive, inputs)
        else:
            angle, drive_squared = self._try(drive, inputs)
        self._first.step(drive_squared)
        return angle

    def _try(self, drive: float, inputs: Inputs) -> tuple[float, float]:
        """Advance all but the first stage; return angle [rad] and drive squared."""
        drive_squared = self._chain.step(drive, inputs)
        offset, factor = self._chain.advance(drive, drive_squared, inputs)
        x = self._first.peek(drive_squared)
        return self._balance.step(x, inputs.dt, offset, factor, inputs.clock), drive_squared

    def _agree(self, drive: float, inputs: Inputs) -> tuple[float, float]:
        """Do the same with the phase that it leads to."""
        chain = self._chain.save()
        balance: Any = self._balance.snapshot()
        found = math.nan, math.nan

        def caused(phase: float) -> float:
            nonlocal found
            self._chain.restore(chain)
            self._balance.rewind(balance)
            found = self._try(drive, inputs._replace(phase=phase))
            return float(self._model.martensite(self._balance.output))

        self._phase = agree(caused, self._phase)
        return found
