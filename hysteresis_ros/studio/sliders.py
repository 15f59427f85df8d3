# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of effects as sliders: a position from 0 to 1 for each value of its range."""

from __future__ import annotations

import dataclasses
import math

from hysteresis_ros.effects import Effect, Parameter

# Digits of a value that was set by hand, so that a command can repeat it exactly.
DIGITS = 4


@dataclasses.dataclass(frozen=True)
class Slider:
    """
    One parameter of one effect, to be set by hand.

    Attributes
    ----------
    effect : str
        Identifier of the effect.
    parameter : Parameter
    value, low, high : float
        Value and ends of the slider, in the parameter's unit.
    interval : (float, float) or None
        95 % interval, if the value was fitted.
    """

    effect: str
    parameter: Parameter
    value: float
    low: float
    high: float
    interval: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """Effect and parameter, as the option `--values` names them."""
        return f'{self.effect}.{self.parameter.name}'

    @property
    def unit(self) -> str:
        """Unit for people, '' for a number without one."""
        return '' if self.parameter.unit == '1' else self.parameter.unit

    @property
    def choices(self) -> list[float]:
        """The only values that it can have, ascending; empty for any value between the ends."""
        return sorted(self.parameter.choices)

    @property
    def logarithmic(self) -> bool:
        """Whether equal ways along the slider multiply the value."""
        return self.parameter.log and self.low > 0.0

    @property
    def position(self) -> float:
        """Where the value lies between the ends, 0 to 1, or the number of its choice."""
        if self.choices:
            return float(self.choices.index(self.value) if self.value in self.choices else 0)
        low, high, value = (self._along(x) for x in (self.low, self.high, self.value))
        return min(max((value - low) / (high - low), 0.0), 1.0)

    def at(self, position: float) -> float:
        """Return the value at a position, or the choice of that number."""
        if self.choices:
            return self.choices[int(min(max(round(position), 0), len(self.choices) - 1))]
        low, high = self._along(self.low), self._along(self.high)
        along = low + min(max(position, 0.0), 1.0) * (high - low)
        return rounded(math.exp(along) if self.logarithmic else along, self.high - self.low)

    def _along(self, value: float) -> float:
        return math.log(max(value, self.low)) if self.logarithmic else value


def rounded(value: float, span: float) -> float:
    """Return a value with a few digits; of a range through zero, as many as the span has."""
    if value == 0.0:
        return 0.0
    size = max(abs(value), 1e-3 * span)
    return round(value, DIGITS - 1 - math.floor(math.log10(size)))


def sliders_of(effect: Effect, kind: str) -> list[Slider]:
    """
    Return the sliders of an effect.

    Parameters
    ----------
    effect : Effect
        With its present values.
    kind : str
        'arm' or 'bench'; what is not fitted to this kind of measurement keeps its value.

    Returns
    -------
    list of Slider
        Over the plausible ranges; over what a fit may try, where a value lies outside.
    """
    found = []
    for parameter in effect.parameters:
        if kind not in parameter.kinds:
            continue
        value = effect.values[parameter.name]
        low, high = plausible_range(parameter)
        if not low <= value <= high and value != parameter.neutral:
            low, high = min(low, parameter.bounds[0]), max(high, parameter.bounds[1])
        found.append(Slider(effect.id, parameter, value, low, high,
                            effect.intervals.get(parameter.name)))
    return found


def plausible_range(parameter: Parameter) -> tuple[float, float]:
    """Return the range that is physical; with its neutral value, if it is not logarithmic."""
    if parameter.choices:
        return min(parameter.choices), max(parameter.choices)
    if parameter.both_signs:
        return -parameter.high, parameter.high
    if parameter.log:
        return parameter.low, parameter.high
    return min(parameter.low, parameter.neutral), max(parameter.high, parameter.neutral)
