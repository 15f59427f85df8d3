# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects that no catalogue has: what can be wrong with an arm although nobody thought of it.

They exist so that a diagnosis can be tested for saying that it does not know. Where something
happens at random moments, these differ from one recording of the same arm to the next.
"""

import math

import numpy as np

from hysteresis_ros.laboratory.conditions import Conditions, Disturbance


class Events:
    """
    Random moments of one recording.

    Parameters
    ----------
    count : float
        How many there are on average in `duration`.
    duration : float
        Typical length of a recording [s]; the moments go on for four times as long.
    rng : numpy.random.Generator
        Random generator.
    """

    def __init__(self, count: float, duration: float, rng: np.random.Generator) -> None:
        gaps = rng.exponential(1.0, size=int(8 * count) + 8) + 0.3
        self.times = np.cumsum(gaps) * duration / (1.3 * count)
        self.signs = np.where(rng.random(len(gaps)) < 0.5, -1.0, 1.0)

    def passed(self, time: float) -> int:
        """Return how many moments have passed."""
        return int(self.times.searchsorted(time))

    def since(self, time: float) -> float:
        """Return the time since the last one [s]; infinite before the first."""
        count = self.passed(time)
        return time - float(self.times[count - 1]) if count else math.inf


class Unlisted(Disturbance):
    """
    Base of the effects of this module.

    Parameters
    ----------
    size : float
        Strength, 1 is strong.
    conditions : Conditions
        Of the arm on which it acts.
    specimen, recording : numpy.random.Generator
        Random generators for what belongs to the arm, and for what differs between recordings.
    """

    def __init__(self, size: float, conditions: Conditions, specimen: np.random.Generator,
                 recording: np.random.Generator) -> None:
        self.size = size
        self.linkage = conditions.linkage
        self.duration = conditions.recording_time
        self.prepare(specimen, recording)

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the random numbers that the effect needs."""


class StiffeningCable(Unlisted):
    """A cable to the forearm stiffens as the arm rises."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw from which angle on the cable pulls."""
        self._start = math.radians(specimen.uniform(122.0, 130.0))

    def moment(self, time: float, theta: float) -> float:
        """Pull the arm down with the square of how far it has risen."""
        return 0.6 * self.size * max(self._start - theta, 0.0) ** 2


class SlippingCrimp(Unlisted):
    """A crimp gives way once; from then on the wires are longer."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the moment."""
        self._moment = recording.uniform(0.3, 0.6) * self.duration

    def excess(self, time: float, tension: float) -> float:
        """Be longer from the moment on."""
        return 0.004 * self.size if time > self._moment else 0.0


class SkippingEncoder(Unlisted):
    """The encoder now and then skips counts, either way."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the moments."""
        self._events = Events(12.0, self.duration, recording)
        self._sums = np.r_[0.0, np.cumsum(self._events.signs)]

    def reading(self, time: float, theta: float) -> float:
        """Be off by all counts skipped so far."""
        return math.radians(3.0) * self.size * float(self._sums[self._events.passed(time)])


class SwingingLoad(Unlisted):
    """The weight hangs on a string; draughts set it swinging again and again."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw when it is pushed, and its string's length."""
        self._events = Events(20.0, self.duration, recording)
        self._pulsation = math.sqrt(9.81 / specimen.uniform(0.2, 0.4))
        self._decay = 0.1 * self.duration

    def moment(self, time: float, theta: float) -> float:
        """Weigh more and less as it swings."""
        since = self._events.since(time)
        if since == math.inf:
            return 0.0
        return (0.5 * self.size * self.linkage.moment(theta) * math.exp(-since / self._decay)
                * math.sin(self._pulsation * since))


class ShakenBench(Unlisted):
    """A machine nearby runs for a while, stands, and runs again."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw when it is switched."""
        self._events = Events(8.0, self.duration, recording)
        self._pulsation = 2.0 * math.pi * specimen.uniform(1.3, 2.1)

    def moment(self, time: float, theta: float) -> float:
        """Shake all masses up and down while it runs."""
        if self._events.passed(time) % 2 == 0:
            return 0.0
        return (0.5 * self.size * self.linkage.moment(theta)
                * math.sin(self._pulsation * time))


class HotSurface(Unlisted):
    """At some angle the wires brush a hot surface."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the angle."""
        self._middle = math.radians(specimen.uniform(112.0, 122.0))

    def warmth(self, time: float, theta: float) -> float:
        """Be warmer near that angle."""
        return 22.0 * self.size * math.exp(-0.5 * ((theta - self._middle) / 0.08) ** 2)


class Magnet(Unlisted):
    """A magnet holds the forearm near one angle."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the angle."""
        self._middle = math.radians(specimen.uniform(112.0, 122.0))

    def moment(self, time: float, theta: float) -> float:
        """Pull towards the angle, most strongly a little off it."""
        offset = (theta - self._middle) / math.radians(6.0)
        return -0.13 * self.size * offset * math.exp(0.5 - 0.5 * offset * offset)


class LooseSetScrew(Unlisted):
    """The hub of the encoder jumps to and fro on its shaft, at random moments."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the moments."""
        self._events = Events(9.0, self.duration, recording)

    def reading(self, time: float, theta: float) -> float:
        """Be off after every other jump."""
        return -math.radians(7.0) * self.size * (self._events.passed(time) % 2)


class PeriodicDraught(Unlisted):
    """Air conditioning blows at the wires at regular intervals."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the interval."""
        self._period = specimen.uniform(35.0, 60.0) * max(self.duration / 900.0, 1.0)

    def airflow(self, time: float) -> float:
        """Cool more during a third of each interval."""
        return 1.0 + 0.35 * self.size * (time / self._period % 1.0 < 0.33)


class EccentricDisc(Unlisted):
    """The encoder's disc sits askew: its error repeats every 30 degrees or so."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw how it sits."""
        self._waves = specimen.integers(11, 16)
        self._phase = specimen.uniform(0.0, 2.0 * math.pi)

    def reading(self, time: float, theta: float) -> float:
        """Read too much and too little in turn."""
        return math.radians(4.5) * self.size * math.sin(self._waves * theta + self._phase)


class FlexedLead(Unlisted):
    """A lead breaks strand by strand: raising the arm flexes it, and less voltage arrives."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw the angle."""
        self._middle = math.radians(specimen.uniform(112.0, 120.0))

    def contact(self, time: float, theta: float) -> float:
        """Lose voltage above the angle."""
        return 1.0 - 0.16 * self.size / (1.0 + math.exp((theta - self._middle) / 0.03))


class WaterDrops(Unlisted):
    """A pipe drips on the wires."""

    def prepare(self, specimen: np.random.Generator, recording: np.random.Generator) -> None:
        """Draw when a drop falls."""
        self._events = Events(18.0, self.duration, recording)
        self._drying = 0.017 * self.duration

    def airflow(self, time: float) -> float:
        """Cool more until the drop is gone."""
        return 1.0 + 0.9 * self.size * math.exp(-self._events.since(time) / self._drying)


UNLISTED = {
    'unlisted_stiffening_cable': StiffeningCable,
    'unlisted_slipping_crimp': SlippingCrimp,
    'unlisted_skipping_encoder': SkippingEncoder,
    'unlisted_swinging_load': SwingingLoad,
    'unlisted_shaken_bench': ShakenBench,
    'unlisted_hot_surface': HotSurface,
    'unlisted_magnet': Magnet,
    'unlisted_loose_set_screw': LooseSetScrew,
    'unlisted_periodic_draught': PeriodicDraught,
    'unlisted_eccentric_disc': EccentricDisc,
    'unlisted_flexed_lead': FlexedLead,
    'unlisted_water_drops': WaterDrops,
}
