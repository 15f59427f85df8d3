# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Time stamps for what the board measured: its clock translated into the computer's.

All times are in s. Stamps always grow, by at least a microsecond.
"""

LARGEST_DRIFT = 0.001   # relative difference in speed of two clocks that both mean seconds
LARGEST_JUMP = 1.0      # s of difference from which somebody has set a clock
SMALLEST_DT = 1e-6    # s


class RealStamps:
    """
    Stamps of a board that lives at the wall's speed.

    A frame arrives late by whatever cable and computer take; the frames that were least late tell
    the offset between the clocks, and all others get their stamps from it.
    """

    def __init__(self) -> None:
        self._offset: float | None = None
        self._last_time = 0.0
        self._last_stamp = -float('inf')

    def stamp(self, time: float, now: float) -> float:
        """
        Translate a board time.

        Parameters
        ----------
        time : float
            Board time of the measurement.
        now : float
            The computer's time at which it arrived.

        Returns
        -------
        float
            The computer's time at which it was measured, at most `now`.

        """
        offset = now - time
        if self._offset is None or abs(offset - self._offset) > LARGEST_JUMP:
            self._offset = offset
            self._last_stamp = -float('inf')
        else:
            drift = LARGEST_DRIFT * (time - self._last_time)
            self._offset = min(offset, self._offset + drift)
        self._last_time = time
        self._last_stamp = max(time + self._offset, self._last_stamp + SMALLEST_DT)
        return self._last_stamp


class SimulatedStamps:
    """
    Stamps of a board that lives at another speed, and the ``/clock`` that belongs to them.

    While the board is away the clock goes on at the board's speed, so that nobody who waits for a
    time waits for ever.

    Parameters
    ----------
    start : float
        Stamp of board time 0.
    speed : float
        Seconds of the board in a second of the wall.

    """

    def __init__(self, start: float, speed: float) -> None:
        self._start = start
        self._speed = speed
        self._last_stamp = start
        self._last_wall: float | None = None

    def stamp(self, time: float, wall: float) -> float:
        """
        Translate a board time.

        Parameters
        ----------
        time : float
            Board time of the measurement.
        wall : float
            The wall's time, from any clock that only grows.

        Returns
        -------
        float

        """
        self._last_wall = wall
        self._last_stamp = max(self._start + time, self._last_stamp + SMALLEST_DT)
        return self._last_stamp

    def idle(self, wall: float) -> float:
        """
        Let the clock go on without the board.

        Parameters
        ----------
        wall : float
            The wall's time.

        Returns
        -------
        float
            The stamp of now.

        """
        passed = 0.0 if self._last_wall is None else wall - self._last_wall
        return self.stamp(self._last_stamp - self._start + self._speed * passed, wall)
