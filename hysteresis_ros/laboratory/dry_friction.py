# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Coulomb friction of many contacts, each of which breaks away after its own distance.

While a contact sticks, its force grows with the displacement; once broken away it stays at its
limit. T. Vo-Minh, T. Tjahjowidodo, H. Ramon, H. Van Brussel: A new approach to modeling hysteresis
in a pneumatic artificial muscle using the Maxwell-slip model, IEEE/ASME Transactions on
Mechatronics 16 (2011) 177-186. All contacts share one limit, which may change while they stick: the
stiffness of a rough contact grows with the force that presses it, as its limit does.
"""

from collections.abc import Sequence


class DryFriction:
    """
    The contacts with their memory.

    Parameters
    ----------
    distances : sequence of float
        Displacements from rest at which the contacts, all of the same limit, break away [m].
    """

    def __init__(self, distances: Sequence[float]) -> None:
        self._distances = tuple(distances)
        self._share = 1.0 / len(self._distances)
        self.reset(0.0)

    def reset(self, position: float) -> None:
        """Put all contacts at rest, without force, at a position [m]."""
        self._position = position
        self._forces = [0.0] * len(self._distances)

    def peek(self, position: float) -> float:
        """Return the friction force over its limit, from -1 to 1, at a position [m]."""
        change = position - self._position
        total = 0.0
        for force, distance in zip(self._forces, self._distances):
            force += change / distance
            total += 1.0 if force > 1.0 else -1.0 if force < -1.0 else force
        return total * self._share

    def commit(self, position: float) -> None:
        """Move to a position [m], memory included."""
        change = position - self._position
        self._forces = [min(max(force + change / distance, -1.0), 1.0)
                        for force, distance in zip(self._forces, self._distances)]
        self._position = position
