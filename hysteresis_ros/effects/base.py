# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a physical effect is: a named correction of one stage between the drive and the sensor.

Stages follow each other in the order of the data, and effects are composed in that order::

    drive -> electrical -> thermal -> material (hysteresis, load) <-> mechanism -> sensor

An effect knows its parameters with unit and plausible range, its forward map, and its inverse where
a controller can undo it. Effects with dynamics or memory of their own carry it in `start` and
`step`; all others are pure functions of arrays.
"""

import abc
from collections.abc import Callable, Iterable, Mapping
import copy
import dataclasses
import math
import re
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from hysteresis_ros.errors import ParameterError

# A number of one moment, or an array of shape (rows,) with one for each row of a trial.
Values: TypeAlias = Any

STAGES = ('electrical', 'thermal', 'material', 'mechanism', 'sensor')


@dataclasses.dataclass(frozen=True)
class Parameter:
    """
    One number of an effect.

    Parameters
    ----------
    name, unit, description : str
        Name, unit and meaning.
    low, high : float
        Plausible range; an estimate outside it is an implausible explanation.
    neutral : float
        The value at which the effect vanishes.
    starts : tuple of float
        Values from which a fit starts.
    log : bool
        Whether the fit moves on a logarithmic scale (positive parameters over decades).
    both_signs : bool
        Whether minus the range is as plausible as the range.
    choices : tuple of float
        For a parameter that is tried at these values instead of being fitted.
    kinds : tuple of str
        Kinds of measurement, 'arm' or 'bench', on which it is fitted; else it keeps its value.
    form : bool
        Whether it tells forms of one equation apart, so that the effect is known without it. The
        neutral one is the simplest form, and stays where it was chosen.
    limits : (float, float), optional
        What the value cannot pass by its nature; default the range widened.
    scale : str
        What of muscle or arm, a key of `SCALES`, range and starts are in proportion to; they are
        those of the paper's. They hold for any muscle if it is empty.
    with_form : str
        Name of the parameter of form without which this one does nothing; fitted only with it.
    one_sided : bool
        Whether rows of a bench bound it on one side only, because H2's weights can make up for a
        value that is too large; the plausible range then counts as known beforehand.
    """

    name: str
    unit: str
    description: str
    low: float
    high: float
    neutral: float
    starts: tuple[float, ...]
    log: bool = False
    both_signs: bool = False
    choices: tuple[float, ...] = ()
    kinds: tuple[str, ...] = ('arm', 'bench')
    limits: tuple[float, float] | None = None
    form: bool = False
    scale: str = ''
    with_form: str = ''
    one_sided: bool = False

    def of(self, surroundings: 'Surroundings | None') -> 'Parameter':
        """Return it with the unit, range and starts that suit a muscle; for none, as it is."""
        if surroundings is None or not self.scale:
            return self
        factor = surroundings.over_paper(self.scale)
        limits = self.limits and (factor * self.limits[0], factor * self.limits[1])
        square, plain = DRIVE_UNITS.get(surroundings.drive, ('V^2', 'V'))
        return dataclasses.replace(
            self, low=factor * self.low, high=factor * self.high, limits=limits,
            starts=tuple(factor * start for start in self.starts),
            unit=(self.unit.replace('V^2', square) if 'V^2' in self.unit
                  else re.sub(r'\bV\b', plain, self.unit)))

    @property
    def bounds(self) -> tuple[float, float]:
        """Limits for a fit: the range widened, so that an implausible value can show itself."""
        if self.choices:
            return min(self.choices), max(self.choices)
        if self.limits is not None:
            return self.limits
        if self.log:
            return self.low / 5.0, self.high * 5.0
        if self.both_signs:
            return -2.0 * self.high, 2.0 * self.high
        margin = 0.5 * (self.high - self.low)
        return min(self.low - margin, self.neutral), self.high + margin

    def plausible(self, value: float, slack: float = 0.0) -> bool:
        """Whether `value` lies in the physical range, or beyond its ends by a share `slack`."""
        if self.choices:
            return value in self.choices
        size = abs(value) if self.both_signs else value
        # An end below 0 lies further away the larger it is.
        least = self.low * (1.0 + slack) if self.low < 0.0 else self.low / (1.0 + slack)
        return least <= size <= self.high * (1.0 + slack)


class Inputs(NamedTuple):
    """
    What was recorded with the drive, as arrays of one trial or as scalars of one moment.

    `time` [s] runs from the start of the trial, `clock` [s] from the start of the recording, `dt`
    is the time since the row before [s]; `ambient` [degC] is NaN where not recorded; `phase` is the
    martensite share (0 hot and short, 1 cold and long) of a first pass; `cycles` counts the travel
    of the drive since the recording began, in full strokes there and back; `supply` [V] and
    `load` are NaN where not recorded, as the load of an arm.
    """

    time: Values
    clock: Values
    dt: Values
    ambient: Values
    phase: Values
    cycles: Values
    supply: Values = math.nan
    load: Values = math.nan


class Surroundings(NamedTuple):
    """
    What an effect may have to know of the muscle: scales taken from the model, never fitted.

    `length` is the muscle's resting length in the response's unit (1 for a strain), `load` the
    mean load of the bench, `full_drive_squared` the largest drive squared seen there (the largest
    drive where that is no voltage or current), `span` the response's range, `drive`, `load_name`
    and `response` what they are. `cold` is the drive that every trial starts from, `drive_range`
    the width of the range seen, and `sign` is -1 for a muscle that gets shorter when driven, 1 for
    one that gets longer. `rest_load` is the load under which the cold muscle has its resting
    length, and `least` the response of H2 where it has transformed altogether. `muscles` is the
    number of parallel muscles that lift the arm, 1 without an arm. `operator` is the kind of H2.
    `ambient` is the range of the ambient temperature on the bench [degC], None where it was not
    recorded. `mass` is that of payload and forearm [kg], `moment` their largest moment about the
    pivot [N m], `inertia` their moment of inertia [kg m^2] and `lever` the distance from pivot to
    clamp [m], NaN without an arm.
    """

    length: float
    load: float
    full_drive_squared: float
    span: float
    drive: str = 'voltage'
    load_name: str | None = 'force'
    response: str = 'length'
    cold: float = 0.0
    drive_range: float = 1.0
    sign: int = -1
    rest_load: float = 0.0
    least: float = 0.0
    muscles: int = 1
    operator: str = 'preisach'
    ambient: tuple[float, float] | None = None
    mass: float = math.nan
    moment: float = math.nan
    inertia: float = math.nan
    lever: float = math.nan

    def over_paper(self, scale: str) -> float:
        """Return one of the `SCALES` over that of the paper's muscle and arm, 1 if not known."""
        share = SCALES[scale](self) / SCALES[scale](PAPER)
        return share if 0.0 < share < math.inf else 1.0


# The muscle and arm for which ranges of parameters are written down: the wires of the paper on a
# bench of 3 to 5 N and 0 to 6 V, and the arm of `config/bicep.yaml`.
PAPER = Surroundings(0.27, 4.116, 36.0, 0.016, drive_range=6.0, mass=0.14,
                     moment=9.81 * 0.3 * (0.1 + 0.04 / 2.0), inertia=0.3 ** 2 * (0.1 + 0.04 / 3.0),
                     lever=0.017)
# What a range may be in proportion to.
SCALES: dict[str, Callable[[Surroundings], float]] = {
    'length': lambda own: own.length,
    'compliance': lambda own: own.length / (own.load or math.nan),
    'strain per load': lambda own: 1.0 / (own.load or math.nan),
    'drive': lambda own: math.sqrt(own.full_drive_squared),
    'drive squared': lambda own: own.full_drive_squared,
    'load per drive squared': lambda own: own.load / (own.full_drive_squared or math.nan),
    'mass': lambda own: own.mass,
    'moment': lambda own: own.moment,
    'inertia': lambda own: own.inertia,
    'lever': lambda own: own.lever,
}
# Units of the drive's square and of the drive where these are not V^2 and V.
DRIVE_UNITS = {'current': ('A^2', 'A'), 'power': ('W', 'W')}


class Effect(abc.ABC):
    """
    One physical effect with its parameter values.

    A class says what it is in its attributes: `id`, `stage`, one physical `sentence`, `equation`,
    `source`, the signal that it `shows_in`, the `experiment` that excites it, and the effects that
    it is easily `confused_with`.

    Parameters
    ----------
    surroundings : Surroundings, optional
        The muscle it belongs to, where units or ranges of parameters depend on it.
    **values : float
        Values of the parameters; those left out are neutral.

    Raises
    ------
    ParameterError
        For a name it does not have or a value that is not finite.
    """

    id: ClassVar[str]
    stage: ClassVar[str]
    sentence: ClassVar[str]
    equation: ClassVar[str]
    source: ClassVar[str]
    shows_in: ClassVar[str]
    experiment: ClassVar[str]
    confused_with: ClassVar[tuple[str, ...]] = ()
    # Those of the class do for any muscle; an object has those that suit its own.
    parameters: tuple[Parameter, ...] = ()
    # Effects whose own equation contains that of another one, which it then replaces.
    replaces: ClassVar[tuple[str, ...]] = ()
    # The simpler effect that its equation comes to in a limit.
    limit: ClassVar[str | None] = None
    # Kinds of measurement in which the effect can show.
    kinds: ClassVar[tuple[str, ...]] = ('arm',)
    # Whether only a recording with transients can show it.
    needs_transients: ClassVar[bool] = False
    # Whether the maps need the martensite share, which a first pass without them gives.
    needs_phase: ClassVar[bool] = False
    # A recorded column without which the effect cannot be told.
    needs_column: ClassVar[str | None] = None
    # What changes by less there is a constant with noise on it, in the column's unit.
    smallest_change: ClassVar[float] = 0.0
    # Whether every muscle under load has it, so that nobody has to prove that it is there.
    universal: ClassVar[bool] = False
    # Whether it is the alloy's, which an arm has from the same reel as the bench.
    of_alloy: ClassVar[bool] = False
    # Whether a controller undoes it.
    invertible: ClassVar[bool] = True
    # Whether it acts before the onset of what a diagnosis tries, too: an error of the model.
    lasting: ClassVar[bool] = False
    # Parameters that are the effect's size together: each may be too small if not all of them are.
    together: ClassVar[tuple[str, ...]] = ()
    # Names of the attributes that hold what it remembers of the past; `start` sets them.
    memory: ClassVar[tuple[str, ...]] = ()

    def __init__(self, surroundings: Surroundings | None = None, **values: float) -> None:
        self.parameters = self.describe(surroundings)
        self._begin({parameter.name: parameter.neutral for parameter in self.parameters}, values)

    def _begin(self, known: Mapping[str, float], values: Mapping[str, float]) -> None:
        """Take over known values and new ones, with no intervals and no past."""
        self.values = {name: float(value) for name, value in known.items()}
        for name, value in values.items():
            if name not in known:
                raise ParameterError(
                    f'effect {self.id} has no parameter {name!r}; it has {", ".join(known)}')
            if not math.isfinite(value):
                raise ParameterError(f'effect {self.id}: {name} must be finite, not {value!r}')
            self.values[name] = float(value)
        self.intervals: dict[str, tuple[float, float]] = {}
        self.start()

    def __getattr__(self, name: str) -> float:
        """Read a parameter's value as an attribute, so that equations stay readable."""
        values = self.__dict__.get('values', {})
        if name in values:
            return values[name]
        raise AttributeError(f'{type(self).__name__} has no attribute {name!r}')

    @classmethod
    def describe(cls, surroundings: Surroundings | None) -> tuple[Parameter, ...]:
        """Return the parameters with the units and ranges that suit the muscle."""
        return tuple(parameter.of(surroundings) for parameter in cls.parameters)

    def __copy__(self) -> 'Effect':
        """Return one with the same values, and a past of its own from now on."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        return other

    def start(self) -> None:
        """Forget the past: a trial starts, from the cold muscle at rest."""

    def save(self) -> dict[str, Any]:
        """Return what it remembers of the past, as plain types."""
        return {name: getattr(self, name) for name in self.memory}

    def restore(self, state: Mapping[str, Any]) -> None:
        """
        Take back what `save` returned.

        Raises
        ------
        KeyError
            If a part of it is missing.
        """
        for name in self.memory:
            setattr(self, name, state[name])

    @classmethod
    def column_on_bench(cls, surroundings: Surroundings | None) -> float | None:
        """Return what its column had while the model was identified, where that is known."""
        return None

    @property
    def prior_odds(self) -> float:
        """Return the odds, before any data, that it acts in this form over those of any effect."""
        return 1.0

    @property
    def size_parameter(self) -> Parameter:
        """The parameter that is its size in the form that it has."""
        return self.parameters[0]

    def in_limit(self) -> bool:
        """Whether its intervals reach the limit in which it is `limit`."""
        return False

    def with_values(self, **values: float) -> 'Effect':
        """
        Return a copy with some values changed, without intervals and without a past.

        Raises
        ------
        ParameterError
            For a name it does not have or a value that is not finite.
        """
        other = copy.copy(self)
        other._begin(self.values, values)
        return other

    def with_parameter(self, name: str, **changes: Any) -> 'Effect':
        """Return a copy, one of whose parameters is described otherwise."""
        other = self.with_values()
        other.parameters = tuple(
            dataclasses.replace(parameter, **changes) if parameter.name == name else parameter
            for parameter in self.parameters)
        return other

    def implausible(self, slack: float = 0.0, duration: float = 0.0) -> list[str]:
        """
        Name the parameters outside their physical range, if in use.

        Parameters
        ----------
        slack : float
            See `Parameter.plausible`.
        duration : float
            Of the recording [s]; an effect whose terms add up over it names what is too large
            together as well.
        """
        odd = [parameter for parameter in self.parameters
               if self.values[parameter.name] != parameter.neutral
               and not parameter.plausible(self.values[parameter.name], slack)]
        if self.size_together(duration) >= 1.0 / (1.0 + slack):
            odd = [parameter for parameter in odd if parameter.name not in self.together
                   or abs(self.values[parameter.name]) > parameter.low]
        return [parameter.name for parameter in odd]

    def size_together(self, duration: float) -> float:
        """Return the size of the parameters `together` over the least that is physical."""
        return math.hypot(*(self.values[parameter.name] / parameter.low
                            for parameter in self.parameters if parameter.name in self.together))

    def to_dict(self) -> dict[str, Any]:
        """Return plain types for the model file."""
        units = {parameter.name: parameter.unit for parameter in self.parameters}
        return {'id': self.id, 'parameters': {
            name: {'value': value, 'low': self.intervals.get(name, (value, value))[0],
                   'high': self.intervals.get(name, (value, value))[1], 'unit': units[name]}
            for name, value in self.values.items()}}

    def within_trials(self) -> 'Effect':
        """Return the effect without what it would carry from one trial to the next."""
        return self

    def in_settled_rows(self) -> 'Effect':
        """Return the effect without parameters that only transients determine: they keep values."""
        return self

    def at_rest(self) -> 'Effect | None':
        """Return the effect as it acts when all has settled; None if it then does nothing."""
        return None if self.needs_transients else self

    def guesses(self, measured: np.ndarray) -> list[dict]:
        """Return values by name that the measured response (n,) suggests to start a fit from."""
        return []

    def moments(self, residual: np.ndarray, response: np.ndarray, clock: np.ndarray
                ) -> list[dict]:
        """
        Return values by name that a residual suggests to start from.

        Parameters
        ----------
        residual, response : ndarray, shape (n,)
            In the response's unit.
        clock : ndarray, shape (n,)
            Time since the recording began [s].
        """
        return []

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the effect makes sense for this muscle, whatever was recorded."""
        return True

    @classmethod
    def doubtful(cls, surroundings: Surroundings) -> bool:
        """Whether it is tried only where it is named; its user knows if the muscle can have it."""
        return False


def needs_phase(effects: Iterable[Effect]) -> bool:
    """Return whether one of some effects needs the martensite share."""
    return any(effect.needs_phase for effect in effects)
