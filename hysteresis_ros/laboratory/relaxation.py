# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Stress relaxation of rubber and polymers: the same share of the stress in each decade of time.

A chain of Maxwell elements, one for each decade, so that under a constant load the muscle creeps
with the logarithm of time. A. N. Gent: Relaxation processes in vulcanized rubber. I. Relation among
stress relaxation, creep, recovery, and hysteresis, Journal of Applied Polymer Science 6 (1962)
433-441.
"""

import math

# Relaxation times of the elements [s].
TIMES = (1.0, 10.0, 100.0, 1000.0)


class Relaxation:
    """
    The elements with their memory.

    Parameters
    ----------
    share : float
        Share of the stress that relaxes in one decade of time.
    """

    def __init__(self, share: float) -> None:
        self._share = share
        self.reset()

    def reset(self) -> None:
        """Forget all stress."""
        self._memory = [0.0] * len(TIMES)

    @property
    def relaxed(self) -> float:
        """What is missing from the stress of a fresh material, in its unit."""
        return self._share * sum(self._memory)

    def advance(self, stress: float, dt: float) -> None:
        """Relax for a time [s] while a fresh material would have a given stress."""
        self._memory = [stress + (memory - stress) * math.exp(-dt / time)
                        for memory, time in zip(self._memory, TIMES)]
