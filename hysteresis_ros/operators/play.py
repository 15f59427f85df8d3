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

import math
from typing import Any, Mapping, Sequence

import numpy as np

from .base import (
    HysteresisOperator, LARGEST, input_range, memory, number, numbers,
    one_sign, resolution, sequence, take)
from .branch import PiecewiseQuadratic
from .staircase import monotone_runs
from ..errors import ParameterError

# Monotone runs of fewer inputs than this are stepped through: arrays cost more to set up.
_WORTH_AN_ARRAY = 20


class PrandtlIshlinskii(HysteresisOperator):
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
        self.thresholds, self.bends = numbers(thresholds, f'{where}: thresholds'), numbers(
            bends, f'{where}: bends')
        self.bias = number(bias, f'{where}: bias')
        self.lower, self.upper = input_range(lower, upper, where)
        if len(self.radii) == 0 or np.any(self.radii < 0.0) or np.any(np.diff(self.radii) <= 0.0):
            raise ParameterError(f'{where}: radii have to be >= 0 and strictly increasing')
        if len(self.weights) != len(self.radii):
            raise ParameterError(f'{where}: {len(self.weights)} weights for '
                                 f'{len(self.radii)} radii')
        self._sign = one_sign(self.weights, f'{where}: weights')
        if np.any(np.diff(self.thresholds) <= 0.0) or len(self.bends) != len(self.thresholds):
            raise ParameterError(f'{where}: thresholds have to be strictly increasing, with one '
                                 'bend each')
        gains = 1.0 + np.cumsum(self.bends)
        if np.any(gains <= 0.0):
            raise ParameterError(f'{where}: the bends turn the slope of the output to '
                                 f'{np.min(gains)}, it has to stay positive')
        for array in (self.radii, self.weights, self.thresholds, self.bends):
            array.flags.writeable = False

        self._plays_of = list(zip(self.radii.tolist(), self.weights.tolist()))
        self._gains = np.concatenate(([1.0], gains))
        self._curve = list(zip(self.thresholds.tolist(), self.bends.tolist()))
        # The outputs at the thresholds; the inverse of the dead zones searches among them.
        self._bent = self._shape(self.thresholds)
        self.reset()
        ends = self._limits()
        if not max(map(abs, ends)) <= LARGEST:
            raise ParameterError(f'{where}: the output reaches beyond {LARGEST:g}, use another '
                                 'unit')
        self._ends = min(ends), max(ends)
        self._tolerance = resolution(self._ends)

    def _limits(self) -> tuple[float, float]:
        """Return the outputs at both ends of the input range."""
        return self.peek(self.lower), self.peek(self.upper)

    def reset(self) -> None:
        """Forget the history: the input came down to `lower` from far above."""
        self._plays = (self.lower + self.radii).tolist()
        self._direction = 0.0
        self.input = self.lower
        self.saturated = False
        self.output = self._bend(self._sum(self._plays))

    @property
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""
        return self._direction

    @property
    def output_range(self) -> tuple[float, float]:
        """Smallest and largest output: those at the ends of the input range."""
        return self._ends

    def _moved(self, u: float) -> list[float]:
        """Return the places of the plays after a movement to an input inside the range."""
        return [u - r if p < u - r else u + r if p > u + r else p
                for p, (r, _) in zip(self._plays, self._plays_of)]

    def _sum(self, plays: list[float]) -> float:
        """Return the weighted sum x of plays."""
        x = 0.0
        for p, (_, w) in zip(plays, self._plays_of):
            x += w * p
        return x

    def _bend(self, x: float) -> float:
        """Return the output for a weighted sum."""
        y = self.bias + x
        for threshold, bend in self._curve:
            if x <= threshold:
                break
            y += bend * (x - threshold)
        return y

    def _shape(self, x: np.ndarray) -> np.ndarray:
        """Return the outputs for an array of weighted sums."""
        over = np.maximum(x[..., None] - self.thresholds, 0.0)
        return self.bias + x + np.sum(self.bends * over, axis=-1)

    def _unbend(self, y: float) -> float:
        """Return the weighted sum that gives an output."""
        k = int(np.searchsorted(self._bent, y))
        if k == 0:
            return y - self.bias
        return float(self.thresholds[k - 1] + (y - self._bent[k - 1]) / self._gains[k])

    def step(self, u: float) -> float:
        """Commit an input and return the output."""
        u = float(u)
        self.saturated = not self.lower <= u <= self.upper
        if not math.isnan(u):
            u = min(max(u, self.lower), self.upper)
            if u != self.input:
                self._direction = 1.0 if u > self.input else -1.0
            self.input = u
            self._plays = plays = self._moved(u)
            self.output = self._bend(self._sum(plays))
        return self.output

    def peek(self, u: float) -> float:
        """Return the output that `step` would give, and commit nothing."""
        u = float(u)
        if math.isnan(u):
            return self.output
        return self._bend(self._sum(self._moved(min(max(u, self.lower), self.upper))))

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """
        Commit a sequence of inputs, shape (M,), and return the outputs, shape (M,).

        Long monotone runs are evaluated as arrays, short ones step by step.
        """
        u = sequence(u)
        if not np.all(np.isfinite(u)):
            return super().simulate(u)
        outputs = np.empty(len(u))
        inside = np.clip(u, self.lower, self.upper)
        for start, stop, rising in monotone_runs(inside, self.input):
            # The last input of a run is a scalar step in any case: that keeps the memory.
            if stop - start > _WORTH_AN_ARRAY:
                outputs[start:stop - 1] = self._shape(
                    self._along(inside[start:stop - 1], rising))
                start = stop - 1
            for n in range(start, stop):
                outputs[n] = self.step(float(u[n]))
        return outputs

    def _along(self, u: np.ndarray, increasing: bool) -> np.ndarray:
        """Return the weighted sums of a monotone run of inputs that starts at the present one."""
        u = u[:, None]
        plays = (np.maximum(self._plays, u - self.radii) if increasing
                 else np.minimum(self._plays, u + self.radii))
        return plays @ self.weights

    def _starts(self, increasing: bool) -> list[float]:
        """
        Return the inputs at which the plays begin to move, the smallest radius first.

        Neighbouring plays are never further apart than their radii, so these are in the order
        in which the input meets them.
        """
        here = self.input
        if increasing:
            return [max(p + r, here) for p, (r, _) in zip(self._plays, self._plays_of)]
        return [min(p - r, here) for p, (r, _) in zip(self._plays, self._plays_of)]

    def branch(self, increasing: bool) -> PiecewiseQuadratic:
        """
        Return the branch from the present input to the end of the range, one way.

        Its knots are where a play begins to move and where the sum passes a threshold.
        """
        ends = (self.input, self.upper) if increasing else (self.lower, self.input)
        knots = np.unique(np.clip([*ends, *self._starts(increasing)], *ends))
        sums = self._along(knots, increasing)
        if len(knots) > 1 and len(self.thresholds):
            order = slice(None) if sums[-1] >= sums[0] else slice(None, None, -1)
            inside = ((self.thresholds > min(sums[0], sums[-1]))
                      & (self.thresholds < max(sums[0], sums[-1])))
            extra = np.interp(self.thresholds[inside], sums[order], knots[order])
            knots = np.unique(np.concatenate((knots, extra)))
            sums = self._along(knots, increasing)
        values = self._shape(sums)
        slopes = np.diff(values) / np.diff(knots)
        return PiecewiseQuadratic(knots, values, slopes, np.zeros_like(slopes), increasing)

    def _solve(self, y: float) -> tuple[float, float, bool]:
        low, high = self._ends
        saturated = not low - self._tolerance <= y <= high + self._tolerance
        y = min(max(y, low), high)
        if abs(y - self.output) <= self._tolerance:
            return self.input, self.output, saturated
        missing = self._sign * (self._unbend(y) - self._sum(self._plays))
        increasing = missing > 0.0
        missing = abs(missing)
        end = self.upper if increasing else self.lower
        starts = [*self._starts(increasing), end]
        found, slope = end, 0.0
        for k, (_, weight) in enumerate(self._plays_of):
            start, following = starts[k], starts[k + 1]
            slope += abs(weight)
            rise = slope * abs(following - start)
            if missing <= rise + self._tolerance:
                d = min(missing / slope, abs(following - start)) if slope > 0.0 else 0.0
                found = start + d if increasing else start - d
                break
            missing -= rise
        found = min(max(found, self.lower), self.upper)
        return found, self.peek(found), saturated

    def save(self) -> dict[str, Any]:
        """Return the memory: the present input and the places of the plays."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'direction': self._direction, 'plays': list(self._plays)}

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
        self.input, self.saturated, self._direction = u, saturated, direction
        self._plays = plays.tolist()
        self.output = self._bend(self._sum(self._plays))

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
