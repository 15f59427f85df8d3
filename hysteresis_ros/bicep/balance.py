# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The balance between muscle and arm: the angle for a drive and a memory.

The muscle stretches to ``L = L0 + S(F) f (H2[u] - L0) + e(F) + o`` with ``u = F - x``, where x is
the first stage's output (H1[V] in the paper's model) and F is what the arm asks for at its angle.
At rest ``L(theta) = H2[F(theta) - x]``; the unknown is u, because H2 then gives everything else.
Dry friction lets F lie in a band, inside which the arm sticks; viscous friction and inertia add
what the present velocity and acceleration cost (implicit Euler), which S and e leave out.
"""

import bisect
import copy
import math

import numpy as np
from scipy import optimize

from hysteresis_ros.bicep.bundle import Bundle
from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.effects.stages import Statics

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
        self.base = operator.output_range[0]
        self._theta = theta.tolist()
        # Lines of state for an arm that slides down, rests, and slides up.
        self._lines = {drag: _Line(statics, leverage, drag * self.coulomb, self.base, chain, loaded)
                       for drag in ((-1, 0, 1) if self.coulomb > 0.0 else (0,))}
        # Whether what the muscle has to give does not depend on friction.
        self._rigid = all(line.demand == self._lines[0].demand for line in self._lines.values())
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
        self._angle = self._inputs = None
        self._velocity = 0.0

    def settle(self, x: float) -> float:
        """Take up the state of rest under `x`, the cold one, and return its angle [rad]."""
        self._angle = None
        return self.step(x, math.inf)

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
        dt = dt if moving else 0.0
        drag = 0
        if self.coulomb > 0.0 and self._angle is not None:
            drag = self._direction(x, offset, factor, dt)
            if drag == 0:
                self._velocity = 0.0
                return self._angle
        line = self._lines[drag]
        solve = self._solve if self._bundle is None else self._solve_bundle
        k, share = line.place(solve(line, x, offset, factor, dt), offset)
        angle = self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])
        self._velocity = (angle - self._angle) / dt if moving else 0.0
        self._angle = angle
        return angle

    def _direction(self, x, offset, factor, dt):
        """Direction in which the arm slides, 0 where friction holds it."""
        place = self._present()
        if self._rigid:
            held = self._inputs or [self.operators[0].input]
            tension = Bundle.share(held, x)
            if self._required(self._lines[1], *place, dt) > tension:
                return 1
            return -1 if self._required(self._lines[-1], *place, dt) < tension else 0
        found = {}

        def lacking(drag):
            # Between rest and sliding friction takes off a part of what it can.
            edge, share = self._lines[1 if drag > 0.0 else -1], abs(drag)
            demand, load = (
                (1.0 - share) * rest + share * most for rest, most in zip(
                    (self._lines[0].demand_at(*place, offset),
                     self._required(self._lines[0], *place, dt)),
                    (edge.demand_at(*place, offset), self._required(edge, *place, dt))))
            found['inputs'] = self._inputs_at(self.base + demand / factor)
            return load - Bundle.share(found['inputs'], x)

        if lacking(1.0) > 0.0:
            return 1
        if lacking(-1.0) < 0.0:
            return -1
        lacking(optimize.brentq(lacking, -1.0, 1.0, xtol=1e-13))
        # The arm stands still, but its load has changed, and with it what the load does.
        self._commit(found['inputs'])
        return 0

    def _inputs_at(self, output):
        if self._bundle is None:
            return [self.operators[0].solve(output)[0]]
        return self._bundle.inputs(output)

    def _commit(self, inputs):
        for operator, u in zip(self.operators, inputs):
            operator.step(u)
        if self._bundle is not None:
            self._inputs = inputs

    def _present(self):
        """Interval on the grid, and share of it, of the present angle."""
        theta = self._theta
        k = min(max(bisect.bisect_right(theta, self._angle), 1), len(theta) - 1)
        return k, (self._angle - theta[k - 1]) / (theta[k] - theta[k - 1])

    def _required(self, line, k, share, dt):
        """Load that the arm asks for at a place of the grid, reached within `dt`."""
        load = line.load[k - 1] + share * (line.load[k] - line.load[k - 1])
        if dt:
            theta = self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])
            speed = (theta - self._angle) / dt
            moment = self.viscous * speed + self.inertia * (speed - self._velocity) / dt
            load -= moment * (line.resist[k - 1] + share * (line.resist[k] - line.resist[k - 1]))
        return load

    def _solve(self, line, x, offset, factor, dt):
        """Commit the u next to the present one with load(theta(H2[u])) - x - u = 0."""
        operator, base = self.operators[0], self.base
        peek, place, required = operator.peek, line.place, self._required

        def residual(u):
            return required(line, *place(factor * (peek(u) - base), offset), dt) - x - u

        u = operator.input
        here = residual(u)
        if abs(here) > self.tolerance:
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

    def _solve_bundle(self, line, x, offset, factor, dt):
        """Commit the elongation in which muscles of unequal length balance the arm."""
        bundle, base = self._bundle, self.base

        def required(output):
            return self._required(line, *line.place(factor * (output - base), offset), dt)

        last = len(self._theta) - 1
        low = base + line.demand_at(1, 0.0, offset) / factor
        high = base + line.demand_at(last, 1.0, offset) / factor
        near = high
        if self._angle is not None:
            near = base + line.demand_at(*self._present(), offset) / factor
        output = bundle.settle(required, x, low, high, near)
        self._commit(bundle.inputs(output))
        return factor * (output - base)


class _Line:
    """
    States of the arm on a grid of angles, at rest or against a moment of friction.

    `demand` is what the transformation has to give at each angle, without offset, and never falls;
    `load` is what it feels there, `resist` what a moment that resists motion takes off it, and
    `strain` what an offset counts in the demand, None where that is one.
    """

    def __init__(self, statics, leverage, friction, base, chain, loaded):
        # A wire cannot push.
        force = np.maximum(statics.moment - friction, 0.0) / leverage
        load, weight = 0.0 * force, 0.0 * force
        if loaded:
            load = chain.load_inside(force)
            weight = chain.load_inside(force + 1.0) - load
        scale = chain.scale(force) + 0.0 * force
        demand = (statics.length - base - chain.stretch(force)) / scale
        # Past a fold, where the arm would fall, the nearest stable state is kept.
        self.demand = np.maximum.accumulate(demand).tolist()
        self.load = load.tolist()
        self.resist = (weight / leverage).tolist()
        self.strain = None if np.all(scale == 1.0) else (1.0 / scale).tolist()

    def place(self, demand, offset):
        """Return interval on the grid, and share of it, for what the transformation gives."""
        grid, strain = self.demand, self.strain
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

    def demand_at(self, k, share, offset):
        """Return what the transformation has to give at a place of the grid: `place` inverted."""
        grid, strain = self.demand, self.strain
        demand = grid[k - 1] + share * (grid[k] - grid[k - 1])
        if strain is None:
            return demand - offset
        return demand - offset * (strain[k - 1] + share * (strain[k] - strain[k - 1]))
