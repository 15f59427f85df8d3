# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The inverse that drives the muscle: Eqs. 12 to 14, and every effect that can be undone."""

from __future__ import annotations

from collections.abc import Mapping
import copy
import math
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np

from hysteresis_ros.bicep.geometry import Reference
from hysteresis_ros.effects import Inputs
from hysteresis_ros.effects.thermal import FirstOrderLag, LatentHeat
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.length_inverse import LengthInverse, Outcome, PHASE_PASSES
from hysteresis_ros.model.pacing import Pacing
from hysteresis_ros.model.targets import Targets
from hysteresis_ros.model.trials import HOLD

if TYPE_CHECKING:
    from hysteresis_ros.model.muscle import MuscleModel

# A reference that is missed by less than this share of the range is reached: the tables of the arm
# are about as exact.
REACHED = 1e-6


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
        Length [m] (or force [N]) that the model gives for this drive; NaN if the reference is no
        number.
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

    Effects that cannot be undone (drifts of the room, creep, latency) are left out, so that a
    controller is never wrong by an effect that it only half knows.

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
        Time [s] within which a lagging muscle is to reach its temperature; it is overdriven
        meanwhile, within the limits, and most in the first part of that time. Call `hold` evenly,
        the more often the better, and at least once within it. Infinite: never overdriven.
    arm : bool
        Whether the muscle lifts the model's arm, whose load it bears while it is cold. Else it
        bears the first reference's force, as on the bench. Calling `reference` says so, too.
    lag_margin : float
        Share, 0 to less than 1, by which the muscle's time constant may differ from the model's,
        if its interval does not say more. Nothing inside is overdriven beyond its temperature; what
        is slower than the fastest then comes later. 0: the model's own muscle arrives exactly. With
        a margin m it lacks at least about m of a step by then, and has come within a share s of it
        after log(m / s) / log(1 / s) of the time that it takes by itself: half for m = sqrt(s).
    rate_limit : float
        Largest change of the drive a second, where times are given; the rest of the way is done by
        the calls of `hold`. It must be positive.
    angle_dead_band : float
        Where friction or backlash is undone, targets that turn round by up to this [rad] are not
        followed: noise would swing the drive by all that is undone.

    Raises
    ------
    ParameterError
        If the limits make no sense, or one of the last three does not.
    """

    # Only of a model with a length stage, and of one with an arm.
    _length: LengthInverse
    _targets: Targets

    def __init__(self, model: MuscleModel, voltage_limits: tuple[float, float] | None = None,
                 dead_band: float = 0.0, horizon: float = math.inf, arm: bool = False,
                 lag_margin: float = 0.3, rate_limit: float = math.inf,
                 angle_dead_band: float = 1e-3) -> None:
        self.model = model
        low, high = voltage_limits or model.ranges.get(model.drive, (0.0, math.inf))
        self.limits = low, high
        if not self.limits[0] < self.limits[1]:
            raise ParameterError(f'the drive limits {self.limits} have to be a lower and an upper')
        if not 0.0 <= lag_margin < 1.0:
            raise ParameterError(f'lag_margin is {lag_margin}; it has to be from 0 to below 1')
        self.dead_band = dead_band
        usable = [effect for effect in model.effects
                  if effect.invertible or effect.stage in ('mechanism', 'sensor')]
        # What the transformation takes up on the way is known only when it is over: the lag counts
        # as a longer one meanwhile.
        latent = sum(effect.latent for effect in usable if isinstance(effect, LatentHeat))
        usable = [effect.with_values(latent=0.0) if isinstance(effect, LatentHeat) else effect
                  for effect in usable]
        self._chain = Chain(usable, model.surroundings)
        at_rest = [effect.at_rest() for effect in usable]
        self._steady = Chain([effect for effect in at_rest if effect is not None],
                             model.surroundings)
        self._first = model.first_stage(self._chain)
        self._force = copy.deepcopy(model.force_stage)
        self._pacing = Pacing(
            [self._chain, *_with_other_lags(model, self._chain, lag_margin)], self._clip,
            self._inputs, horizon, rate_limit, latent * model.surroundings.full_drive_squared)
        if model.length_stage is not None:
            self._length = LengthInverse(model, self._chain, self._steady, self._first,
                                         self._pacing, self.limits, self._clip)
        if model.geometry is not None:
            self._targets = Targets(model.geometry, self._chain, lambda: self._at_rest()[0])
        self.rate_limit = rate_limit
        self.angle_dead_band = angle_dead_band
        self._rest: tuple[float, np.ndarray] | None = None
        self._arm = arm
        self.reset()

    @property
    def horizon(self) -> float:
        """Time [s] within which a lagging muscle is to reach its temperature."""
        return self._pacing.horizon

    @horizon.setter
    def horizon(self, value: float) -> None:
        self._pacing.horizon = value

    @property
    def angle_dead_band(self) -> float:
        """Turn of the target [rad] up to which friction and backlash keep their direction."""
        return self._angle_dead_band

    @angle_dead_band.setter
    def angle_dead_band(self, value: float) -> None:
        if not 0.0 <= value < math.inf:
            raise ParameterError(f'angle_dead_band is {value}; it has to be 0 or more')
        self._angle_dead_band = value
        for effect in self._chain.sensor:
            effect.dead_band = value
        if self.model.geometry is not None:
            self._targets.dead_band = value

    @property
    def rate_limit(self) -> float:
        """Largest change of the drive a second."""
        return self._pacing.rate_limit

    @rate_limit.setter
    def rate_limit(self, value: float) -> None:
        if not value > 0.0:
            raise ParameterError(f'rate_limit is {value}; it has to be positive')
        self._pacing.rate_limit = value

    def reset(self) -> None:
        """Forget the history: the muscle was heated and cooled. What has worn it stays."""
        cold = self.model.cold_drive
        self._chain.start()
        self._steady.start()
        drive_squared = float(self._chain.to_drive_squared(cold))
        self._first.reset()
        self._cold = self._first.step(drive_squared)
        if self.model.length_stage is not None:
            self._length.second.reset()
        if self._force is not None:
            self._force.reset()
            self._force.step(cold)
        if self.model.geometry is not None:
            self._targets.reset()
        self._pacing.reset(cold, drive_squared)
        self._fresh = True
        self._ambient: float | None = None
        self._supply: float | None = None
        # Time of the last setpoint, where it was given, and that since heating and cooling [s].
        self._time: float | None = None
        self._clock = 0.0

    def save(self) -> dict[str, Any]:
        """Return the memory as plain types, fit for JSON and YAML."""
        return {'first': self._first.save(),
                'second': (self._length.second.save() if self.model.length_stage is not None
                           else None),
                'force': self._force.save() if self._force is not None else None,
                'effects': [self._chain.save(), self._steady.save()],
                'targets': self._targets.save() if self.model.geometry is not None else {},
                'pacing': self._pacing.save(),
                'fresh': self._fresh, 'arm': self._arm, 'ambient': self._ambient,
                'supply': self._supply, 'time': self._time, 'clock': self._clock}

    def restore(self, state: Mapping[str, Any]) -> None:
        """
        Take a saved memory back.

        Raises
        ------
        ParameterError
            If it is damaged or was saved by another model; the memory stays as it was.
        """
        before = self.save()
        try:
            for name in ('ambient', 'supply', 'time', 'clock'):
                value = state.get(name)
                if value is not None and not math.isfinite(value):
                    raise ValueError(f'{name} is {value}')
            self._take(state)
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            self._take(before)
            raise ParameterError(f'saved memory does not fit the model ({error})') from None

    def _take(self, state: Mapping[str, Any]) -> None:
        self._first.restore(state['first'])
        if self.model.length_stage is not None:
            self._length.second.restore(state['second'])
        if self._force is not None:
            self._force.restore(state['force'])
        for chain, entry in zip((self._chain, self._steady), state['effects'], strict=True):
            chain.restore(entry)
        if self.model.geometry is not None:
            self._targets.restore(**state['targets'])
        self._pacing.restore(**state['pacing'])
        self._fresh, self._arm = bool(state['fresh']), bool(state['arm'])
        self._ambient, self._supply = state['ambient'], state.get('supply')
        self._time, self._clock = state.get('time'), float(state.get('clock') or 0.0)

    def reference(self, theta: float) -> Reference:
        """
        Elongation and force for a target angle, effects of arm and sensor undone.

        Friction and backlash make it depend on the target before, so call it once for each.

        Parameters
        ----------
        theta : float
            What the sensor is to measure [rad].

        Returns
        -------
        Reference
            Elongation [m], and tension [N] of one muscle.

        Raises
        ------
        RangeError
            If the arm cannot be held there; nothing is remembered of that target.
        ParameterError
            If the model has no arm.
        """
        self.model.require_geometry()
        found = self._targets.reference(theta)
        self._arm = True
        return found

    def _at_rest(self) -> tuple[float, np.ndarray]:
        """Angle of the cold arm, and what its muscles start from, shape (muscles, 5)."""
        if self._rest is None:
            balance = self.model.balance(self.model.chain())
            angle = balance.settle(self._cold)
            self._rest = angle, balance.muscles
        return self._rest

    def force_setpoint(self, force: float, commit: bool = True, ambient: float = math.nan,
                       supply: float = math.nan) -> Setpoint:
        """
        Return the drive for a force at resting length (Eq. 12).

        Parameters
        ----------
        force : float
            Reference F_d [N].
        commit : bool
            Whether it will be applied, so that the memory has to follow.
        ambient : float
            Ambient temperature [degC], NaN if unknown.
        supply : float
            Voltage of the supply [V], NaN if unknown.

        Returns
        -------
        Setpoint
            Nearest possible drive; saturated if the reference is out of reach or not finite.

        Raises
        ------
        ParameterError
            If the model has no force stage.
        """
        if self._force is None:
            raise ParameterError('the model has no force stage; identify it with --force F.csv')
        if not math.isfinite(force):
            return self._no_number()
        found = self._force.invert(force)
        low, high = self._force.output_range
        phase = (high - found.output) / max(high - low, 1e-12)
        inputs = self._inputs(0.0, phase, ambient, supply)
        drive, clipped = self._clip(self._steady.inverse(
            float(self._chain.to_drive_squared(found.input)), inputs))
        applied = float(self._chain.to_drive(self._steady.step(drive, inputs)))
        expected = self._force.step(applied) if commit else self._force.peek(applied)
        if commit:
            self._pacing.apply(drive)
        saturated = (found.saturated or clipped) and not (
            abs(expected - force) <= REACHED * (high - low))
        reason = (f'force {force:.4g} N is outside {low:.4g} to {high:.4g} N or beyond the drive '
                  'limits' if saturated else '')
        return Setpoint(drive, saturated, expected, expected - force, reason)

    def setpoint(self, length: float, force: float, time: float | None = None,
                 commit: bool = True, ambient: float = math.nan,
                 supply: float = math.nan) -> Setpoint:
        """
        Return the drive for an elongation under a force (Eqs. 13 and 14).

        Parameters
        ----------
        length : float
            Reference L_d [m].
        force : float
            Reference F_d of one muscle [N].
        time : float, optional
            When it is applied [s]; needed where a lagging muscle is to be overdriven.
        commit : bool
            Whether it will be applied, so that the memory has to follow.
        ambient : float
            Ambient temperature [degC], NaN if unknown.
        supply : float
            Voltage of the supply [V], NaN if unknown.

        Returns
        -------
        Setpoint
            Nearest possible drive; saturated if the reference is out of reach or not finite.

        Raises
        ------
        ParameterError
            If the model has no length stage.
        """
        if self.model.length_stage is None:
            raise ParameterError('the model has no length stage; identify it with a length table')
        if not (math.isfinite(length) and math.isfinite(force)):
            return self._no_number()
        if commit:
            return self._setpoint(length, force, time, ambient, supply)
        before = self.save()
        found = self._setpoint(length, force, time, ambient, supply)
        self._take(before)
        return found

    def _setpoint(self, length: float, force: float, time: float | None, ambient: float,
                  supply: float) -> Setpoint:
        self._pacing.advance(time)
        if self._fresh:
            # The cold muscle lengthens under its load before it is first driven.
            self._length.second.settle_cold(
                self._cold, force, self._at_rest()[1] if self._arm else None)
            self._pacing.rest(float(self.model.martensite(self._length.second.output)))
        inputs = self._inputs(
            self._since_setpoint(time), self._length.share(length, force), ambient, supply)
        drive, saturated, outcome, inputs = self._length.find(
            length, force, inputs._replace(time=self._clock), self.dead_band)
        if saturated:
            outcome, inputs = self._at_limit(drive, force, inputs)
        # At the ends of the drive a plateau, or rounding, may give just what was asked for.
        saturated = saturated and not (
            abs(outcome.length - length) <= REACHED * self._chain.surroundings.span)
        applied = self._commit(drive, outcome, inputs, time)
        reason = ''
        if saturated:
            limits = f'{self.limits[0]:.4g} to {self.limits[1]:.4g}'
            reason = (f'length {1e3 * length:.3f} mm under {force:.3f} N is out of reach within '
                      f'{limits} {self.model.drive}; expected {1e3 * outcome.length:.3f} mm')
        return Setpoint(applied, saturated, outcome.length, outcome.length - length, reason)

    def _since_setpoint(self, time: float | None) -> float:
        """Return the time [s] since the setpoint before; where it is not known, that of a hold."""
        since = HOLD
        if time is not None and math.isfinite(time):
            before = time if self._time is None else self._time
            since = max(time - before, 0.0)
            self._time = before + since
        self._clock += since
        return since

    def _at_limit(self, drive: float, force: float, inputs: Inputs) -> tuple[Outcome, Inputs]:
        """Say what a drive does that does not lead to the reference, under the load that it has."""
        for _ in range(PHASE_PASSES if self._chain.needs_phase else 1):
            if self._arm and self.model.geometry is not None:
                stopped = self._targets.stopped(
                    lambda tension: self._length.outcome(drive, tension, inputs).length)
                force = force if stopped is None else stopped.force
            if self._chain.needs_phase:
                inputs = inputs._replace(phase=self._length.outcome(drive, force, inputs).phase)
        return self._length.outcome(drive, force, inputs), inputs

    def _commit(self, drive: float, outcome: Outcome, inputs: Inputs, time: float | None) -> float:
        self._first.step(outcome.drive_squared)
        self._length.second.step(outcome.following)
        self._steady.advance(drive, outcome.drive_squared, self._length.worn(inputs, drive))
        self._fresh = False
        if math.isfinite(inputs.ambient):
            self._ambient = inputs.ambient
        if math.isfinite(inputs.supply):
            self._supply = inputs.supply
        self._pacing.begin(drive, outcome.drive_squared, inputs.phase, time)
        return self._pacing.drive

    def hold(self, time: float, ambient: float = math.nan, supply: float = math.nan) -> float:
        """
        Return the drive that keeps the last reference, without touching its memory.

        It differs from the last setpoint's only while a lagging muscle is being overdriven, which
        ends with the first call at the horizon or after it; on the way that the rate limit makes
        longer; and where the ambient temperature or the supply has changed.

        Parameters
        ----------
        time : float
            Now [s].
        ambient : float
            Ambient temperature [degC], NaN if unknown: then that of before counts.
        supply : float
            Voltage of the supply [V], likewise.
        """
        if self._fresh:
            self._pacing.advance(time)
            return self._pacing.drive
        steady = None
        known = self._ambient, self._supply
        if math.isfinite(ambient):
            self._ambient = ambient
        if math.isfinite(supply):
            self._supply = supply
        if (self._ambient, self._supply) != known:
            steady = self._clip(self._steady.inverse(
                self._pacing.drive_squared, self._inputs(0.0, self._pacing.phase)))[0]
        self._pacing.hold(time, steady)
        return self._pacing.drive

    def _inputs(self, dt: float, phase: float, ambient: float = math.nan,
                supply: float = math.nan) -> Inputs:
        if not math.isfinite(ambient) and self._ambient is not None:
            ambient = self._ambient
        if not math.isfinite(supply) and self._supply is not None:
            supply = self._supply
        return Inputs(0.0, 0.0, dt, ambient, phase, 0.0, supply)

    def _no_number(self) -> Setpoint:
        return Setpoint(self._clip(self._pacing.drive)[0], True, math.nan, math.nan,
                        'the reference is not a finite number')

    def _clip(self, drive: float) -> tuple[float, bool]:
        low, high = self.limits
        if not math.isfinite(drive):
            return min(max(self._pacing.drive, low), high), True
        margin = 1e-9 * max(abs(low), abs(high)) if math.isfinite(high) else 0.0
        clipped = min(max(drive, low), high)
        return clipped, abs(clipped - drive) > margin


def _with_other_lags(model: MuscleModel, chain: Chain, margin: float) -> list[Chain]:
    """Return the effects of a chain with the fastest and the slowest lag that they may have."""
    effects = chain.thermal
    lags = [effect for effect in effects if isinstance(effect, FirstOrderLag)]
    if not lags:
        return []
    others = [*chain.electrical, *(effect for effect in effects if effect is not lags[0])]
    return [Chain([*others, lag], model.surroundings) for lag in lags[0].extremes(margin)]
