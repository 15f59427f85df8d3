# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The temperature along a heated wire between two clamps that stay as cold as the room.

Each piece dz of the wire is heated alike, loses heat to the air in proportion to its excess theta
over the room, and passes heat on to its neighbours. In units of the excess of an endless wire, and
with ``b^2 = k d / (4 h)``::

    b^2 (theta[n - 1] - 2 theta[n] + theta[n + 1]) / dz^2 = theta[n] - 1,    theta = 0 at the clamps
"""

import numpy as np

# Pieces that half the wire is divided into: a hundred in the length b of weak clamps.
PIECES = 2000


def excess(position: np.ndarray, ends: float) -> np.ndarray:
    """
    Return the excess temperature of some places over that of an endless wire.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Distance from the nearer clamp over half the length, in [0, 1].
    ends : float
        The length b of both ends over the whole length; 0: no heat goes into the clamps.

    Returns
    -------
    ndarray, shape (n,)
    """
    if ends <= 0.0:
        return np.ones(len(position))
    passed = (ends * PIECES) ** 2
    # Elimination from the clamp on: theta[n] = ratio[n] theta[n + 1] + rest[n].
    ratio, rest = np.zeros(PIECES + 1), np.zeros(PIECES + 1)
    for n in range(1, PIECES + 1):
        pivot = 1.0 + passed * (2.0 - ratio[n - 1])
        ratio[n], rest[n] = passed / pivot, (1.0 + passed * rest[n - 1]) / pivot
    theta = np.zeros(PIECES + 1)
    # Both halves are alike: beyond the middle comes what came before it.
    theta[PIECES] = (rest[PIECES] + ratio[PIECES] * rest[PIECES - 1]) / (
        1.0 - ratio[PIECES] * ratio[PIECES - 1])
    for n in range(PIECES - 1, 0, -1):
        theta[n] = ratio[n] * theta[n + 1] + rest[n]
    return np.interp(position, np.linspace(0.0, 1.0, PIECES + 1), theta)
