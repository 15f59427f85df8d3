# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Limits of what a muscle stands: its heat, its time at full heat, and heating without an angle.

The wire's temperature is estimated by the law of the paper (Eq. 1), as it was identified,

    tau dT/dt = T0 - T + gain V^2

and its heating power, which is V^2 over its resistance, by a running mean of V^2. Both limits lower
the voltage before they are passed; what cannot be cured by a lower voltage is a fault, and the
output has to stay off until a person has looked. Pure computation: time, voltages and angles come
from the caller.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from hysteresis_ros.errors import ParameterError

if TYPE_CHECKING:
    from hysteresis_ros.bridge.board_state import Sample

AHEAD = 0.5             # s that the limits look ahead, longer than a setpoint goes uncorrected
FULL_HEAT = 0.95        # share of the largest voltage from which it is full heat
WARMEST_AMBIENT = 40.0  # degC, taken where nobody measures it
COLD = 5.0              # K above ambient up to which the muscle counts as cold
STILL = 0.01            # rad, 13 counts of the AMT103: less is no motion
WRONG_WAY = 0.07        # rad that a muscle which is heated from cold may lengthen
OFF_MOTION = 0.3        # rad that the arm may lift when nothing heats it, such as by swinging
OFF_WATCH = 12.0        # thermal time constants for which that is watched; later, a hand may do it
# How a bench is heated on which nothing moves.
WITHOUT_ARM = 'set encoder_check to false where there is no arm'


@dataclasses.dataclass(frozen=True)
class Limits:
    """
    What the muscle stands. Each 0 or False switches its limit off.

    Parameters
    ----------
    maximum_voltage : float
        Largest voltage in V, for what full heat is and how steep a soft start.
    rms_voltage : float
        Largest RMS in V of the voltage, the limit of the mean heating power.
    rms_window : float
        Time in s over which that is taken, as the time constant of a running mean.
    maximum_temperature : float
        Largest estimated temperature of the wire in degC.
    thermal_gain : float
        Temperature above ambient per square of the voltage in K/V^2, at rest.
    thermal_time_constant : float
        Time constant of warming and cooling in s.
    full_heat_time : float
        Longest time in s at 95 % of `maximum_voltage` or more.
    soft_start_time : float
        Time in s in which the voltage may rise from off to `maximum_voltage`.
    encoder_check : bool
        Whether heating needs an angle that can be believed and that follows the heat.
    motion_temperature_rise : float
        Estimated temperature above ambient in K at which a muscle heated from cold has moved.
    angle_latency : float
        Time in s by which the angle may come late: so long after heating, a lift shows no fault.

    Raises
    ------
    ParameterError
        If a value makes no sense.

    """

    maximum_voltage: float = 6.0
    rms_voltage: float = 6.5
    rms_window: float = 60.0
    maximum_temperature: float = 150.0
    thermal_gain: float = 2.7
    thermal_time_constant: float = 5.0
    full_heat_time: float = 1800.0
    soft_start_time: float = 0.2
    encoder_check: bool = True
    motion_temperature_rise: float = 60.0
    angle_latency: float = 0.0

    def __post_init__(self) -> None:
        """Check the values."""
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f'{field.name} {value:g}: a number of at least 0')
        for name in ('maximum_voltage', 'rms_window', 'thermal_gain', 'thermal_time_constant',
                     'motion_temperature_rise'):
            if getattr(self, name) == 0.0:
                raise ParameterError(f'{name} 0: it has to be positive')
        if 0.0 < self.maximum_temperature <= WARMEST_AMBIENT:
            raise ParameterError(f'maximum_temperature {self.maximum_temperature:g} degC: above '
                                 f'{WARMEST_AMBIENT:g} degC, or 0 for no limit')


class RunningMean:
    """
    Running mean of the voltage's square, a first-order lag.

    Parameters
    ----------
    time_constant : float
        In s.

    Attributes
    ----------
    value : float
        In V^2.

    """

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self.value = 0.0

    def advance(self, duration: float, square: float) -> None:
        """Let `duration` s pass with a voltage whose square in V^2 is constant."""
        self.value += (square - self.value) * -math.expm1(-duration / self._time_constant)

    def allowed(self, most: float, duration: float) -> float:
        """Return the square in V^2 that keeps `value` below `most` for `duration` s."""
        share = -math.expm1(-duration / self._time_constant)
        return max(self.value + (most - self.value) / share, 0.0)


class Protection:
    """
    Watches what the board applies, and says what it may be asked for.

    Parameters
    ----------
    limits : Limits
        What the muscle stands.

    Attributes
    ----------
    limits : Limits
        May be replaced by others with the same time constants.

    """

    def __init__(self, limits: Limits = Limits()) -> None:
        self.limits = limits
        self._heat = RunningMean(limits.thermal_time_constant)
        self._power = RunningMean(limits.rms_window)
        self._time: float | None = None
        self._ambient = WARMEST_AMBIENT
        self._full = 0.0                        # s at full heat
        self._start: float | None = None        # when the voltage left zero
        self._anchor: float | None = None       # that angle, while its motion is to be watched
        self._off_since: float | None = None    # when it was last heated
        self._highest = -math.inf               # angle since then
        self._cold: float | None = None         # angle when the muscle was last cold
        self._doubts = 0                        # samples in a row that were not believed

    @property
    def temperature(self) -> float:
        """Estimated temperature of the wire in degC."""
        return self._ambient + self._rise

    @property
    def rms(self) -> float:
        """RMS of the voltage in V."""
        return math.sqrt(self._power.value)

    @property
    def full_heat(self) -> float:
        """Time at full heat in s; cooler times count it down again."""
        return self._full

    @property
    def _rise(self) -> float:
        return self.limits.thermal_gain * self._heat.value

    def clear(self) -> None:
        """Clear what is a fault until somebody has looked. The heat stays."""
        self._full = 0.0
        self._anchor = self._cold = None
        self._off_since = None

    def begin_softly(self) -> None:
        """Take note that nothing is asked for: the next start is a soft one."""
        self._start = None

    def limit(self, voltage: float, time: float, ramp_dt: float = 0.0,
              ahead: float = AHEAD) -> tuple[float, str, bool]:
        """
        Lower a voltage to what the muscle stands.

        Parameters
        ----------
        voltage : float
            Voltage in V that is asked for.
        time : float
            Board time in s.
        ramp_dt : float
            Time in s until the next call during a soft start.
        ahead : float
            Longest time in s until the next call otherwise; `AHEAD` at least.

        Returns
        -------
        float
            Voltage in V, at most `voltage`.
        str
            Why it is less, or ''.
        bool
            Whether it is less because of a soft start, so that the next call shall come soon.

        """
        limits, reason, ahead = self.limits, '', max(ahead, AHEAD)
        if voltage == 0.0:
            self.begin_softly()
            return voltage, '', False
        hottest = strongest = math.inf
        if limits.maximum_temperature:
            rise = limits.maximum_temperature - self._ambient
            hottest = self._most(self._heat, rise / limits.thermal_gain, ahead)
        if limits.rms_voltage:
            strongest = self._most(self._power, limits.rms_voltage ** 2, ahead)
        if min(hottest, strongest) < voltage:
            reason = (f'estimated temperature {self.temperature:.0f} degC, '
                      f'{limits.maximum_temperature:g} degC allowed (maximum_temperature)'
                      if hottest <= strongest else
                      f'RMS voltage {self.rms:.2f} V, {limits.rms_voltage:g} V allowed over '
                      f'{limits.rms_window:g} s (rms_voltage_limit)')
            reason = f'{voltage:g} V asked, {min(hottest, strongest):.3g} V given: {reason}'
            voltage = min(hottest, strongest)
        if self._start is None:
            self._start = time
        if limits.soft_start_time:
            ramp = limits.maximum_voltage * (time - self._start + ramp_dt) / limits.soft_start_time
            if ramp < voltage:
                return max(ramp, 0.0), reason, True
        return voltage, reason, False

    def observe(self, sample: Sample) -> str:
        """
        Take one sample of telemetry.

        Parameters
        ----------
        sample : Sample
            What the board measures and applies.

        Returns
        -------
        str
            Why the output has to be switched off until a person has looked, or ''.

        """
        time = sample.time
        passed = 0.0 if self._time is None else max(time - self._time, 0.0)
        self._time = time
        if sample.ambient is not None and math.isfinite(sample.ambient):
            self._ambient = sample.ambient
        square = sample.voltage ** 2
        self._heat.advance(passed, square)
        self._power.advance(passed, square)
        full = sample.voltage >= FULL_HEAT * self.limits.maximum_voltage
        self._full = max(self._full + (passed if full else -passed), 0.0)
        if self.limits.full_heat_time and self._full > self.limits.full_heat_time:
            return (f'full heat for {self._full:.0f} s, {self.limits.full_heat_time:g} s are '
                    'allowed (full_heat_time)')
        if not self.limits.encoder_check:
            return ''
        self._doubts = 0 if sample.fresh else self._doubts + 1
        if sample.encoder_fault and self._doubts != 1 and sample.enabled:
            return f'{sample.encoder_fault} (encoder_check)'
        if 'encoder' in sample.faults and sample.enabled:
            return f'the encoder is not connected; connect it, or {WITHOUT_ARM}'
        return self._follows_heat(sample) or self._follows_off(sample)

    @staticmethod
    def _most(mean: RunningMean, square: float, ahead: float) -> float:
        return math.sqrt(mean.allowed(max(square, 0.0), ahead))

    def _follows_heat(self, sample: Sample) -> str:
        """Return what is wrong with an angle that does not follow the heat."""
        if self._rise <= COLD or self._anchor is None:
            self._anchor = sample.angle if self._rise <= COLD else None
            if sample.voltage > 0.0 and self._cold is None:
                self._cold = self._anchor
            return ''
        turned = sample.angle - self._anchor
        if sample.voltage > 0.0 and turned > WRONG_WAY:
            return (f'the angle grew by {turned:.2f} rad while the muscle was heated: the encoder '
                    'counts the wrong way, or something pulls the arm; check encoder_direction '
                    '(encoder_check)')
        if self._rise > self.limits.motion_temperature_rise:
            self._anchor = None     # it need not be watched any more, until it is cold again
            if abs(turned) <= STILL:
                return ('heated, and the angle stands still: the encoder is not connected, or the '
                        f'muscle does not pull; check both, or {WITHOUT_ARM}')
        return ''

    def _follows_off(self, sample: Sample) -> str:
        """Return what is wrong with an arm that lifts while nothing heats it."""
        if sample.voltage > 0.0:
            self._off_since, self._highest = sample.time, -math.inf
            return ''
        if self._off_since is None:
            return ''
        if sample.time - self._off_since > OFF_WATCH * self.limits.thermal_time_constant:
            self._off_since, cold, self._cold = None, self._cold, sample.angle
            if cold is None or sample.angle > cold - OFF_MOTION:
                return ''
            return (f'the arm is still {cold - sample.angle:.2f} rad above its cold place long '
                    'after the duty went to 0: a MOSFET may be stuck on, cut the supply '
                    '(encoder_check)')
        if sample.time - self._off_since <= self.limits.angle_latency:
            return ''
        self._highest = max(self._highest, sample.angle)
        if sample.angle > self._highest - OFF_MOTION:
            return ''
        return (f'the arm lifts by {self._highest - sample.angle:.2f} rad while the duty is 0: a '
                'MOSFET may be stuck on, cut the supply; an angle that comes late looks the same, '
                'see angle_latency (encoder_check)')
