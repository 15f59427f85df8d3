# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The balance between muscle and arm: the angle for a drive and a memory.

The muscle stretches to ``L = L0 + S(F) f (H2[u] - L0) + e(F) + o`` with ``u = F - x``, where x is
the first stage's output (H1[V] in the paper's model) and F is what the arm asks for at its angle.
At rest ``L(theta) = H2[F(theta) - x]``; the unknown is u, because H2 then gives everything else.
Dry friction lets F lie in a band, inside which the arm sticks; viscous friction and inertia add
what the present velocity and acceleration cost (implicit Euler). S and e take the F of the arm at
rest, without what resists its motion.
"""

import bisect
import copy
import math

import numpy as np

from hysteresis_ros.bicep.bundle import Bundle
from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.effects.base import Statics

# Between two angles of the grid the linkage is a straight line, which costs less than 1e-6 rad.
GRID = math.radians(0.1)
# A step longer than this is a settled state to which dynamics contribute nothing.
LONGEST_TRANSIENT = 5.0
# Longest step for which implicit Euler still shows an arm that rings (its period is about 1 s).
LONGEST_INERTIAL_STEP = 0.02
MOST_ITERATIONS = 60


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
    loaded : bool
        Whether the load counts; not in a model without a first stage to weigh it against.
    """

    def __init__(self, operator, geometry: BicepGeometry, chain, loaded: bool = True):
        low, high = geometry.angle_range
        theta = np.linspace(low, high, max(int((high - low) / GRID), 2))
        statics = Statics.of(geometry, theta)
        for effect in chain.mechanism:
            statics = effect.forward(statics, geometry)
        resistances = [effect.resistance() for effect in chain.mechanism]
        self.coulomb, self.viscous, self.inertia = (
            sum(values) for values in zip((0.0, 0.0, 0.0), *resistances))
        leverage = geometry.muscle_count * np.maximum(statics.moment_arm, 1e-6)
        # A wire cannot push.
        force = np.maximum(statics.moment / leverage, 0.0)
        load, weight = 0.0 * force, 0.0 * force
        if loaded:
            load = chain.load_inside(force)
            weight = chain.load_inside(force + 1.0) - load
        self.base = operator.output_range[0]
        scale = chain.scale(force) + 0.0 * force
        demand = (statics.length - self.base - chain.stretch(force)) / scale
        self._theta = theta.tolist()
        # Past a fold, where the arm would fall, the nearest stable state is kept.
        self._demand = np.maximum.accumulate(demand).tolist()
        self._strain = None if np.all(scale == 1.0) else (1.0 / scale).tolist()
        self._load = load.tolist()
        # What a moment that resists motion changes in the load.
        self._resist = (weight / leverage).tolist()
        self.has_dynamics = self.viscous > 0.0 or self.inertia > 0.0
        self.tolerance = 1e-10 * (operator.upper - operator.lower)
        self._bundle = Bundle(operator, chain.offsets) if len(chain.offsets) > 1 else None
        self.operators = self._bundle.operators if self._bundle else [copy.deepcopy(operator)]
        self.start()

    def start(self) -> None:
        """Wipe the memory: after a full heat and cool cycle, before the first sample."""
        for operator in self.operators:
            operator.reset()
        self._gain = 1.5
        self._angle = None
        self._velocity = 0.0

    def settle(self, x: float) -> float:
        """Take up the state of rest under `x`, the cold one, and return its angle [rad]."""
        friction, self.coulomb = self.coulomb, 0.0
        angle = self.step(x, math.inf)
        self.coulomb = friction
        return angle

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
        if moving and dt <= 0.0:
            return self._angle
        solve = self._solve if self._bundle is None else self._solve_bundle
        demand = solve(x, offset, factor, dt if moving else 0.0)
        k, share = self._place(demand, offset)
        angle = self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])
        self._velocity = (angle - self._angle) / dt if moving else 0.0
        self._angle = angle
        return angle

    def _place(self, demand, offset):
        """Interval on the grid, and share of it, for what the transformation has to give."""
        grid, strain = self._demand, self._strain
        if strain is None or offset == 0.0:
            demand += offset
            k = min(max(bisect.bisect_right(grid, demand), 1), len(grid) - 1)
            below, above = grid[k - 1], grid[k]
        else:
            # The offset is not part of the strain that the load scales.
            k = bisect.bisect_right(range(len(grid)), demand,
                                    key=lambda row: grid[row] - offset * strain[row])
            k = min(max(k, 1), len(grid) - 1)
            below = grid[k - 1] - offset * strain[k - 1]
            above = grid[k] - offset * strain[k]
        if demand <= below:
            return k, 0.0
        return k, 1.0 if demand >= above else (demand - below) / (above - below)

    def _required(self, demand, offset, drag, dt):
        """Load that the arm asks for, moving towards `demand` within `dt`."""
        k, share = self._place(demand, offset)
        load = self._load[k - 1] + share * (self._load[k] - self._load[k - 1])
        if drag or dt:
            moment = drag * self.coulomb
            if dt:
                theta = self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])
                speed = (theta - self._angle) / dt
                moment += self.viscous * speed + self.inertia * (speed - self._velocity) / dt
            load -= moment * (
                self._resist[k - 1] + share * (self._resist[k] - self._resist[k - 1]))
        return load

    def _drag(self, demand, offset, lacking):
        """Direction in which the arm slides, 0 if friction holds it; `lacking` is its want."""
        k, share = self._place(demand, offset)
        resist = self._resist[k - 1] + share * (self._resist[k] - self._resist[k - 1])
        return 0.0 if abs(lacking) <= self.coulomb * resist else math.copysign(1.0, lacking)

    def _solve(self, x, offset, factor, dt):
        """Commit the u next to the present one with load(theta(H2[u])) - x - u = 0."""
        operator, base, tolerance = self.operators[0], self.base, self.tolerance
        peek, required = operator.peek, self._required
        drag = 0.0

        def residual(u):
            return required(factor * (peek(u) - base), offset, drag, dt) - x - u

        u = operator.input
        here = residual(u)
        if self.coulomb > 0.0:
            drag = self._drag(factor * (operator.output - base), offset, here)
            here = residual(u) if drag else 0.0
        if abs(here) > tolerance:
            operator.step(self._root(residual, u, here))
        return factor * (operator.output - base)

    def _root(self, residual, u, here):
        # The residual falls with u: go the way of its sign until it changes.
        first, initial = u, here
        step = here * self._gain
        far = u + step
        there = residual(far)
        for _ in range(MOST_ITERATIONS):
            if there * here <= 0.0:
                break
            u, here = far, there
            step *= 2.0
            far = u + step
            there = residual(far)
        # Illinois: false position that cannot stall at one end.
        for _ in range(MOST_ITERATIONS):
            if abs(there) <= self.tolerance or there == here:
                break
            middle = far - there * (far - u) / (there - here)
            value = residual(middle)
            if value * there < 0.0:
                u, here = far, there
            else:
                here *= 0.5
            far, there = middle, value
        self._gain = min(max((far - first) / initial, 0.5), 10.0)
        return far

    def _solve_bundle(self, x, offset, factor, dt):
        """Commit the elongation in which muscles of unequal length balance the arm."""
        bundle, base, grid = self._bundle, self.base, self._demand
        drag = 0.0

        def required(output):
            return self._required(factor * (output - base), offset, drag, dt)

        room = abs(offset) * max(self._strain or [1.0])
        low, high = base + (grid[0] - room) / factor, base + (grid[-1] + room) / factor
        present = high if self._angle is None else base + self._present(offset) / factor
        if self.coulomb > 0.0:
            here = required(present) - bundle.share(bundle.inputs(present), x)
            drag = self._drag(factor * (present - base), offset, here)
            if drag == 0.0:
                return factor * (present - base)
        output = bundle.settle(required, x, low, high, present)
        bundle.step(bundle.inputs(output))
        return factor * (output - base)

    def _present(self, offset):
        """What the transformation gives at the present angle."""
        demand = float(np.interp(self._angle, self._theta, self._demand))
        if offset != 0.0:
            strain = 1.0 if self._strain is None else float(
                np.interp(self._angle, self._theta, self._strain))
            demand -= offset * strain
        return demand
