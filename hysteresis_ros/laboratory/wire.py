# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every wire of the laboratory can do, whichever constitutive equations it follows.

Bench and arm ask a wire how long it would be at a temperature and a tension, and bring it there.
A constitutive model is a `Material`, which holds constants and makes wires, and a `Wire`, which has
the state; elongation is counted from the resting length, that of the cold wire under pretension.
"""

import abc
import dataclasses
import math
from typing import Any, cast, ClassVar

import numpy as np

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.heat import ROOM
from hysteresis_ros.laboratory.solve import RootFinder

# Largest tension considered [N]; far above what any bench or arm here asks for.
LARGEST_TENSION = 60.0
# Elongations count as equal below this [m].
LENGTH_TOLERANCE = 5e-8
# About how much a wire stretches [m/N].
TYPICAL_COMPLIANCE = 4e-4


class Material(abc.ABC):
    """
    Constants of one batch of wire.

    Attributes
    ----------
    name : str
        What users call the constitutive model.
    resting_length, diameter : float
        Cold length under the pretension, and thickness [m].
    pretension : float
        Tension at which the resting length is measured [N].
    temperature_step : float
        Largest change of temperature [K] that is taken at once where the tension changes along:
        finite where the strain depends on the tension at which the martensite has formed.
    arm_range : tuple of float
        About where an arm of such wires stands without voltage and at 6 V [deg].
    drive, highest_drive, loads : str, float, tuple of float
        What is applied on the bench, at most how much [V], and the weights there [N]: 20 g of
        magnet and hooks with 100, 300, 500 and 700 g, at 9.8 m/s^2.
    """

    name: ClassVar[str]
    drive: ClassVar[str] = 'voltage'
    highest_drive: ClassVar[float] = 6.0
    loads: ClassVar[tuple[float, ...]] = (1.176, 3.136, 5.096, 7.056)
    temperature_step: ClassVar[float] = math.inf
    arm_range: ClassVar[tuple[float, float]]
    resting_length: float
    diameter: float
    pretension: float

    @property
    def section(self) -> float:
        """Cross section [m^2]."""
        return 0.25 * math.pi * self.diameter ** 2

    @classmethod
    @abc.abstractmethod
    def specimen(cls, rng: np.random.Generator) -> 'Material':
        """Return a batch that differs a little from the next."""

    @abc.abstractmethod
    def wire(self) -> 'Wire':
        """Return a new wire, cold."""

    def with_slopes(self, factor: float) -> 'Material':
        """Return the same with all Clausius-Clapeyron slopes times a factor."""
        raise self._lacks('stress_dependence')

    def with_strain_growth(self, factor: float) -> 'Material':
        """Return the same with the transformation strain's growth with stress times a factor."""
        raise self._lacks('stress_dependent_strain')

    def with_early_phase(self, strain: float) -> 'Material':
        """Return the same with an R-phase of a strain before the martensite."""
        raise self._lacks('r_phase')

    def with_kept_strain(self, share: float) -> 'Material':
        """Return the same with martensite that keeps a share of the strain it formed with."""
        raise self._lacks('formation_memory')

    def with_cold_ends(self, share: float) -> 'Material':
        """Return the same with clamps that keep the ends cold over a share of the length."""
        raise self._lacks('cold_clamps')

    def _lacks(self, effect: str) -> ParameterError:
        return ParameterError(f'laboratory: a {self.name} muscle cannot have {effect}: its '
                              'constitutive equations have no such constant; choose another '
                              'muscle or effect')


class TwoSlopeMaterial(Material):
    """
    Constants of a wire whose transformation temperatures rise in proportion to the stress.

    Attributes
    ----------
    austenite_slope, martensite_slope : float
        Clausius-Clapeyron slopes [Pa/K], fields of the dataclass that a model is.
    """

    austenite_slope: float
    martensite_slope: float

    def with_slopes(self, factor: float) -> 'Material':
        """Return the same with both Clausius-Clapeyron slopes times a factor."""
        return dataclasses.replace(
            cast(Any, self), austenite_slope=self.austenite_slope * factor,
            martensite_slope=self.martensite_slope * factor)


class Wire(abc.ABC):
    """
    One wire with its memory.

    Parameters
    ----------
    material : Material
        Constants of this specimen.

    Attributes
    ----------
    retained : float
        Share of the wire that stays martensite for good, as use makes it; negative where training
        lets it recover more than when it was new.
    excess : float
        Length that the wire has beyond its elongation: dead length, creep [m].
    compliance : float
        Of crimps and cable in series with the wire [m/N].
    expansion : float
        Coefficient of thermal expansion of both phases [1/K].
    """

    def __init__(self, material: Material) -> None:
        self.material = material
        self.retained = 0.0
        self.excess = 0.0
        self.compliance = 0.0
        self.expansion = 0.0
        self._section = material.section
        self._length = material.resting_length
        self._find = RootFinder(TYPICAL_COMPLIANCE, LENGTH_TOLERANCE)
        self._rest = self._resting_strain()
        self.heat_and_cool()

    @property
    @abc.abstractmethod
    def martensite(self) -> float:
        """Martensite share after the last `commit`."""

    @abc.abstractmethod
    def peek_martensite(self, temperature: float, tension: float) -> float:
        """Return the martensite share at a temperature [degC] and tension [N]; memory stays."""

    @abc.abstractmethod
    def heat_and_cool(self, temperature: float = 22.0, tension: float | None = None) -> None:
        """
        Heat until all is austenite, cool, and so wipe the memory.

        Parameters
        ----------
        temperature : float
            Temperature at the end [degC].
        tension : float or None
            Tension meanwhile [N]; the pretension by default.
        """

    @abc.abstractmethod
    def _resting_strain(self) -> float:
        """Return the strain of the cold wire under its pretension."""

    @abc.abstractmethod
    def _peek_strain(self, temperature: float, stress: float) -> float:
        """Return the strain at a temperature [degC] and stress [Pa]; memory stays."""

    @abc.abstractmethod
    def _commit_strain(self, temperature: float, stress: float) -> float:
        """Bring the wire to a temperature [degC] and stress [Pa] and return its strain."""

    def elongation(self, temperature: float, tension: float) -> float:
        """
        Return the elongation [m] that the wire would have; its memory stays.

        Parameters
        ----------
        temperature : float
            Temperature [degC].
        tension : float
            Tension [N], at least 0.
        """
        return self._elongation(
            self._peek_strain(temperature, tension / self._section), temperature, tension)

    def commit(self, temperature: float, tension: float) -> float:
        """Bring the wire there, memory included, and return its elongation [m]."""
        return self._elongation(
            self._commit_strain(temperature, tension / self._section), temperature, tension)

    def tension(self, temperature: float, elongation: float, guess: float = 1.0) -> float:
        """
        Return the tension [N] at which the wire has a given elongation; its memory stays.

        Parameters
        ----------
        temperature : float
            Temperature [degC].
        elongation : float
            Length less resting length [m].
        guess : float
            Tension to start from [N].

        Returns
        -------
        float
            Zero where the wire hangs loose: it cannot push.
        """
        return self._find(lambda force: self.elongation(temperature, force) - elongation,
                          guess, 0.0, LARGEST_TENSION)

    def _elongation(self, strain: float, temperature: float, tension: float) -> float:
        expanded = self.expansion * (temperature - ROOM)
        return (self._length * (strain + expanded - self._rest) + self.excess
                + self.compliance * tension)


def steps_between(before: float, after: float, largest: float) -> list[float]:
    """
    Return temperatures on the way from one to another, the last of them included.

    Parameters
    ----------
    before, after : float
        Temperatures [degC].
    largest : float
        Largest step [K]; infinite: go there at once.
    """
    count = max(math.ceil(abs(after - before) / largest), 1)
    return [before + (after - before) * number / count for number in range(1, count)] + [after]
