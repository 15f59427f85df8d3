# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What warmer or colder air adds to the drive squared that the muscle feels (Eq. 2)."""

import dataclasses
import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.electrical import ELECTRIC_DRIVES
from hysteresis_ros.effects.thermal import ThermalEffect

# By how much the full drive heats a muscle above the room [K], about.
FULL_HEAT = 80.0


class AmbientTemperature(ThermalEffect):
    """The recorded ambient temperature shifts the wire's own."""

    id = 'ambient_temperature'
    sentence = 'Warm air heats the wire as the drive does: the recorded ambient temperature counts.'
    equation = 'Vs^2 = V^2 + (d1/d2) (Ta - T0)'
    source = 'Eq. 2 of the paper with a variable T0'
    shows_in = 'the recorded ambient temperature'
    experiment = 'log the ambient temperature on a cold and on a warm day, and on the bench'
    confused_with = ('ambient_drift',)
    kinds = ('arm', 'bench')
    needs_column = 'ambient_temperature'
    smallest_change = 0.5
    parameters = (
        Parameter('gain', 'V^2/K', 'd1/d2: drive squared that one kelvin stands for', 0.02, 2.0,
                  0.0, (0.2, 0.6), log=True, scale='drive squared'),
        Parameter('reference', 'degC', 'ambient temperature T0 of the bench', 5.0, 40.0, 25.0,
                  (23.0,), kinds=('arm',)),)

    # What two thermometers, or two places of a room, differ by [K].
    APART = 1.0

    @classmethod
    def describe(cls, surroundings: Surroundings | None) -> tuple[Parameter, ...]:
        """Give the reference the range that was recorded on the bench, where it was."""
        gain, reference = super().describe(surroundings)
        middle = cls.column_on_bench(surroundings)
        if surroundings is None or surroundings.ambient is None or middle is None:
            return gain, reference
        low, high = surroundings.ambient
        return gain, dataclasses.replace(
            reference, low=low - cls.APART, high=high + cls.APART, neutral=middle,
            starts=(middle,))

    @classmethod
    def column_on_bench(cls, surroundings: Surroundings | None) -> float | None:
        """Return the middle of what was recorded on the bench [degC], where it was."""
        if surroundings is None or surroundings.ambient is None:
            return None
        return 0.5 * sum(surroundings.ambient)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive heats: a muscle's own temperature has the room in it."""
        return surroundings.drive in (*ELECTRIC_DRIVES, 'power')

    @classmethod
    def typical(cls, surroundings: Surroundings, reference: float) -> 'AmbientTemperature':
        """Return what a room usually does, against one that is as warm as `reference` [degC]."""
        return cls(surroundings, gain=surroundings.full_drive_squared / FULL_HEAT,
                   reference=reference)

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Add what warmer or colder air stands for; nothing where it was not recorded."""
        warmer = np.where(np.isfinite(inputs.ambient), inputs.ambient - self.reference, 0.0)
        return signal + self.gain * warmer

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Drive less in warm air."""
        if not math.isfinite(inputs.ambient):
            return signal
        return signal - self.gain * (inputs.ambient - self.reference)


# Largest change of the drive squared in ten minutes that is tried [V^2]: that of 20 K in 40 s.
FAST = 120.0


class AmbientDrift(ThermalEffect):
    """The ambient temperature changes slowly and nobody recorded it."""

    id = 'ambient_drift'
    sentence = 'The room slowly gets warmer or colder during the recording.'
    equation = ('Vs^2 = V^2 + a + b (t/t1) + c (t/t1)^2 + s sin(2 pi t / P) + k cos(2 pi t / P), '
                't the time of day, t1 = 10 min')
    source = ('Eq. 2 of the paper with T0 a slow function of time; the waves are those of a room '
              'that is heated or cooled in turns')
    shows_in = 'time of day'
    experiment = 'repeat the same loop every few minutes, or log the ambient temperature'
    confused_with = ('fatigue', 'creep')
    invertible = False
    parameters = (
        # A room differs by up to 20 K, of about 0.4 V^2 each, and settles within minutes.
        Parameter('offset', 'V^2', 'what the air at the start adds against the bench', 0.0, 8.0,
                  0.0, (0.0,), both_signs=True, scale='drive squared'),
        Parameter('rate', 'V^2/10 min', 'change of that', 0.05, 12.0, 0.0, (-1.0, 1.0),
                  both_signs=True, limits=(-FAST, FAST), scale='drive squared'),
        Parameter('curvature', 'V^2/(10 min)^2', 'bend of that change', 0.05, 8.0, 0.0, (0.0,),
                  both_signs=True, limits=(-FAST, FAST), scale='drive squared'),
        Parameter('sine', 'V^2', 'wave of it, by its sine', 0.05, 8.0, 0.0, (0.0,),
                  both_signs=True, scale='drive squared', form=True),
        Parameter('cosine', 'V^2', 'the same, by its cosine', 0.05, 8.0, 0.0, (0.0,),
                  both_signs=True, scale='drive squared', with_form='sine'),
        Parameter('period', 's', 'period of the wave', 60.0, 86400.0, 3600.0, (3600.0,), log=True,
                  with_form='sine'))
    together = ('rate', 'curvature', 'sine', 'cosine')

    CLOCK_UNIT = 600.0
    # Size of a wave to start from, over the usual range: from a small one a fit finds a large one,
    # not the other way round.
    WAVE = 0.1
    # How many slow waves a recording may hold to start from, and of faster ones those of which one
    # is chosen by its residual. What comes and goes more often is no slow change.
    SLOW, FASTER = (1.0, 1.6), np.arange(2.0, 6.01, 0.25)

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Add a slow function of the time since the recording began."""
        return signal + self.total(inputs.clock)

    def total(self, clock: Values) -> Values:
        """Return what the air adds [V^2] at times since the recording began [s]."""
        t = clock / self.CLOCK_UNIT
        found = self.offset + self.rate * t + self.curvature * t * t
        if self.sine:
            turned = 2.0 * math.pi * clock / self.period
            found = found + self.sine * np.sin(turned) + self.cosine * np.cos(turned)
        return found

    def moments(self, residual: np.ndarray, response: np.ndarray, clock: np.ndarray
                ) -> list[dict[str, float]]:
        """Return rates at which a room of half the usual range changes, and small waves."""
        largest, duration = self.parameters[0].high, max(float(np.ptp(clock)), 1.0)
        half = 0.5 * largest * self.CLOCK_UNIT / duration
        return [{'rate': -half}, {'rate': half},
                *({'rate': 0.0, 'sine': self.WAVE * largest, 'period': duration / waves}
                  for waves in (*self.SLOW, self._faster(residual, clock / duration)))]

    def _faster(self, residual: np.ndarray, time: np.ndarray) -> float:
        """Return of how many waves those are that explain most of a residual besides a bend."""
        bend, errors = np.vander(time, 3), []
        for waves in self.FASTER:
            turned = 2.0 * math.pi * waves * time
            columns = np.column_stack([bend, np.sin(turned), np.cos(turned)])
            fitted = columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
            errors.append(float(np.sum((residual - fitted) ** 2)))
        return float(self.FASTER[int(np.argmin(errors))])

    def implausible(self, slack: float = 0.0, duration: float = 0.0) -> list[str]:
        """
        Name also the total, where no room is as warm or changes as much in a recording.

        How fast it changes, and how soon that bends, is limited by that alone: a draught takes
        minutes, the day's course hours.
        """
        total = self._course(duration)
        size = max(float(np.max(np.abs(total))), float(np.ptp(total)))
        # No more than the air at the start: 20 K.
        offset = self.parameters[0]
        fast = {one.name for one in self.parameters if one.name in ('rate', 'curvature')
                and abs(self.values[one.name]) > one.high} if duration else set()
        odd = [name for name in super().implausible(slack, duration) if name not in fast]
        return odd + (['total'] if size > offset.high * (1.0 + slack) else [])

    def size_together(self, duration: float) -> float:
        """Return it with what a small rate adds up to in a long recording."""
        rate = self.parameters[1]
        return max(super().size_together(duration),
                   float(np.ptp(self._course(duration))) / rate.low)

    def _course(self, duration: float) -> np.ndarray:
        """Return what the air adds [V^2] along a recording of a duration [s]."""
        course: np.ndarray = self.total(np.linspace(0.0, duration, 101))
        return course
