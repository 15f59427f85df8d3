# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A wire after Brinson (1993): stress-induced and temperature-induced martensite, cosine kinetics.

L. C. Brinson: One-dimensional constitutive behavior of shape memory alloys: thermomechanical
derivation with non-constant material functions and redefined martensite internal variable, Journal
of Intelligent Material Systems and Structures 4 (1993) 229-242. With the shares xi_S of oriented
(stress-induced) and xi_T of self-accommodated (temperature-induced) martensite, xi = xi_S + xi_T::

    sigma = D(xi) (strain - eps_L xi_S) + Theta (T - T_0),    D(xi) = D_a + xi (D_m - D_a)

Martensite is oriented between the critical stresses, sigma_s + C_M (T - M_s) and sigma_f + the
same, which are constant below M_s; between M_s and M_f the cold makes self-accommodated martensite;
both turn to austenite between A_s + sigma / C_A and A_f + sigma / C_A. Each share goes along half a
cosine from where its last turn in the other direction has left it; so a low stress orients a little
more with each partial cycle. Where stress and cold act together the paper's rule lets the shares
add up to more than one; here is the one of H. Chung, J. Heo, J. Lee: Implementation strategy for
the dual transformation region in the Brinson SMA constitutive model, Smart Materials and Structures
16 (2007) N1. Beyond the stress at which the lines of both directions cross (544 MPa with the
paper's constants) martensite begins to form on the line of A_s.

The constants are the paper's, after measurements of Dye (1990) on NiTi. That wire has no stroke
under less than 100 MPa. The specimens of the laboratory are trained: an internal stress that
training has left acts on the transformation in addition to the
applied one.
"""

import dataclasses
import math
from typing import ClassVar, NamedTuple

import numpy as np

from hysteresis_ros.laboratory.variation import vary
from hysteresis_ros.laboratory.wire import TwoSlopeMaterial, Wire


@dataclasses.dataclass(frozen=True)
class BrinsonMaterial(TwoSlopeMaterial):
    """
    Constants of Brinson's model, by default those of the paper and an untrained wire.

    Parameters
    ----------
    resting_length, diameter : float
        Cold length under the pretension, and thickness [m].
    pretension : float
        Tension at which the resting length is measured [N].
    austenite_modulus, martensite_modulus : float
        D_a and D_m [Pa].
    thermoelastic : float
        Theta [Pa/K].
    reference_temperature : float
        T_0, at which the unloaded austenite has no strain [degC].
    martensite_start, martensite_finish, austenite_start, austenite_finish : float
        Transformation temperatures at zero stress [degC].
    austenite_slope, martensite_slope : float
        C_A and C_M [Pa/K].
    orienting_start, orienting_finish : float
        Critical stresses sigma_s and sigma_f [Pa].
    largest_strain : float
        eps_L, strain of oriented martensite.
    training_stress : float
        Internal stress of a trained wire [Pa].
    """

    name: ClassVar[str] = 'brinson'
    temperature_step: ClassVar[float] = 4.0
    arm_range: ClassVar[tuple[float, float]] = (141.8, 93.4)
    resting_length: float = 0.27
    diameter: float = 0.203e-3
    pretension: float = 0.5
    austenite_modulus: float = 67e9
    martensite_modulus: float = 26.3e9
    thermoelastic: float = 0.55e6
    reference_temperature: float = 22.0
    martensite_start: float = 18.4
    martensite_finish: float = 9.0
    austenite_start: float = 34.5
    austenite_finish: float = 49.0
    austenite_slope: float = 13.8e6
    martensite_slope: float = 8.0e6
    orienting_start: float = 100e6
    orienting_finish: float = 170e6
    largest_strain: float = 0.067
    training_stress: float = 0.0

    @classmethod
    def specimen(cls, rng: np.random.Generator) -> 'BrinsonMaterial':
        """
        Return a batch that differs a little from the next.

        Its alloy transforms 18 K higher than the paper's, so that it is martensite at room
        temperature; it is trained, which costs a quarter of the strain, and its resting length is
        measured under a little more pretension, so that the arm moves over its usual range.
        """
        usual = cls(pretension=1.1, largest_strain=0.05, training_stress=110e6)
        shift = 18.0 + rng.uniform(0.0, 1.5)
        width = vary(rng, 1.0, 0.06)
        start = usual.martensite_start + shift
        return dataclasses.replace(
            usual, martensite_start=start,
            martensite_finish=start + width * (usual.martensite_finish - usual.martensite_start),
            austenite_start=usual.austenite_start + shift,
            austenite_finish=usual.austenite_start + shift + width * (
                usual.austenite_finish - usual.austenite_start),
            austenite_modulus=vary(rng, usual.austenite_modulus, 0.04),
            martensite_modulus=vary(rng, usual.martensite_modulus, 0.04),
            largest_strain=vary(rng, usual.largest_strain, 0.02),
            training_stress=vary(rng, usual.training_stress, 0.015),
            austenite_slope=vary(rng, usual.austenite_slope, 0.03),
            martensite_slope=vary(rng, usual.martensite_slope, 0.03))

    def wire(self) -> 'BrinsonWire':
        """Return a new wire, cold."""
        return BrinsonWire(self)


class Shares(NamedTuple):
    """
    Shares of martensite, and where the present way along the cosines began.

    Parameters
    ----------
    oriented, accommodated : float
        xi_S and xi_T.
    from_oriented, from_accommodated : float
        The same at the last turn between the two directions.
    forming : bool
        Whether martensite has formed since then, or gone back.
    pulled, cooled : float
        How far the two cosines towards martensite have come since then, from 0 to 1.
    """

    oriented: float = 0.0
    accommodated: float = 0.0
    from_oriented: float = 0.0
    from_accommodated: float = 0.0
    forming: bool = True
    pulled: float = 0.0
    cooled: float = 0.0

    @property
    def martensite(self) -> float:
        """All martensite xi."""
        return self.oriented + self.accommodated


class BrinsonWire(Wire):
    """
    One wire of Brinson's model with its memory.

    Parameters
    ----------
    material : BrinsonMaterial
        Constants of this specimen.
    """

    material: BrinsonMaterial

    def heat_and_cool(self, temperature: float = 22.0, tension: float | None = None) -> None:
        """Heat until all is austenite, cool, and so wipe the memory; see `Wire`."""
        tension = self.material.pretension if tension is None else tension
        self._shares = self._turn(Shares(), temperature, tension / self._section)

    @property
    def martensite(self) -> float:
        """Martensite share after the last `commit`."""
        return self._shares.martensite

    @property
    def shares(self) -> Shares:
        """Both shares after the last `commit`."""
        return self._shares

    def peek_martensite(self, temperature: float, tension: float) -> float:
        """Return the martensite share at a temperature [degC] and tension [N]; memory stays."""
        return self._turn(self._shares, temperature, tension / self._section).martensite

    def _resting_strain(self) -> float:
        material = self.material
        stress, cold = material.pretension / self._section, material.martensite_finish
        return self._strain(self._turn(Shares(), cold, stress),
                            material.reference_temperature, stress)

    def _turn(self, shares: Shares, temperature: float, stress: float) -> Shares:
        """Return the shares at a temperature [degC] and an applied stress [Pa]."""
        material = self.material
        stress = stress + material.training_stress
        above_start = temperature - material.austenite_start - stress / material.austenite_slope
        beyond = min(stress - material.martensite_slope * max(
            temperature - material.martensite_start, 0.0),
            material.orienting_start - material.martensite_slope * above_start)
        pulled = _half_cosine((beyond - material.orienting_start)
                              / (material.orienting_finish - material.orienting_start))
        cooled = _half_cosine((material.martensite_start - temperature)
                              / (material.martensite_start - material.martensite_finish))
        if above_start > 0.0:
            return _gone_back(shares, 1.0 - _half_cosine(
                above_start / (material.austenite_finish - material.austenite_start)))
        if not shares.forming:
            if pulled == 0.0 and cooled == 0.0:
                return shares
            shares = Shares(shares.oriented, shares.accommodated, shares.oriented,
                            shares.accommodated)
        elif pulled <= shares.pulled and cooled <= shares.cooled:
            return shares
        return _formed(shares, max(pulled, shares.pulled), max(cooled, shares.cooled))

    def _strain(self, shares: Shares, temperature: float, stress: float) -> float:
        material, oriented, martensite = self.material, shares.oriented, shares.martensite
        if self.retained != 0.0:
            oriented = self.retained + (1.0 - self.retained) * oriented
            martensite = self.retained + (1.0 - self.retained) * martensite
        modulus = material.austenite_modulus + martensite * (
            material.martensite_modulus - material.austenite_modulus)
        thermal = material.thermoelastic * (temperature - material.reference_temperature)
        return (stress - thermal) / modulus + material.largest_strain * oriented

    def _peek_strain(self, temperature: float, stress: float) -> float:
        return self._strain(self._turn(self._shares, temperature, stress), temperature, stress)

    def _commit_strain(self, temperature: float, stress: float) -> float:
        self._shares = self._turn(self._shares, temperature, stress)
        return self._strain(self._shares, temperature, stress)


def _formed(shares: Shares, pulled: float, cooled: float) -> Shares:
    """Return the shares after stress and cold have gone on along their cosines."""
    from_oriented, from_accommodated = shares.from_oriented, shares.from_accommodated
    free = 1.0 - from_oriented
    return Shares(from_oriented + free * pulled,
                  (from_accommodated + (free - from_accommodated) * cooled) * (1.0 - pulled),
                  from_oriented, from_accommodated, True, pulled, cooled)


def _gone_back(shares: Shares, left: float) -> Shares:
    """Return the shares of which at most a part `left` of those at the last turn is left."""
    if shares.forming:
        oriented, accommodated = shares.oriented, shares.accommodated
    else:
        oriented, accommodated = shares.from_oriented, shares.from_accommodated
    if left * (oriented + accommodated) >= shares.martensite:
        return shares
    return Shares(left * oriented, left * accommodated, oriented, accommodated, False)


def _half_cosine(part: float) -> float:
    """Return the way from 0 to 1 along half a cosine, for a part of it from 0 to 1."""
    if part <= 0.0:
        return 0.0
    if part >= 1.0:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * part)
