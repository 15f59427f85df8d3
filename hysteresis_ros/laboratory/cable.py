# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The cables by which wires pull at the forearm, bent around a guide.

At each small bend dphi the tension presses the cable on its guide with T dphi, so that sliding
takes dT = mu T dphi (Euler). A guide is a chain of such bends here; what one end lacks against the
other is between minus and plus what all of them take together.
"""

import dataclasses
import functools


@dataclasses.dataclass(frozen=True)
class Cable:
    """
    A cable with its guide; by default a straight one, which loses nothing.

    Parameters
    ----------
    friction : float
        Coefficient of friction mu.
    wrap : float
        Angle by which the cable is bent [rad].
    bends : int
        Pieces that the bend is divided into.
    """

    friction: float = 0.0
    wrap: float = 0.0
    bends: int = 200

    @property
    def rubs(self) -> bool:
        """Whether the cable loses tension at all."""
        return self.friction > 0.0 and self.wrap > 0.0

    def behind(self, tension: float) -> float:
        """Return the tension that is left of another one [N] behind the guide, sliding."""
        return self._left * tension

    def before(self, tension: float) -> float:
        """Return the tension that is needed before the guide for another one [N] behind it."""
        return tension / self._left

    @functools.cached_property
    def _left(self) -> float:
        part, tension = 0.5 * self.friction * self.wrap / self.bends, 1.0
        for _ in range(self.bends):
            # The mean tension of a piece presses it on.
            tension *= (1.0 - part) / (1.0 + part)
        return tension
