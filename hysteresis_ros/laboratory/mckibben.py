# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A McKibben muscle: a rubber bladder in a braided sleeve, which pressure makes thick and short.

The air pulls with the force of C.-P. Chou, B. Hannaford: Measurement and modeling of McKibben
pneumatic artificial muscles, IEEE Transactions on Robotics and Automation 12 (1996) 90-102, in the
form of B. Tondu, P. Lopez: Modeling and control of McKibben artificial muscle robot actuators, IEEE
Control Systems Magazine 20 (2000) 15-38, whose factor k > 1 is for the ends, which are cones. With
contraction e = 1 - L / l0 and the stretch s = L / l0::

    F_air = pi r0^2 P (a (1 - k e)^2 - b),    a = 3 / tan^2(alpha0),    b = 1 / sin^2(alpha0)

The threads of the braid rub on each other (Tondu and Lopez), in proportion to pressure and contact
area; quasi-statically only their coefficient of static friction counts::

    |F_friction| <= f S P,    S = 2 pi r0 l0 sin(alpha0) / (s sqrt(1 - s^2 cos^2(alpha0)))

The bladder follows the braid as an incompressible tube of rubber, here with one constant G instead
of the two of G. K. Klute, B. Hannaford: Accounting for elastic energy storage in McKibben
artificial muscle actuators, Journal of Dynamic Systems, Measurement, and Control 122 (2000)
386-388; its stress relaxes (`relaxation`), so the muscle creeps::

    F_bladder = 2 pi r0 t G d/ds (s^2 + q + 1 / (s^2 q)) / 2
    q = (1 - s^2 cos^2(alpha0)) / sin^2(alpha0)

The pressure inside follows the one applied, through a valve that fills and vents with time
constants of their own. Braid angle and friction are of the size that Tondu and Lopez give; the
other numbers are of usual size and belong to no measured muscle.
"""

import dataclasses
import math
from typing import ClassVar

import numpy as np

from hysteresis_ros.laboratory.dry_friction import DryFriction
from hysteresis_ros.laboratory.relaxation import Relaxation
from hysteresis_ros.laboratory.soft_muscle import SoftMaterial, SoftMuscle
from hysteresis_ros.laboratory.variation import vary

# Contractions after which the threads of the braid break away, one part after the other.
BREAKAWAY = (0.0008, 0.0018, 0.0035, 0.006, 0.01)
# Smallest stretch considered, and how near the largest comes to that of a braid without inside.
SMALLEST_STRETCH, NEARLY = 0.5, 0.999
TOLERANCE = 1e-4


@dataclasses.dataclass(frozen=True)
class McKibbenMaterial(SoftMaterial):
    """
    Constants of a McKibben muscle, by default of a usual size.

    Parameters
    ----------
    initial_length, initial_radius : float
        l0 and r0 [m].
    braid_angle : float
        Initial angle alpha0 between threads and axis [rad].
    end_factor : float
        k, for the shape of the ends.
    friction : float
        Coefficient f of static friction of the threads.
    bladder_thickness : float
        t, of the unstretched rubber [m].
    shear_modulus : float
        G of the fresh rubber [Pa].
    relaxation : float
        Share of the rubber's stress that relaxes in a decade of time.
    filling_time, venting_time : float
        Time constants of the valve [s].
    """

    name: ClassVar[str] = 'mckibben'
    drive: ClassVar[str] = 'pressure'
    highest_drive: ClassVar[float] = 3e5
    loads: ClassVar[tuple[float, ...]] = (50.0, 100.0, 150.0, 200.0)
    pretension: ClassVar[float] = 5.0
    hold: ClassVar[float] = 30.0
    largest_force: ClassVar[float] = 1000.0
    frame_stiffness: ClassVar[float] = 2e6
    initial_length: float = 0.3
    initial_radius: float = 0.01
    braid_angle: float = math.radians(20.0)
    end_factor: float = 1.25
    friction: float = 0.015
    bladder_thickness: float = 0.6e-3
    shear_modulus: float = 0.4e6
    relaxation: float = 0.04
    filling_time: float = 0.2
    venting_time: float = 0.4

    @classmethod
    def specimen(cls, rng: np.random.Generator) -> 'McKibbenMaterial':
        """Return a batch that differs a little from the next, thin enough for weights."""
        usual = cls(initial_radius=0.007)
        return dataclasses.replace(
            usual, initial_radius=vary(rng, usual.initial_radius, 0.02),
            braid_angle=vary(rng, usual.braid_angle, 0.02),
            end_factor=vary(rng, usual.end_factor, 0.02),
            friction=vary(rng, usual.friction, 0.1),
            bladder_thickness=vary(rng, usual.bladder_thickness, 0.05),
            shear_modulus=vary(rng, usual.shear_modulus, 0.05),
            relaxation=vary(rng, usual.relaxation, 0.2))

    def muscle(self) -> 'McKibbenMuscle':
        """Return a new muscle, at rest and without pressure."""
        return McKibbenMuscle(self)

    def air_force(self, pressure: float, stretch: float) -> float:
        """Return the pull of the air [N] at a pressure [Pa] and a stretch L / l0."""
        inner = 1.0 - self.end_factor * (1.0 - stretch)
        return math.pi * self.initial_radius ** 2 * pressure * (
            3.0 / math.tan(self.braid_angle) ** 2 * inner * inner
            - 1.0 / math.sin(self.braid_angle) ** 2)

    def friction_limit(self, pressure: float, stretch: float) -> float:
        """Return the largest friction of the braid [N] at a pressure [Pa] and a stretch."""
        thickening = math.sqrt(1.0 - (stretch * math.cos(self.braid_angle)) ** 2)
        contact = (2.0 * math.pi * self.initial_radius * self.initial_length
                   * math.sin(self.braid_angle) / (stretch * thickening))
        return self.friction * contact * pressure

    def bladder_force(self, stretch: float) -> float:
        """Return the pull of the fresh bladder [N] at a stretch; it pushes where negative."""
        tangent = math.cos(self.braid_angle) ** 2 / math.sin(self.braid_angle) ** 2
        wide = 1.0 + tangent * (1.0 - stretch * stretch)
        slope = -2.0 * stretch * tangent
        thin = 1.0 / (stretch * stretch * wide)
        return (math.pi * self.initial_radius * self.bladder_thickness * self.shear_modulus * (
            2.0 * stretch + slope - thin * (2.0 / stretch + slope / wide)))


class McKibbenMuscle(SoftMuscle):
    """
    One McKibben muscle with its memory.

    Parameters
    ----------
    material : McKibbenMaterial
        Constants of this specimen.

    Attributes
    ----------
    pressure : float
        In the bladder, above that of the air outside [Pa].
    """

    def __init__(self, material: McKibbenMaterial) -> None:
        length = material.initial_length
        super().__init__((SMALLEST_STRETCH - 1.0) * length,
                         (NEARLY / math.cos(material.braid_angle) - 1.0) * length, 5e3, TOLERANCE)
        self.material = material
        self._friction = DryFriction([length * part for part in BREAKAWAY])
        self._relaxation = Relaxation(material.relaxation)
        self.reset()

    def reset(self) -> None:
        """Return to a muscle that was never driven or loaded."""
        self.pressure = 0.0
        self._elongation = 0.0
        self._friction.reset(0.0)
        self._relaxation.reset()

    def tension(self, elongation: float) -> float:
        """Return the tension [N] that it would have at an elongation [m]; its memory stays."""
        material, stretch = self.material, 1.0 + elongation / self.material.initial_length
        return (material.air_force(self.pressure, stretch) + material.bladder_force(stretch)
                - self._relaxation.relaxed
                + material.friction_limit(self.pressure, stretch) * self._friction.peek(elongation))

    def _follow(self, drive: float, dt: float) -> None:
        time = (self.material.filling_time if drive > self.pressure
                else self.material.venting_time)
        self.pressure = drive + (self.pressure - drive) * math.exp(-dt / time)

    def _settle(self, dt: float) -> None:
        self._friction.commit(self._elongation)
        self._relaxation.advance(self.material.bladder_force(
            1.0 + self._elongation / self.material.initial_length), dt)
