# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A wire of grains: how long it is at a temperature and a tension, after all that was before.

The strain is what the two phases in series stretch elastically, and the transformation strain of
the martensite, which grows with the stress that orients it and saturates::

    strain = sigma (x / E_M + (1 - x) / E_A) + H(sigma) x,      x the martensite share
    H(sigma) = H_min + (H_max - H_min) (1 - exp(-sigma / sigma_H))

Even without load a trained wire shortens when heated (H_min > 0). Elongation is counted from the
resting length, which is that of the cold wire under its pretension.
"""

import dataclasses
import math
from typing import ClassVar

import numpy as np

from hysteresis_ros.laboratory.clamps import excess
from hysteresis_ros.laboratory.grains import Felt, GrainDistribution, Grains
from hysteresis_ros.laboratory.heat import ROOM
from hysteresis_ros.laboratory.variation import vary
from hysteresis_ros.laboratory.wire import Material, Wire

# Grains of a wire whose places differ: four times as many move an arm by one count of its encoder.
# A low-discrepancy sequence, other than that of the loops, spreads them over half the wire.
GRAINS_WITH_PLACES = 3000
SILVER = math.sqrt(2.0) - 1.0


@dataclasses.dataclass(frozen=True)
class GrainMaterial(Material):
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
    kept_strain : float
        Share of the strain that grains keep from the stress under which they turned to martensite,
        until they turn back; 0: none.
    cold_ends : float
        Length over which the wire's two ends warm up, over its length: see `clamps`; 0: all of it
        is equally warm.
    """

    name: ClassVar[str] = 'grains'
    arm_range: ClassVar[tuple[float, float]] = (141.6, 94.2)
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
    kept_strain: float = 0.0
    cold_ends: float = 0.0

    @property
    def temperature_step(self) -> float:    # type: ignore[override]
        """Largest change of temperature at once [K]; finite where grains keep their strain."""
        return 1.0 if self.kept_strain > 0.0 else math.inf

    @classmethod
    def specimen(cls, rng: np.random.Generator) -> 'GrainMaterial':
        """Return a batch that differs a little from the next."""
        usual = cls()
        grains = dataclasses.replace(
            usual.grains, start=usual.grains.start + rng.uniform(0.0, 1.5),
            spread=vary(rng, usual.grains.spread, 0.06), shape=vary(rng, usual.grains.shape, 0.05),
            tail=vary(rng, usual.grains.tail, 0.08), loop=vary(rng, usual.grains.loop, 0.05),
            loop_growth=vary(rng, usual.grains.loop_growth, 0.08))
        return dataclasses.replace(
            usual, grains=grains, grain_offset=rng.uniform(),
            austenite_modulus=vary(rng, usual.austenite_modulus, 0.04),
            martensite_modulus=vary(rng, usual.martensite_modulus, 0.04),
            strain_without_load=vary(rng, usual.strain_without_load, 0.03),
            largest_strain=vary(rng, usual.largest_strain, 0.02),
            orienting_stress=vary(rng, usual.orienting_stress, 0.08),
            clausius_clapeyron=vary(rng, usual.clausius_clapeyron, 0.03))

    def wire(self) -> 'GrainWire':
        """Return a new wire, cold."""
        return GrainWire(self)

    def with_slopes(self, factor: float) -> 'GrainMaterial':
        """Return the same with the Clausius-Clapeyron slope times a factor."""
        return dataclasses.replace(self, clausius_clapeyron=self.clausius_clapeyron * factor)

    def with_strain_growth(self, factor: float) -> 'GrainMaterial':
        """Return the same with the transformation strain's growth with stress times a factor."""
        growth = self.largest_strain - self.strain_without_load
        return dataclasses.replace(
            self, largest_strain=self.strain_without_load + growth * factor)

    def with_early_phase(self, strain: float) -> 'GrainMaterial':
        """Return the same with an R-phase of a strain before the martensite."""
        return dataclasses.replace(self, early_strain=strain)

    def with_kept_strain(self, share: float) -> 'GrainMaterial':
        """Return the same with grains that keep a share of the strain they formed with."""
        return dataclasses.replace(self, kept_strain=share)

    def with_cold_ends(self, share: float) -> 'GrainMaterial':
        """Return the same with clamps that keep the wire's ends cold, and grains enough."""
        return dataclasses.replace(self, cold_ends=share, grain_count=GRAINS_WITH_PLACES)

    def transformation_strain(self, stress: float) -> float:
        """Return H(sigma) for a stress [Pa]."""
        return self.strain_without_load + (self.largest_strain - self.strain_without_load) * (
            1.0 - math.exp(-max(stress, 0.0) / self.orienting_stress))

    def strain(self, martensite: float, early: float, stress: float,
               formed: float | None = None) -> float:
        """
        Return the strain against the unloaded austenite.

        Parameters
        ----------
        martensite, early : float
            Shares of martensite and of R-phase (or beyond) in [0, 1].
        stress : float
            Tension over cross section [Pa].
        formed : float, optional
            Mean strain with which the martensite formed; by default that of the present stress.
        """
        compliance = (martensite / self.martensite_modulus
                      + (1.0 - martensite) / self.austenite_modulus)
        mean = self.transformation_strain(stress)
        if formed is not None:
            mean += self.kept_strain * (formed - mean)
        return stress * compliance + mean * martensite + self.early_strain * early


class GrainWire(Wire):
    """
    One wire of grains with its memory.

    Parameters
    ----------
    material : GrainMaterial
        Constants of this specimen.
    """

    material: GrainMaterial

    def __init__(self, material: GrainMaterial):
        self._heating, self._cooling = material.grains.temperatures(
            material.grain_count, material.grain_offset)
        self._shift = 1.0 / material.clausius_clapeyron
        self._cooling_shift = self._shift / material.cooling_ratio
        # Every grain has its place, whatever its temperatures are.
        place = (material.grain_offset + SILVER * np.arange(material.grain_count)) % 1.0
        self._excess = excess(place, material.cold_ends)
        self._early_shift = 1.0 / material.early_clausius_clapeyron
        super().__init__(material)

    def heat_and_cool(self, temperature: float = 22.0, tension: float | None = None) -> None:
        """Heat until all is austenite, cool, and so wipe the memory; see `Wire`."""
        material = self.material
        self._grains = Grains(self._heating, self._cooling)
        # Strain of all martensite as it formed, times its share.
        self._formed = material.strain_without_load
        self._early = None
        if material.early_strain > 0.0:
            middle = material.early_temperature + material.early_spread * np.linspace(
                -1.0, 1.0, len(self._excess) if material.cold_ends > 0.0 else 40)
            self._early = Grains(middle, middle - material.early_loop)
        tension = material.pretension if tension is None else tension
        hot = float(self._heating.max()) + self._shift * tension / self._section + 20.0
        self.commit(hot, tension)
        self.commit(temperature, tension)

    @property
    def martensite(self) -> float:
        """Martensite share after the last `commit`."""
        return self._martensite

    def peek_martensite(self, temperature: float, tension: float) -> float:
        """Return the martensite share at a temperature [degC] and tension [N]; memory stays."""
        return self._peek(temperature, tension / self._section)

    def _peek(self, temperature: float, stress: float) -> float:
        local = self._local(temperature)
        return self._grains.peek(local - self._shift * stress,
                                 local - self._cooling_shift * stress)

    def _local(self, temperature: float) -> Felt:
        """Return the temperature of each grain where the clamps leave the wire at one [degC]."""
        if self.material.cold_ends == 0.0:
            return temperature
        return ROOM + self._excess * (temperature - ROOM)

    def _resting_strain(self) -> float:
        return self.material.strain(1.0, 1.0, self.material.pretension / self._section)

    def _peek_strain(self, temperature: float, stress: float) -> float:
        early = 1.0
        if self._early is not None:
            felt = self._local(temperature) - self._early_shift * stress
            early = self._early.peek(felt, felt)
        formed = self._formed_at(temperature, stress) if self._keeps else 0.0
        return self._strain(self._peek(temperature, stress), early, stress, formed)

    @property
    def _keeps(self) -> bool:
        return self.material.kept_strain > 0.0

    def _formed_at(self, temperature: float, stress: float) -> float:
        """
        Return the strain, times its share, that the martensite would remember.

        Grains hold each other: one that turns to martensite brings the strain of that moment in,
        and one that turns back takes the mean of all out.
        """
        before, local = self._grains.martensite, self._local(temperature)
        change = self._grains.turned(local - self._shift * stress,
                                     local - self._cooling_shift * stress) - before
        mean = self._formed / max(float(before.mean()), 1e-12)
        strain = self.material.transformation_strain(stress)
        return self._formed + (strain * float(np.maximum(change, 0.0).mean())
                               + mean * float(np.minimum(change, 0.0).mean()))

    def _commit_strain(self, temperature: float, stress: float) -> float:
        if self._keeps:
            self._formed = self._formed_at(temperature, stress)
        local = self._local(temperature)
        self._martensite = self._grains.commit(local - self._shift * stress,
                                               local - self._cooling_shift * stress)
        early = 1.0
        if self._early is not None:
            felt = self._local(temperature) - self._early_shift * stress
            early = self._early.commit(felt, felt)
        return self._strain(self._martensite, early, stress, self._formed)

    def _strain(self, martensite: float, early: float, stress: float, formed: float) -> float:
        mean = formed / max(martensite, 1e-12) if self._keeps else None
        martensite = self.retained + (1.0 - self.retained) * martensite
        return self.material.strain(martensite, early, stress, mean)
