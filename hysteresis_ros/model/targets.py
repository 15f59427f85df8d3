# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""From a target angle to what each muscle has to do, effects of arm and sensor undone."""

from collections.abc import Callable
import math
from typing import Any

import numpy as np

from hysteresis_ros.bicep.geometry import BicepGeometry, Reference
from hysteresis_ros.effects import Statics
from hysteresis_ros.errors import RangeError
from hysteresis_ros.model.chain import Chain


class Targets:
    """
    The arm's inverse: target angle to elongation and force (Eqs. 21 and 22).

    Parameters
    ----------
    geometry : BicepGeometry
        The linkage.
    chain : Chain
        Effects of the model: those of the mechanism and of the sensor count here.
    angle_at_rest : callable
        Gives the angle [rad] from which the cold arm starts.
    """

    def __init__(self, geometry: BicepGeometry, chain: Chain, angle_at_rest: Callable[[], float]
                 ) -> None:
        self._geometry = geometry
        self._chain = chain
        self._angle_at_rest = angle_at_rest
        # A turn of the target up to this [rad] leaves the direction of friction as it is.
        self.dead_band = 0.0
        self.reset()

    def reset(self) -> None:
        """Forget the targets before: the arm is cold."""
        self._angle: float | None = None
        self._direction = 0.0

    def save(self) -> dict[str, Any]:
        """Return what is remembered of the targets before, as plain types."""
        return {'angle': self._angle, 'direction': self._direction}

    def restore(self, angle: float | None, direction: float) -> None:
        """Take back what `save` returned; ValueError or TypeError if it is damaged."""
        if not all(math.isfinite(value) for value in (angle or 0.0, direction)):
            raise ValueError('a number of the targets is not finite')
        self._angle, self._direction = angle, direction

    def reference(self, theta: float) -> Reference:
        """
        Return elongation [m] and tension [N] of one muscle for a target angle [rad].

        Raises
        ------
        RangeError
            If the arm cannot be held there; nothing is remembered of that target.
        """
        self._geometry.check_angle(theta)
        before = self._chain.save()
        try:
            true = theta
            for effect in reversed(self._chain.sensor):
                true = effect.inverse(true)
            self._geometry.check_angle(true)
            return self._hold(theta, true)
        except RangeError:
            self._chain.restore(before)
            raise

    def _hold(self, theta: float, true: float) -> Reference:
        geometry = self._geometry
        friction = sum(effect.resistance()[0] for effect in self._chain.mechanism)
        capstan = sum(effect.capstan() for effect in self._chain.mechanism)
        if friction > 0.0 or capstan > 0.0:
            true = self._with_direction(true)
        statics = Statics.of(geometry, np.array([true]))
        for effect in self._chain.mechanism:
            statics = effect.forward(statics, geometry)
        leverage = geometry.muscle_count * float(statics.moment_arm[0])
        moment = float(statics.moment[0])
        if leverage <= 0.0:
            raise RangeError(f'target angle {theta:.4f} rad lies beyond a dead centre of the arm')
        if moment < 0.0:
            raise RangeError(f'nothing pulls the arm to the target angle {theta:.4f} rad; the '
                             'muscle would have to push')
        self._angle = true
        force = max(moment - self._direction * friction, 0.0) / (
            leverage * math.exp(self._direction * capstan))
        return Reference(float(statics.length[0]), force)

    def _with_direction(self, true: float) -> float:
        """Note the direction of the motion to an angle, and return where it leads [rad]."""
        start = self._angle_at_rest() if self._angle is None else self._angle
        way = true - start
        if way * self._direction > 0.0 or abs(way) > self.dead_band:
            self._direction = math.copysign(1.0, way)
        elif self._angle is not None:
            # Not a turn yet: the arm sticks at the furthest target.
            return start
        return true
