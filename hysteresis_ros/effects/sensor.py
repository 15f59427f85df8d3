# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects between the true response and what the sensor says."""

import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter
from hysteresis_ros.effects.stages import SensorEffect
from hysteresis_ros.kernels.play import follow


class EncoderOffset(SensorEffect):
    """The encoder's zero is not where it should be."""

    id = 'encoder_offset'
    rowwise = True
    sentence = 'The encoder was zeroed at another angle than assumed.'
    equation = 'theta_m = theta + offset'
    source = 'incremental encoder'
    shows_in = 'constant'
    experiment = 'drive the arm against a hard stop of known angle'
    confused_with = ('geometry_error',)
    kinds = ('arm',)
    parameters = (
        Parameter('offset', 'deg', 'measured less true angle', 0.2, 15.0, 0.0, (-2.0, 2.0),
                  both_signs=True),)

    def forward(self, response: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Add the offset."""
        return response + math.radians(self.offset)

    def step(self, value: float, dt: float) -> float:
        """Add the offset."""
        return value + math.radians(self.offset)

    def inverse(self, response: float) -> float:
        """Take the offset away."""
        return response - math.radians(self.offset)


class Backlash(SensorEffect):
    """
    Play between shaft and encoder.

    Where in its play the encoder lies at the state of rest before a trial depends on how the arm
    came to rest: a muscle that has cooled down has left it at one end. It may be zeroed there, or
    have been in the middle of its play. Of a recording that begins in the middle of a run nothing
    before its first row is known: the encoder lies somewhere there.
    """

    id = 'backlash'
    rowwise = True
    sentence = 'The encoder stands still until the play at its coupling is used up.'
    equation = ('play operator of width B between shaft and encoder: theta_m is from theta + '
                '(s - 1) B / 2 to theta + (s + 1) B / 2 with s = seat where zeroed is 1, else 0')
    source = 'play operator'
    shows_in = 'reversals'
    experiment = 'move the arm by hand and watch the counts'
    confused_with = ('coulomb_friction',)
    kinds = ('arm',)
    parameters = (
        Parameter('B', 'deg', 'width of the play', 0.2, 12.0, 0.0, (1.0, 4.0), log=True),
        Parameter('seat', '1', 'where in its play the encoder lies before a trial: 0 in the '
                  'middle, 1 where a turn to larger angles moves it at once, -1 one to smaller',
                  -1.0, 1.0, 0.0, (0.0, 1.0, -1.0), limits=(-1.0, 1.0), form=True),
        Parameter('zeroed', '1', '1: the encoder is zeroed at rest before a trial, 0: it was in '
                  'the middle of its play, 2: as 0, with the seat of the first row of a trial',
                  0.0, 2.0, 1.0, (1.0,), choices=(1.0, 0.0, 2.0)))

    memory = ('_state', '_target', '_lead')

    # Where the encoder is, or was at rest, and the target before; None before a trial.
    _state: float | None
    _target: float | None

    def start(self) -> None:
        """Forget the past: the first sample is the state of rest, if none was before."""
        self._state = None
        self._target = None
        self._lead = 0.0

    def begin(self, rest: float) -> None:
        """Lay the encoder where it is at rest, unless the first sample says where it is."""
        self._state = None if self.zeroed == 2.0 else self._at_rest(rest)

    def _at_rest(self, rest: float) -> float:
        """Return what the encoder shows at rest [rad]."""
        return rest + self._middle - self.seat * self._half

    @property
    def _half(self) -> float:
        return 0.5 * math.radians(self.B)

    @property
    def _middle(self) -> float:
        """What the encoder shows more than the angle in the middle of its play [rad]."""
        return self.seat * self._half if self.zeroed == 1.0 else 0.0

    def step(self, value: float, dt: float) -> float:
        """Move the encoder only when the play is used up."""
        state = self._at_rest(value) if self._state is None else self._state
        middle = value + self._middle
        self._state = min(max(state, middle - self._half), middle + self._half)
        return self._state

    def forward(self, response: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Do what `step` does for a whole trial."""
        place = self._at_rest(response[0]) if self._state is None else self._state
        course = follow(np.ascontiguousarray(response + self._middle, float), self._half,
                        float(place))
        self._state = float(course[-1])
        return course

    def inverse(self, response: float) -> float:
        """Go further by half the play in the direction of the motion."""
        before = self._state if self._target is None else self._target
        moved = before is None or (response - before) * self._lead > 0.0 or (
            abs(response - before) > self.dead_band)
        if before is None:
            self._lead = self.seat * self._half
        elif moved:
            self._lead = math.copysign(self._half, response - before)
        if moved or self._target is None:
            self._target = response
        # Not a turn yet: the furthest target goes on to count.
        return self._target + self._lead - self._middle


class Latency(SensorEffect):
    """The measurement arrives late."""

    id = 'latency'
    sentence = 'The measured response is that of a moment ago.'
    equation = 'theta_m(t) = theta(t - delay)'
    source = 'transport delay of bus, filter and time stamps'
    shows_in = 'dtheta/dt'
    experiment = 'a fast chirp'
    confused_with = ('thermal_lag',)
    needs_transients = True
    invertible = False
    parameters = (
        Parameter('delay', 's', 'age of a measurement', 0.005, 5.0, 0.0, (0.1, 1.0), log=True),
        Parameter('held', '1', 'until the first measurement of a trial arrives, 0: the response '
                  'before the trial is read, 1: that first measurement, as where a recording was '
                  'shifted afterwards', 0.0, 1.0, 0.0, (0.0,), choices=(0.0, 1.0)))

    memory = ('_past',)

    # Age [s] and response of what was seen, oldest first.
    _past: list[list[float]]

    def forward(self, response: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Read the response of a moment ago."""
        time = inputs.time
        if self._past:
            # Before the trial the muscle was at rest.
            time = np.append(time[0] - inputs.dt[0], time)
            response = np.append(self._past[-1][1], response)
        return np.interp(inputs.time - self.delay, time, response)

    def rows_read(self, asked: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Each row reads those before and after the moment of a delay ago."""
        read = np.zeros_like(asked)
        after = np.searchsorted(inputs.time, inputs.time[asked] - self.delay)
        read[np.maximum(after - 1, 0)] = read[after] = True
        return read

    def start(self) -> None:
        """Forget the past."""
        self._past = []

    def begin(self, rest: float) -> None:
        """See the state of rest until what follows it arrives."""
        self._past = [] if self.held else [[0.0, rest]]

    def step(self, value: float, dt: float) -> float:
        """Interpolate in what was seen within the delay."""
        past = [[age + dt, old] for age, old in self._past]
        past.append([0.0, value])
        # One sample beyond the delay is needed, none before that.
        beyond = sum(age >= self.delay for age, _ in past)
        self._past = past[max(beyond - 1, 0):]
        ages, values = zip(*reversed(self._past))
        return float(np.interp(self.delay, ages, values))
