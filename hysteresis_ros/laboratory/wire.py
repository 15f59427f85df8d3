# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One shape memory wire: how long it is at a temperature and a tension, after all that was before.

The strain is what the two phases in series stretch elastically, and the transformation strain of
the martensite, which grows with the stress that orients it and saturates::

    strain = sigma (x / E_M + (1 - x) / E_A) + H(sigma) x,      x the martensite share
    H(sigma) = H_min + (H_max - H_min) (1 - exp(-sigma / sigma_H))

Even without load a trained wire shortens when heated (H_min > 0). Elongation is counted from the
resting length, which is that of the cold wire under its pretension.
"""

import dataclasses
import math

import numpy as np

from hysteresis_ros.laboratory.grains import GrainDistribution, Grains
from hysteresis_ros.laboratory.solve import RootFinder

# Largest tension considered [N]; far above what any bench or arm here asks for.
LARGEST_TENSION = 60.0
# Elongations count as equal below this [m].
LENGTH_TOLERANCE = 5e-8
# About how much a wire stretches [m/N].
TYPICAL_COMPLIANCE = 4e-4


@dataclasses.dataclass(frozen=True)
class WireMaterial:
    """
    Constants of one 0.203 mm Flexinol wire of 0.27 m.

    Parameters
    ----------
    resting_length, diameter : float
        Cold length under the pretension, and thickness [m].
    pretension : float
        Tension at which the resting length is measured [N].
    austenite_modulus, martensite_modulus : float
        Young's moduli of the two phases [Pa].
    strain_without_load, largest_strain : float
        Transformation strains H_min and H_max.
    orienting_stress : float
        Stress sigma_H over which the transformation strain saturates [Pa].
    clausius_clapeyron : float
        Stress that shifts the transformation to austenite by one kelvin, C [Pa/K].
    cooling_ratio : float
        C of the transformation back over that.
    grains : GrainDistribution
        Transformation temperatures at zero stress.
    grain_count : int
        Number of grains.
    grain_offset : float
        What tells the grains of one specimen from those of another, in [0, 1).
    early_strain : float
        Strain of an R-phase that comes before the martensite, nearly without hysteresis; 0: none.
    early_temperature, early_loop, early_spread : float
        Heating temperature of the R-phase's middle, its hysteresis, and its spread [degC, K, K].
    early_clausius_clapeyron : float
        C of the R-phase, steeper than that of the martensite [Pa/K].
    """

    resting_length: float = 0.27
    diameter: float = 0.203e-3
    pretension: float = 0.5
    austenite_modulus: float = 62e9
    martensite_modulus: float = 32e9
    strain_without_load: float = 0.0315
    largest_strain: float = 0.0575
    orienting_stress: float = 110e6
    clausius_clapeyron: float = 7.0e6
    cooling_ratio: float = 1.03
    grains: GrainDistribution = GrainDistribution()
    grain_count: int = 400
    grain_offset: float = 0.0
    early_strain: float = 0.0
    early_temperature: float = 45.0
    early_loop: float = 3.0
    early_spread: float = 6.0
    early_clausius_clapeyron: float = 16e6

    @property
    def section(self) -> float:
        """Cross section [m^2]."""
        return 0.25 * math.pi * self.diameter ** 2

    def transformation_strain(self, stress: float) -> float:
        """Return H(sigma) for a stress [Pa]."""
        return self.strain_without_load + (self.largest_strain - self.strain_without_load) * (
            1.0 - math.exp(-max(stress, 0.0) / self.orienting_stress))

    def strain(self, martensite: float, early: float, stress: float) -> float:
        """
        Return the strain against the unloaded austenite.

        Parameters
        ----------
        martensite, early : float
            Shares of martensite and of R-phase (or beyond) in [0, 1].
        stress : float
            Tension over cross section [Pa].
        """
        compliance = (martensite / self.martensite_modulus
                      + (1.0 - martensite) / self.austenite_modulus)
        return (stress * compliance + self.transformation_strain(stress) * martensite
                + self.early_strain * early)


class Wire:
    """
    One wire with its memory.

    Parameters
    ----------
    material : WireMaterial
        Constants of this specimen.

    Attributes
    ----------
    retained : float
        Share of the grains that stay martensite for good, as use makes them.
    excess : float
        Length that the wire has beyond its elongation: dead length, creep [m].
    compliance : float
        Of crimps and cable in series with the wire [m/N].
    """

    def __init__(self, material: WireMaterial) -> None:
        self.material = material
        self.retained = 0.0
        self.excess = 0.0
        self.compliance = 0.0
        self._heating, self._cooling = material.grains.temperatures(
            material.grain_count, material.grain_offset)
        self._shift = 1.0 / (material.section * material.clausius_clapeyron)
        self._cooling_shift = self._shift / material.cooling_ratio
        self._early_shift = 1.0 / (material.section * material.early_clausius_clapeyron)
        self._find = RootFinder(TYPICAL_COMPLIANCE, LENGTH_TOLERANCE)
        self._rest = material.strain(1.0, 1.0, material.pretension / material.section)
        self.heat_and_cool()

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
        material = self.material
        self._grains = Grains(self._heating, self._cooling)
        self._early = None
        if material.early_strain > 0.0:
            middle = material.early_temperature + material.early_spread * np.linspace(-1.0, 1.0, 40)
            self._early = Grains(middle, middle - material.early_loop)
        tension = material.pretension if tension is None else tension
        self.commit(float(self._heating.max()) + self._shift * tension + 20.0, tension)
        self.commit(temperature, tension)

    @property
    def martensite(self) -> float:
        """Martensite share after the last `commit`."""
        return self._martensite

    def peek_martensite(self, temperature: float, tension: float) -> float:
        """Return the martensite share at a temperature [degC] and tension [N]; memory stays."""
        return self._grains.peek(temperature - self._shift * tension,
                                 temperature - self._cooling_shift * tension)

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
        early = 1.0
        if self._early is not None:
            felt = temperature - self._early_shift * tension
            early = self._early.peek(felt, felt)
        return self._length(self.peek_martensite(temperature, tension), early, tension)

    def commit(self, temperature: float, tension: float) -> float:
        """Bring the wire there, memory included, and return its elongation [m]."""
        self._martensite = self._grains.commit(temperature - self._shift * tension,
                                               temperature - self._cooling_shift * tension)
        early = 1.0
        if self._early is not None:
            felt = temperature - self._early_shift * tension
            early = self._early.commit(felt, felt)
        return self._length(self._martensite, early, tension)

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

    def _length(self, martensite: float, early: float, tension: float) -> float:
        material = self.material
        martensite = self.retained + (1.0 - self.retained) * martensite
        strain = material.strain(martensite, early, tension / material.section)
        return (material.resting_length * (strain - self._rest) + self.excess
                + self.compliance * tension)
