# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm whose muscles keep a residual strain from the largest load that they have borne."""

from __future__ import annotations

from collections.abc import Callable
import copy
import math
from typing import Any

import numpy as np

from hysteresis_ros.bicep.balance import ArmBalance
from hysteresis_ros.bicep.breaking import BreakingBalance, run_trials
from hysteresis_ros.operators import HysteresisOperator

# A residual elongation is found to this [m], in so many trials at most.
TOLERANCE, MOST_TRIALS = 1e-9, 60
# An arm that has not yielded in so many rows is taken not to in this many times as many, until its
# load is looked at.
FURTHER = 4


class YieldingBalance:
    """
    An arm and its muscles that yield; used as an `ArmBalance` is.

    The residual elongation is the largest ``(F - Fy) / K`` so far. Where a sample would make it
    larger, the arm sinks by it, so that the sample is balanced again until both agree. Heating and
    cooling do not undo it; it lasts as long as this object.

    Parameters
    ----------
    arm : ArmBalance or BreakingBalance
        The arm without residual strain.
    load : float
        Load Fy of each muscle from which it yields [N].
    compliance : float
        Residual elongation per load beyond, 1 / K [m/N].
    """

    def __init__(self, arm: ArmBalance | BreakingBalance, load: float, compliance: float) -> None:
        self._arm: Any = arm
        self._load, self._compliance = load, compliance
        self.span = arm.span
        self._residual = 0.0

    def copy(self) -> YieldingBalance:
        """Return the same arm with a state of its own."""
        other = copy.copy(self)
        other._arm = self._arm.copy()
        return other

    def snapshot(self) -> tuple[float, Any]:
        """Return the state for `rewind`."""
        return self._residual, self._arm.snapshot()

    def rewind(self, snapshot: tuple[float, Any]) -> None:
        """Go back to a state that `snapshot` returned."""
        self._residual, state = snapshot
        self._arm.rewind(state)

    def take_over(self, other: ArmBalance | BreakingBalance | YieldingBalance) -> None:
        """Go on from the state of another arm, with the residual strain that it has, if any."""
        self._residual = 0.0
        if isinstance(other, YieldingBalance):
            self._residual, other = other._residual, other._arm
        self._arm.take_over(other)

    @property
    def residual(self) -> float:
        """Residual elongation of each muscle so far [m]."""
        return self._residual

    @property
    def output(self) -> float:
        """Output of H2 [m]; see `ArmBalance`."""
        return self._arm.output

    @property
    def operators(self) -> list[HysteresisOperator]:
        """H2 of each muscle that is told from the others."""
        return self._arm.operators

    def settle(self, x: float, clock: float = 0.0, offset: float = 0.0) -> float:
        """Wipe the memory, take up the state of rest under `x` at `clock` [s]; see `ArmBalance`."""
        return self._yield(lambda more: self._arm.settle(x, clock, offset + more), clock)

    def step(self, x: float, dt: float, offset: float = 0.0, factor: float = 1.0,
             clock: float = 0.0) -> float:
        """Advance to the next sample, at `clock` [s]; see `ArmBalance`."""
        return self._yield(lambda more: self._arm.step(x, dt, offset + more, factor, clock), clock)

    def _yield(self, advance: Callable[[float], float], clock: float) -> float:
        """Return the angle of `advance(residual)`, with the residual elongation under its load."""
        state = self._arm.snapshot()
        angle = advance(self._residual)
        low, above = self._residual, self._residual_under(angle, clock) - self._residual
        high, below = math.inf, 0.0
        # The longer the muscles, the less they yield.
        for trial in range(MOST_TRIALS if above > TOLERANCE else 0):
            if high == math.inf:
                self._residual = low + above
            elif trial % 2:
                self._residual = low + (high - low) * above / (above - below)
            else:
                self._residual = 0.5 * (low + high)
            self._arm.rewind(state)
            angle = advance(self._residual)
            error = self._residual_under(angle, clock) - self._residual
            if abs(error) <= TOLERANCE:
                break
            if error > 0.0:
                low, above = self._residual, error
            else:
                high, below = self._residual, error
        return angle

    def _residual_under(self, angle: Any, clock: Any) -> Any:
        """Return the residual elongation [m] under the load at each angle [rad]."""
        return self._compliance * np.maximum(self._arm.load(angle, clock) - self._load, 0.0)

    def run(self, cold: float, ends: np.ndarray, x: np.ndarray, dt: np.ndarray, offset: np.ndarray,
            factor: np.ndarray, clock: np.ndarray
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Run all trials of a recording, each from the cold state; see `BreakingBalance`."""
        self._residual = 0.0
        return run_trials(self, cold, ends, np.array([x, dt, offset, factor, clock]))

    def proceed(self, x: np.ndarray, dt: np.ndarray, offset: np.ndarray, factor: np.ndarray,
                clock: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Go on from the present state, within one trial; see `ArmBalance`."""
        columns, rows = np.array([x, dt, offset, factor, clock]), len(x)
        found, begin, ahead = np.empty((3, rows)), 0, rows
        while begin < rows:
            held = 0
            if ahead > 1:
                held = self._hold(columns[:, begin:begin + ahead], found[:, begin:begin + ahead])
                begin += held
            if held == ahead or begin == rows:
                ahead *= FURTHER
                continue
            before = self._residual
            found[:, begin] = (self.step(*columns[:, begin].tolist()), self.output,
                               self.operators[0].input)
            begin += 1
            # While the load grows it yields row after row.
            ahead = 1 if self._residual > before else FURTHER
        angles, outputs, inputs = found
        return angles, outputs, inputs

    def _hold(self, columns: np.ndarray, found: np.ndarray) -> int:
        """Fill `found` (3, rows) as far as nothing yields, go there, and return how far."""
        state, (x, dt, offset, *others) = self._arm.snapshot(), columns
        found[:] = self._arm.proceed(x, dt, offset + self._residual, *others)
        above = self._residual_under(found[0], others[-1]) - self._residual > TOLERANCE
        if not above.any():
            return len(x)
        held = int(np.argmax(above))
        self._arm.rewind(state)
        if held:
            self._arm.proceed(x[:held], dt[:held], offset[:held] + self._residual,
                              *(column[:held] for column in others))
        return held
