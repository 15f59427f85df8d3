# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The limit that a board sets to its mean heating power, as `firmware/power.c` computes it."""

import math

TICK = 100                  # ms over which the duty is averaged before it enters the mean
WINDOW = 60000              # ms, the mean's time constant until `config` says otherwise
LONGEST_WINDOW = 3600000    # ms


class PowerLimit:
    """
    Running mean of the voltage's square over the wires, and the most that it may be.

    Attributes
    ----------
    mean : float
        In V^2.
    """

    def __init__(self) -> None:
        self.mean = 0.0
        self._most = math.inf
        self._ticks = WINDOW // TICK
        self._passed = 0            # ms of this tick
        self._duties = 0.0          # sum of duty times ms in it

    def set(self, rms: float, window: int) -> None:
        """
        Set the limit; the mean stays.

        Parameters
        ----------
        rms : float
            Largest RMS in V.
        window : int
            The mean's time constant in ms.
        """
        self._most = rms ** 2
        self._ticks = max(min(window, LONGEST_WINDOW) // TICK, 1)

    def add(self, duty: float, supply: float, milliseconds: int) -> None:
        """
        Take note of what was applied.

        Parameters
        ----------
        duty : float
            0 to 1.
        supply : float
            In V.
        milliseconds : int
            How long.
        """
        self._passed += milliseconds
        self._duties += duty * milliseconds
        if self._passed >= TICK:
            self.mean += (self._duties / self._passed * supply ** 2 - self.mean) / self._ticks
            self._passed, self._duties = 0, 0.0

    @property
    def exceeded(self) -> bool:
        """Whether the mean is above the limit."""
        return self.mean > self._most
