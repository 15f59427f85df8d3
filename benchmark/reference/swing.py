# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One step of an arm in motion.

The muscle pulls with what the arm asks for at rest, less what friction and inertia take:
``n F r(theta) = tau(theta) - tau_c - b dtheta/dt - I d2theta/dt2``. It gives way as always, so a
sudden acceleration also stretches what is elastic in it, and an arm that swings faster than its
muscle shortens leaves the muscle loose.
"""

import bisect

import numpy as np
from scipy import optimize

from benchmark.reference.bundle import TYPICAL_COMPLIANCE
from benchmark.reference.root import bracket, illinois

# Loads of the muscle's table, up to this many times the largest at rest.
LOADS, LARGEST = 400, 4.0
# Least share of a load that is missing by which the load changes in a step.
LEAST_GAIN = 1e-3
# How exactly an elongation [m] is met.
EXACT = 1e-9


class Swing:
    """
    Arm and one muscle, or several alike, in motion.

    Parameters
    ----------
    statics : Statics
        The arm at rest on a grid of angles.
    leverage : ndarray, shape (n,)
        Moment arm times number of muscles [m].
    chain : Chain
        Effects of the material.
    base : float
        Least elongation that H2 gives [m].
    viscous, inertia : float
        Coefficient [N m s/rad] and moment of inertia [kg m^2].
    tolerance : float
        Load [N] that may be missing.
    """

    def __init__(self, statics, leverage, chain, base, viscous, inertia, tolerance):
        self._theta, self._length = statics.theta.tolist(), statics.length.tolist()
        self._moment, self._leverage = statics.moment.tolist(), leverage.tolist()
        loads = np.linspace(0.0, LARGEST * np.max(np.abs(statics.moment / leverage)), LOADS)
        self._spacing = float(loads[1])
        self._inside = (chain.load_inside(loads) + 0.0 * loads).tolist()
        self._scale = (chain.scale(loads) + 0.0 * loads).tolist()
        self._stretch = (chain.stretch(loads) + 0.0 * loads).tolist()
        self._base, self._viscous, self._inertia = base, viscous, inertia
        self._tolerance = tolerance
        self._gain = 1.0

    def step(self, operator, x, offset, factor, friction, moved) -> float:
        """
        Commit what the muscle does in this step and return the angle [rad].

        Parameters
        ----------
        operator : HysteresisOperator
            The muscle's H2.
        x : float
            Output of the first stage.
        offset, factor : float
            What time and use add to the elongation [m] and do to the stroke.
        friction : float
            Moment of dry friction against the motion [N m].
        moved : callable
            Gives velocity and acceleration for the angle that the step ends at.
        """
        # Friction and inertia are linear in the angle that the step ends at.
        (speed, acceleration), (faster, jerked) = moved(0.0), moved(1.0)
        drag = friction + self._viscous * speed + self._inertia * acceleration
        slope = (self._viscous * (faster - speed)
                 + self._inertia * (jerked - acceleration))
        k, share = 1, 0.0

        # Its last call is at the u that is found.
        def residual(u):
            nonlocal k, share
            load, length = self._muscle(operator, u, x, offset, factor)
            k, share = self._place(length)
            return self._needed(k, share, drag, slope) - load

        u = operator.input
        here = residual(u)
        if abs(here) > self._tolerance:
            points = bracket(residual, u, here, here * self._gain)
            found = illinois(residual, *points, self._tolerance)
            self._gain = min(max((found - u) / here, LEAST_GAIN), 1.5)
            u = found
        if u + x < self._inside[0]:
            u = self._inside[0] - x
            k, share = self._fly(drag, slope)
        operator.step(u)
        return self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])

    def acceleration(self, operator, x, offset, factor, k, share, drag) -> float:
        """
        Return the angular acceleration [rad/s^2] of an arm under a new x.

        Parameters
        ----------
        operator, x, offset, factor
            As for `step`.
        k, share : int, float
            Interval of the grid, and share of it, at which the arm is.
        drag : float
            Moment of friction [N m].
        """
        lengths = self._length
        wanted = lengths[k - 1] + share * (lengths[k] - lengths[k - 1])

        def lacking(u):
            return wanted - self._muscle(operator, u, x, offset, factor)[1]

        u = operator.input
        here = lacking(u)
        if here != 0.0:
            points = bracket(lacking, u, here, here / TYPICAL_COMPLIANCE, self._inside[0] - x,
                             self._inside[-1] - x)
            u = points[2]
            if points[1] * points[3] < 0.0:
                u = illinois(lacking, *points, EXACT)
        load = self._muscle(operator, u, x, offset, factor)[0]
        leverage = self._leverage[k - 1] + share * (self._leverage[k] - self._leverage[k - 1])
        return (self._needed(k, share, drag, 0.0) - load) * leverage / self._inertia

    def _muscle(self, operator, u, x, offset, factor):
        """Return the load of the muscle and its elongation."""
        insides, stretches, scales = self._inside, self._stretch, self._scale
        n = bisect.bisect_right(insides, u + x, 1, LOADS - 1)
        part = (u + x - insides[n - 1]) / (insides[n] - insides[n - 1])
        load = (n - 1 + part) * self._spacing
        # A loose muscle's load goes on falling, so that the root can be found.
        part = max(part, 0.0)
        stretch = stretches[n - 1] + part * (stretches[n] - stretches[n - 1])
        scale = scales[n - 1] + part * (scales[n] - scales[n - 1])
        return load, (self._base + scale * factor * (operator.peek(u) - self._base) + stretch
                      + offset)

    def _place(self, length):
        """Return interval on the grid of angles, and share of it, at an elongation."""
        lengths = self._length
        k = bisect.bisect_right(lengths, length, 1, len(lengths) - 1)
        share = (length - lengths[k - 1]) / (lengths[k] - lengths[k - 1])
        return k, min(max(share, 0.0), 1.0)

    def _needed(self, k, share, drag, slope):
        """Return the load that the arm asks for at a place where the step may end."""
        theta, moment, leverage = self._theta, self._moment, self._leverage
        before = k - 1
        angle = theta[before] + share * (theta[k] - theta[before])
        held = moment[before] + share * (moment[k] - moment[before])
        return (held - drag - slope * angle) / (
            leverage[before] + share * (leverage[k] - leverage[before]))

    def _fly(self, drag, slope):
        """Return the place of an arm without a pull."""
        last = len(self._theta) - 1

        def needed(position):
            k = min(int(position), last - 1)
            return self._needed(k + 1, position - k, drag, slope)

        if needed(0.0) <= 0.0:
            return 1, 0.0
        if needed(last) >= 0.0:
            return last, 1.0
        position = optimize.brentq(needed, 0.0, last, xtol=1e-9)
        k = min(int(position), last - 1)
        return k + 1, position - k
