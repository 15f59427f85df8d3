# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The normalised Bouc-Wen operator, solved exactly between reversals.

In the normalised form (F. Ikhouane and J. Rodellar, Systems with Hysteresis, Wiley 2007, Sec. 2.4)
the hidden state w in [-1, 1] follows the input u by ::

    dw = rho (du - sigma |du| |w|^(n-1) w + (sigma - 1) du |w|^n)

which knows no time. Along a branch it is solved in closed form (`kernels.bouc_wen`), so the result
does not depend on how finely the input is sampled. The output is bias + S(x) with

    x = stiffness * u + gain * w

and S a curve of dead zones, without which loops are alike at every level of the input. With a gain
of the sign of the stiffness the output leads its input, as the force of a spring with friction
does; with one of the other sign it lags, as the response of an actuator does (T. S. Low and W. Guo,
J. Microelectromech. Syst. 4 (1995) 230).
"""

import functools
import math
from types import ModuleType
from typing import Any, Mapping, Sequence

import numpy as np
from scipy.special import psi

from .base import (
    HysteresisOperator, LARGEST, input_range, memory, number, resolution, sequence, take)
from .dead_zones import DeadZones
from ..errors import ParameterError

_ITERATIONS = 200
# By this share the gain of an output that lags may be too large: rounding.
_ROUNDING = 1e-9


@functools.cache
def _kernel() -> ModuleType:
    """Return the compiled part, which takes longer to import than all else here."""
    from ..kernels import bouc_wen
    return bouc_wen


class BoucWen(HysteresisOperator):
    """
    Bouc-Wen operator: output = bias + S(stiffness * input + gain * w).

    Parameters
    ----------
    stiffness, gain : float
        Of one sign, or, so that the output is monotone between reversals, of two signs with
        2 * shape * rate * abs(gain) at most abs(stiffness). Unit of the output over that of the
        input, and of the output.
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
    thresholds, bends : array_like, shape (L,)
        Dead zones of S, see `DeadZones`; without them S(x) = x.

    Raises
    ------
    ParameterError
        If a parameter is outside its range or not finite.

    """

    kind = 'bouc-wen'

    def __init__(self, stiffness: float, gain: float, rate: float, shape: float,
                 exponent: float, bias: float, lower: float, upper: float,
                 thresholds: Sequence[float] = (), bends: Sequence[float] = ()) -> None:
        where = 'Bouc-Wen operator'
        self.stiffness, self.gain = (
            number(stiffness, f'{where}: stiffness'), number(gain, f'{where}: gain'))
        self.rate, self.shape = number(rate, f'{where}: rate'), number(shape, f'{where}: shape')
        self.exponent = number(exponent, f'{where}: exponent')
        self.bias = number(bias, f'{where}: bias')
        self.lower, self.upper = input_range(lower, upper, where)
        self.curve = DeadZones(thresholds, bends, where)
        if not 0.0 < self.rate <= LARGEST:
            raise ParameterError(f'{where}: rate is {self.rate}, it has to be above 0')
        if not 0.5 <= self.shape <= 100.0:
            raise ParameterError(f'{where}: shape is {self.shape}, it has to be at least 0.5 '
                                 'and at most 100')
        if not 1.0 <= self.exponent <= 100.0:
            raise ParameterError(f'{where}: exponent is {self.exponent}, it has to be 1 to 100')
        self._sign = self._checked_sign(where)
        self._curl = 2.0 * self.shape - 1.0
        self._pole = float(psi(1.0) - psi(1.0 / self.exponent))
        self.reset()
        ends = self.output, self._at(self.upper, 1.0)
        if not max(map(abs, ends)) <= LARGEST:
            raise ParameterError(f'{where}: the output reaches beyond {LARGEST:g}, use another '
                                 'unit')
        self._ends = min(ends), max(ends)
        self._tolerance = resolution(self._ends)

    def _checked_sign(self, where: str) -> float:
        """Return whether the output rises (1.0) or falls (-1.0) with the input."""
        if self.stiffness * self.gain >= 0.0:
            return -1.0 if min(self.stiffness, self.gain) < 0.0 else 1.0
        most = abs(self.stiffness) / (2.0 * self.shape * self.rate)
        if abs(self.gain) > (1.0 + _ROUNDING) * most:
            raise ParameterError(
                f'{where}: stiffness and gain have both signs, and a gain beyond {most:.6g} would '
                'let the output turn where the input does not')
        return math.copysign(1.0, self.stiffness)

    def reset(self) -> None:
        """Forget the history: the input came down to `lower` from far above, w = -1."""
        self._w = -1.0
        self._direction = 0.0
        self.input = self.lower
        self.saturated = False
        self.output = self._at(self.lower, self._w)

    def _at(self, u: float, w: float) -> float:
        return self.bias + self.curve.value(self.stiffness * u + self.gain * w)

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

    def _slope(self, w: float) -> float:
        """Return d x / d input while rising, or while falling with -w for w."""
        return self.stiffness + self.gain * self.rate * _kernel().pace(
            w, 1.0 - w, self._curl, self.exponent)

    def _turned(self, u: float) -> float:
        """Return w after a movement to an input inside the range."""
        return _kernel().moved(
            self._w, self.rate * (u - self.input), self._curl, self.exponent, self._pole)

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

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """Commit a sequence of inputs, shape (M,), and return the outputs, shape (M,)."""
        u = sequence(u)
        if len(u) < 3 or not np.all(np.isfinite(u)):
            return super().simulate(u)
        inside = np.clip(u, self.lower, self.upper)
        states = _kernel().follow(inside, self.input, self._w, self.rate, self._curl,
                                  self.exponent, self._pole)
        outputs = self.bias + self.curve.values(self.stiffness * inside + self.gain * states)
        moves = np.sign(np.diff(inside, prepend=self.input))
        if np.any(moves):
            self._direction = float(moves[np.flatnonzero(moves)[-1]])
        self.input, self._w = float(inside[-1]), float(states[-1])
        self.output = self._at(self.input, self._w)
        self.saturated = bool(inside[-1] != u[-1])
        return outputs

    def _solve(self, y: float) -> tuple[float, float, bool]:
        missing = self._sign * (y - self.output)
        if abs(missing) <= self._tolerance:
            return self.input, self.output, False
        u, output = self._seek(y, self.upper if missing > 0.0 else self.lower)
        if abs(output - self.output) <= self._tolerance:
            # On a plateau nothing is gained by a movement.
            u, output = self.input, self.output
        # What the present branch cannot reach before the end of the range is out of reach.
        return u, output, abs(output - y) > 10.0 * self._tolerance

    def _seek(self, y: float, end: float) -> tuple[float, float]:
        """
        Find the input between the present one and an end whose output is y, or comes nearest.

        Along a branch the slope of x over the input only falls, or only grows where the output
        lags, so Newton's method comes from one side; halving guards the rest.
        """
        side = 1.0 if end > self.input else -1.0
        output = self.peek(end)
        if self._sign * side * (y - output) >= 0.0:
            return end, output
        near, far = self.input, end
        wanted = self.curve.inverse(y - self.bias)
        u, w, output = near, self._w, self.output
        for _ in range(_ITERATIONS):
            error = y - output
            if abs(error) <= 0.1 * self._tolerance:
                break
            if self._sign * side * error > 0.0:
                near = u
            else:
                far = u
            slope = self._slope(side * w)
            missing = wanted - (self.stiffness * u + self.gain * w)
            u = u + missing / slope if slope != 0.0 else far
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
                'bias': self.bias, 'lower': self.lower, 'upper': self.upper,
                'thresholds': self.curve.thresholds.tolist(),
                'bends': self.curve.bends.tolist()}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'BoucWen':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        names = ('stiffness', 'gain', 'rate', 'shape', 'exponent', 'bias', 'lower', 'upper')
        # Files written before there were dead zones do not name them.
        curve = {name: parameters.get(name, ()) for name in ('thresholds', 'bends')}
        return cls(*(take(parameters, name, 'Bouc-Wen operator') for name in names), **curve)
