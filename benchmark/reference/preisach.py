# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The Preisach operator, one input at a time, on plain lists."""

import copy

import numpy as np

from benchmark.reference.everett import Everett
from benchmark.reference.staircase import MOST_CORNERS, beyond, thin


class Preisach:
    """
    Preisach operator with a piecewise constant weight of one sign, one input at a time.

    Parameters
    ----------
    operator : hysteresis_ros.operators.Preisach
        Whose nodes, weights and tolerance it takes; its memory starts in the cold state.

    """

    def __init__(self, operator) -> None:
        self.lower, self.upper = operator.lower, operator.upper
        self._bias = operator.bias
        negative = np.any(operator.weights < 0.0) or np.any(operator.reversible < 0.0)
        self._sign = -1.0 if negative else 1.0
        self._take(Everett(operator.nodes, 2.0 * np.abs(operator.weights),
                           2.0 * np.abs(operator.reversible)))

    def _take(self, everett: Everett) -> None:
        """Take the weight as a function, and wipe the memory."""
        self._everett = everett
        self._span = everett.total
        self._base = self._bias - self._sign * self._span / 2.0
        low, high = self.output_range
        self._tolerance = (1e-13 * (high - low)
                           + 8.0 * float(np.finfo(float).eps) * max(abs(low), abs(high)))
        self.reset()

    def tilted(self, slope: float) -> 'Preisach':
        """Return the operator, its memory wiped, plus a line of a slope."""
        other = copy.copy(self)
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
        """Commit a sequence of inputs, shape (M,), and return the outputs, shape (M,)."""
        return np.array([self.step(value) for value in u.tolist()])

    def solve(self, y: float) -> tuple[float, float, bool]:
        """Return input, its output, and whether the request is out of reach."""
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
