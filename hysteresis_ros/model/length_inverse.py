# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The inverse of a muscle's elongation: the drive for it under a force (Eqs. 13 and 14)."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import NamedTuple, TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import Inputs, needs_phase
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.first_stage import FirstStage
from hysteresis_ros.model.pacing import Pacing
from hysteresis_ros.model.second_stage import SecondStage

if TYPE_CHECKING:
    from hysteresis_ros.model.muscle import MuscleModel

# Passes that bring a clipped drive into agreement with the phase that it causes.
PHASE_PASSES = 20
# Share of martensite that makes no difference to the drive.
SAME_SHARE = 1e-9


class Outcome(NamedTuple):
    """
    What a drive would do.

    `length` [m], `drive_squared`, what the muscles commit, and their share of martensite where an
    effect needs it.
    """

    length: float
    drive_squared: float
    following: np.ndarray
    phase: float


class LengthInverse:
    """
    Finds the drive for an elongation under a force, and says what a drive would do.

    It commits nothing: the memory of both stages and of the effects is its owner's to advance.

    Parameters
    ----------
    model : MuscleModel
        With a length stage.
    chain, steady : Chain
        All effects that are undone, and those of them that act at once.
    first : FirstStage
        With its memory.
    pacing : Pacing
        What is applied at present.
    limits : (float, float)
        Lowest and highest drive.
    clip : callable
        Brings a drive within the limits, and says whether it was beyond.

    Attributes
    ----------
    second : SecondStage
        With its memory.
    """

    def __init__(self, model: MuscleModel, chain: Chain, steady: Chain, first: FirstStage,
                 pacing: Pacing, limits: tuple[float, float],
                 clip: Callable[[float], tuple[float, bool]]) -> None:
        self._model, self._chain, self._steady = model, chain, steady
        self._first, self._pacing = first, pacing
        self._limits, self._clip = limits, clip
        self._heat_needs_phase = needs_phase([*steady.electrical, *steady.thermal])
        self.second = SecondStage(
            model.require_length_stage(chain), model.sign, chain, first.loaded)

    def find(self, length: float, force: float, inputs: Inputs, dead_band: float
             ) -> tuple[float, bool, Outcome, Inputs]:
        """
        Return the drive nearest to an elongation under a force.

        Parameters
        ----------
        length : float
            Elongation [m].
        force : float
            Tension of one muscle [N].
        inputs : Inputs
            Surroundings, and a first guess of the phase.
        dead_band : float
            A reversal of the length by less than this [m] is not followed.

        Returns
        -------
        drive : float
            Within the limits.
        saturated : bool
            Whether the elongation is out of reach.
        outcome : Outcome
            Of the drive.
        inputs : Inputs
            With the phase that the drive causes.
        """
        find = self._search if self._steady.drifts else self._invert
        drive, saturated = find(length, force, inputs, dead_band)
        outcome = self.outcome(drive, force, inputs)
        if self._steady.drifts and self._chain.needs_phase:
            # Of a length to which time and use add, the transformation's share is not known before.
            for _ in range(PHASE_PASSES):
                if abs(outcome.phase - inputs.phase) <= SAME_SHARE:
                    break
                inputs = inputs._replace(phase=outcome.phase)
                if not self._heat_needs_phase:
                    break
                drive, saturated = find(length, force, inputs, dead_band)
                outcome = self.outcome(drive, force, inputs)
        return drive, saturated, outcome, inputs

    def _transformed(self, length: float, force: float) -> float:
        """Return what the transformation has to give for a length [m] under a force [N]."""
        base = self.second.base
        scale = float(self._chain.scale(np.float64(force)))
        return base + (length - base - float(self._chain.stretch(np.float64(force)))) / scale

    def share(self, length: float, force: float) -> float:
        """Return the share of martensite at a length [m] under a force [N]."""
        return float(self._model.martensite(
            self.second.given(self._transformed(length, force), force)))

    def _invert(self, length: float, force: float, inputs: Inputs, dead_band: float
                ) -> tuple[float, bool]:
        """Drive in closed form, and whether it is out of reach."""
        x, out_of_reach = self.second.drive(
            self._transformed(length, force), force, dead_band)
        drive_squared, saturated = self._first.invert(x)
        drive, clipped = self._clip(self._steady.inverse(drive_squared, inputs))
        return drive, out_of_reach or saturated or clipped

    def _search(self, length: float, force: float, inputs: Inputs, dead_band: float
                ) -> tuple[float, bool]:
        """Drive by a search: the offset of time and use depends on the drive that is sought."""
        low, high = self._limits
        if not math.isfinite(high):
            high = float(self._chain.to_drive(self._chain.surroundings.full_drive_squared))

        def error(drive: float) -> float:
            return self._model.sign * (
                self.outcome(drive, force, inputs).length - length)

        here = self._pacing.drive
        if low <= here <= high and abs(error(here)) <= dead_band:
            return here, False
        margin = 1e-9 * self._chain.surroundings.span
        at_low, at_high = error(low), error(high)
        if at_low >= 0.0:
            return low, at_low > margin
        if at_high <= 0.0:
            return high, at_high < -margin
        from scipy.optimize import brentq   # half a second that most models do not need
        return brentq(error, low, high, xtol=1e-14, rtol=1e-14), False

    def outcome(self, drive: float, force: float, inputs: Inputs) -> Outcome:
        """Say what a drive would do; commits nothing."""
        worn = self.worn(inputs, drive)
        drive_squared = self._steady.step(drive, worn)
        output, committed = self.second.respond(self._first.peek(drive_squared), force)
        phase = (float(self._model.martensite(self.second.given(output, force)))
                 if self._chain.needs_phase else math.nan)
        offset, factor = 0.0, 1.0
        if self._steady.drifts:
            before = self._steady.save()
            # What the transformation leads to is that of this drive, not of the guess before it.
            offset, factor = self._steady.advance(
                drive, drive_squared, worn._replace(phase=phase))
            self._steady.restore(before)
        base, felt = self.second.base, np.float64(force)
        length = (base + float(self._chain.scale(felt)) * factor * (output - base)
                  + float(self._chain.stretch(felt)) + offset)
        return Outcome(length, drive_squared, committed, phase)

    def worn(self, inputs: Inputs, drive: float) -> Inputs:
        """Return the inputs with the cycles that there will be after `drive`."""
        travel = self._pacing.travel + abs(drive - self._pacing.drive)
        return inputs._replace(cycles=travel / (2.0 * self._model.drive_range))
