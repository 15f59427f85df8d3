# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The balance between muscle and arm: the angle for a drive and a memory.

The muscle stretches to ``L = L0 + S(F) f (H2[u] - L0) + e(F) + o`` with ``u = F - x``, where x is
the first stage's output (H1[V] in the paper's model) and F is what the arm asks for at its angle.
At rest ``L(theta) = H2[F(theta) - x]``; the unknown is u, because H2 then gives everything else.
Dry friction lets F lie in a band, inside which the arm sticks; viscous friction and inertia add
what the present velocity and acceleration cost (see `swing`): by backward differences of second
order, and while the arm rings by the method of Fox and Goodwin, Newmark's with beta = 1/12, whose
phase is of fourth order.
"""

import bisect
import copy
import math

import numpy as np

from benchmark.reference.bundle import Bundle, COMPLIANCE, TYPICAL_COMPLIANCE
from hysteresis_ros.bicep.geometry import BicepGeometry
from benchmark.reference.root import bracket, illinois
from benchmark.reference.swing import Swing
from hysteresis_ros.effects.stages import Statics

# Between two angles of the grid the linkage is a straight line, which costs less than 1e-6 rad.
GRID = math.radians(0.2)
# A dt longer than this [s] leads to a settled state to which dynamics contribute nothing.
LONGEST_TRANSIENT = 5.0
# Longest dt of an arm that rings, as a phase [rad] of its fastest ringing; from 2.4 the method
# would not be stable.
LONGEST_PHASE = 0.7
# What rings so fast that a sample would take more parts than this has come to rest by its end.
MOST_PIECES = 200
# An arm whose inertia takes less than this share of the largest moment at rest, under a step of x
# of less than this share of H2's range, does not ring, and is followed by a longer dt.
CALM, CALM_STEP, FADING = 0.005, 0.005, 0.97


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
        # Lines of state for an arm that rises, rests, and sinks.
        self._lines = {drag: _Line(statics, leverage, drag * self.coulomb, self.base, chain, loaded)
                       for drag in ((-1, 0, 1) if self.coulomb > 0.0 else (0,))}
        # Whether what the muscle has to give does not depend on friction.
        self._rigid = all(line.demand == self._lines[0].demand for line in self._lines.values())
        self.has_dynamics = chain.moves
        self.tolerance = 1e-10 * (operator.upper - operator.lower)
        # Where the wires only stretch the arm is stiffest, and rings fastest.
        stiffness = np.max(leverage * statics.moment_arm) / (chain.compliance() or COMPLIANCE)
        self._longest = LONGEST_PHASE * math.sqrt(self.inertia / stiffness)
        self._heaviest = max(float(np.max(np.abs(statics.moment))), 1e-12)
        self._calm = CALM_STEP * (operator.upper - operator.lower)
        self._bundle = None
        if len(chain.offsets) > 1:
            self._bundle = Bundle(operator, chain.offsets, chain.compliance())
            # Whose wires stretch when the drive changes, even while the arm sticks.
            self._rigid = False
        self.operators = self._bundle.operators if self._bundle else [copy.deepcopy(operator)]
        self._swing = None
        if self.has_dynamics and loaded and self._bundle is None:
            self._swing = Swing(statics, leverage, chain, self.base, self.viscous, self.inertia,
                                1e4 * self.tolerance)
        self.start()

    def start(self) -> None:
        """Wipe the memory: after a full heat and cool cycle, before the first sample."""
        for operator in self.operators:
            operator.reset()
        self._gain = 1.5
        self._angle = None
        self._velocity, self._before = 0.0, None
        self._x, self._ringing = math.inf, False
        self._jerk = self._acceleration = 0.0

    @property
    def output(self) -> float:
        """Output of H2 [m], which follows the martensite share; the mean of the muscles."""
        return self._bundle.output if self._bundle else self.operators[0].output

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
        pieces = 1
        self._ringing = 0.0 < dt < min(LONGEST_TRANSIENT, MOST_PIECES * self._longest) and (
            abs(x - self._x) > self._calm or self._jerk > CALM)
        if self._ringing:
            pieces = math.ceil(dt / self._longest)
            if self._swing is not None and x != self._x:
                self._kick(x, offset, factor)
        self._x = x
        for _ in range(pieces):
            angle = self._advance(x, dt / pieces, offset, factor)
        # What rings is not accelerated for a moment in the middle of its way.
        self._jerk = max(self.inertia * abs(self._acceleration) / self._heaviest,
                         FADING ** pieces * self._jerk)
        return angle

    def _kick(self, x, offset, factor):
        """Begin a step with the acceleration under a new x."""
        # An arm that friction holds is not accelerated before it slides.
        if self._angle is not None and (self._velocity or not self.coulomb):
            drag = math.copysign(self.coulomb, self._velocity) if self._velocity else 0.0
            self._acceleration = self._swing.acceleration(
                self.operators[0], x, offset, factor, *self._present(),
                drag + self.viscous * self._velocity)

    def _advance(self, x, dt, offset, factor):
        moving = self.has_dynamics and dt < LONGEST_TRANSIENT and self._angle is not None
        if moving and dt <= 0.0:
            return self._angle
        dt = dt if moving else 0.0
        drag = 0
        if self.coulomb > 0.0:
            # At the start the arm has sunk to where it rests, and friction has held it up.
            drag = 1 if self._angle is None else self._direction(x, offset, factor, dt)
            if drag == 0:
                self._keep_motion(self._angle, 0.0)
                return self._angle
        if moving and self._swing is not None:
            angle = self._swing.step(self.operators[0], x, offset, factor, drag * self.coulomb,
                                     lambda theta: self._moved(theta, dt))
        else:
            angle = self._rest(self._lines[drag], x, offset, factor, dt)
        self._keep_motion(angle, dt)
        self._angle = angle
        return angle

    def _rest(self, line, x, offset, factor, dt):
        if self._bundle is None:
            k, share = line.place(self._solve(line, x, offset, factor), offset)
        else:
            k, share = self._solve_bundle(line, x, offset, factor, dt)
        return self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])

    def _direction(self, x, offset, factor, dt):
        """Direction in which the arm slides, 0 where friction holds it."""
        place = self._present()
        if self._rigid:
            tension = max(self.operators[0].input + x, 0.0)
            if self._required(self._lines[1], *place, dt) > tension:
                return 1
            return -1 if self._required(self._lines[-1], *place, dt) < tension else 0
        demands, loads = zip(*(
            (line.demand_at(*place, offset), self._required(line, *place, dt))
            for line in map(self._lines.__getitem__, (0, 1, -1))))
        inputs = []

        def lacking(drag):
            # Between rest and sliding friction takes off a part of what it can.
            edge, share = 1 if drag > 0.0 else -1, abs(drag)
            demand = demands[0] + share * (demands[edge] - demands[0])
            load = loads[0] + share * (loads[edge] - loads[0])
            inputs[:] = self._inputs_at(self.base + demand / factor, load - x)
            return load - Bundle.share(inputs, x)

        sinking = lacking(1.0)
        if sinking > 0.0:
            return 1
        rising = lacking(-1.0)
        if rising < 0.0:
            return -1
        illinois(lacking, 1.0, sinking, -1.0, rising, self.tolerance)
        # The arm stands still, but its load has changed, and with it what the load does.
        self._commit(inputs)
        return 0

    def _inputs_at(self, output, mean):
        if self._bundle is None:
            return [self.operators[0].solve(output)[0]]
        return self._bundle.inputs(output, mean)

    def _commit(self, inputs):
        for operator, u in zip(self.operators, inputs):
            operator.step(u)

    def _present(self):
        """Interval on the grid, and share of it, of the present angle."""
        theta = self._theta
        k = bisect.bisect_right(theta, self._angle, 1, len(theta) - 1)
        return k, (self._angle - theta[k - 1]) / (theta[k] - theta[k - 1])

    def _required(self, line, k, share, dt):
        """Load that the arm asks for at a place of the grid, reached within `dt`."""
        load = line.load[k - 1] + share * (line.load[k] - line.load[k - 1])
        if dt:
            theta = self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])
            speed, acceleration = self._moved(theta, dt)
            moment = self.viscous * speed + self.inertia * acceleration
            load -= moment * (line.resist[k - 1] + share * (line.resist[k] - line.resist[k - 1]))
        return load

    def _moved(self, theta, dt):
        """Return velocity and acceleration where the arm gets to `theta` within `dt`."""
        if self._ringing:
            way = theta - self._angle - dt * self._velocity
            acceleration = 12.0 * way / dt ** 2 - 5.0 * self._acceleration
            return self._velocity + 0.5 * dt * (self._acceleration + acceleration), acceleration
        if self._before is not None and dt < 2.414 * self._before[0]:
            before, angle, velocity = self._before
            # Derivative of the parabola through three points at its end.
            r = dt / before
            here, last = (1.0 + 2.0 * r) / (1.0 + r), r * r / (1.0 + r)
            speed = (here * theta - (1.0 + r) * self._angle + last * angle) / dt
            return speed, (here * speed - (1.0 + r) * self._velocity + last * velocity) / dt
        speed = (theta - self._angle) / dt
        return speed, (speed - self._velocity) / dt

    def _keep_motion(self, angle, dt):
        """Note the velocity with which the arm gets to `angle`; none at an end or at rest."""
        if not dt or angle in (self._theta[0], self._theta[-1]):
            self._velocity, self._acceleration, self._before = 0.0, 0.0, None
            return
        velocity, self._acceleration = self._moved(angle, dt)
        self._before = dt, self._angle, self._velocity
        self._velocity = velocity

    def _solve(self, line, x, offset, factor):
        """Commit the u next to the present one with load(theta(H2[u])) - x - u = 0."""
        operator, base = self.operators[0], self.base
        peek, place, load = operator.peek, line.place, line.load

        def residual(u):
            k, share = place(factor * (peek(u) - base), offset)
            return load[k - 1] + share * (load[k] - load[k - 1]) - x - u

        u = operator.input
        here = residual(u)
        if abs(here) > self.tolerance:
            points = bracket(residual, u, here, here * self._gain)
            found = illinois(residual, *points, self.tolerance)
            self._gain = min(max((found - u) / here, 0.5), 10.0)
            operator.step(found)
        return factor * (operator.output - base)

    def _solve_bundle(self, line, x, offset, factor, dt):
        """Commit what unequal muscles do, and return the place on the grid where they balance."""
        last = len(self._theta) - 1

        def split(place):
            k = min(int(place), last - 1)
            return k + 1, place - k

        def state(place):
            k, share = split(place)
            output = self.base + line.demand_at(k, share, offset) / factor
            return output, self._required(line, k, share, dt)

        near = last
        if self._angle is not None:
            k, share = self._present()
            near = k - 1 + share
        # Along the grid the muscles give way by about this much.
        scale = TYPICAL_COMPLIANCE * last / (line.demand[-1] - line.demand[0])
        place, inputs = self._bundle.settle(state, x, 0.0, last, near, scale)
        self._commit(inputs)
        return split(place)


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
        self._near = 1

    def place(self, demand, offset):
        """Return interval on the grid, and share of it, for what the transformation gives."""
        grid, strain, last = self.demand, self.strain, len(self.demand) - 1
        if strain is None or offset == 0.0:
            demand += offset
            k = bisect.bisect_right(grid, demand, 1, last)
            below, above = grid[k - 1], grid[k]
        else:
            # The offset is not part of the strain that the load scales; it is small, so the
            # place is near the one without it.
            k = bisect.bisect_right(grid, demand + offset * strain[self._near], 1, last)
            below = grid[k - 1] - offset * strain[k - 1]
            above = grid[k] - offset * strain[k]
            while demand >= above and k < last:
                k += 1
                below, above = above, grid[k] - offset * strain[k]
            while demand < below and k > 1:
                k -= 1
                below, above = grid[k - 1] - offset * strain[k - 1], below
            self._near = k
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
