# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Prandtl-Ishlinskii operator: weighted plays, and its exact inverse.

A play of radius r is a piston with clearance 2 r pulled to and fro by the input u: its place p
stays until the input has taken up the clearance, p = max(u - r, min(u + r, p)). Their weighted sum
gives loops that are alike at every level of the input; one-sided dead zones behind the sum (the
modified operator of K. Kuhnen, Eur. J. Control 9 (2003) 407) make them asymmetric and let them
saturate. Sum and dead zones are piecewise linear along a branch, so the inverse is exact.
"""

from typing import Any, Mapping, Sequence

import numpy as np

from .base import LARGEST, input_range, memory, number, numbers, one_sign, resolution, take
from .compiled import CompiledOperator
from .dead_zones import DeadZones
from ..errors import ParameterError
from ..kernels import layout, play as kernel


class PrandtlIshlinskii(CompiledOperator):
    """
    Weighted play operators, optionally followed by one-sided dead zones.

    With x = sum of weights[k] * play of radii[k], the output is
    bias + x + sum of bends[l] * max(x - thresholds[l], 0).

    Parameters
    ----------
    radii : array_like, shape (K,)
        Radii of the plays, >= 0 and strictly increasing. Unit of the input.
    weights : array_like, shape (K,)
        Weights of the plays, all >= 0 or all <= 0. Unit of the output over that of the input.
    bias : float
        Constant. Unit of the output.
    lower, upper : float
        Input range.
    thresholds, bends : array_like, shape (L,)
        Where the slope of the output over x changes (strictly increasing), and by how much. The
        slope, 1 below the first threshold, has to stay positive.

    Raises
    ------
    ParameterError
        If one of these conditions does not hold or a value is not finite.

    """

    kind = 'play'

    def __init__(self, radii: Sequence[float], weights: Sequence[float], bias: float,
                 lower: float, upper: float, thresholds: Sequence[float] = (),
                 bends: Sequence[float] = ()) -> None:
        where = 'play operator'
        self.radii, self.weights = numbers(radii, f'{where}: radii'), numbers(
            weights, f'{where}: weights')
        curve = DeadZones(thresholds, bends, where)
        self.thresholds, self.bends = curve.thresholds, curve.bends
        self.bias = number(bias, f'{where}: bias')
        self.lower, self.upper = input_range(lower, upper, where)
        if len(self.radii) == 0 or np.any(self.radii < 0.0) or np.any(np.diff(self.radii) <= 0.0):
            raise ParameterError(f'{where}: radii have to be >= 0 and strictly increasing')
        if len(self.weights) != len(self.radii):
            raise ParameterError(f'{where}: {len(self.weights)} weights for '
                                 f'{len(self.radii)} radii')
        sign = one_sign(self.weights, f'{where}: weights')
        for array in (self.radii, self.weights):
            array.flags.writeable = False

        # The outputs at the thresholds; the inverse of the dead zones searches among them.
        bent = self.bias + curve.values(self.thresholds)
        self.table = np.concatenate((
            [layout.PLAY, self.lower, self.upper, sign, 0.0, 0.0, 0.0, len(self.radii),
             len(self.bends), self.bias],
            self.radii, self.weights, self.thresholds, self.bends, bent, curve.slopes[1:]))
        self.memory = np.empty(layout.MEMORY + len(self.radii))
        self.reset()
        ends = self.peek(self.lower), self.peek(self.upper)
        if not max(map(abs, ends)) <= LARGEST:
            raise ParameterError(f'{where}: the output reaches beyond {LARGEST:g}, use another '
                                 'unit')
        low, high = min(ends), max(ends)
        self.table[[layout.LOW, layout.HIGH, layout.TOLERANCE]] = low, high, resolution((low, high))

    def save(self) -> dict[str, Any]:
        """Return the memory: the present input and the places of the plays."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'direction': self.direction, 'plays': self.memory[layout.MEMORY:].tolist()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `save` returned; ParameterError if it is something else."""
        u, saturated, where = memory(state, self)
        direction = number(take(state, 'direction', where), f'{where}: direction')
        plays = numbers(take(state, 'plays', where), f'{where}: plays')
        slack = 1e-9 * (self.upper - self.lower)
        if (len(plays) != len(self.radii) or np.any(np.abs(plays - u) > self.radii + slack)
                or np.any(np.abs(np.diff(plays)) > np.diff(self.radii) + slack)):
            raise ParameterError(f'{where}: the plays are not where this input could have '
                                 'left them')
        self.memory[layout.MEMORY:] = plays
        output = kernel.bend(self.table, kernel.total(self.table, self.memory, u))
        self.memory[:layout.MEMORY] = u, output, saturated, direction

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'radii': self.radii.tolist(),
                'weights': self.weights.tolist(), 'bias': self.bias, 'lower': self.lower,
                'upper': self.upper, 'thresholds': self.thresholds.tolist(),
                'bends': self.bends.tolist()}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'PrandtlIshlinskii':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        names = ('radii', 'weights', 'bias', 'lower', 'upper', 'thresholds', 'bends')
        return cls(*(take(parameters, name, 'play operator') for name in names))
