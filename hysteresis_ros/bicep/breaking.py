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

    def load(self, angle: float) -> float:
        """Return the load [N] of each muscle at an angle [rad]; see `ArmBalance`."""
        return self._present.load(angle)

    def settle(self, x: float, clock: float = 0.0, offset: float = 0.0) -> float:
        """Wipe the memory, take up the state of rest under `x` at `clock` [s]; see `ArmBalance`."""
        self._present = self._broken if clock > self.time else self._intact
        return self._present.settle(x, offset=offset)

    def step(self, x: float, dt: float, offset: float = 0.0, factor: float = 1.0,
             clock: float = 0.0) -> float:
        """Advance to the next sample, at `clock` [s]; see `ArmBalance`."""
        if self._present is self._broken or clock <= self.time:
            return self._present.step(x, dt, offset, factor)
        self._broken.take_over(self._intact)
        self._present = self._broken
        before, after = (one.step(x, dt, offset, factor) for one in (self._intact, self._broken))
        return _on_its_way(before, after, clock - self.time, dt)

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
        rests, found, begin = [], np.empty((3, len(x))), 0
        for end in np.asarray(ends).tolist():
            own = slice(begin, end)
            rests.append(self.settle(cold, float(clock[begin] - dt[begin])))
            found[:, own] = self.proceed(x[own], dt[own], offset[own], factor[own], clock[own])
            begin = end
        return np.array(rests), *found

    def proceed(self, x: np.ndarray, dt: np.ndarray, offset: np.ndarray, factor: np.ndarray,
                clock: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Go on from the present state, within one trial; see `ArmBalance`."""
        columns = np.array([x, dt, offset, factor])
        first = int(np.searchsorted(clock, self.time, 'right'))
        if self._present is self._broken or first == len(clock):
            return self._present.proceed(*columns)
        head = self._intact.proceed(*columns[:, :first])
        self._broken.take_over(self._intact)
        self._present = self._broken
        before = self._intact.step(*columns[:, first].tolist())
        tail = self._broken.proceed(*columns[:, first:])
        tail[0][0] = _on_its_way(before, tail[0][0], clock[first] - self.time, float(dt[first]))
        angles, outputs, inputs = (np.concatenate(pair) for pair in zip(head, tail))
        return angles, outputs, inputs


def _on_its_way(before: float, after: float, since: float, dt: float) -> float:
    """Return the angle [rad] of a sample of `dt` [s] that ends some time after the break."""
    share = min(since / dt, 1.0) if dt > 0.0 else 1.0
    return float(before + share * (after - before))
