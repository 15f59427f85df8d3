# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects on the heat balance of Eq. 1, ``dT/dt = -d1 (T - T0) + d2 V^2``.

They work on the drive squared: in the steady-state voltage squared ``q = Vs^2 = (d1/d2) (T - T0)``
Eq. 1 reads ``dq/dt = d1 (V^2 - q)``. For a drive that is itself a temperature, pressure or power, q
is the drive.

They act in this order: the heat transfer divides what comes in, the lags follow, and what the air
adds (`ambient`) comes last, because it changes slowly and the wire is in balance with it.
"""

from collections.abc import Sequence
import math

import numpy as np

from hysteresis_ros.effects.base import Effect, Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.stages import DriveEffect
from hysteresis_ros.kernels.lag import lag
from hysteresis_ros.kernels.latent import phase_along_branches


# A rate [1/s] that stands for one without bound, which times no time would be no number.
FASTEST = 1e12
# Time constants [s] of muscles, from a thin wire in water to a thick one in still air, a polymer
# thread or a long bladder behind a small valve.
LAGS = 0.03, 150.0


class ThermalEffect(DriveEffect):
    """An effect on the drive squared that the muscle feels."""

    stage = 'thermal'


class Airflow(ThermalEffect):
    """A fan or a draught changes how well the wire is cooled."""

    id = 'airflow'
    sentence = 'More or less air over the wire changes what a voltage heats, and how fast.'
    equation = 'd1 -> beta d1: Vs^2 = V^2 / beta'
    source = 'Eq. 1 of the paper: d1 is proportional to the heat transfer coefficient'
    shows_in = 'V, and the time constant'
    experiment = 'switch the fan and watch gain and time constant change together'
    confused_with = ('supply_sag',)
    parameters = (
        Parameter('beta', '1', 'heat transfer over that of the bench', 0.5, 3.0, 1.0,
                  (0.8, 0.96, 1.04, 1.3), log=True),)

    @property
    def exchange(self) -> float:    # type: ignore[override]
        """Heat transfer over that of the bench, which the lags follow."""
        return self.beta

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Divide the drive squared by the better cooling."""
        return signal / self.beta

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Multiply it again."""
        return signal * self.beta


class FirstOrderLag(ThermalEffect):
    """
    Shared by the effects with the dynamics of Eq. 1; the exact solution over each interval.

    The input is held constant from one row to the next, as a board holds its setpoint.
    """

    needs_transients = True
    kinds = ('arm', 'bench')

    memory = ('_q', '_phase')

    # The drive squared that the muscle feels, and the last phase known; None before a trial.
    _q: float | None
    _phase: float | None

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether there is heat that has to come and go; of pressure see `valve_lag`."""
        return surroundings.drive != 'pressure'

    # Without a chain the heat is exchanged as on the bench.
    speed = 1.0
    # How much larger the heat capacity counts, where a controller takes latent heat for that.
    slowing = 1.0

    @property
    def present(self) -> float:
        """Drive squared that the muscle feels at present."""
        return 0.0 if self._q is None else self._q

    def rate(self, rising: bool) -> float:
        """Return d1 [1/s] while q rises or falls, infinite without a lag."""
        if self.time_constant <= 0.0:
            return math.inf
        return self.speed / (self.slowing * self.time_constant)

    def extremes(self, margin: float) -> list[Effect]:
        """
        Return the same lag at both ends of what its time constant may be, the faster one first.

        They are those of its interval, and at least a share `margin` from the value.
        """
        return self._extremes(('time_constant',), margin)

    def _extremes(self, names: Sequence[str], margin: float) -> list[Effect]:
        ends: dict[str, tuple[float, float]] = {}
        for name in names:
            value = self.values[name]
            low, high = self.intervals.get(name, (value, value))
            low, high = min(low, (1.0 - margin) * value), max(high, (1.0 + margin) * value)
            if value > 0.0 and low < high:
                ends[name] = max(low, 1e-3 * value), high
        return [self.with_values(**{name: pair[side] for name, pair in ends.items()})
                for side in (0, 1)] if ends else []

    def start(self) -> None:
        """Forget the past: q is that of the cold state."""
        self._q = None
        self._phase = None

    def step(self, value: float, dt: float, phase: float, surroundings: Surroundings) -> float:
        """Advance Eq. 1 by `dt` [s] towards `value`."""
        q = self._cold(value, surroundings) if self._q is None else self._q
        before = phase if self._phase is None else self._phase
        if math.isfinite(phase):
            self._phase = phase
        self._q = (value + (q - value) * self._decay(value > q, dt)
                   + float(self._released(before, phase, dt, surroundings)))
        return self._q

    @staticmethod
    def _cold(value: float, surroundings: Surroundings) -> float:
        """Return q before a trial: 0, or the first one where that is a temperature."""
        return value if surroundings.drive == 'temperature' else 0.0

    def _released(self, before: Values, phase: Values, dt: Values, surroundings: Surroundings
                  ) -> Values:
        """Return what changing from the phase `before` within `dt` [s] adds to q."""
        return np.zeros(np.shape(phase))

    def forward(self, signal: np.ndarray, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Do what `step` does for a whole trial."""
        self.start()
        times, phases = (np.ascontiguousarray(np.broadcast_to(column, np.shape(signal)), float)
                         for column in (inputs.dt, inputs.phase))
        released = self._released(
            np.concatenate((phases[:1], phases[:-1])), phases, times, surroundings)
        up, down = (min(self.rate(rising), FASTEST) for rising in (True, False))
        course = lag(np.ascontiguousarray(signal, float), times, up, down, released,
                     float(self._cold(signal[0], surroundings)))
        self._q, self._phase = float(course[-1]), float(phases[-1])
        return course

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Return the input that brings q to `signal` in ``inputs.dt`` seconds."""
        if self._q is None or not 0.0 < inputs.dt < math.inf:
            return signal
        decay = self._decay(signal > self._q, inputs.dt)
        return signal + (signal - self._q) * decay / max(1.0 - decay, 1e-3)

    def _decay(self, rising: bool, dt: float) -> float:
        """Return the share of the distance to the input that remains after `dt` [s]."""
        rate = self.rate(rising)
        if rate == math.inf:
            return 0.0
        return math.exp(-rate * dt)


class ThermalLag(FirstOrderLag):
    """The wire takes time to heat and to cool."""

    id = 'thermal_lag'
    sentence = 'The wire needs time to warm up and to cool down: it lags behind the voltage.'
    equation = 'd(Vs^2)/dt = d1 (V^2 - Vs^2), time constant 1/d1'
    source = 'Eq. 1 of the paper (time constant about 5 s)'
    shows_in = 'time since a step, dV/dt'
    experiment = 'fast steps, and the same ramp at several rates'
    confused_with = ('latency', 'viscous_friction', 'creep')
    parameters = (
        Parameter('time_constant', 's', 'time constant 1/d1 of Eq. 1', *LAGS, 0.0,
                  (0.08, 0.3, 1.2, 5.0, 20.0, 80.0), log=True),)


class HeatingCoolingAsymmetry(FirstOrderLag):
    """Heating and cooling have time constants of their own."""

    id = 'heating_cooling_asymmetry'
    sentence = 'The wire warms up at another rate than it cools down.'
    equation = 'as thermal_lag, with d1 (heating) = ratio * d1 (cooling)'
    source = ('Eq. 1 with d1 by direction (convection differs with the temperature); Dynalloy, '
              'Flexinol technical data: contraction and off time')
    shows_in = 'sign of dV/dt'
    experiment = 'steps up and down to the same voltage'
    confused_with = ('thermal_lag',)
    replaces = ('thermal_lag',)
    parameters = (
        Parameter('time_constant', 's', 'time constant while cooling', *LAGS, 0.0,
                  (0.5, 2.0, 5.0, 25.0), log=True),
        # A data sheet's wire contracts in a third to a fifth of the time that it takes to relax.
        Parameter('ratio', '1', 'rate of heating over rate of cooling', 0.2, 5.0, 1.0,
                  (0.6, 1.4, 3.0), log=True),)

    def rate(self, rising: bool) -> float:
        """Return d1 [1/s] by direction."""
        return super().rate(rising) * (self.ratio if rising else 1.0)


class LatentHeat(FirstOrderLag):
    """Transforming takes up and gives off heat."""

    id = 'latent_heat'
    sentence = 'While the wire transforms, the latent heat slows its temperature down.'
    equation = 'dq/dt = d1 (V^2 - q) + h qmax dxi/dt, xi the martensite share'
    source = 'heat balance with the enthalpy of transformation, about 24 kJ/kg'
    shows_in = 'slow parts inside the loop only'
    experiment = 'small steps in and out of the loop'
    confused_with = ('thermal_lag',)
    replaces = ('thermal_lag',)
    needs_phase = True
    parameters = (
        Parameter('time_constant', 's', 'time constant 1/d1 outside the transformation', *LAGS,
                  0.0, (0.5, 2.0, 5.0, 25.0), log=True),
        Parameter('latent', '1', 'h: latent heat over the heat stored at full drive', 0.05, 1.0,
                  0.0, (0.2, 0.5), log=True),)

    def _released(self, before: Values, phase: Values, dt: Values, surroundings: Surroundings
                  ) -> Values:
        """Return the latent heat in units of q; nothing where the phase is not known."""
        heat = np.nan_to_num(self.latent * surroundings.full_drive_squared * (phase - before))
        return self._share_kept(dt) * heat

    def _share_kept(self, dt: Values) -> Values:
        """Return the share of the heat released within `dt` [s] that is there at its end."""
        # It comes evenly over the time and is lost to the air as all heat is.
        lost = np.maximum(dt * min(self.rate(True), FASTEST), 1e-12)
        return -np.expm1(-lost) / lost

    def agreeing_phase(self, phase: np.ndarray, caused: np.ndarray, drive_squared: np.ndarray,
                       dt: np.ndarray, surroundings: Surroundings) -> np.ndarray:
        """
        Return the phase that agrees with the heat it releases, as far as one run shows it.

        Parameters
        ----------
        phase, caused : ndarray, shape (rows,)
            Share of martensite that the effects took in a run, and that the muscle then had.
        drive_squared, dt : ndarray, shape (rows,)
            What the muscle felt in this run, and the time since the row before [s].
        surroundings : Surroundings

        Returns
        -------
        ndarray, shape (rows,)
        """
        released = self.latent * surroundings.full_drive_squared * self._share_kept(dt)
        decay = np.exp(-dt * min(self.rate(True), FASTEST))
        return phase_along_branches(drive_squared, caused, phase, decay, released)
