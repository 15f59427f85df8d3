# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Preisach operator of Eqs. 3 to 6, with exact areas, and its exact inverse.

The relays that are up fill the Preisach plane below a staircase whose corners are the reversals
of the input that nothing has wiped out since. The output moves with the weight between the last
corner and the present input (`everett`), so one stack of corners with the sums up to each of
them is the whole memory, and a step costs amortised constant time however long the history is.
"""

import copy
from typing import Any, Mapping

import numpy as np

from ..errors import ParameterError
from .areas import signed_areas
from .base import (
    HysteresisOperator, LARGEST, memory, number, numbers, one_sign, resolution,
    sequence, take)
from .branch import PiecewiseQuadratic
from .everett import Everett, check_nodes
from .staircase import MOST_CORNERS, beyond, check_corners, monotone_runs, thin

# Monotone runs of fewer inputs than this are stepped through: arrays cost more to set up.
_WORTH_AN_ARRAY = 50


class Preisach(HysteresisOperator):
    """
    Preisach operator with a piecewise constant weight of one sign.

    Output = sum over the cells of weight times signed area + bias (Eq. 6), and optionally + sum
    over the intervals of reversible weight times signed length: relays without a loop, on the line
    beta = alpha. Cells alone, however small their weight's loop should be, make loops of their own
    width, and leave a branch with slope zero where it turns.

    Parameters
    ----------
    nodes : array_like, shape (N + 1,)
        Inputs at which the weight may jump, strictly increasing; the input range is from the
        first to the last.
    weights : array_like, shape (N (N + 1) / 2,)
        Weight of each cell in the order of Eq. 8, all >= 0 or all <= 0 (then the output falls
        when the input rises). Unit of the output over the square of the unit of the input.
    bias : float
        The constant c of Eqs. 3 and 6.
    reversible : array_like, shape (N,), optional
        Weights on the line beta = alpha, one an interval, of the same sign; every branch has at
        least twice this slope there. Unit of the output over the unit of the input. Default 0.

    Raises
    ------
    ParameterError
        If nodes are not increasing, there are more or fewer weights than cells, the signs are
        mixed, or a value is not finite.

    """

    kind = 'preisach'

    def __init__(self, nodes: np.ndarray, weights: np.ndarray, bias: float = 0.0,
                 reversible: np.ndarray | None = None) -> None:
        self.nodes = check_nodes(nodes)
        levels = len(self.nodes) - 1
        self.weights = _check_weights(weights, levels)
        self.reversible = numbers(
            np.zeros(levels) if reversible is None else reversible, 'Preisach reversible weights')
        if len(self.reversible) != levels:
            raise ParameterError(f'Preisach reversible weights: {len(self.reversible)} given for '
                                 f'{levels} levels')
        self.bias = number(bias, 'Preisach bias')
        self.lower, self.upper = float(self.nodes[0]), float(self.nodes[-1])
        self._sign = one_sign(
            np.concatenate((self.weights, self.reversible)), 'Preisach weights')
        # The output is base + sign * z with z from 0, all relays down, to span, all up.
        self._take(Everett(
            self.nodes, 2.0 * np.abs(self.weights), 2.0 * np.abs(self.reversible)))
        for array in (self.nodes, self.weights, self.reversible):
            array.flags.writeable = False

    def _take(self, everett: Everett) -> None:
        """Take the weight as a function, and wipe the memory."""
        self._everett = everett
        self._span = everett.total
        self._base = self.bias - self._sign * self._span / 2.0
        if not self._span + abs(self._base) <= LARGEST:
            raise ParameterError(
                f'Preisach operator: the output reaches beyond {LARGEST:g}, use another unit')
        self._tolerance = resolution(self.output_range)
        self.reset()

    def tilted(self, slope: float) -> 'Preisach':
        """
        Return the operator, its memory wiped, plus a line that is 0 in the middle of its range.

        Parameters
        ----------
        slope : float
            Not negative: how much steeper, in the direction of the weights. Unit of the output
            over the unit of the input.

        """
        other = copy.copy(self)
        other.reversible = self.reversible + 0.5 * self._sign * slope
        other.reversible.flags.writeable = False
        other._take(self._everett.tilted(slope))
        return other

    def reset(self) -> None:
        """Forget the history: all relays down, input at `lower`."""
        # The stack starts with upper and lower as if the input had come down from saturation:
        # entries alternate maximum, minimum; an even count means that the input rises.
        self._corners = [self.upper, self.lower]
        self._sums = [self._span, 0.0]
        self._commit(self.lower, 0.0, False)

    def _commit(self, u: float, z: float, saturated: bool) -> None:
        self.input = u
        self._z = z
        self.output = self._base + self._sign * z
        self.saturated = saturated

    @property
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""
        if self.input == self._corners[-1]:
            return 0.0
        return -1.0 if len(self._corners) & 1 else 1.0

    @property
    def corners(self) -> list[float]:
        """Reversals that the memory holds: maximum, minimum, maximum, ... outside in."""
        return self._corners[2:]

    @property
    def output_range(self) -> tuple[float, float]:
        """Smallest and largest output: all relays down and all up."""
        ends = self._base, self._base + self._sign * self._span
        return min(ends), max(ends)

    def step(self, u: float) -> float:
        """
        Commit an input and return the output.

        Amortised constant time. An input outside the grid counts as the nearer end; NaN leaves
        the memory as it is. Both set `saturated`.
        """
        u = float(u)
        if self.lower < u < self.upper:
            z, depth, turned = self._trace(u)
            corners, sums = self._corners, self._sums
            if depth < len(corners):
                del corners[depth:], sums[depth:]
            if turned:
                corners.append(self.input)
                sums.append(self._z)
                if len(corners) > MOST_CORNERS:
                    thin(corners, sums, self._everett)
            self.input = u
            self._z = z
            self.saturated = False
            self.output = y = self._base + self._sign * z
            return y
        if u >= self.upper:
            del self._corners[2:], self._sums[2:]
            self._commit(self.upper, self._span, u > self.upper)
        elif u <= self.lower:
            self.reset()
            self.saturated = u < self.lower
        else:
            self.saturated = True
        return self.output

    def peek(self, u: float) -> float:
        """Return the output that `step` would give, and commit nothing."""
        u = float(u)
        if self.lower < u < self.upper:
            return self._base + self._sign * self._trace(u)[0]
        if u >= self.upper:
            return self._base + self._sign * self._span
        return self._base if u <= self.lower else self.output

    def _trace(self, u: float) -> tuple[float, int, bool]:
        """
        Follow the memory to an input strictly inside the range.

        Returns
        -------
        z : float
            Level there.
        depth : int
            Number of corners that survive.
        turned : bool
            Whether the present input becomes a corner on top of them.

        """
        corners = self._corners
        depth = len(corners)
        here = self.input
        if depth & 1:
            if u <= here:
                if u <= corners[depth - 2]:
                    depth = beyond(corners, depth, u, False)
                top = depth - 1
                return self._sums[top] - self._everett.at(corners[top], u), depth, False
            if u < corners[depth - 1]:
                return self._z + self._everett.at(u, here), depth, True
            depth = beyond(corners, depth + 1, u, True)
            top = depth - 1
            return self._sums[top] + self._everett.at(u, corners[top]), depth, False
        if u >= here:
            if u >= corners[depth - 2]:
                depth = beyond(corners, depth, u, True)
            top = depth - 1
            return self._sums[top] + self._everett.at(u, corners[top]), depth, False
        if u > corners[depth - 1]:
            return self._z - self._everett.at(here, u), depth, True
        depth = beyond(corners, depth + 1, u, False)
        top = depth - 1
        return self._sums[top] - self._everett.at(corners[top], u), depth, False

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """
        Commit a sequence of inputs and return the outputs.

        Long monotone runs are evaluated as arrays, short ones step by step.

        Parameters
        ----------
        u : ndarray, shape (M,)
            Inputs, taken after those committed so far.

        Returns
        -------
        ndarray, shape (M,)
            The outputs of M calls of `step`, to 1e-12 of full scale.

        """
        u = sequence(u)
        if not np.all(np.isfinite(u)):
            return super().simulate(u)
        outputs = np.empty(len(u))
        inside = np.clip(u, self.lower, self.upper)
        for start, stop, rising in monotone_runs(inside, self.input):
            # The last input of a run is a scalar step in any case: that keeps the memory.
            if stop - start > _WORTH_AN_ARRAY:
                outputs[start:stop - 1] = self._along(inside[start:stop - 1], rising)
                start = stop - 1
            for n in range(start, stop):
                outputs[n] = self.step(float(u[n]))
        return outputs

    def _along(self, u: np.ndarray, increasing: bool) -> np.ndarray:
        """Return the outputs of a monotone run of inputs that starts at the present one."""
        bases, levels, thresholds = self._ladder(increasing)
        k = np.searchsorted(thresholds, u if increasing else -u, side='right')
        if increasing:
            z = levels[k] + self._everett.value(u, bases[k])
        else:
            z = levels[k] - self._everett.value(bases[k], u)
        return self._base + self._sign * z

    def _ladder(self, increasing: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """
        Return the corners that a monotone run starts from, one after the other.

        Returns
        -------
        bases, levels : ndarray, shape (K,)
            Corner and level from which each part of the branch is measured.
        thresholds : ndarray, shape (K - 1,)
            Inputs, negated on the way down so that they ascend, at which the next part begins.

        """
        corners, sums = self._corners, self._sums
        top = len(corners) - 1
        bases, levels = [], []
        if bool(top & 1) == increasing:
            wipers = corners[top - 1:0 if increasing else 1:-2]
        else:
            # The input turns and makes a corner of its own.
            bases.append(self.input)
            levels.append(self._z)
            wipers = corners[top:0 if increasing else 1:-2]
            top -= 1
        bases += corners[top:0:-2]
        levels += sums[top:0:-2]
        thresholds = np.array(wipers, dtype=float)
        return np.array(bases), np.array(levels), thresholds if increasing else -thresholds

    def branch(self, increasing: bool) -> PiecewiseQuadratic:
        """
        Return the branch from the present input to the end of the range, one way.

        Its knots are the grid's nodes and the corners that the input wipes out on the way.
        """
        bases, levels, thresholds = self._ladder(increasing)
        marks = thresholds if increasing else -thresholds
        knots = np.unique(np.concatenate((self.nodes, marks, [self.input])))
        if increasing:
            knots = knots[knots >= self.input]
        else:
            knots = knots[knots <= self.input]
        values = self._along(knots, increasing)
        # Each piece belongs to the corner that its middle is measured from.
        middle = knots[:-1] + np.diff(knots) / 2.0
        k = np.searchsorted(thresholds, middle if increasing else -middle, side='right')
        if increasing:
            slopes, bends = self._everett.rise(knots[:-1], bases[k])
        else:
            slopes, bends = self._everett.fall(bases[k], knots[:-1])
            bends = -bends
        return PiecewiseQuadratic(
            knots, values, self._sign * slopes, self._sign * bends, increasing)

    def _solve(self, y: float) -> tuple[float, float, bool]:
        sign, base, tolerance = self._sign, self._base, self._tolerance
        target = sign * (y - base)
        saturated = False
        if target < 0.0:
            saturated = target < -tolerance
            target = 0.0
        elif target > self._span:
            saturated = target > self._span + tolerance
            target = self._span
        change = target - self._z
        if -tolerance <= change <= tolerance:
            return self.input, self.output, saturated

        # Find the corner that the branch is measured from where it meets the target, and the
        # two corners between which it is measured from that one.
        corners, sums = self._corners, self._sums
        up = change > 0.0
        held = len(corners)
        # If the input has to turn, it makes a corner of its own on top of the others.
        depth = held + 1 if bool(held & 1) == up else held
        depth = beyond(sums, depth, target - tolerance if up else target + tolerance, up)
        if depth > held:
            corner, level = self.input, self._z
        else:
            corner, level = corners[depth - 1], sums[depth - 1]
        passed = corners[depth] if depth < held else self.input
        coming = corners[depth - 2]
        if up:
            u, rise = self._everett.alpha(target - level, corner, tolerance)
            if not passed <= u <= coming:
                u = min(max(u, passed), coming)
                rise = self._everett.at(u, corner)
            return u, base + sign * (level + rise), saturated
        u, fall = self._everett.beta(level - target, corner, tolerance)
        if not coming <= u <= passed:
            u = max(min(u, passed), coming)
            fall = self._everett.at(corner, u)
        return u, base + sign * (level - fall), saturated

    def save(self) -> dict[str, Any]:
        """Return the memory: the present input and the corners, outside in."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'corners': self._corners[2:]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """
        Take over a memory that `save` returned.

        Raises
        ------
        ParameterError
            If it is no memory of a Preisach operator on this input range.

        """
        u, saturated, where = memory(state, self)
        corners = numbers(take(state, 'corners', where), f'{where}: corners').tolist()
        corners = check_corners(corners, u, self.lower, self.upper, where)
        sums = [self._span, 0.0]
        for k in range(2, len(corners)):
            sums.append(self._level(corners, sums, k, corners[k]))
        self._corners, self._sums = corners, sums
        self._commit(u, self._level(corners, sums, len(corners), u), saturated)

    def _level(self, corners: list[float], sums: list[float], depth: int, u: float) -> float:
        """Return the level at an input measured from the corner below a given depth."""
        if u >= self.upper:
            return self._span
        top = depth - 1
        if top & 1:
            return sums[top] + self._everett.at(u, corners[top])
        return sums[top] - self._everett.at(corners[top], u)

    def areas(self, inputs: np.ndarray) -> np.ndarray:
        """Return the signed areas after inputs from the cold state, shape (M, cells)."""
        return signed_areas(self.nodes, inputs)

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'nodes': self.nodes.tolist(),
                'weights': self.weights.tolist(), 'bias': self.bias,
                'reversible': self.reversible.tolist()}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'Preisach':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        where = 'Preisach operator'
        return cls(take(parameters, 'nodes', where), take(parameters, 'weights', where),
                   take(parameters, 'bias', where), parameters.get('reversible'))


def _check_weights(weights: np.ndarray, levels: int) -> np.ndarray:
    """Return weights, one a cell, as a checked array."""
    array = numbers(weights, 'Preisach weights')
    if len(array) != levels * (levels + 1) // 2:
        raise ParameterError(
            f'Preisach weights: {len(array)} given, {levels} levels have '
            f'{levels * (levels + 1) // 2} cells')
    return array
