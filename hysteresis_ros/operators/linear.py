# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The straight line: the operator without hysteresis that the paper compares with (Eq. 11)."""

from typing import Any, Mapping

import numpy as np

from .base import LARGEST, input_range, memory, number, resolution, take
from .compiled import CompiledOperator
from ..kernels import layout, linear as kernel
from ..errors import ParameterError


class Linear(CompiledOperator):
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
        ends = [self.intercept + self.slope * end for end in (self.lower, self.upper)]
        if not max(map(abs, ends)) <= LARGEST:
            raise ParameterError(
                f'linear operator: the output reaches beyond {LARGEST:g}, use another unit')
        low, high = min(ends), max(ends)
        self.table = np.array([
            layout.LINEAR, self.lower, self.upper, -1.0 if self.slope < 0.0 else 1.0, low, high,
            resolution((low, high)), self.slope, self.intercept])
        self.memory = np.empty(layout.MEMORY)
        self.reset()

    def save(self) -> dict[str, Any]:
        """Return the present input and its last movement."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'direction': self.direction}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `save` returned; ParameterError if it is something else."""
        u, saturated, where = memory(state, self)
        direction = number(take(state, 'direction', where), f'{where}: direction')
        self.memory[:] = u, kernel.at(self.table, u), saturated, direction

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'slope': self.slope, 'intercept': self.intercept,
                'lower': self.lower, 'upper': self.upper}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'Linear':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        names = ('slope', 'intercept', 'lower', 'upper')
        return cls(*(take(parameters, name, 'linear operator') for name in names))
