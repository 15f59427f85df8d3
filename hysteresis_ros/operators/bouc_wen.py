# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The normalised Bouc-Wen operator, solved exactly between reversals.

In the normalised form (F. Ikhouane and J. Rodellar, Systems with Hysteresis, Wiley 2007, Sec. 2.4)
the hidden state w in [-1, 1] follows the input u by

    dw = rho (du - sigma |du| |w|^(n-1) w + (sigma - 1) du |w|^n)

which knows no time. While the input rises this is dw/du = rho (1 - w^n) for w >= 0 and
rho (1 + (2 sigma - 1) |w|^n) for w < 0. So rho (u - u0) = G(w) - G(w0) with

    G(w) = w F(1, 1/n; 1 + 1/n; w^n)  or, for w < 0,  w F(1, 1/n; 1 + 1/n; -(2 sigma - 1) |w|^n)

(F is Gauss's hypergeometric function), and the result does not depend on how finely the input
is sampled. While it falls the same holds for -w over -u.
"""

import math
from typing import Any, Mapping

import numpy as np
from scipy.special import hyp2f1, poch, psi

from .base import (
    HysteresisOperator, LARGEST, input_range, memory, number, one_sign,
    resolution, take)
from ..errors import ParameterError

# exp(-40) is below the spacing of floats at 1: from there on w is 1.
_SATURATED = 40.0
# Where 1 - w^n is smaller, G is summed around its logarithmic pole instead (M. Abramowitz and
# I. Stegun, Handbook of Mathematical Functions, 15.3.10), which library functions do not do.
_NEAR_ONE = 1e-4
_ITERATIONS = 100


class BoucWen(HysteresisOperator):
    """
    Bouc-Wen operator: output = bias + stiffness * input + gain * w.

    Parameters
    ----------
    stiffness, gain : float
        Both >= 0 or both <= 0, so that the output is monotone between reversals. Unit of the
        output over that of the input, and of the output.
    rate : float
        rho > 0, in 1 / unit of the input: 1 / rho is the input over which w turns.
    shape : float
        sigma from 1/2 to 100. From 1/2 on the operator is thermodynamically admissible.
    exponent : float
        n from 1 to 100: how sharply w goes over into saturation.
    bias : float
        Constant. Unit of the output.
    lower, upper : float
        Input range.

    Raises
    ------
    ParameterError
        If a parameter is outside its range or not finite.

    """

    kind = 'bouc-wen'

    def __init__(self, stiffness: float, gain: float, rate: float, shape: float,
                 exponent: float, bias: float, lower: float, upper: float) -> None:
        where = 'Bouc-Wen operator'
        self.stiffness, self.gain = (
            number(stiffness, f'{where}: stiffness'), number(gain, f'{where}: gain'))
        self.rate, self.shape = number(rate, f'{where}: rate'), number(shape, f'{where}: shape')
        self.exponent = number(exponent, f'{where}: exponent')
        self.bias = number(bias, f'{where}: bias')
        self.lower, self.upper = input_range(lower, upper, where)
        self._sign = one_sign(np.array([self.stiffness, self.gain]), f'{where}: stiffness, gain')
        if not 0.0 < self.rate <= LARGEST:
            raise ParameterError(f'{where}: rate is {self.rate}, it has to be above 0')
        if not 0.5 <= self.shape <= 100.0:
            raise ParameterError(f'{where}: shape is {self.shape}, it has to be at least 0.5 '
                                 'and at most 100')
        if not 1.0 <= self.exponent <= 100.0:
            raise ParameterError(f'{where}: exponent is {self.exponent}, it has to be 1 to 100')
        self._curl = 2.0 * self.shape - 1.0
        b = 1.0 / self.exponent
        self._series = [(float(poch(b, k)) / math.factorial(k), float(psi(k + 1.0) - psi(b + k)))
                        for k in range(4)]
        self.reset()
        ends = self.output, self._at(self.upper, 1.0)
        if not max(map(abs, ends)) <= LARGEST:
            raise ParameterError(f'{where}: the output reaches beyond {LARGEST:g}, use another '
                                 'unit')
        self._ends = min(ends), max(ends)
        self._tolerance = resolution(self._ends)

    def reset(self) -> None:
        """Forget the history: the input came down to `lower` from far above, w = -1."""
        self._w = -1.0
        self._direction = 0.0
        self.input = self.lower
        self.saturated = False
        self.output = self._at(self.lower, self._w)

    def _at(self, u: float, w: float) -> float:
        return self.bias + self.stiffness * u + self.gain * w

    @property
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""
        return self._direction

    @property
    def output_range(self) -> tuple[float, float]:
        """
        Outputs at the ends of the input range with the hidden state saturated.

        The hidden state saturates over an input of about 1 / rate, not at the ends of the
        range, so the present branch may reach less; the inverse flags what it cannot reach.
        """
        return self._ends

    def _travel(self, w: float, gap: float) -> float:
        """Return G(w), rho times the input from w = 0 to w while rising; gap = 1 - w > 0."""
        b = 1.0 / self.exponent
        if w < 0.0:
            z = -self._curl * (-w) ** self.exponent
        else:
            away = self._pace(w, gap)
            if away < _NEAR_ONE:
                logarithm = math.log(away)
                return w * b * sum(
                    factor * (shift - logarithm) * away ** k
                    for k, (factor, shift) in enumerate(self._series))
            z = 1.0 - away
        return w * float(hyp2f1(1.0, b, 1.0 + b, z))

    def _pace(self, w: float, gap: float) -> float:
        """Return dw/du / rho while rising."""
        if w < 0.0:
            return 1.0 + self._curl * (-w) ** self.exponent
        if w < 0.5:
            return 1.0 - w ** self.exponent
        return -math.expm1(self.exponent * math.log1p(-gap)) if gap > 0.0 else 0.0

    def _slope(self, w: float) -> float:
        """Return d output / d input while rising, or while falling with -w for w."""
        return self.stiffness + self.gain * self.rate * self._pace(w, 1.0 - w)

    def _reached(self, travel: float) -> float:
        """
        Return w with G(w) = travel.

        Newton's method from the side of 0 over t, w = 1 - exp(-t), respectively over -w: there
        G is concave, so it approaches the solution from one side and cannot overshoot.
        """
        if travel >= _SATURATED:
            return 1.0
        place = distance = abs(travel)
        for _ in range(_ITERATIONS):
            if travel >= 0.0:
                w, gap = -math.expm1(-place), math.exp(-place)
                slope = gap / self._pace(w, gap)
            else:
                w, gap = -place, 1.0 + place
                slope = 1.0 / self._pace(w, gap)
            change = (distance - abs(self._travel(w, gap))) / slope
            place += change
            if place >= _SATURATED:
                return 1.0
            if abs(change) <= 1e-15 * place:
                break
        return -math.expm1(-place) if travel >= 0.0 else max(-place, -1.0)

    def _turned(self, u: float) -> float:
        """Return w after a movement to an input inside the range."""
        if u == self.input:
            return self._w
        side = 1.0 if u > self.input else -1.0
        w = side * self._w
        if w >= 1.0:
            return self._w
        return side * self._reached(self._travel(w, 1.0 - w) + self.rate * abs(u - self.input))

    def step(self, u: float) -> float:
        """Commit an input and return the output."""
        u = float(u)
        self.saturated = not self.lower <= u <= self.upper
        if not math.isnan(u):
            u = min(max(u, self.lower), self.upper)
            self._w = self._turned(u)
            if u != self.input:
                self._direction = 1.0 if u > self.input else -1.0
            self.input = u
            self.output = self._at(u, self._w)
        return self.output

    def peek(self, u: float) -> float:
        """Return the output that `step` would give, and commit nothing."""
        u = float(u)
        if math.isnan(u):
            return self.output
        u = min(max(u, self.lower), self.upper)
        return self._at(u, self._turned(u))

    def _solve(self, y: float) -> tuple[float, float, bool]:
        low, high = self._ends
        saturated = not low - self._tolerance <= y <= high + self._tolerance
        y = min(max(y, low), high)
        missing = self._sign * (y - self.output)
        if abs(missing) <= self._tolerance:
            return self.input, self.output, saturated
        u, output = self._seek(y, self.upper if missing > 0.0 else self.lower)
        # What the present branch cannot reach before the end of the range is out of reach.
        saturated = saturated or abs(output - y) > 10.0 * self._tolerance
        return u, output, saturated

    def _seek(self, y: float, end: float) -> tuple[float, float]:
        """
        Find the input between the present one and an end whose output is y, or comes nearest.

        Away from the present input the slope never grows, so Newton's method stays on the near
        side of the solution; halving guards against rounding.
        """
        side = 1.0 if end > self.input else -1.0
        output = self.peek(end)
        if self._sign * side * (y - output) >= 0.0:
            return end, output
        near, far = self.input, end
        u, output = near, self.output
        w = self._w
        for _ in range(_ITERATIONS):
            error = y - output
            if abs(error) <= 0.1 * self._tolerance:
                break
            if self._sign * side * error > 0.0:
                near = u
            else:
                far = u
            slope = self._slope(side * w)
            u = u + error / slope if slope != 0.0 else far
            if not min(near, far) < u < max(near, far):
                u = near + (far - near) / 2.0
                if u in (near, far):
                    break
            w = self._turned(u)
            output = self._at(u, w)
        return u, output

    def save(self) -> dict[str, Any]:
        """Return the memory: the present input and w."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'direction': self._direction, 'state': self._w}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `save` returned; ParameterError if it is something else."""
        u, saturated, where = memory(state, self)
        direction = number(take(state, 'direction', where), f'{where}: direction')
        w = number(take(state, 'state', where), f'{where}: state')
        if not -1.0 <= w <= 1.0:
            raise ParameterError(f'{where}: state is {w}, not between -1 and 1')
        self.input, self.saturated, self._direction, self._w = u, saturated, direction, w
        self.output = self._at(u, w)

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'stiffness': self.stiffness, 'gain': self.gain,
                'rate': self.rate, 'shape': self.shape, 'exponent': self.exponent,
                'bias': self.bias, 'lower': self.lower, 'upper': self.upper}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'BoucWen':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        names = ('stiffness', 'gain', 'rate', 'shape', 'exponent', 'bias', 'lower', 'upper')
        return cls(*(take(parameters, name, 'Bouc-Wen operator') for name in names))
