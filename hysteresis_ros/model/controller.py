# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The inverse that drives the muscle: Eqs. 12 to 14, and every effect that can be undone."""

import copy
import math
from typing import NamedTuple

import numpy as np

from hysteresis_ros.bicep.geometry import Reference
from hysteresis_ros.effects import Inputs, Statics
from hysteresis_ros.effects.thermal import FirstOrderLag
from hysteresis_ros.errors import ParameterError, RangeError
from hysteresis_ros.model.chain import Chain

# Passes that settle an offset which depends on the drive that is being looked for.
DRIFT_PASSES = 3


class Setpoint(NamedTuple):
    """
    What to apply, and what to expect of it.

    Attributes
    ----------
    voltage : float
        Drive [V for a voltage], always finite and within the limits.
    saturated : bool
        Whether the reference is out of reach.
    expected : float
        Length [m] (or force [N]) that the model gives for this drive.
    error : float
        `expected` less the reference.
    reason : str
        Why it is saturated, else ''.
    """

    voltage: float
    saturated: bool
    expected: float
    error: float
    reason: str


class Controller:
    """
    The two-stage inverse with memory.

    Parameters
    ----------
    model : MuscleModel
        Operators, effects and geometry.
    voltage_limits : (float, float), optional
        Lowest and highest drive; by default what the bench has seen.
    dead_band : float
        A reversal of the length by less than this [m] is not followed: right after a reversal the
        inverse amplifies noise without bound.
    horizon : float
        Time [s] within which a lagging muscle is to reach its heat; it is overdriven meanwhile,
        within the limits. Call `hold` at least this often. Infinite: never overdriven.
    """

    def __init__(self, model, voltage_limits=None, dead_band: float = 0.0,
                 horizon: float = math.inf):
        self.model = model
        surroundings = model.surroundings
        self._chain = model.chain()
        self._steady = Chain([effect for effect in model.effects
                              if not isinstance(effect, FirstOrderLag)], surroundings)
        self._length = (model.require_length_stage() if model.length_stage is not None else None)
        self._first = model.first_stage(self._chain)
        self._force = copy.deepcopy(model.force_stage)
        self.limits = tuple(voltage_limits or model.ranges.get(model.drive, (0.0, math.inf)))
        self.dead_band = dead_band
        self.horizon = horizon
        self.reset()

    def reset(self) -> None:
        """Forget the history: the muscle was heated and cooled."""
        cold = self.model.cold_drive
        self._chain.start()
        self._steady.start()
        self._heat = float(self._chain.to_heat(cold))
        self._first.reset()
        x = self._first.step(self._heat)
        if self._length is not None:
            self._length.reset()
            self._cold = x
        if self._force is not None:
            self._force.reset()
            self._force.step(cold)
        self._fresh = True
        self._time = None
        self._voltage = cold
        self._travel = 0.0
        self._angle = None
        self._direction = 0.0
        self._target_heat = self._heat

    def save(self) -> dict:
        """Return the memory as plain types."""
        return {'first': self._first.save(),
                'length': self._length.save() if self._length is not None else None,
                'force': self._force.save() if self._force is not None else None,
                'fresh': self._fresh, 'voltage': self._voltage, 'travel': self._travel,
                'angle': self._angle, 'direction': self._direction}

    def restore(self, state: dict) -> None:
        """
        Take a saved memory back.

        Raises
        ------
        ParameterError
            If it was saved by another model.
        """
        self.reset()
        try:
            self._first.restore(state['first'])
            if self._length is not None:
                self._length.restore(state['length'])
            if self._force is not None:
                self._force.restore(state['force'])
            self._fresh = bool(state['fresh'])
            self._voltage, self._travel = float(state['voltage']), float(state['travel'])
            self._angle, self._direction = state['angle'], float(state['direction'])
        except (KeyError, TypeError, ValueError) as error:
            self.reset()
            raise ParameterError(f'saved memory does not fit the model ({error})') from None

    def reference(self, theta: float) -> Reference:
        """
        Elongation and force for a target angle [rad], effects of arm and sensor undone.

        Raises
        ------
        RangeError
            If the linkage cannot take the angle.
        """
        geometry = self.model.require_geometry()
        geometry.check_angle(theta)
        true = theta
        for effect in reversed(self._chain.sensor):
            true = effect.inverse(true)
        geometry.check_angle(true)
        grid = np.array([true])
        statics = Statics(grid, geometry.length(grid), geometry.moment_arm(grid),
                          geometry.load_moment(grid))
        for effect in self._chain.mechanism:
            statics = effect.forward(statics, geometry)
        leverage = geometry.muscle_count * float(statics.moment_arm[0])
        if leverage <= 0.0:
            raise RangeError(f'target angle {theta:.4f} rad lies beyond a dead centre of the arm')
        friction = sum(effect.resistance()[0] for effect in self._chain.mechanism)
        if self._angle is not None and true != self._angle:
            self._direction = math.copysign(1.0, true - self._angle)
        self._angle = true
        moment = float(statics.moment[0]) - self._direction * friction
        return Reference(float(statics.length[0]), max(moment / leverage, 0.0))

    def force_setpoint(self, force: float, commit: bool = True) -> Setpoint:
        """Return the drive for a force [N] at resting length (Eq. 12)."""
        if self._force is None:
            raise ParameterError('the model has no force stage; identify it with --force F.csv')
        found = self._force.invert(force)
        inputs = self._inputs(0.0, 1.0, math.nan)
        drive, clipped = self._clip(self._steady.inverse(
            float(self._chain.to_heat(found.input)), inputs))
        applied = float(self._chain.to_drive(self._steady.step(drive, inputs)))
        expected = self._force.step(applied) if commit else self._force.peek(applied)
        saturated = found.saturated or clipped
        low, high = self._force.output_range
        reason = (f'force {force:.4g} N is outside {low:.4g} to {high:.4g} N or beyond the drive '
                  'limits' if saturated else '')
        return Setpoint(drive, saturated, expected, expected - force, reason)

    def setpoint(self, length: float, force: float, time: float | None = None,
                 commit: bool = True, ambient: float = math.nan) -> Setpoint:
        """
        Return the drive for an elongation under a force (Eqs. 13 and 14).

        Parameters
        ----------
        length : float
            Reference L_d [m].
        force : float
            Reference F_d of one muscle [N].
        time : float, optional
            When it is applied [s]; needed where the model has a lag.
        commit : bool
            Whether it will be applied, so that the memory has to follow.
        ambient : float
            Ambient temperature [degC], NaN if unknown.

        Returns
        -------
        Setpoint
            Nearest possible drive; saturated if the reference is out of reach or not finite.
        """
        if self._length is None:
            raise ParameterError('the model has no length stage; identify it with a length table')
        if not (math.isfinite(length) and math.isfinite(force)):
            return Setpoint(self._voltage, True, math.nan, math.nan,
                            'the reference is not a finite number')
        self._advance(time)
        operator, sign = self._length, self.model.sign
        loaded = self._first.loaded
        inside = float(self._chain.load_inside(np.float64(force))) if loaded else 0.0
        if self._fresh:
            # The cold muscle lengthens under the load before it is first driven.
            operator.reset()
            operator.step(sign * (self._cold - inside))
        base = operator.output_range[0]
        scale = float(self._chain.scale(np.float64(force)))
        stretch = float(self._chain.stretch(np.float64(force)))
        offset, factor = self._drift(self._heat)
        for _ in range(DRIFT_PASSES if self._chain.material else 1):
            wanted = base + (length - base - stretch - offset) / (scale * factor)
            found = operator.invert(wanted, dead_band=self.dead_band)
            heat, _, first_saturated = self._first.invert(sign * found.input + inside)
            if not self._chain.material:
                break
            offset, factor = self._drift(heat)
        low, high = operator.output_range
        phase = (found.output - low) / max(high - low, 1e-12)
        inputs = self._inputs(0.0, min(max(phase, 0.0), 1.0), ambient)
        steady, clipped = self._clip(self._steady.inverse(heat, inputs))
        heat = self._steady.step(steady, inputs)
        u = sign * (self._first.peek(heat) - inside)
        output = operator.peek(u)
        expected = base + scale * factor * (output - base) + stretch + offset
        drive, _ = self._clip(self._chain.inverse(
            heat, inputs._replace(step=self.horizon))) if math.isfinite(self.horizon) else (
                steady, False)
        saturated = found.saturated or first_saturated or clipped
        if commit:
            self._first.step(heat)
            operator.step(u)
            self._fresh = False
            self._travel += abs(steady - self._voltage)
            self._voltage, self._heat, self._target_heat = drive, heat, heat
        reason = ''
        if saturated:
            limits = f'{self.limits[0]:.4g} to {self.limits[1]:.4g}'
            reason = (f'length {1e3 * length:.3f} mm under {force:.3f} N is out of reach within '
                      f'{limits} {self.model.drive}; expected {1e3 * expected:.3f} mm')
        return Setpoint(drive, saturated, expected, expected - length, reason)

    def hold(self, time: float) -> float:
        """
        Return the drive that keeps the last reference, without touching the memory.

        It differs from the last setpoint's only while a lagging muscle is being overdriven.
        """
        self._advance(time)
        if math.isfinite(self.horizon) and not self._fresh:
            inputs = self._inputs(self.horizon, math.nan, math.nan)
            self._voltage, _ = self._clip(self._chain.inverse(self._target_heat, inputs))
        return self._voltage

    def _advance(self, time) -> None:
        if time is None:
            return
        if self._time is not None and time > self._time:
            self._chain.step(self._voltage, self._inputs(time - self._time, math.nan, math.nan))
        elif self._time is None:
            self._chain.step(self._voltage, self._inputs(0.0, math.nan, math.nan))
        self._time = time

    def _inputs(self, step, phase, ambient) -> Inputs:
        low, high = self.model.ranges.get(self.model.drive, (0.0, 1.0))
        cycles = self._travel / (2.0 * max(high - low, 1e-12))
        return Inputs(0.0, 0.0, step, ambient, phase, cycles)

    def _drift(self, heat) -> tuple[float, float]:
        inputs = self._inputs(np.zeros(1), math.nan, math.nan)
        inputs = inputs._replace(time=np.zeros(1), cycles=np.array([inputs.cycles]))
        offset, factor = self._chain.drift(np.array([self._voltage]), np.array([heat]), inputs)
        return float(offset[0]), float(factor[0])

    def _clip(self, drive: float) -> tuple[float, bool]:
        low, high = self.limits
        if not math.isfinite(drive):
            return self._voltage, True
        margin = 1e-9 * max(abs(low), abs(high), 1e-12) if math.isfinite(high) else 0.0
        clipped = min(max(drive, low), high)
        return clipped, abs(clipped - drive) > margin
