# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Free parameters of effects as one vector that an optimiser can move."""

from collections.abc import Collection, Sequence
import itertools
import math

import numpy as np

from hysteresis_ros.effects import catalogue, Effect, Parameter, Surroundings


class ParameterVector:
    """
    The parameters of some effects that are fitted to one kind of measurement.

    Positive parameters over decades are moved on a logarithmic scale, all others in units of their
    plausible range, so that every component has a size of about one. The simplest form of an
    equation stays as it is.

    Parameters
    ----------
    effects : sequence of Effect
        The effects that are fitted, with the values that stay fixed.
    kind : str
        'arm' or 'bench'.
    """

    def __init__(self, effects: Sequence[Effect], kind: str) -> None:
        self.effects, self._kind = list(effects), kind
        self.entries = [(index, parameter) for index, effect in enumerate(self.effects)
                        for parameter in effect.parameters
                        if kind in parameter.kinds and not parameter.choices
                        and not _in_simplest_form(effect, parameter)]
        self.lower, self.upper = (
            np.array([_to_unit(parameter, parameter.bounds[side])
                      for _, parameter in self.entries]) for side in (0, 1))

    def __len__(self) -> int:
        """Return the number of free parameters."""
        return len(self.entries)

    def vector(self) -> np.ndarray:
        """Return the present values, shape (k,)."""
        return np.clip([_to_unit(parameter, self.effects[index].values[parameter.name])
                        for index, parameter in self.entries], self.lower, self.upper)

    def prior(self) -> tuple[np.ndarray, np.ndarray]:
        """
        Return mean and standard deviation of the parameters beforehand, each shape (k,).

        The plausible range is the middle 87 % (1.5 standard deviations to each side).
        """
        low, high = np.reshape([self.plausible(index) for index in range(len(self))], (-1, 2)).T
        return 0.5 * (low + high), 0.5 * (high - low) / 1.5

    def with_vector(self, vector: np.ndarray) -> list[Effect]:
        """Return the effects with the values of a vector of shape (k,)."""
        values: list[dict[str, float]] = [{} for _ in self.effects]
        for (index, parameter), value in zip(self.entries, np.clip(
                vector, self.lower, self.upper)):
            values[index][parameter.name] = _from_unit(parameter, float(value))
        return [effect.with_values(**changed)
                for effect, changed in zip(self.effects, values)]

    def free_still(self, effects: Sequence[Effect]) -> np.ndarray:
        """
        Return which parameters are free with other values of the effects, bool of shape (k,).

        A form that comes out neutral is the simplest one and stays so.
        """
        free = ParameterVector(effects, self._kind).entries
        return np.array([entry in free for entry in self.entries], dtype=bool)

    def plausible(self, index: int) -> tuple[float, float]:
        """Return the plausible range of one parameter, in the units of the vector."""
        _, parameter = self.entries[index]
        low, high = (_to_unit(parameter, value) for value in (parameter.low, parameter.high))
        return (-high if parameter.both_signs else low), high

    def values_at(self, index: int, places: tuple[float, float]) -> tuple[float, float]:
        """Return the values of one parameter at two places in the units of the vector."""
        _, parameter = self.entries[index]
        low, high = (_from_unit(parameter, place) for place in places)
        return low, high

    def with_intervals(self, vector: np.ndarray, half_widths: np.ndarray) -> list[Effect]:
        """Return the effects at `vector` (k,) with the intervals of `half_widths` (k,)."""
        effects = self.with_vector(vector)
        ends = np.clip(np.stack([vector - half_widths, vector + half_widths]),
                       self.lower, self.upper)
        for (index, parameter), low, high in zip(self.entries, *ends):
            effects[index].intervals[parameter.name] = (
                _from_unit(parameter, float(low)), _from_unit(parameter, float(high)))
        return effects


def _in_simplest_form(effect: Effect, parameter: Parameter) -> bool:
    """Whether a parameter tells forms apart, or belongs to a form, and the form is neutral."""
    form = parameter.name if parameter.form else parameter.with_form
    return any(other.name == form and effect.values[form] == other.neutral
               for other in effect.parameters)


def _unit(parameter: Parameter) -> float:
    return max(parameter.high if parameter.both_signs else parameter.high - parameter.low, 1e-12)


def _to_unit(parameter: Parameter, value: float) -> float:
    if parameter.log:
        return math.log(max(value, parameter.bounds[0]))
    return value / _unit(parameter)


def _from_unit(parameter: Parameter, value: float) -> float:
    return math.exp(value) if parameter.log else value * _unit(parameter)


def starts_of(effect: Effect, kind: str, measured: np.ndarray | None = None,
              most: int = 18, residual: np.ndarray | None = None,
              clock: np.ndarray | None = None) -> list[Effect]:
    """
    Return copies of `effect` at the values from which a fit may start.

    All combinations of the starts of its parameters, thinned evenly to at most `most`, and what
    the response and the residual, where they are given, suggest.

    Parameters
    ----------
    effect : Effect
    kind : str
        'arm' or 'bench'.
    measured : ndarray, shape (n,), optional
        The response.
    most : int
        Combinations, without those that are suggested.
    residual, clock : ndarray, shape (n,), optional
        What is not explained without the effect, and since when its recording runs [s].

    Returns
    -------
    list of Effect
    """
    fitted = [parameter for parameter in effect.parameters if kind in parameter.kinds]
    combinations = list(itertools.product(
        *(parameter.starts if parameter.form else parameter.choices or parameter.starts
          for parameter in fitted)))
    if len(combinations) > most:
        chosen = np.linspace(0, len(combinations) - 1, most).round().astype(int)
        combinations = [combinations[index] for index in chosen]
    starts = [effect.with_values(**{parameter.name: value
                                    for parameter, value in zip(fitted, combination)})
              for combination in combinations]
    guesses = [] if measured is None else effect.guesses(measured)
    if measured is not None and residual is not None and clock is not None:
        guesses = [*guesses, *effect.moments(residual, measured, clock)]
    # A guess of what this kind of measurement does not show is none.
    names = {parameter.name for parameter in fitted}
    return starts + [starts[0].with_values(**guess) for guess in guesses
                     if names.issuperset(guess)]


def universal(surroundings: Surroundings, but: Collection[str]) -> list[Effect]:
    """Return what every loaded muscle has on a bench, at usual values, but for some by name."""
    return usual([kind(surroundings) for name, kind in catalogue().items()
                  if kind.universal and name not in but and kind.available(surroundings)], 'bench')


def usual(effects: Sequence[Effect], kind: str) -> list[Effect]:
    """Return copies of effects at usual values; what is chosen, not fitted, stays."""
    found = []
    for effect in effects:
        starts = starts_of(effect, kind)
        found.append(starts[len(starts) // 2].with_values(**{
            parameter.name: effect.values[parameter.name]
            for parameter in effect.parameters if parameter.choices}))
    return found
