# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Seconds that only grow, from a board's clock of milliseconds that wraps and starts anew."""

from hysteresis_ros.bridge.messages import TIME_LIMIT


class BoardClock:
    """
    The board's time since the first contact.

    A board that started anew is told by `back`; `begin` then takes its new clock over.
    """

    def __init__(self) -> None:
        self._milliseconds = 0
        self._last = 0

    @property
    def time(self) -> float:
        """Seconds since `begin` was first called; 0 before."""
        return self._milliseconds / 1000.0

    def begin(self, milliseconds: int, gap: float = 0.0) -> None:
        """
        Take the board's clock as it is now.

        Parameters
        ----------
        milliseconds : int
            The board's clock.
        gap : float
            Time in s that has passed since the last reading, when the board started anew.

        """
        self._milliseconds += round(1000.0 * gap)
        self._last = milliseconds

    def back(self, milliseconds: int) -> bool:
        """
        Tell whether the board's clock has gone back, so that the board must have started anew.

        Parameters
        ----------
        milliseconds : int
            The board's clock.

        Returns
        -------
        bool

        """
        return (milliseconds - self._last) % TIME_LIMIT >= TIME_LIMIT // 2

    def same(self, milliseconds: int) -> bool:
        """
        Tell whether the board's clock has stood still.

        Parameters
        ----------
        milliseconds : int
            The board's clock.

        Returns
        -------
        bool

        """
        return milliseconds == self._last

    def follow(self, milliseconds: int) -> float:
        """
        Take a reading.

        Parameters
        ----------
        milliseconds : int
            The board's clock, not `back`.

        Returns
        -------
        float
            `time` in s.

        """
        self._milliseconds += (milliseconds - self._last) % TIME_LIMIT
        self._last = milliseconds
        return self.time
