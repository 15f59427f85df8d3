# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The straight line: the operator without hysteresis that the paper compares with (Eq. 11)."""

import math
from typing import Any, Mapping

import numpy as np

from .base import (
    HysteresisOperator, LARGEST, input_range, memory, number, resolution,
    sequence, take)
from .branch import PiecewiseQuadratic
from ..errors import ParameterError


class Linear(HysteresisOperator):
    """
    Output = slope * input + intercept.

    Parameters
    ----------
    slope : float
        Unit of the output over the unit of the input; any sign, also zero.
    intercept : float
        Output at input zero.
    lower, upper : float
        Input range.

    Raises
    ------
    ParameterError
        If a value is not finite or the range is empty.

    """

    kind = 'linear'

    def __init__(self, slope: float, intercept: float, lower: float, upper: float) -> None:
        self.slope = number(slope, 'linear operator: slope')
        self.intercept = number(intercept, 'linear operator: intercept')
        self.lower, self.upper = input_range(lower, upper, 'linear operator')
        ends = self._at(self.lower), self._at(self.upper)
        if not max(map(abs, ends)) <= LARGEST:
            raise ParameterError(
                f'linear operator: the output reaches beyond {LARGEST:g}, use another unit')
        self._ends = min(ends), max(ends)
        self._tolerance = resolution(self._ends)
        self.reset()

    def _at(self, u: float) -> float:
        return self.intercept + self.slope * u

    def reset(self) -> None:
        """Go back to the lower end of the range."""
        self._direction = 0.0
        self.saturated = False
        self.input = self.lower
        self.output = self._at(self.lower)

    @property
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""
        return self._direction

    @property
    def output_range(self) -> tuple[float, float]:
        """Outputs at the ends of the range, in ascending order."""
        return self._ends

    def step(self, u: float) -> float:
        """Commit an input and return the output."""
        u = float(u)
        self.saturated = not self.lower <= u <= self.upper
        if not math.isnan(u):
            u = min(max(u, self.lower), self.upper)
            if u != self.input:
                self._direction = 1.0 if u > self.input else -1.0
            self.input = u
            self.output = self._at(u)
        return self.output

    def peek(self, u: float) -> float:
        """Return the output that `step` would give, and commit nothing."""
        u = float(u)
        return self.output if math.isnan(u) else self._at(min(max(u, self.lower), self.upper))

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """Commit a sequence of inputs, shape (M,), and return the outputs."""
        u = sequence(u)
        if len(u) < 3 or not np.all(np.isfinite(u)):
            return super().simulate(u)
        outputs = self._at(np.clip(u, self.lower, self.upper))
        moves = np.flatnonzero(np.diff(np.clip(u, self.lower, self.upper)))
        # The last movement is all that is remembered.
        self.step(float(u[moves[-1]] if len(moves) else u[0]))
        self.step(float(u[-1]))
        return outputs

    def branch(self, increasing: bool) -> PiecewiseQuadratic:
        """Return the part of the line from the present input to the end of the range."""
        ends = (self.input, self.upper) if increasing else (self.lower, self.input)
        knots = np.unique(ends)
        pieces = len(knots) - 1
        return PiecewiseQuadratic(knots, self._at(knots), np.full(pieces, self.slope),
                                  np.zeros(pieces), increasing)

    def _solve(self, y: float) -> tuple[float, float, bool]:
        low, high = self._ends
        saturated = not low - self._tolerance <= y <= high + self._tolerance
        y = min(max(y, low), high)
        if abs(y - self.output) <= self._tolerance:
            return self.input, self.output, saturated
        u = min(max((y - self.intercept) / self.slope, self.lower), self.upper)
        return u, self._at(u), saturated

    def save(self) -> dict[str, Any]:
        """Return the present input and its last movement."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'direction': self._direction}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `save` returned; ParameterError if it is something else."""
        u, saturated, where = memory(state, self)
        direction = number(take(state, 'direction', where), f'{where}: direction')
        self.input, self.output, self.saturated = u, self._at(u), saturated
        self._direction = direction

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'slope': self.slope, 'intercept': self.intercept,
                'lower': self.lower, 'upper': self.upper}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'Linear':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        names = ('slope', 'intercept', 'lower', 'upper')
        return cls(*(take(parameters, name, 'linear operator') for name in names))
