# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every hysteresis operator is: a scalar input, a scalar output, and a memory.

An operator is rate-independent (Sec. IV of the paper): only the sequence of inputs counts, not
their times. Committing an input (`step`) changes the memory; asking (`peek`, `invert`)
never does, so that a controller may try as often as it likes and commit what it applied.
"""

import abc
import math
from typing import Any, ClassVar, Mapping, NamedTuple

import numpy as np

from ..errors import ParameterError

# Parameters beyond are refused, so that no product of two can overflow.
LARGEST = 1e100
# Differences of the output below this share of full scale are rounding, not a request.
_RESOLUTION = 1e-13
# So are those below a few units in the last place, where a constant hides a small full scale.
_LAST_PLACES = 8.0 * float(np.finfo(float).eps)


class Inversion(NamedTuple):
    """
    The answer of an inverse.

    Attributes
    ----------
    input : float
        Input to apply, inside the operator's range, never NaN.
    output : float
        What the operator gives at that input.
    saturated : bool
        True if the request was outside what the operator can give, or not a finite number.

    """

    input: float
    output: float
    saturated: bool


class HysteresisOperator(abc.ABC):
    """
    Rate-independent hysteresis: scalar input, scalar output, memory between them.

    Attributes
    ----------
    lower, upper : float
        Input range. An input outside is taken as the nearer end.
    input, output : float
        Last committed input (inside the range) and the output that it gave. Read only.
    saturated : bool
        Whether the last committed input was outside the range, or not a finite number. Read only.

    """

    kind: ClassVar[str] = ''
    lower: float
    upper: float
    input: float
    output: float
    saturated: bool

    _kinds: ClassVar[dict[str, type['HysteresisOperator']]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        """Enter the class under its kind, for `operator_from_dict`."""
        super().__init_subclass__(**options)
        if cls.kind:
            HysteresisOperator._kinds[cls.kind] = cls

    @abc.abstractmethod
    def reset(self) -> None:
        """Forget the history: cold state, negative saturation, input at `lower`."""

    @abc.abstractmethod
    def save(self) -> dict[str, Any]:
        """
        Return the memory as plain numbers and lists, fit for JSON and YAML.

        `restore` of an operator with the same parameters brings back the same future to the
        last bit.
        """

    @abc.abstractmethod
    def restore(self, state: Mapping[str, Any]) -> None:
        """
        Take over a memory that `save` returned.

        Raises
        ------
        ParameterError
            If it is no memory of this kind of operator and this input range. The operator
            keeps the memory that it had.

        """

    def snapshot(self) -> Any:
        """Return the memory for `rewind`: quicker than `save`, but good for this operator only."""
        return self.save()

    def rewind(self, snapshot: Any) -> None:
        """Go back to a memory that `snapshot` returned."""
        self.restore(snapshot)

    @abc.abstractmethod
    def step(self, u: float) -> float:
        """
        Commit an input and return the output.

        An input outside the range counts as the nearer end; NaN leaves the memory as it is.
        Both set `saturated`.
        """

    @abc.abstractmethod
    def peek(self, u: float) -> float:
        """Return the output that `step` would give, and commit nothing."""

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """
        Commit a sequence of inputs and return the outputs.

        Parameters
        ----------
        u : ndarray, shape (M,)
            Inputs, taken after those committed so far.

        Returns
        -------
        ndarray, shape (M,)
            The outputs of M calls of `step`, to 1e-12 of full scale.

        """
        step = self.step
        return np.array([step(value) for value in sequence(u).tolist()])

    def invert(self, y: float, dead_band: float = 0.0) -> Inversion:
        """
        Find the input nearest to the present one whose output is `y`; commit nothing.

        The slope of a hysteresis branch starts at zero, so right after a reversal a small
        change dy of the reference asks for an input change that goes with the root of dy:
        noise in the reference is amplified without bound. A dead band limits this; with 0 the
        inverse is exact.

        Parameters
        ----------
        y : float
            Requested output. Outside `output_range` the nearest output is taken, flagged as
            saturated; NaN and infinities keep the present input, flagged as saturated.
        dead_band : float
            A move that would reverse the input for an output change of at most this size is
            not made. Costs an output error of at most `dead_band`, until the reference has
            moved by more. As wide as the noise of the reference from peak to peak it keeps
            the input still; narrower ones leave reversals in. Unit of the output.

        Returns
        -------
        Inversion
            Input, the output that it gives, and whether the request was out of reach.

        """
        return Inversion(*self.solve(y, dead_band))

    def solve(self, y: float, dead_band: float = 0.0) -> tuple[float, float, bool]:
        """Return what `invert` does as a plain tuple, which is faster inside a control loop."""
        y = float(y)
        if not -math.inf < y < math.inf:
            return self.input, self.output, True
        found = self._solve(y)
        if dead_band > 0.0:
            u, _, saturated = found
            reverses = (u - self.input) * self.direction <= 0.0
            if reverses and abs(y - self.output) <= dead_band:
                return self.input, self.output, saturated
        return found

    @abc.abstractmethod
    def _solve(self, y: float) -> tuple[float, float, bool]:
        """Solve for a finite request exactly: input, its output, whether out of reach."""

    @property
    @abc.abstractmethod
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""

    @property
    @abc.abstractmethod
    def output_range(self) -> tuple[float, float]:
        """Smallest and largest output that the operator can give."""

    @abc.abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""

    @classmethod
    @abc.abstractmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'HysteresisOperator':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""


def operator_from_dict(parameters: Mapping[str, Any]) -> HysteresisOperator:
    """
    Build an operator of any kind, in its cold state, from what its `to_dict` returned.

    Raises
    ------
    ParameterError
        If the kind is not known, or a parameter is missing or makes no sense.

    """
    kinds = HysteresisOperator._kinds
    kind = parameters.get('kind') if isinstance(parameters, Mapping) else None
    if not isinstance(kind, str) or kind not in kinds:
        raise ParameterError(
            f'hysteresis operator of unknown kind {kind!r}: use one of {", ".join(sorted(kinds))}')
    return kinds[kind].from_dict(parameters)


def take(mapping: Mapping[str, Any], key: str, where: str) -> Any:
    """Return an entry of a mapping; ParameterError with its place if it is missing."""
    if not isinstance(mapping, Mapping) or key not in mapping:
        raise ParameterError(f'{where}: "{key}" is missing')
    return mapping[key]


def number(value: Any, name: str) -> float:
    """Return a finite float; ParameterError otherwise."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ParameterError(f'{name} is {value!r}, not a number')
    if not math.isfinite(value):
        raise ParameterError(f'{name} is {value}: give a finite number')
    return float(value)


def numbers(values: Any, name: str) -> np.ndarray:
    """Return a finite 1-D float array (a copy); ParameterError otherwise."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(f'{name}: not a list of numbers') from None
    if array.ndim != 1:
        raise ParameterError(f'{name}: {array.ndim} dimensions instead of a plain list')
    if not np.all(np.isfinite(array)):
        raise ParameterError(f'{name}: entry {int(np.argmin(np.isfinite(array)))} is not finite')
    return array


def memory(state: Mapping[str, Any], operator: HysteresisOperator) -> tuple[float, bool, str]:
    """
    Check what every saved memory holds.

    Returns
    -------
    input : float
        The present input, inside the operator's range.
    saturated : bool
        Whether the committed input was outside.
    where : str
        How messages name the memory.

    """
    where = f'memory of a {operator.kind} operator'
    if take(state, 'kind', where) != operator.kind:
        raise ParameterError(f'{where}: kind is {state["kind"]!r} instead of {operator.kind!r}')
    u = number(take(state, 'input', where), f'{where}: input')
    if not operator.lower <= u <= operator.upper:
        raise ParameterError(f'{where}: input {u} is outside of the range '
                             f'{operator.lower} to {operator.upper}')
    saturated = take(state, 'saturated', where)
    if not isinstance(saturated, bool):
        raise ParameterError(f'{where}: saturated is {saturated!r}, not true or false')
    return u, saturated, where


def resolution(ends: tuple[float, float]) -> float:
    """Return the difference of outputs that counts as rounding, given the output range."""
    low, high = ends
    return _RESOLUTION * (high - low) + _LAST_PLACES * max(abs(low), abs(high))


def input_range(lower: Any, upper: Any, where: str) -> tuple[float, float]:
    """Return a checked input range, lower below upper."""
    low, high = number(lower, f'{where}: lower'), number(upper, f'{where}: upper')
    if not low < high:
        raise ParameterError(f'{where}: lower {low} is not below upper {high}')
    return low, high


def one_sign(values: np.ndarray, name: str) -> float:
    """Return the sign of values, 1.0 if all are zero; ParameterError if they are mixed."""
    if np.any(values < 0.0) and np.any(values > 0.0):
        raise ParameterError(f'{name}: both signs, so the output would not follow the input one '
                             'way; make all of them >= 0 or all <= 0')
    return -1.0 if np.any(values < 0.0) else 1.0


def sequence(u: Any) -> np.ndarray:
    """Return inputs as a 1-D float array; NaN is let through, as `step` does."""
    array = np.asarray(u, dtype=float)
    if array.ndim != 1:
        raise ParameterError(f'inputs have {array.ndim} dimensions: give a plain sequence')
    return array
