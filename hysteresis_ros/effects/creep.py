# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Creep after a step: the muscle goes on transforming while its drive is held."""

import math

import numpy as np

from hysteresis_ros.effects.base import Effect, Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.stages import MaterialEffect
from hysteresis_ros.kernels.creep import fade, relax
from hysteresis_ros.kernels.trial import LONGEST_TRANSIENT

# Value of `kept` for one relaxation.
SINGLE = 2.0


class Creep(MaterialEffect):
    """The muscle goes on moving in the direction of its last step."""

    id = 'creep'
    sentence = 'After a step the muscle goes on moving the same way, with the logarithm of time.'
    equation = ('L += c l0 g(dxi) ln(1 + t / t0), t since the last step and dxi the change of the '
                'martensite share by it, g(dxi) = dxi, or tanh(dxi / s) / tanh(1 / s); and that of '
                'the steps before, which fades with exp(-2 t / t0); where kept is 1, the '
                'logarithms of all steps so far, where it is 2, c l0 ln(10) y with '
                'dy/dt = (xi - y) / t0, less those of the cold muscle if it is not rested; where '
                'settled is 1, less those of all time, so that the muscle comes to what H2 says')
    source = ("logarithmic creep of what has just transformed; Boltzmann's superposition "
              '(kept = 1); Kelvin and Voigt (kept = 2)')
    shows_in = 'log time in a hold'
    experiment = 'holds of 300 s'
    confused_with = ('thermal_lag', 'ambient_drift')
    kinds = ('arm', 'bench')
    needs_phase = True
    parameters = (
        Parameter('c', '% of l0', 'strain per factor e of time after a full transformation', 0.01,
                  0.5, 0.0, (0.03, 0.15), log=True),
        Parameter('t0', 's', 'time from which the logarithm counts, or time constant', 0.005,
                  300.0, 3.0, (3.0,), log=True),
        Parameter('kept', '1', '0: a step lets the creep of those before fade, as in a '
                  'transformation; 1: it goes on, as in a polymer; 2: so does one relaxation', 0.0,
                  2.0, 0.0, (0.0, 1.0), choices=(0.0, 1.0, 2.0), form=True),
        Parameter('s', '1', 'change of the martensite share by a step from which on a larger one '
                  'creeps hardly more; 0: in proportion to it', 0.0, 0.1, 0.0, (0.0, 0.1),
                  choices=(0.0, 0.1)),
        Parameter('rested', '1', 'of what goes on, 0: the cold muscle has crept before a trial, '
                  '1: it begins to', 0.0, 1.0, 0.0, (0.0,), choices=(0.0, 1.0), kinds=('arm',),
                  form=True),
        Parameter('settled', '1', 'of what goes on, 0: the bench has what a step does at once, 1: '
                  'what it comes to in the end', 0.0, 1.0, 0.0, (0.0,), choices=(0.0, 1.0),
                  kinds=('arm',), form=True))

    # Martensite share, less one, that relaxations go to.
    _target: float

    # When the last step was [s], and the drive before; None before a trial.
    _since: float | None
    _drive: float | None

    memory = ('_since', '_drive', '_phase', '_before', '_direction', '_crept', '_carried', '_modes',
              '_target')

    # The logarithm as a sum of relaxations, each this many times slower than the one before.
    MODES, RATIO = 6, 3.0

    # One relaxation comes to what the logarithm does in time that grows by this factor.
    DECADE = 10.0

    # A change of the drive by less than this share of its range is a hold.
    HOLD = 1e-3

    # How much faster than t0 the strain of earlier steps fades.
    FADING = 2.0

    # A slow relaxation [s].
    SLOW = 60.0

    def start(self) -> None:
        """Forget the past: cold, before the first step."""
        self._since = self._drive = None
        self._phase = self._before = 1.0
        self._direction = self._crept = self._carried = 0.0
        self._modes = [-self.rested] * len(self._times())
        self._target = 0.0

    def guesses(self, measured: np.ndarray) -> list[dict[str, float]]:
        """Begin also with slow relaxations, new or settled on the bench, and from a cold muscle."""
        slow = {'c': 0.15, 't0': self.SLOW, 'kept': SINGLE}
        return [{**slow, 'rested': 0.0}, {**slow, 'rested': 1.0},
                {'c': 0.15, 'kept': 1.0, 'rested': 1.0}, {'c': 0.15, 'kept': 1.0, 'settled': 1.0}]

    def advance(self, drive: float, drive_squared: float, inputs: Inputs,
                surroundings: Surroundings) -> tuple[float, float]:
        """Return the strain since the last step, in that step's direction."""
        if self.kept:
            return self._relax(inputs.phase, inputs.dt, surroundings), 1.0
        # A ramp is many small steps: what a hold after it shows is the whole ramp's. Rows that are
        # far apart are the ends of holds, each after a step of its own.
        change = drive - (surroundings.cold if self._drive is None else self._drive)
        direction = 0.0
        if abs(change) > self.HOLD * surroundings.drive_range:
            direction = math.copysign(1.0, change)
        if direction != 0.0:
            if direction != self._direction or inputs.dt > LONGEST_TRANSIENT:
                self._before = self._phase
                self._carried += self._crept
            self._since = inputs.time - inputs.dt
        self._carried *= math.exp(-self.FADING * inputs.dt / self.t0)
        self._direction, self._drive, self._phase = direction, drive, inputs.phase
        if self._since is None:
            return 0.0, 1.0
        self._crept = float(self._strain(
            inputs.phase - self._before, inputs.time - self._since, surroundings))
        return self._carried + self._crept, 1.0

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the same for a whole trial at once."""
        if self.kept:
            return self._relaxed(inputs, surroundings), np.ones(len(drive))
        change = np.diff(drive, prepend=surroundings.cold)
        direction = np.where(
            np.abs(change) > self.HOLD * surroundings.drive_range, np.sign(change), 0.0)
        rows = np.arange(len(drive))
        last = np.maximum.accumulate(np.where(direction != 0.0, rows, -1))
        turned = (direction != 0.0) & (
            (direction != np.concatenate(([0.0], direction[:-1])))
            | (inputs.dt > LONGEST_TRANSIENT))
        begun = np.maximum.accumulate(np.where(turned, rows, 0))
        before = np.concatenate(([1.0], inputs.phase))[begun]
        stepped = inputs.time - inputs.dt
        held = np.where(last >= 0, inputs.time - stepped[last], 0.0)
        strain = self._strain(inputs.phase - before, held, surroundings)
        clock = self.FADING / self.t0 * np.cumsum(inputs.dt)
        return strain + fade(strain, turned, clock), np.ones(len(drive))

    def in_settled_rows(self) -> Effect:
        """
        Return the effect with t0 as it is, but where it goes on: on an arm, whose holds differ.

        Of equal holds all that shows is what has crept at their ends.
        """
        return self.with_parameter('t0', kinds=('arm',), with_form='kept')

    def _times(self) -> np.ndarray:
        """Return the time constant [s] of each relaxation, (modes,)."""
        if self.kept == SINGLE:
            return np.array([self.t0])
        # With this first time the sum comes to the logarithm, not beside it, in the long run.
        return 3.0 * self.t0 * self.RATIO ** np.arange(self.MODES)

    def _relax(self, phase: float, dt: float, surroundings: Surroundings) -> float:
        """Bring all relaxations nearer to the phase, and return their strain."""
        if math.isfinite(phase):
            self._target = target = phase - 1.0
            decays = np.exp(-dt / self._times())
            self._modes = (target + (np.array(self._modes) - target) * decays).tolist()
        return self._strain_of_modes(sum(self._modes), self._target, surroundings)

    def _relaxed(self, inputs: Inputs, surroundings: Surroundings) -> np.ndarray:
        """Return what `_relax` does for a whole trial."""
        self.start()
        modes = np.array(self._modes)
        # Where the phase is not known, nothing relaxes.
        targets = np.where(np.isfinite(inputs.phase), inputs.phase - 1.0, np.nan)
        total = relax(targets, np.array(inputs.dt, float), self._times(), modes)
        self._modes = modes.tolist()
        known = np.maximum.accumulate(np.where(np.isfinite(targets), np.arange(len(targets)), -1))
        targets = np.where(known < 0, 0.0, targets[known])
        if len(targets):
            self._target = float(targets[-1])
        return self._strain_of_modes(total, targets, surroundings)

    def _strain_of_modes(self, total: Values, target: Values, surroundings: Surroundings) -> Values:
        each = math.log(self.DECADE if self.kept == SINGLE else self.RATIO)
        before = self.settled * target - (1.0 - self.settled) * self.rested
        strain = self.c / 100.0 * each * (total - before * len(self._modes))
        return -surroundings.sign * surroundings.length * strain

    def _strain(self, change: Values, held: Values, surroundings: Surroundings) -> Values:
        """Return it for a change of the phase; nothing where that is not known."""
        change = np.nan_to_num(change)
        if self.s > 0.0:
            change = np.tanh(change / self.s) / math.tanh(1.0 / self.s)
        strain = self.c / 100.0 * change * np.log1p(held / self.t0)
        return -surroundings.sign * surroundings.length * strain
