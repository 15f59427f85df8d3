# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A super-coiled polymer muscle: conductive nylon thread, twisted until it coils, that heat shortens.

M. C. Yip, G. Niemeyer: On the control and properties of supercoiled polymer artificial muscles,
IEEE Transactions on Robotics 33 (2017) 689-699. Force F, elongation x from the cold unloaded length
and temperature T are those of a spring with damping and a thermal force, heated by its own
resistance::

    F = k x + b dx/dt + c (T - T0),    C dT/dt = V^2 / R - lambda (T - T0)

Besides this linear law a muscle has a loss and creeps. The loss is Coulomb friction of the plies,
which their tension presses together, so that it is mu F at most. J. Zhang, K. Iyer, A. Simeonov,
M. C. Yip: Modeling and inverse compensation of hysteresis in supercoiled polymer artificial
muscles, IEEE Robotics and Automation Letters 2 (2017) 773-780: length on heating and on cooling
differ by up to 30 % of the stroke. Between clamps the coils hardly slide, which is why the force
has much less of it. Creep: the stress of the nylon relaxes (`relaxation`).

The friction is such that the loss under the largest load is that of the source; stiffness, thermal
force and heat balance are those of a muscle of 0.1 m that shortens by a tenth, of the size that is
usual for such threads, and belong to no measured muscle.
"""

import dataclasses
import math
from typing import ClassVar

import numpy as np

from hysteresis_ros.laboratory.dry_friction import DryFriction
from hysteresis_ros.laboratory.heat import ROOM
from hysteresis_ros.laboratory.relaxation import Relaxation
from hysteresis_ros.laboratory.soft_muscle import SoftMaterial, SoftMuscle
from hysteresis_ros.laboratory.variation import vary

# Elongations over the length after which the plies break away, one part after the other.
BREAKAWAY = (0.001, 0.0025, 0.005, 0.009, 0.015)
# Bounds of the elongation over the length.
BOUNDS = (-0.6, 1.5)
TOLERANCE = 1e-7


@dataclasses.dataclass(frozen=True)
class ScpMaterial(SoftMaterial):
    """
    Constants of a super-coiled polymer muscle.

    Parameters
    ----------
    initial_length : float
        Cold unloaded length [m].
    stiffness : float
        k of the fresh muscle [N/m].
    damping : float
        b [N s/m].
    thermal_force : float
        c [N/K].
    friction : float
        mu, largest friction over tension.
    relaxation : float
        Share of the nylon's stress that relaxes in a decade of time.
    resistance : float
        R [Ohm].
    heat_loss : float
        lambda [W/K].
    heat_capacity : float
        C [J/K].
    """

    name: ClassVar[str] = 'scp'
    drive: ClassVar[str] = 'voltage'
    highest_drive: ClassVar[float] = 6.0
    loads: ClassVar[tuple[float, ...]] = (1.5, 2.0, 2.5, 3.0)
    pretension: ClassVar[float] = 0.5
    hold: ClassVar[float] = 60.0
    largest_force: ClassVar[float] = 5.0
    frame_stiffness: ClassVar[float] = 5e3
    initial_length: float = 0.1
    stiffness: float = 150.0
    damping: float = 2.0
    thermal_force: float = 0.02
    friction: float = 0.06
    relaxation: float = 0.03
    resistance: float = 20.0
    heat_loss: float = 0.0257
    heat_capacity: float = 0.2

    @classmethod
    def specimen(cls, rng: np.random.Generator) -> 'ScpMaterial':
        """Return a batch that differs a little from the next."""
        usual = cls()
        return dataclasses.replace(
            usual, stiffness=vary(rng, usual.stiffness, 0.05),
            thermal_force=vary(rng, usual.thermal_force, 0.05),
            friction=vary(rng, usual.friction, 0.1),
            relaxation=vary(rng, usual.relaxation, 0.2),
            resistance=vary(rng, usual.resistance, 0.03),
            heat_loss=vary(rng, usual.heat_loss, 0.03))

    def muscle(self) -> 'ScpMuscle':
        """Return a new muscle, at rest and at room temperature."""
        return ScpMuscle(self)


class ScpMuscle(SoftMuscle):
    """
    One super-coiled polymer muscle with its memory.

    Parameters
    ----------
    material : ScpMaterial
        Constants of this specimen.

    Attributes
    ----------
    temperature : float
        Of the thread [degC].
    """

    def __init__(self, material: ScpMaterial) -> None:
        length = material.initial_length
        super().__init__(BOUNDS[0] * length, BOUNDS[1] * length, material.stiffness, TOLERANCE)
        self.material = material
        self._friction = DryFriction([length * part for part in BREAKAWAY])
        self._relaxation = Relaxation(material.relaxation)
        self.reset()

    def reset(self) -> None:
        """Return to a muscle that was never driven or loaded."""
        self.temperature = ROOM
        self._elongation = self._before = 0.0
        self._damping = 0.0
        self._friction.reset(0.0)
        self._relaxation.reset()

    def tension(self, elongation: float) -> float:
        """Return the tension [N] that it would have at an elongation [m]; its memory stays."""
        material = self.material
        pull = (material.stiffness * elongation - self._relaxation.relaxed
                + self._damping * (elongation - self._before)
                + material.thermal_force * (self.temperature - ROOM))
        return pull / (1.0 - material.friction * self._friction.peek(elongation))

    def _follow(self, drive: float, dt: float) -> None:
        material = self.material
        balance = ROOM + drive * drive / (material.resistance * material.heat_loss)
        self.temperature = balance + (self.temperature - balance) * math.exp(
            -dt * material.heat_loss / material.heat_capacity)
        self._before, self._damping = self._elongation, material.damping / dt

    def _settle(self, dt: float) -> None:
        self._damping = 0.0
        self._friction.commit(self._elongation)
        self._relaxation.advance(self.material.stiffness * self._elongation, dt)
