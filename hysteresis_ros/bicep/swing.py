# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One step of an arm in motion.

The muscle pulls with what the arm asks for at rest, less what friction and inertia take:
``n F r(theta) = tau(theta) - tau_c - b dtheta/dt - I d2theta/dt2``. It gives way as always, so a
jerk also stretches what is elastic in it, and an arm that swings faster than its muscle shortens
leaves the muscle loose.
"""

import bisect

import numpy as np
from scipy import optimize

from hysteresis_ros.bicep.root import bracket, illinois

# Loads of the muscle's table, up to this many times the largest at rest.
LOADS, LARGEST = 400, 4.0
# Least share of a load that is missing by which the load changes in a step.
LEAST_GAIN = 1e-3


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
        place = [1, 0.0]

        # Its last call is at the u that is found.
        def residual(u):
            load, stretch, scale = self._muscle(u + x)
            length = (self._base + scale * factor * (operator.peek(u) - self._base) + stretch
                      + offset)
            place[0], place[1] = self._place(length)
            return self._needed(*place, friction, moved) - load

        u = operator.input
        here = residual(u)
        if abs(here) > self._tolerance:
            points = bracket(residual, u, here, here * self._gain)
            found = illinois(residual, *points, self._tolerance)
            self._gain = min(max((found - u) / here, LEAST_GAIN), 1.5)
            u = found
        if u + x < self._inside[0]:
            u = self._inside[0] - x
            place[:] = self._fly(friction, moved)
        operator.step(u)
        k, share = place
        return self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])

    def _muscle(self, inside):
        """Return load, elastic elongation and factor of the stroke for the load inside."""
        k = bisect.bisect_right(self._inside, inside, 1, LOADS - 1)
        share = ((inside - self._inside[k - 1]) / (self._inside[k] - self._inside[k - 1]))
        load = (k - 1 + share) * self._spacing
        if share < 0.0:
            # A loose muscle; the load goes on falling, so that the root can be found.
            return load, self._stretch[0], self._scale[0]
        stretch, scale = (table[k - 1] + share * (table[k] - table[k - 1])
                          for table in (self._stretch, self._scale))
        return load, stretch, scale

    def _place(self, length):
        """Return interval on the grid of angles, and share of it, at an elongation."""
        lengths = self._length
        k = bisect.bisect_right(lengths, length, 1, len(lengths) - 1)
        share = (length - lengths[k - 1]) / (lengths[k] - lengths[k - 1])
        return k, min(max(share, 0.0), 1.0)

    def _needed(self, k, share, friction, moved):
        """Return the load that the arm asks for at a place where the step may end."""
        theta = self._theta[k - 1] + share * (self._theta[k] - self._theta[k - 1])
        speed, acceleration = moved(theta)
        moment = self._moment[k - 1] + share * (self._moment[k] - self._moment[k - 1])
        leverage = self._leverage[k - 1] + share * (self._leverage[k] - self._leverage[k - 1])
        return (moment - friction - self._viscous * speed - self._inertia * acceleration) / leverage

    def _fly(self, friction, moved):
        """Return the place of an arm without a pull."""
        last = len(self._theta) - 1

        def needed(position):
            k = min(int(position), last - 1)
            return self._needed(k + 1, position - k, friction, moved)

        if needed(0.0) <= 0.0:
            return 1, 0.0
        if needed(last) >= 0.0:
            return last, 1.0
        position = optimize.brentq(needed, 0.0, last, xtol=1e-9)
        k = min(int(position), last - 1)
        return k + 1, position - k
