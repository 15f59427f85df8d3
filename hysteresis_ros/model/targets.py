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
from hysteresis_ros.false_position import false_position
from hysteresis_ros.model.chain import Chain

# Elongation [m] by which muscle and arm may differ where the arm comes to rest.
AT_REST = 1e-9


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
        if self._angle is None and any(effect.memory for effect in self._chain.sensor):
            self._begin()
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

    def _begin(self) -> None:
        """Start the sensor from the cold arm's angle."""
        rest = self._angle_at_rest()
        for effect in self._chain.sensor:
            rest = effect.start_from(rest)

    def _hold(self, theta: float, true: float) -> Reference:
        friction, capstan = self._friction()
        if friction > 0.0 or capstan > 0.0:
            true = self._with_direction(true)
        found = self._balanced(theta, true)
        self._angle = true
        return found

    def _friction(self) -> tuple[float, float]:
        """Return the moment of dry friction [N m], and the exponent of that of the cables."""
        mechanism = self._chain.mechanism
        return (sum(effect.resistance()[0] for effect in mechanism),
                sum(effect.capstan() for effect in mechanism))

    def _balanced(self, theta: float, true: float) -> Reference:
        """Return elongation and tension that hold the arm at an angle [rad] after its last way."""
        geometry, (friction, capstan) = self._geometry, self._friction()
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
        force = max(moment - self._direction * friction, 0.0) / (
            leverage * math.exp(self._direction * capstan))
        return Reference(float(statics.length[0]), force)

    def stopped(self, length: Callable[[float], float]) -> Reference | None:
        """
        Return where the arm comes to rest that cannot reach its target.

        Parameters
        ----------
        length : callable
            Elongation [m] of a muscle under a tension [N].

        Returns
        -------
        Reference or None
            Elongation and tension there; None where the arm leaves its range.
        """
        def gap(true: float) -> float:
            found.append(self._balanced(true, true))
            return length(found[-1].force) - found[-1].length

        found: list[Reference] = []
        low, high = self._geometry.angle_range
        try:
            ends = (low, gap(low)), (high, gap(high))
            if ends[0][1] * ends[1][1] >= 0.0:
                return None
            false_position(gap, *ends, AT_REST)
        except RangeError:
            return None
        return found[-1]

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
