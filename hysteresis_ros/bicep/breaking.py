# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm one of whose muscles breaks: two balances, of which the second takes over the memory."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from hysteresis_ros.bicep.balance import ArmBalance
from hysteresis_ros.operators import HysteresisOperator


class BreakingBalance:
    """
    Arm and parallel muscles before and after one of them breaks; used as an `ArmBalance` is.

    In the sample during which it breaks the arm counts as on its way: the angle is that of the
    intact arm and that of the other, in proportion to the times before and after. So the angle is a
    continuous function of the time of the break.

    Parameters
    ----------
    intact, broken : ArmBalance
        The arm with all muscles, and with one less.
    time : float
        When it breaks, since the recording began [s].
    """

    def __init__(self, intact: ArmBalance, broken: ArmBalance, time: float) -> None:
        self._intact, self._broken, self.time = intact, broken, time
        self.span = intact.span
        self._present = intact

    def copy(self) -> BreakingBalance:
        """Return the same arm with a state of its own."""
        other = copy.copy(self)
        other._intact, other._broken = self._intact.copy(), self._broken.copy()
        other._present = other._broken if self._present is self._broken else other._intact
        return other

    def snapshot(self) -> tuple[bool, Any]:
        """Return the state for `rewind`."""
        return self._present is self._broken, self._present.snapshot()

    def rewind(self, snapshot: tuple[bool, Any]) -> None:
        """Go back to a state that `snapshot` returned."""
        broken, state = snapshot
        self._present = self._broken if broken else self._intact
        self._present.rewind(state)

    def take_over(self, other: ArmBalance | BreakingBalance) -> None:
        """Go on from the state of another arm; see `ArmBalance`."""
        # What is broken by then breaks in the next sample.
        self._present = self._intact
        self._present.take_over(other._present if isinstance(other, BreakingBalance) else other)

    @property
    def output(self) -> float:
        """Output of H2 [m]; see `ArmBalance`."""
        return self._present.output

    @property
    def operators(self) -> list[HysteresisOperator]:
        """H2 of each muscle that is told from the others."""
        return self._present.operators

    def load(self, angle: Any, clock: Any) -> Any:
        """Return the load [N] of each muscle at each angle [rad] and time [s]; see `ArmBalance`."""
        return np.where(np.asarray(clock) > self.time, self._broken.load(angle),
                        self._intact.load(angle))

    def settle(self, x: float, clock: float = 0.0, offset: float = 0.0) -> float:
        """Wipe the memory, take up the state of rest under `x` at `clock` [s]; see `ArmBalance`."""
        self._present = self._broken if clock > self.time else self._intact
        return self._present.settle(x, offset=offset)

    def step(self, x: float, dt: float, offset: float = 0.0, factor: float = 1.0,
             clock: float = 0.0) -> float:
        """Advance to the next sample, at `clock` [s]; see `ArmBalance`."""
        if clock <= self.time and self._present is self._intact:
            return self._intact.step(x, dt, offset, factor)
        before = self._break_before(x, dt, offset, factor)
        after = self._broken.step(x, dt, offset, factor)
        return after if before is None else _on_its_way(before, after, clock - self.time, dt)

    def run(self, cold: float, ends: np.ndarray, x: np.ndarray, dt: np.ndarray, offset: np.ndarray,
            factor: np.ndarray, clock: np.ndarray
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """
        Run whole trials, each from the cold state; see `ArmBalance`.

        Parameters
        ----------
        cold, ends, x, dt, offset, factor
            As for `ArmBalance.run`.
        clock : ndarray, shape (rows,)
            Time since the recording began [s].

        Returns
        -------
        rest : ndarray, shape (trials,)
            Angle in the cold state before each trial [rad].
        angles, outputs, inputs : ndarray, shape (rows,)
            As of `ArmBalance.run`.
        """
        return run_trials(self, cold, ends, np.array([x, dt, offset, factor, clock]))

    def proceed(self, x: np.ndarray, dt: np.ndarray, offset: np.ndarray, factor: np.ndarray,
                clock: np.ndarray) -> tuple[np.ndarray, ...]:
        """Go on from the present state; angles, outputs and inputs (rows,) as of `run`."""
        columns = np.array([x, dt, offset, factor])
        first = 0 if self._present is self._broken else int(
            np.searchsorted(clock, self.time, 'right'))
        parts = [self._present.proceed(*columns[:, :first])] if first else []
        if first < len(clock):
            before = self._break_before(*columns[:, first].tolist())
            rest = self._broken.proceed(*columns[:, first:])
            if before is not None:
                rest[0][0] = _on_its_way(before, rest[0][0], clock[first] - self.time, dt[first])
            parts.append(rest)
        return tuple(np.concatenate(pair) for pair in zip(*parts))

    def _break_before(self, x: float, dt: float, offset: float, factor: float) -> float | None:
        """Let the muscle break if it has not; return the angle [rad] of the arm if it had held."""
        if self._present is self._broken:
            return None
        self._broken.take_over(self._intact)
        self._present = self._broken
        return self._intact.step(x, dt, offset, factor)


def run_trials(arm: Any, cold: float, ends: np.ndarray, columns: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Run whole trials of an arm that can settle and proceed; see `BreakingBalance.run`."""
    clock, dt = columns[4], columns[1]
    rests, found, begin = [], np.empty((3, columns.shape[1])), 0
    for end in np.asarray(ends).tolist():
        rests.append(arm.settle(cold, float(clock[begin] - dt[begin])))
        found[:, begin:end] = arm.proceed(*columns[:, begin:end])
        begin = end
    return np.array(rests), *found


def _on_its_way(before: float, after: float, since: float, dt: float) -> float:
    """Return the angle [rad] of a sample of `dt` [s] that ends some time after the break."""
    share = min(since / dt, 1.0) if dt > 0.0 else 1.0
    return float(before + share * (after - before))
