# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Natural convection and radiation: the hotter the wire, the faster it gives its heat away."""

import math

import numpy as np

from hysteresis_ros.effects.base import Effect, Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.thermal import FASTEST, FirstOrderLag, LAGS
from hysteresis_ros.false_position import false_position
from hysteresis_ros.kernels.lag import approach, growing_lag

# Share of the way that an input is taken to be good for, at least: it is finite in no time, too.
LEAST_SHARE = 1e-3
# An input is found to this share of the full drive squared.
TOLERANCE = 1e-13


class HeatLoss(FirstOrderLag):
    """
    The heat transfer coefficient h grows with the temperature, and the rate of Eq. 1 with it.

    In the balance ``m c dT/dt = V^2 / R - A h(T) (T - T0)`` the drive squared q that keeps a
    temperature is in proportion to ``h(T) (T - T0)``. What a settled row shows of that is another,
    still monotone, relation of drive squared and temperature, which the operators identified on the
    bench have absorbed; so q stays what they know. Its rate, in proportion to ``dq/dT``, grows:
    natural convection, h ~ (T - T0)^(1/4), has a rate ~ q^(1/5), radiation one ~ T^3. From a fifth
    of the full drive on, where wires transform, a straight line in q is within 3 % of either.

    Where the bench lost heat in proportion to the temperature, as a fan or a housing makes it, and
    the arm does not, q stands for the temperature, and an arm at rest shows the loss, too. `linear`
    says where both lose as much: of the choices, near ambient, where wires transform, or halfway.

    The recorded or assumed ambient temperature goes on counting as in a constant h.
    """

    id = 'heat_loss'
    sentence = 'The hotter the wire, the faster it gives off heat: it cools faster than a lag says.'
    equation = ('d(Vs^2)/dt = d1 (1 + growth Vs^2 / Vm^2) (V^2 - Vs^2), Vm the full drive and 1/d1 '
                'the time constant near ambient; where linear is not 0, d(Vs^2)/dt = d1 (n V^2 - '
                'Vs^2 - growth Vs^4 / (2 Vm^2)), n = 1 + growth (1 - linear) / 2')
    source = ('natural convection of horizontal cylinders: Churchill and Chu, Int. J. Heat Mass '
              'Transfer 18 (1975) 1049; radiation: Stefan-Boltzmann')
    shows_in = ('time since a step, against where it begins: faster from hot than into cold; where '
                'the bench lost heat otherwise, V at rest')
    experiment = ('steps down from full heat and from half of it, recorded faster than they '
                  'settle; at rest, a bench in the air of the arm')
    confused_with = ('thermal_lag', 'heating_cooling_asymmetry')
    replaces = ('thermal_lag',)
    parameters = (
        Parameter('time_constant', 's', 'time constant 1/d1 near ambient temperature', *LAGS, 0.0,
                  (0.5, 2.0, 6.0, 25.0), log=True),
        # Natural convection has 0.5 over the loop; radiation alone, from 20 to 120 degC, 1.4.
        Parameter('growth', '1', 'share by which the rate at full drive exceeds that near ambient',
                  0.05, 1.5, 0.0, (0.3, 1.0), log=True),
        Parameter('linear', '1', '0: the bench lost heat as the arm does; else it lost it in '
                  'proportion to the temperature, and as much as the arm at 1 - linear of the full '
                  'drive squared (1: near ambient)', 0.0, 1.0, 0.0, (0.0,),
                  choices=(0.0, 0.5, 0.65, 1.0), kinds=('arm',), form=True))

    # Such a loss shows at rest, too.
    needs_transients = False

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive heats the wire above its surroundings by what q stands for."""
        return surroundings.drive in ('voltage', 'current', 'power')

    def guesses(self, measured: np.ndarray) -> list[dict[str, float]]:
        """Begin also with a bench that lost heat in proportion, fast and slow."""
        return [{'time_constant': time, 'growth': 0.5, 'linear': linear}
                for time in (0.5, 4.0) for linear in (0.5, 0.65, 1.0)]

    def in_settled_rows(self) -> Effect:
        """Return the effect without its lag, and with a bench that lost heat in proportion."""
        choices = tuple(choice for one in self.parameters if one.name == 'linear'
                        for choice in one.choices if choice)
        return self.with_parameter('time_constant', kinds=()).with_parameter(
            'linear', choices=choices, starts=choices)

    def at_rest(self) -> Effect | None:
        """Return it without its lag, where it is the bench that lost heat in proportion."""
        return self.with_values(time_constant=0.0) if self.linear else None

    def _growth(self, surroundings: Surroundings) -> float:
        """Return the growth of the rate per unit of q."""
        return self.growth / (surroundings.full_drive_squared or 1.0)

    def _settles_at(self, drive_squared: Values, surroundings: Surroundings) -> Values:
        """Return q settled at a drive squared; below 0 nothing is heated, and all is linear."""
        if not self.linear:
            return drive_squared
        scaled = self._gain * drive_squared
        growth = self._growth(surroundings)
        return 2.0 * scaled / (1.0 + np.sqrt(1.0 + 2.0 * growth * np.maximum(scaled, 0.0)))

    def _settling_at(self, q: float, surroundings: Surroundings) -> float:
        """Return the drive squared at which q settles."""
        if not self.linear:
            return q
        return q * (1.0 + 0.5 * self._growth(surroundings) * max(q, 0.0)) / self._gain

    @property
    def _gain(self) -> float:
        return 1.0 + 0.5 * self.growth * (1.0 - self.linear)

    def _approaching(self, settled: Values, surroundings: Surroundings) -> tuple[Values, Values]:
        """
        Return rate [1/s] at q = 0, and its growth per unit of q, on the way to the q settled.

        As the loss is quadratic in q, ``dq/dt = d1 (1 + growth (q + settled) / (2 Vm^2))
        (settled - q)``.
        """
        rate, growth = min(self.rate(True), FASTEST), self._growth(surroundings)
        if not self.linear:
            return rate + 0.0 * settled, growth + 0.0 * settled
        faster = 1.0 + 0.5 * growth * np.maximum(settled, 0.0)
        return rate * faster, 0.5 * growth / faster

    def step(self, value: float, dt: float, phase: float, surroundings: Surroundings) -> float:
        """Advance by `dt` [s] towards where q settles at `value`."""
        q = self._cold(value, surroundings) if self._q is None else self._q
        self._q = self._after(q, float(self._settles_at(value, surroundings)), dt, surroundings)
        return self._q

    def forward(self, signal: np.ndarray, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Do what `step` does for a whole trial."""
        self.start()
        dt = np.ascontiguousarray(np.broadcast_to(inputs.dt, np.shape(signal)), float)
        settled = np.ascontiguousarray(self._settles_at(signal, surroundings), float)
        course = growing_lag(
            settled, dt, *self._approaching(settled, surroundings),
            float(self._cold(signal[0], surroundings)))
        self._q = float(course[-1])
        return course

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Return the input that brings q to `signal` in ``inputs.dt`` seconds."""
        return self._settling_at(self._aimed_at(signal, inputs.dt, surroundings), surroundings)

    def _aimed_at(self, signal: float, dt: float, surroundings: Surroundings) -> float:
        """Return the q to set out for, to be at `signal` in `dt` [s]."""
        q, rate = self._q, self.rate(True)
        if q is None or not 0.0 < dt < math.inf or rate == math.inf or q == signal:
            return signal
        # On its way the rate is nowhere less than here: its answer is as far or further.
        growth = self._growth(surroundings) * (0.5 if self.linear else 1.0)
        slowest = rate * (1.0 + growth * max(min(q, signal), 0.0))
        decay = math.exp(-slowest * dt)
        furthest = signal + (signal - q) * decay / max(1.0 - decay, LEAST_SHARE)

        def missing(settled: float) -> float:
            return self._after(q, settled, dt, surroundings) - signal
        lacking, beyond = missing(signal), missing(furthest)
        if lacking * beyond >= 0.0:
            return furthest
        return false_position(missing, (signal, lacking), (furthest, beyond),
                              TOLERANCE * (surroundings.full_drive_squared or 1.0))

    def _after(self, q: float, settled: float, dt: float, surroundings: Surroundings) -> float:
        if self.rate(True) == math.inf:
            return settled
        rate, growth = self._approaching(settled, surroundings)
        return float(approach(q, settled, float(rate), float(growth), dt))
