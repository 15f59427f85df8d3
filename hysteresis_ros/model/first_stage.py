# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The first stage of a muscle's model: from the drive squared to what the load is weighed with."""

import copy

import numpy as np

from hysteresis_ros.model.chain import Chain
from hysteresis_ros.operators import HysteresisOperator


class FirstStage:
    """
    From the drive squared that the muscle feels to x, in the unit of the load.

    In the paper's model x = H1[V]. With `stress_dependence` on the bench x = C V^2 takes its place,
    because temperature, not blocked force, is then what the load is weighed against. A model
    without a first stage takes the drive as it is.

    Parameters
    ----------
    operator : HysteresisOperator or None
        The first stage H1; it is copied.
    chain : Chain
        Effects of the model.
    """

    def __init__(self, operator: HysteresisOperator | None, chain: Chain) -> None:
        self._chain = chain
        self.load_per_drive_squared = chain.load_per_drive_squared()
        self.loaded = self.load_per_drive_squared > 0.0 or operator is not None
        self._operator: HysteresisOperator | None = None
        if self.load_per_drive_squared == 0.0 and operator is not None:
            self._operator = copy.deepcopy(operator)
            self._operator.reset()

    def reset(self) -> None:
        """Wipe the memory."""
        if self._operator is not None:
            self._operator.reset()

    def save(self) -> dict:
        """Return the memory."""
        return self._operator.save() if self._operator is not None else {}

    def restore(self, state: dict) -> None:
        """Take a saved memory back."""
        if self._operator is not None:
            self._operator.restore(state)

    def simulate(self, drive_squared: np.ndarray) -> np.ndarray:
        """Return x for the drive squared of consecutive rows, shape (rows,)."""
        if self.load_per_drive_squared > 0.0:
            return self.load_per_drive_squared * drive_squared
        drive = self._chain.to_drive(drive_squared)
        return self._operator.simulate(drive) if self._operator is not None else drive

    def step(self, drive_squared: float) -> float:
        """Commit one sample."""
        if self.load_per_drive_squared > 0.0:
            return self.load_per_drive_squared * drive_squared
        drive = float(self._chain.to_drive(drive_squared))
        return self._operator.step(drive) if self._operator is not None else drive

    def invert(self, x: float) -> tuple[float, bool]:
        """Return the drive squared for x, and whether x is out of reach."""
        if self.load_per_drive_squared > 0.0:
            return x / self.load_per_drive_squared, False
        if self._operator is None:
            return float(self._chain.to_drive_squared(x)), False
        found = self._operator.invert(x)
        return float(self._chain.to_drive_squared(found.input)), found.saturated

    def peek(self, drive_squared: float) -> float:
        """Return x without committing."""
        if self.load_per_drive_squared > 0.0:
            return self.load_per_drive_squared * drive_squared
        drive = float(self._chain.to_drive(drive_squared))
        return self._operator.peek(drive) if self._operator is not None else drive
