# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Parallel muscles of unequal length, which share the load as their own memories allow."""

import copy
import math

from scipy import optimize

from hysteresis_ros.bicep.root import bracket

# Force per elongation [N/m] of a wire that is wholly in one phase.
ELASTICITY = 5e3
# First step [m] of the search for the balance, at least; how exactly it is found [m].
FIRST_STEP, EXACT = 1e-5, 1e-11
# About how far the muscles go for a load that is missing [m/N].
USUAL_GAIN = 1e-3


class Bundle:
    """
    Parallel muscles, each with a memory of its own, that end on one clamp.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2 of one muscle; it is copied for each.
    offsets : tuple of float
        Excess length dL_i [m] of each muscle, so that it is stretched by ``L - dL_i``.
    """

    def __init__(self, operator, offsets):
        self.operators = [copy.deepcopy(operator) for _ in offsets]
        self.offsets = offsets

    def reset(self) -> None:
        """Wipe the memories."""
        for operator in self.operators:
            operator.reset()

    def inputs(self, output: float) -> list[float]:
        """
        Return each muscle's input ``u_i = F_i - x`` at the common elongation `output` [m].

        Beyond what the transformation can give, only the wire's elasticity gives way.
        """
        inputs = []
        for operator, excess in zip(self.operators, self.offsets):
            wanted = output - excess
            u, given, _ = operator.solve(wanted)
            inputs.append(u + ELASTICITY * (wanted - given))
        return inputs

    @staticmethod
    def share(inputs, x: float) -> float:
        """Return the mean load for each muscle's input; a wire cannot push."""
        return sum(max(u + x, 0.0) for u in inputs) / len(inputs)

    def drive(self, inputs, load: float) -> float:
        """Return the x under which the muscles together carry `load` each: `share` inverted."""
        # The tightest muscles first, until the next one would not be slack any more.
        tight = sorted(inputs, reverse=True)
        total = 0.0
        for count, u in enumerate(tight, start=1):
            total += u
            x = (load * len(tight) - total) / count
            if count == len(tight) or tight[count] + x <= 0.0:
                break
        return x

    def settle(self, load, x: float, low: float, high: float, near: float) -> float:
        """
        Return the elongation in which the muscles carry what they have to; commits nothing.

        Parameters
        ----------
        load : callable
            Load for each muscle at an elongation.
        x : float
            Output of the first stage.
        low, high, near : float
            Limits of the elongation, and where to look first [m].
        """
        def lacking(output):
            return load(output) - self.share(self.inputs(output), x)

        near = min(max(near, low), high)
        here = lacking(near)
        if here == 0.0:
            return near
        step = math.copysign(max(abs(here) * USUAL_GAIN, FIRST_STEP), here)
        near, here, far, there = bracket(lacking, near, here, step, low, high)
        if here * there < 0.0:
            far = optimize.brentq(lacking, near, far, xtol=EXACT, rtol=1e-14)
        return far

    def step(self, inputs) -> None:
        """Commit each muscle's input."""
        for operator, u in zip(self.operators, inputs):
            operator.step(u)
