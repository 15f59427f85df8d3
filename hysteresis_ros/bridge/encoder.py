# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Counts of an incremental quadrature encoder (AMT103) to angle and velocity.

The AMT103 gives 2048 pulses per turn on each of two tracks, so 4 x 2048 = 8192 counts per turn,
and one index pulse per turn. The counter of the board wraps, starts anywhere and knows nothing of
the angle, so

    angle = zero + direction * 2 pi / counts_per_revolution * counts
"""

import collections
import math
from typing import NamedTuple

from hysteresis_ros.errors import ParameterError

AMT103_PULSES = 2048
AMT103_COUNTS = 4 * AMT103_PULSES

INDEX_USES = ('ignore', 'check', 'home')
INDEX_TOLERANCE = 4   # counts: one quadrature cycle, the width of the index pulse
INDEX_MARGIN = 16       # counts beyond its place within which the index pulse must have come


class Reading(NamedTuple):
    """
    One reading of the encoder.

    Attributes
    ----------
    angle : float
        Angle in rad; the last believable one if `fresh` is False.
    velocity : float
        Angular velocity in rad/s, mean over the velocity window.
    fresh : bool
        Whether this sample was believed.
    fault : str
        What is wrong, or ''. Faults that leave the angle in doubt stay until `clear_fault`.

    """

    angle: float
    velocity: float
    fresh: bool
    fault: str


class Encoder:
    """
    Angle and velocity from quadrature counts, with zero, wrapping, index pulse and checks.

    Parameters
    ----------
    counts_per_revolution : int
        Quadrature counts per turn.
    direction : int
        1 if counts grow with the angle, -1 if they fall.
    zero : float
        Angle in rad at count 0.
    counter_bits : int
        Width of the board's counter, after which it wraps: 16 or 32.
    maximum_speed : float
        Angular speed in rad/s that the arm cannot exceed; a larger jump is a fault.
    velocity_window : float
        Time in s over which the velocity is taken; at least two samples are used.
    index : str
        What to do at an index pulse: 'ignore'; 'check' that it comes at the same place every
        turn; 'home': the angle there is `index_angle`.
    index_angle : float
        Angle in rad at the index pulse, for 'home'.

    Raises
    ------
    ParameterError
        If a value makes no sense.

    """

    def __init__(self, counts_per_revolution: int = AMT103_COUNTS, direction: int = 1,
                 zero: float = 0.0, counter_bits: int = 32, maximum_speed: float = 30.0,
                 velocity_window: float = 0.1, index: str = 'ignore',
                 index_angle: float = 0.0) -> None:
        if counts_per_revolution < 4:
            raise ParameterError(f'counts_per_revolution {counts_per_revolution}: at least 4')
        if direction not in (-1, 1):
            raise ParameterError(f'encoder_direction {direction}: 1 or -1')
        if counter_bits not in (16, 32):
            raise ParameterError(f'encoder counter of {counter_bits} bits: 16 or 32')
        if index not in INDEX_USES:
            raise ParameterError(f'encoder_index {index!r}: use one of {", ".join(INDEX_USES)}')
        if not (maximum_speed > 0.0 and velocity_window >= 0.0
                and math.isfinite(zero) and math.isfinite(index_angle)):
            raise ParameterError('encoder: maximum_speed has to be positive, velocity_window not '
                                 'negative, zero and index_angle finite')
        self.counter_bits = counter_bits
        self._counts_per_revolution = counts_per_revolution
        self._scale = direction * 2.0 * math.pi / counts_per_revolution
        self._zero = zero
        self._maximum_speed = maximum_speed
        self._window = velocity_window
        self._index_use = index
        self._index_angle = index_angle
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next sample is the first."""
        self._begun = False
        self._position = 0          # counts from the angle `zero`, unwrapped
        self._counter = 0           # the counter as last believed
        self._time = 0.0
        # (time, counter) of a sample that was not believed
        self._suspect: tuple[float, int] | None = None
        self._restarted = False
        self._history: collections.deque[tuple[float, int]] = collections.deque()
        self._index: int | None = None
        self._index_position: int | None = None
        # Between which two places of the index the arm was, and the number of pulses by then.
        self._sector: tuple[int | None, int] = None, 0
        self._fault = ''

    def restart(self) -> None:
        """
        Take note that the board has started anew, so that its counter begins again.

        The arm is taken to be where it was; that is a fault until the index pulse or
        `clear_fault` ends it.
        """
        if self._begun:
            self._restarted = True
            self._fault = ('the board has started anew: its encoder counter was lost, the angle '
                           'is carried on from before and may be off')

    def clear_fault(self) -> None:
        """Clear the fault of the angle, because somebody has checked it."""
        self._fault = ''
        self._index_position = None
        self._sector = None, 0

    @property
    def angle(self) -> float | None:
        """Angle in rad of the last sample that was believed; None before the first."""
        return self._angle(self._position) if self._begun else None

    def update(self, time: float, counter: int, index: int = 0,
               latch: int | None = None) -> Reading:
        """
        Take one sample.

        Parameters
        ----------
        time : float
            Time in s of the board's clock, not falling.
        counter : int
            The board's counter.
        index : int
            How many index pulses the board has seen.
        latch : int, optional
            The counter at the latest index pulse.

        Returns
        -------
        Reading

        """
        if not self._begun or self._restarted:
            self._begin(time, counter, index)
            self._look_at_index(counter, index, latch)
            return self._reading(True, '')
        change = self._wrap(counter - self._counter)
        if abs(change) > self._possible(time - self._time):
            if not self._agrees_with_suspect(time, counter):
                self._suspect = (time, counter)
                return self._reading(False, f'encoder counts jumped by {change} within '
                                     f'{time - self._time:.3g} s, which the arm cannot do: '
                                     'sample not believed; check cable and supply')
            self._fault = (f'encoder counts jumped by {change} and stayed there: the angle may be '
                           'off; check cable and coupling')
            self._history.clear()
        self._suspect = None
        self._position += change
        self._counter = counter
        self._time = time
        self._remember(time)
        self._look_at_index(counter, index, latch)
        self._look_for_missing_index(index)
        return self._reading(True, '')

    def _begin(self, time: float, counter: int, index: int) -> None:
        if not self._restarted:
            self._position = self._wrap(counter)
        self._begun = True
        self._counter = counter
        self._time = time
        self._index = None
        self._sector = None, index
        self._suspect = None
        self._restarted = False
        self._history.clear()
        self._remember(time)

    def _agrees_with_suspect(self, time: float, counter: int) -> bool:
        if self._suspect is None:
            return False
        since, suspect = self._suspect
        return abs(self._wrap(counter - suspect)) <= self._possible(time - since)

    def _possible(self, duration: float) -> float:
        """Return how many counts the arm can turn within `duration`, and one for rounding."""
        return self._maximum_speed * max(duration, 0.0) / abs(self._scale) + 1.0

    def _wrap(self, difference: int) -> int:
        half = 1 << (self.counter_bits - 1)
        return (difference + half) % (2 * half) - half

    def _remember(self, time: float) -> None:
        history = self._history
        history.append((time, self._position))
        while len(history) > 2 and history[1][0] <= time - self._window:
            history.popleft()

    def _look_at_index(self, counter: int, index: int, latch: int | None) -> None:
        if latch is None or index == self._index or self._index_use == 'ignore':
            return
        self._index = index
        self._at_index(self._position - self._wrap(counter - latch))

    def _look_for_missing_index(self, index: int) -> None:
        """Find out whether the arm has passed the place of the index pulse without one."""
        if self._index_use == 'ignore' or self._index_position is None:
            return
        turn, (sector, since) = self._counts_per_revolution, self._sector
        turns, beyond = divmod(self._position - self._index_position, turn)
        if not INDEX_MARGIN < beyond < turn - INDEX_MARGIN:
            return      # too near to the place to tell
        self._sector = turns, index
        if sector is not None and turns != sector and index == since:
            self._fault = ('the arm has passed the place of the index pulse and none came: counts '
                           'were lost or the index is not connected, the angle may be off; check '
                           'cable and coupling')

    def _at_index(self, position: int) -> None:
        """Compare or correct the position with the index pulse that came at `position`."""
        expected, first = self._index_position, self._index_position is None
        if self._index_use == 'home':
            expected = round((self._index_angle - self._zero) / self._scale)
        elif expected is None:
            expected = position
        self._index_position = expected
        turn = self._counts_per_revolution
        error = (position - expected + turn // 2) % turn - turn // 2
        if self._index_use == 'home':
            self._move(-error)
            self._fault = ''
        if abs(error) > INDEX_TOLERANCE and not (first and self._index_use == 'home'):
            self._fault = (f'the index pulse came {error} counts off its place: counts were lost, '
                           'the angle ' + ('was put right' if self._index_use == 'home'
                                           else 'may be off') + '; check cable and coupling')

    def _move(self, counts: int) -> None:
        self._position += counts
        self._sector = None, 0
        self._history = collections.deque(
            (time, position + counts) for time, position in self._history)

    def _angle(self, position: int) -> float:
        return self._zero + self._scale * position

    def _reading(self, fresh: bool, fault: str) -> Reading:
        (start, before), (end, now) = self._history[0], self._history[-1]
        velocity = self._scale * (now - before) / (end - start) if end > start else 0.0
        return Reading(self._angle(self._position), velocity, fresh, fault or self._fault)
