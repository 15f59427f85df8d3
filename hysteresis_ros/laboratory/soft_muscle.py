# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every muscle of the laboratory can do that is no wire: a bladder in a braid, a coiled polymer.

As of a wire there is a material, which holds constants and makes muscles, and a muscle, which has
the state. Unlike a wire's, that state goes on by itself while nothing is done: pressure or
temperature follow what is applied, and rubber and polymers creep.
"""

import abc
import dataclasses
from typing import ClassVar

import numpy as np

from hysteresis_ros.laboratory.solve import RootFinder


@dataclasses.dataclass(frozen=True)
class SoftMaterial(abc.ABC):
    """
    Constants of one batch of muscles, and how a bench treats them.

    Attributes
    ----------
    name : str
        What users call the muscle.
    drive : str
        Column of what is applied: voltage [V] or pressure [Pa].
    highest_drive : float
        What the bench applies at most.
    loads : tuple of float
        Weights on the bench [N].
    pretension : float
        Tension at which the resting length is measured [N].
    hold : float
        How long each step is held [s]: until what is applied has arrived.
    largest_force : float
        Range of the bench's load cell [N].
    frame_stiffness : float
        Of the bench, where the muscle is clamped [N/m].
    """

    name: ClassVar[str]
    drive: ClassVar[str]
    highest_drive: ClassVar[float]
    loads: ClassVar[tuple[float, ...]]
    pretension: ClassVar[float]
    hold: ClassVar[float]
    largest_force: ClassVar[float]
    frame_stiffness: ClassVar[float]

    @classmethod
    @abc.abstractmethod
    def specimen(cls, rng: np.random.Generator) -> 'SoftMaterial':
        """Return a batch that differs a little from the next."""

    @abc.abstractmethod
    def muscle(self) -> 'SoftMuscle':
        """Return a new muscle, at rest and without drive."""


class SoftMuscle(abc.ABC):
    """
    One muscle with its memory.

    Parameters
    ----------
    shortest, longest : float
        Bounds of its elongation from the length as made [m].
    stiffness : float
        About how stiff it is [N/m].
    tolerance : float
        Tensions count as equal below this [N].
    """

    def __init__(self, shortest: float, longest: float, stiffness: float,
                 tolerance: float) -> None:
        self._bounds = shortest, longest
        self._find = RootFinder(stiffness, tolerance)
        self._elongation = 0.0

    @property
    def elongation(self) -> float:
        """Elongation from the length as made [m]."""
        return self._elongation

    @abc.abstractmethod
    def reset(self) -> None:
        """Return to a muscle that was never driven or loaded."""

    @abc.abstractmethod
    def tension(self, elongation: float) -> float:
        """Return the tension [N] that it would have at an elongation [m]; its memory stays."""

    @abc.abstractmethod
    def _follow(self, drive: float, dt: float) -> None:
        """Let pressure or temperature follow what is applied for a time [s]."""

    @abc.abstractmethod
    def _settle(self, dt: float) -> None:
        """Let the memory of friction and creep follow the elongation for a time [s]."""

    def hang(self, drive: float, dt: float, load: float) -> None:
        """
        Let a time pass under a dead weight.

        Parameters
        ----------
        drive : float
            Voltage [V] or pressure [Pa] applied.
        dt : float
            Time [s].
        load : float
            Weight [N].
        """
        self._pass(drive, dt, load, 0.0, 0.0)

    def clamp(self, drive: float, dt: float, place: float, tension: float,
              stiffness: float) -> None:
        """
        Let a time pass between the clamps of a bench that gives a little.

        Parameters
        ----------
        drive, dt : float
            As for `hang`.
        place, tension, stiffness : float
            Elongation [m] at which it was clamped, its tension then [N], stiffness of the bench
            [N/m].
        """
        self._pass(drive, dt, tension, stiffness, place)

    def _pass(self, drive: float, dt: float, load: float, stiffness: float, place: float) -> None:
        self._follow(drive, dt)
        self._elongation = self._find(
            lambda elongation: self.tension(elongation) - load + stiffness * (elongation - place),
            self._elongation, *self._bounds)
        self._settle(dt)
