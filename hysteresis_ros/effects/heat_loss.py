# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Natural convection and radiation: the hotter the wire, the faster it gives its heat away."""

import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings, Values
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

    The recorded or assumed ambient temperature goes on counting as in a constant h.
    """

    id = 'heat_loss'
    sentence = 'The hotter the wire, the faster it gives off heat: it cools faster than a lag says.'
    equation = ('d(Vs^2)/dt = d1 (1 + growth Vs^2 / Vm^2) (V^2 - Vs^2), Vm the full drive and 1/d1 '
                'the time constant near ambient')
    source = ('natural convection of horizontal cylinders: Churchill and Chu, Int. J. Heat Mass '
              'Transfer 18 (1975) 1049; radiation: Stefan-Boltzmann')
    shows_in = 'time since a step, against where it begins: faster from hot than into cold'
    experiment = 'steps down from full heat and from half of it, recorded faster than they settle'
    confused_with = ('thermal_lag', 'heating_cooling_asymmetry')
    replaces = ('thermal_lag',)
    parameters = (
        Parameter('time_constant', 's', 'time constant 1/d1 near ambient temperature', *LAGS, 0.0,
                  (0.5, 2.0, 6.0, 25.0), log=True),
        # Natural convection has 0.5 over the loop; radiation alone, from 20 to 120 degC, 1.4.
        Parameter('growth', '1', 'share by which the rate at full drive exceeds that near ambient',
                  0.05, 1.5, 0.0, (0.3, 1.0), log=True),)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive heats the wire above its surroundings by what q stands for."""
        return surroundings.drive in ('voltage', 'current', 'power')

    def _growth(self, surroundings: Surroundings) -> float:
        """Return the growth of the rate per unit of q."""
        return self.growth / (surroundings.full_drive_squared or 1.0)

    def step(self, value: float, dt: float, phase: float, surroundings: Surroundings) -> float:
        """Advance by `dt` [s] towards `value`."""
        q = self._cold(value, surroundings) if self._q is None else self._q
        self._q = self._after(q, value, dt, surroundings)
        return self._q

    def forward(self, signal: np.ndarray, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Do what `step` does for a whole trial."""
        self.start()
        dt = np.ascontiguousarray(np.broadcast_to(inputs.dt, np.shape(signal)), float)
        course = growing_lag(
            np.ascontiguousarray(signal, float), dt, min(self.rate(True), FASTEST),
            self._growth(surroundings), float(self._cold(signal[0], surroundings)))
        self._q = float(course[-1])
        return course

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Return the input that brings q to `signal` in ``inputs.dt`` seconds."""
        q, rate = self._q, self.rate(True)
        if q is None or not 0.0 < inputs.dt < math.inf or rate == math.inf or q == signal:
            return signal
        # On its way the rate is nowhere less than here: its answer is as far or further.
        slowest = rate * (1.0 + self._growth(surroundings) * max(min(q, signal), 0.0))
        decay = math.exp(-slowest * inputs.dt)
        furthest = signal + (signal - q) * decay / max(1.0 - decay, LEAST_SHARE)

        def missing(value: float) -> float:
            return self._after(q, value, inputs.dt, surroundings) - signal
        lacking, beyond = missing(signal), missing(furthest)
        if lacking * beyond >= 0.0:
            return furthest
        return false_position(missing, (signal, lacking), (furthest, beyond),
                              TOLERANCE * (surroundings.full_drive_squared or 1.0))

    def _after(self, q: float, value: float, dt: float, surroundings: Surroundings) -> float:
        rate = self.rate(True)
        if rate == math.inf:
            return value
        return float(approach(q, value, rate, self._growth(surroundings), dt))
