# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A wire after Tanaka (1986): one share of martensite, exponential kinetics.

K. Tanaka: A thermomechanical sketch of shape memory effect: one-dimensional tensile behavior, Res
Mechanica 18 (1986) 251-263; K. Tanaka, S. Kobayashi, Y. Sato: Thermomechanics of transformation
pseudoelasticity and shape memory effect in alloys, International Journal of Plasticity 2 (1986)
59-72. With the martensite share xi::

    sigma = D(xi) (strain - eps_L xi) + Theta (T - T_0),    D(xi) = D_a + xi (D_m - D_a)
    towards martensite  xi = 1 - exp(a_M (M_s - T) + b_M sigma)
    back                xi = exp(a_A (A_s - T) + b_A sigma)
    a_M = ln(0.01) / (M_s - M_f),  b_M = a_M / C_M,  a_A = ln(0.01) / (A_s - A_f),  b_A = a_A / C_A

(C_M and C_A positive: stress makes martensite.) So most transforms near the start temperatures, and
one percent is left at the finish temperatures. All martensite has the strain eps_L, whatever the
stress under which it forms: the wire has a two-way effect without load, as a trained one has.

These equations begin at all austenite or all martensite. After a turn in between, the new way
begins at the share there and takes what is left in the same proportion, as in C. Liang, C. A.
Rogers: One-dimensional thermomechanical constitutive relations for shape memory materials, Journal
of Intelligent Material Systems and Structures 1 (1990) 207-234. Inner loops lie inside the outer
one and close after some cycles. Where the lines of M_s and A_s cross (they do not with C_A < C_M),
martensite begins to form on the line of A_s.

Transformation temperatures, slopes and moduli are values for Ni-Ti that are common in the
literature on exponential kinetics; Theta and eps_L are those of Brinson (1993). In Tanaka's papers
D is a constant.
"""

import dataclasses
import math
from typing import ClassVar, NamedTuple

import numpy as np

from hysteresis_ros.laboratory.variation import vary
from hysteresis_ros.laboratory.wire import TwoSlopeMaterial, Wire

# By which the exponent changes between start and finish, so that one percent is left.
RATE = math.log(100.0)


@dataclasses.dataclass(frozen=True)
class TanakaMaterial(TwoSlopeMaterial):
    """
    Constants of Tanaka's model, by default those of an untrained Ni-Ti wire.

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
        T_0, at which the unloaded austenite has no strain, and the wire its resting length [degC].
    martensite_start, martensite_finish, austenite_start, austenite_finish : float
        Transformation temperatures at zero stress [degC].
    austenite_slope, martensite_slope : float
        C_A and C_M [Pa/K].
    largest_strain : float
        eps_L, strain of all martensite.
    """

    name: ClassVar[str] = 'tanaka'
    arm_range: ClassVar[tuple[float, float]] = (132.9, 86.9)
    resting_length: float = 0.27
    diameter: float = 0.203e-3
    pretension: float = 0.5
    austenite_modulus: float = 30e9
    martensite_modulus: float = 13e9
    thermoelastic: float = 0.55e6
    reference_temperature: float = 22.0
    martensite_start: float = 23.0
    martensite_finish: float = 5.0
    austenite_start: float = 29.0
    austenite_finish: float = 51.0
    austenite_slope: float = 4.5e6
    martensite_slope: float = 11.3e6
    largest_strain: float = 0.067

    @classmethod
    def specimen(cls, rng: np.random.Generator) -> 'TanakaMaterial':
        """
        Return a batch that differs a little from the next.

        Its alloy transforms 18 K higher than usual, so that it is martensite at room temperature;
        it is trained, which costs a third of the strain.
        """
        usual = cls(largest_strain=0.045)
        shift = 18.0 + rng.uniform(0.0, 1.5)
        width = vary(rng, 1.0, 0.06)
        cold, hot = usual.martensite_start + shift, usual.austenite_start + shift
        return dataclasses.replace(
            usual, martensite_start=cold,
            martensite_finish=cold + width * (usual.martensite_finish - usual.martensite_start),
            austenite_start=hot,
            austenite_finish=hot + width * (usual.austenite_finish - usual.austenite_start),
            austenite_modulus=vary(rng, usual.austenite_modulus, 0.04),
            martensite_modulus=vary(rng, usual.martensite_modulus, 0.04),
            largest_strain=vary(rng, usual.largest_strain, 0.02),
            austenite_slope=vary(rng, usual.austenite_slope, 0.03),
            martensite_slope=vary(rng, usual.martensite_slope, 0.03))

    def wire(self) -> 'TanakaWire':
        """Return a new wire, cold."""
        return TanakaWire(self)


class Branch(NamedTuple):
    """
    Share of martensite, and where the present way along the exponentials began.

    Parameters
    ----------
    share : float
        xi.
    start : float
        The same at the last turn between the two directions.
    forming : bool
        Whether martensite has formed since then, or gone back.
    """

    share: float = 0.0
    start: float = 0.0
    forming: bool = True


class TanakaWire(Wire):
    """
    One wire of Tanaka's model with its memory.

    Parameters
    ----------
    material : TanakaMaterial
        Constants of this specimen.
    """

    material: TanakaMaterial

    def heat_and_cool(self, temperature: float = 22.0, tension: float | None = None) -> None:
        """Heat until all is austenite, cool, and so wipe the memory; see `Wire`."""
        tension = self.material.pretension if tension is None else tension
        self._branch = self._turn(Branch(), temperature, tension / self._section)

    @property
    def martensite(self) -> float:
        """Martensite share after the last `commit`."""
        return self._branch.share

    def peek_martensite(self, temperature: float, tension: float) -> float:
        """Return the martensite share at a temperature [degC] and tension [N]; memory stays."""
        return self._turn(self._branch, temperature, tension / self._section).share

    def _resting_strain(self) -> float:
        room, stress = self.material.reference_temperature, self.material.pretension / self._section
        return self._strain(self._turn(Branch(), room, stress), room, stress)

    def _turn(self, branch: Branch, temperature: float, stress: float) -> Branch:
        """Return where the wire is at a temperature [degC] and a stress [Pa]."""
        material = self.material
        superheating = temperature - material.austenite_start - stress / material.austenite_slope
        if superheating > 0.0:
            start = branch.share if branch.forming else branch.start
            share = start * math.exp(
                -RATE * superheating / (material.austenite_finish - material.austenite_start))
            return Branch(share, start, False) if share < branch.share else branch
        undercooling = min(
            material.martensite_start - temperature + stress / material.martensite_slope,
            -superheating)
        if undercooling <= 0.0:
            return branch
        start = branch.start if branch.forming else branch.share
        share = 1.0 - (1.0 - start) * math.exp(
            -RATE * undercooling / (material.martensite_start - material.martensite_finish))
        return Branch(share, start, True) if share > branch.share else branch

    def _strain(self, branch: Branch, temperature: float, stress: float) -> float:
        material, share = self.material, branch.share
        if self.retained != 0.0:
            share = self.retained + (1.0 - self.retained) * share
        modulus = material.austenite_modulus + share * (
            material.martensite_modulus - material.austenite_modulus)
        thermal = material.thermoelastic * (temperature - material.reference_temperature)
        return (stress - thermal) / modulus + material.largest_strain * share

    def _peek_strain(self, temperature: float, stress: float) -> float:
        return self._strain(self._turn(self._branch, temperature, stress), temperature, stress)

    def _commit_strain(self, temperature: float, stress: float) -> float:
        self._branch = self._turn(self._branch, temperature, stress)
        return self._strain(self._branch, temperature, stress)
