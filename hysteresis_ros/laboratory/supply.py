# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The supply of the board: as regulated as a laboratory's, or a battery that others use, too."""

import dataclasses
import math

from hysteresis_ros.laboratory.sensors import SUPPLY


@dataclasses.dataclass(frozen=True)
class Supply:
    """
    A source whose voltage changes with time; by default it does not.

    Parameters
    ----------
    drain : float
        Share of its voltage that a battery loses within the recording; it begins with a fifth of
        that above the nominal voltage.
    dip : float
        Share that it loses while another machine runs on it, two fifths of the time.
    duration : float
        Of the recording [s].
    begin : float
        Where in its cycle, 0 to 1, the other machine is when the recording begins.
    """

    drain: float = 0.0
    dip: float = 0.0
    duration: float = 900.0
    begin: float = 0.0

    # Cycles of the other machine within a recording.
    CYCLES = 7.3

    def voltage(self, time: float) -> float:
        """Return it at a time since the recording began [s], in V."""
        return SUPPLY * self.share(time)

    def share(self, time: float) -> float:
        """Return it over the nominal voltage."""
        if self.drain == 0.0 and self.dip == 0.0:
            return 1.0
        passed = time / self.duration
        # Fast at first, then long on a plateau, and down to the end.
        emptied = 0.25 * (1.0 - math.exp(-12.0 * passed)) + 0.75 * passed ** 2
        running = (self.begin + self.CYCLES * passed) % 1.0 < 0.4
        return max(1.0 + 0.2 * self.drain - self.drain * emptied - self.dip * running, 0.5)
