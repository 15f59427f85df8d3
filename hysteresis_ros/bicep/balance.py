# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The balance between muscle and arm: the angle for a drive and a memory.

The muscle stretches to ``L = L0 + S(F) f (H2[u] - L0) + e(F) + o`` with ``u = F - x``, where x is
the first stage's output (H1[V] in the paper's model) and F is what the arm asks for at its angle.
At rest ``L(theta) = H2[F(theta) - x]``; the unknown is u, because H2 then gives everything else.
Dry friction lets F lie in a band, inside which the arm sticks; viscous friction and inertia add
what the present velocity and acceleration cost (implicit Euler).
"""

import bisect
import copy
import math

import numpy as np
from scipy import optimize

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.effects.base import Statics

GRID = math.radians(0.25)
# A step longer than this is a settled state to which dynamics contribute nothing.
LONGEST_TRANSIENT = 5.0
# Longest step for which implicit Euler still shows an arm that rings (its period is about 1 s).
LONGEST_INERTIAL_STEP = 0.02
MOST_ITERATIONS = 60
# Force per elongation [N/m] of a wire that is wholly in one phase.
ELASTICITY = 5e3


class ArmBalance:
    """
    Arm and parallel muscles, advanced one sample at a time.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2; its memory is the muscle's. It is copied.
    geometry : BicepGeometry
        The linkage.
    chain : Chain
        Effects of the model: those of the material and of the mechanism count here.
    offsets : tuple of float
        Excess length [m] of each parallel muscle; the default is equal muscles.
    """

    def __init__(self, operator, geometry: BicepGeometry, chain, offsets=(0.0,)):
        low, high = geometry.angle_range
        theta = np.linspace(low, high, max(int((high - low) / GRID), 2))
        statics = Statics(theta, geometry.length(theta), geometry.moment_arm(theta),
                          geometry.load_moment(theta))
        for effect in chain.mechanism:
            statics = effect.forward(statics, geometry)
        resistances = [effect.resistance() for effect in chain.mechanism]
        coulomb, self.viscous, self.inertia = (
            sum(values) for values in zip((0.0, 0.0, 0.0), *resistances))
        leverage = geometry.muscle_count * np.maximum(statics.moment_arm, 1e-6)
        # A wire cannot push.
        force = np.maximum(statics.moment / leverage, 0.0)
        self.operators = [copy.deepcopy(operator) for _ in offsets]
        self.offsets = offsets
        self.base = operator.output_range[0]
        demand = (statics.length - self.base - chain.stretch(force)) / chain.scale(force)
        # Past a fold, where the arm would fall, the nearest stable state is kept.
        self.demand = np.maximum.accumulate(demand).tolist()
        self.theta = theta.tolist()
        self.load = (chain.load_inside(force)).tolist()
        self.friction = (coulomb / leverage).tolist()
        self.leverage = leverage.tolist()
        self.has_friction = coulomb > 0.0
        self.has_dynamics = self.viscous > 0.0 or self.inertia > 0.0
        self.tolerance = 1e-10 * (operator.upper - operator.lower)
        self.start()

    def start(self) -> None:
        """Wipe the memory: after a full heat and cool cycle, before the first sample."""
        for operator in self.operators:
            operator.reset()
        self._gain = 1.5
        self._angle = None
        self._velocity = 0.0
        self._sliding = 0.0

    def settle(self, x: float) -> float:
        """Take up the state of rest under `x`, the cold one, and return its angle [rad]."""
        friction, self.has_friction = self.has_friction, False
        self._angle = self.step(x, math.inf)
        self.has_friction = friction
        return self._angle

    def step(self, x: float, dt: float, offset: float = 0.0, factor: float = 1.0) -> float:
        """
        Advance to the next sample.

        Parameters
        ----------
        x : float
            Output of the first stage, unit of the load.
        dt : float
            Time since the sample before [s].
        offset, factor : float
            What time and use add to the elongation [m] and do to the stroke.

        Returns
        -------
        float
            Angle [rad].
        """
        if self.inertia > 0.0 and LONGEST_INERTIAL_STEP < dt < LONGEST_TRANSIENT:
            pieces = math.ceil(dt / LONGEST_INERTIAL_STEP)
            for _ in range(pieces - 1):
                self._advance(x, dt / pieces, offset, factor)
            dt /= pieces
        return self._advance(x, dt, offset, factor)

    def _advance(self, x, dt, offset, factor):
        moving = self.has_dynamics and dt < LONGEST_TRANSIENT and self._angle is not None
        if len(self.operators) > 1:
            angle = self._solve_bundle(x, offset, factor)
        else:
            u = self._solve(x, offset, factor, dt if moving else 0.0)
            operator = self.operators[0]
            angle = self._state(factor * (operator.step(u) - self.base) + offset)[0]
        if moving:
            self._velocity = (angle - self._angle) / dt
        else:
            self._velocity = 0.0
        self._angle = angle
        return angle

    def _state(self, demand: float) -> tuple[float, float, int]:
        """Angle, load and index on the grid for what the transformation has to give."""
        grid = self.demand
        k = bisect.bisect_right(grid, demand)
        if k == 0:
            return self.theta[0], self.load[0], 0
        if k == len(grid):
            return self.theta[-1], self.load[-1], k - 1
        below = grid[k - 1]
        share = (demand - below) / (grid[k] - below)
        theta, load = self.theta, self.load
        return (theta[k - 1] + share * (theta[k] - theta[k - 1]),
                load[k - 1] + share * (load[k] - load[k - 1]), k)

    def _solve(self, x, offset, factor, dt):
        """Find u with load(theta(H2[u])) - x - u = 0 next to the present one."""
        operator, base, tolerance = self.operators[0], self.base, self.tolerance
        peek, state = operator.peek, self._state
        angle, velocity = self._angle, self._velocity

        def residual(u, drag):
            theta, load, k = state(factor * (peek(u) - base) + offset)
            if drag:
                load -= drag * self.friction[k]
            if dt:
                speed = (theta - angle) / dt
                load -= (self.viscous * speed
                         + self.inertia * (speed - velocity) / dt) / self.leverage[k]
            return load - x - u

        u = operator.input
        drag = 0.0
        here = residual(u, 0.0)
        if self.has_friction:
            band = self.friction[state(factor * (operator.output - base) + offset)[2]]
            if abs(here) <= band:
                return u
            drag = math.copysign(1.0, here)
            here = residual(u, drag)
        if abs(here) <= tolerance:
            return u
        # The residual falls with u: go the way of its sign until it changes.
        first, initial = u, here
        step = here * self._gain
        far = u + step
        there = residual(far, drag)
        for _ in range(MOST_ITERATIONS):
            if there * here <= 0.0:
                break
            u, here = far, there
            step *= 2.0
            far = u + step
            there = residual(far, drag)
        # Illinois: false position that cannot stall at one end.
        for _ in range(MOST_ITERATIONS):
            if abs(there) <= tolerance or there == here:
                break
            middle = far - there * (far - u) / (there - here)
            value = residual(middle, drag)
            if value * there < 0.0:
                u, here = far, there
            else:
                here *= 0.5
            far, there = middle, value
        self._gain = min(max((far - first) / initial, 0.5), 10.0)
        return far

    def _solve_bundle(self, x, offset, factor):
        """Balance muscles of unequal length, each with a memory of its own."""
        grid = self.demand

        def tension(operator, output):
            """Input of one muscle; beyond saturation only the wire's elasticity gives way."""
            found = operator.invert(output)
            return found.input + ELASTICITY * (output - found.output)

        def residual(demand):
            output = (demand - offset) / factor + self.base
            self._inputs = [tension(operator, output - excess)
                            for operator, excess in zip(self.operators, self.offsets)]
            mean = sum(max(u + x, 0.0) for u in self._inputs) / len(self._inputs)
            return mean - self._state(demand)[1]

        near = grid[0] if self._angle is None else float(
            np.interp(self._angle, self.theta, grid))
        here = residual(near)
        far = grid[0] if here > 0.0 else grid[-1]
        there = residual(far)
        if here * there < 0.0:
            far = optimize.brentq(residual, near, far, xtol=1e-10)
            residual(far)
        for operator, u in zip(self.operators, self._inputs):
            operator.step(u)
        return self._state(far)[0]
