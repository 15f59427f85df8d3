# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A wire after the unified model of Lagoudas and others (2012), in one dimension.

D. Lagoudas, D. Hartl, Y. Chemisky, L. Machado, P. Popov: Constitutive model for the numerical
analysis of phase transformation in polycrystalline shape memory alloys, International Journal of
Plasticity 32-33 (2012) 155-183. With the martensite share xi and the transformation strain e::

    strain = sigma (S_A + xi (S_M - S_A)) + e
    towards martensite  de = H_cur(sigma) dxi;   back  de = (e / xi) dxi
    H_cur(sigma) = H_min + (H_sat - H_min) (1 - exp(-k (sigma - sigma_crit)))

so martensite keeps the strain of the stress under which it formed until it is heated. It forms, and
goes back, where the driving force reaches the hardening function; divided by the difference of
entropy rho ds (negative) these conditions are temperatures::

    (M_s - T) + ((1 - D) sigma H_cur + dS sigma^2 / 2) / -rho ds = (M_s - M_f) g(xi; n1, n2)
    (A_f - T) + ((1 + D) sigma e / xi + dS sigma^2 / 2) / -rho ds = (A_f - A_s) g(xi; n3, n4)
    g(xi; n, m) = (1 + xi^n - (1 - xi)^m) / 2

where rho ds and D follow from the slopes C_A and C_M at a calibration stress; a3, rho du0 and Y0
of the paper cancel out. Between the two nothing transforms: the same rule makes the inner loops.

The constants are those of a trained NiTi wire, the example of the program `1D SMA TAMU Model` that
comes with D. Lagoudas, E. Peraza Hernandez, D. Hartl: Analysis and Design of Shape Memory Alloy
Morphing Structures (C. Nauck and E. Peraza Hernandez, Texas A&M University). That fit has a stiffer
martensite than austenite, which serves its fit only; the moduli here are those of Brinson (1993).
"""

from collections.abc import Callable
import dataclasses
import functools
import math
from typing import ClassVar

import numpy as np

from hysteresis_ros.laboratory.variation import vary
from hysteresis_ros.laboratory.wire import TwoSlopeMaterial, Wire

# Entries of the inverted hardening function.
ENTRIES = 4000
# Shares of martensite below this have no strain of their own.
SMALLEST_SHARE = 1e-9


@dataclasses.dataclass(frozen=True)
class LagoudasMaterial(TwoSlopeMaterial):
    """
    Constants of the unified model, by default those of the trained wire of the source.

    Parameters
    ----------
    resting_length, diameter : float
        Cold length under the pretension, and thickness [m].
    pretension : float
        Tension at which the resting length is measured [N].
    austenite_modulus, martensite_modulus : float
        Young's moduli of the two phases [Pa].
    martensite_start, martensite_finish, austenite_start, austenite_finish : float
        Transformation temperatures at zero stress, ends of the smooth tails [degC].
    austenite_slope, martensite_slope : float
        Clausius-Clapeyron slopes C_A and C_M at the calibration stress [Pa/K].
    calibration_stress : float
        Stress at which the slopes are those [Pa].
    least_strain, saturated_strain : float
        H_min and H_sat.
    strain_rate : float
        k, by which the strain saturates with stress [1/Pa].
    critical_stress : float
        sigma_crit, from which on it grows [Pa].
    exponents : tuple of float
        Smooth hardening n1, n2 towards martensite, n3, n4 back.
    """

    name: ClassVar[str] = 'lagoudas'
    temperature_step: ClassVar[float] = 1.0
    arm_range: ClassVar[tuple[float, float]] = (135.2, 89.7)
    resting_length: float = 0.27
    diameter: float = 0.203e-3
    pretension: float = 0.5
    austenite_modulus: float = 67e9
    martensite_modulus: float = 26.3e9
    martensite_start: float = 90.3513
    martensite_finish: float = 24.8235
    austenite_start: float = 51.4927
    austenite_finish: float = 111.8514
    austenite_slope: float = 7.1986e6
    martensite_slope: float = 7.9498e6
    calibration_stress: float = 200e6
    least_strain: float = 0.0387
    saturated_strain: float = 0.0550
    strain_rate: float = 4.6849e-9
    critical_stress: float = 0.0
    exponents: tuple[float, float, float, float] = (0.1919, 0.1823, 0.1623, 0.2188)

    @classmethod
    def specimen(cls, rng: np.random.Generator) -> 'LagoudasMaterial':
        """
        Return a batch that differs a little from the next.

        Its transformation temperatures are lower than those of the source and half as far apart,
        so that 6 V and no voltage drive it from end to end under each load of the bench.
        """
        usual = cls(martensite_start=54.0, martensite_finish=22.0,
                    austenite_start=42.0, austenite_finish=74.0)
        shift = rng.uniform(0.0, 1.5)
        width = vary(rng, 1.0, 0.06)
        loop = vary(rng, 1.0, 0.05)
        middle = usual.austenite_start - usual.martensite_finish
        finish = usual.martensite_finish + shift
        first, second, third, fourth = usual.exponents
        return dataclasses.replace(
            usual, martensite_finish=finish,
            martensite_start=finish + width * (usual.martensite_start - usual.martensite_finish),
            austenite_start=finish + loop * middle,
            austenite_finish=finish + loop * middle + width * (
                usual.austenite_finish - usual.austenite_start),
            austenite_modulus=vary(rng, usual.austenite_modulus, 0.04),
            martensite_modulus=vary(rng, usual.martensite_modulus, 0.04),
            least_strain=vary(rng, usual.least_strain, 0.03),
            saturated_strain=vary(rng, usual.saturated_strain, 0.02),
            strain_rate=vary(rng, usual.strain_rate, 0.08),
            austenite_slope=vary(rng, usual.austenite_slope, 0.03),
            martensite_slope=vary(rng, usual.martensite_slope, 0.03),
            exponents=(vary(rng, first, 0.05), vary(rng, second, 0.05), vary(rng, third, 0.05),
                       vary(rng, fourth, 0.05)))

    def wire(self) -> 'LagoudasWire':
        """Return a new wire, cold."""
        return LagoudasWire(self)

    def with_strain_growth(self, factor: float) -> 'LagoudasMaterial':
        """Return the same with H_sat - H_min times a factor."""
        return dataclasses.replace(self, saturated_strain=self.least_strain + factor * (
            self.saturated_strain - self.least_strain))

    def strain_of_new_martensite(self, stress: float) -> float:
        """Return H_cur(sigma) for a stress [Pa]."""
        beyond = stress - self.critical_stress
        if beyond <= 0.0:
            return self.least_strain
        return self.saturated_strain - (self.saturated_strain - self.least_strain) * math.exp(
            -self.strain_rate * beyond)


class LagoudasWire(Wire):
    """
    One wire of the unified model with its memory: martensite share and transformation strain.

    Parameters
    ----------
    material : LagoudasMaterial
        Constants of this specimen.
    """

    material: LagoudasMaterial

    def __init__(self, material: LagoudasMaterial):
        self._soft = 1.0 / material.martensite_modulus - 1.0 / material.austenite_modulus
        self._stiff = 1.0 / material.austenite_modulus
        stress, strain = material.calibration_stress, material.strain_of_new_martensite
        growth = 0.0
        if stress > material.critical_stress:
            growth = material.strain_rate * (material.saturated_strain - strain(stress))
        oriented = strain(stress) + stress * growth
        whole = oriented + stress * self._soft
        slope_a, slope_m = material.austenite_slope, material.martensite_slope
        dissipation = (slope_m - slope_a) / (slope_m + slope_a) * whole / oriented
        entropy = 2.0 * slope_m * slope_a / (slope_m + slope_a) * whole
        self._onward, self._back = (1.0 - dissipation) / entropy, (1.0 + dissipation) / entropy
        self._elastic = 0.5 * self._soft / entropy
        self._forward_width = 1.0 / (material.martensite_start - material.martensite_finish)
        self._reverse_width = 1.0 / (material.austenite_finish - material.austenite_start)
        self._forward_table = _inverse_hardening(*material.exponents[:2])
        self._reverse_table = _inverse_hardening(*material.exponents[2:])
        super().__init__(material)

    def heat_and_cool(self, temperature: float = 22.0, tension: float | None = None) -> None:
        """Heat until all is austenite, cool, and so wipe the memory; see `Wire`."""
        self._share = self._transformation = 0.0
        self.commit(temperature, self.material.pretension if tension is None else tension)

    @property
    def martensite(self) -> float:
        """Martensite share after the last `commit`."""
        return self._share

    @property
    def transformation_strain(self) -> float:
        """Transformation strain after the last `commit`."""
        return self._transformation

    def peek_martensite(self, temperature: float, tension: float) -> float:
        """Return the martensite share at a temperature [degC] and tension [N]; memory stays."""
        return self._turn(temperature, tension / self._section)[0]

    def _resting_strain(self) -> float:
        stress = self.material.pretension / self._section
        return (stress * (self._stiff + self._soft)
                + self.material.strain_of_new_martensite(stress))

    def _turn(self, temperature: float, stress: float) -> tuple[float, float]:
        """Return martensite share and transformation strain at a temperature and a stress."""
        material, share, strain = self.material, self._share, self._transformation
        current = material.strain_of_new_martensite(stress)
        squared = self._elastic * stress * stress
        formed = self._forward_table(self._forward_width * (
            material.martensite_start - temperature + self._onward * stress * current + squared))
        if formed > share:
            return formed, strain + current * (formed - share)
        if share <= SMALLEST_SHARE:
            return share, strain
        mean = strain / share
        left = self._reverse_table(self._reverse_width * (
            material.austenite_finish - temperature + self._back * stress * mean + squared))
        if left < share:
            return left, mean * left
        return share, strain

    def _strain(self, share: float, transformation: float, stress: float) -> float:
        if self.retained != 0.0:
            share = self.retained + (1.0 - self.retained) * share
            transformation = (1.0 - self.retained) * transformation + (
                self.retained * self.material.strain_of_new_martensite(stress))
        return stress * (self._stiff + self._soft * share) + transformation

    def _peek_strain(self, temperature: float, stress: float) -> float:
        return self._strain(*self._turn(temperature, stress), stress)

    def _commit_strain(self, temperature: float, stress: float) -> float:
        self._share, self._transformation = self._turn(temperature, stress)
        return self._strain(self._share, self._transformation, stress)


@functools.lru_cache(maxsize=64)
def _inverse_hardening(low: float, high: float) -> Callable[[float], float]:
    """Return the function that gives the share xi where (1 + xi^low - (1 - xi)^high) / 2 is."""
    # Shares crowd at both ends, where the exponents below one make the function steep.
    up = np.linspace(0.0, 1.0, 40001) ** 8
    down = up[::-1]
    share, rest = up / (up + down), down / (up + down)
    level = 0.5 * (1.0 + share ** low - rest ** high)
    table = np.interp(np.linspace(0.0, 1.0, ENTRIES + 1), level, share).tolist()

    def inverse(value: float) -> float:
        if value <= 0.0:
            return 0.0
        if value >= 1.0:
            return 1.0
        place = value * ENTRIES
        entry = int(place)
        below = table[entry]
        return below + (place - entry) * (table[entry + 1] - below)
    return inverse
