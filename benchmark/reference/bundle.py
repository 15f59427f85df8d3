# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parallel muscles of unequal length, which share the load as their own memories allow.

A muscle that lacks dL_i is stretched further than the mean one and bears more. What it bears more
stretches its wire elastically, too: ``H2[u_i] + c (u_i - u) = L - dL_i``, with c the compliance, u
the input that goes with the mean load, and L what the transformation gives under that. A
compliance is a reversible weight, so H2 with it has an exact inverse, which no plateau interrupts.
"""

import copy

from benchmark.reference.root import bracket, illinois
from benchmark.reference.preisach import Preisach

# Compliance [m/N] of a wire whose own is not known.
COMPLIANCE = 2e-4
# About how far muscles go for a load that is missing [m/N], to begin a search with.
TYPICAL_COMPLIANCE = 1e-3


class Bundle:
    """
    Parallel muscles, each with a memory of its own, that end on one clamp.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2 of one muscle; it is copied for each.
    offsets : tuple of float
        Excess length dL_i [m] of each muscle.
    compliance : float
        Elastic compliance of a wire [m/N]; 0 for a typical wire's.
    """

    def __init__(self, operator, offsets, compliance: float = 0.0):
        self.offsets = offsets
        self.tolerance = 1e-10 * (operator.upper - operator.lower)
        self._compliance = compliance or COMPLIANCE
        # Of other operators the wires are elastic only beyond what H2 can give.
        self._inside = self._compliance if isinstance(operator, Preisach) else 0.0
        self._middle = 0.5 * (operator.lower + operator.upper)
        if self._inside:
            operator = operator.tilted(self._inside)
        self.operators = [copy.deepcopy(operator) for _ in offsets]
        self._gain = 1.0

    @property
    def output(self) -> float:
        """What the transformation gives [m], the mean of the muscles."""
        return sum(operator.output - self._inside * (operator.input - self._middle)
                   for operator in self.operators) / len(self.operators)

    def inputs(self, output: float, mean: float) -> list[float]:
        """
        Return each muscle's input ``u_i = F_i - x``.

        Parameters
        ----------
        output : float
            What the transformation gives under the mean load [m].
        mean : float
            Input that goes with the mean load [N].
        """
        stretched = output + self._inside * (mean - self._middle)
        inputs = []
        for operator, excess in zip(self.operators, self.offsets):
            wanted = stretched - excess
            u, given, _ = operator.solve(wanted)
            inputs.append(u + (wanted - given) / self._compliance)
        return inputs

    @staticmethod
    def share(inputs, x: float) -> float:
        """Return the mean load for each muscle's input; a wire cannot push."""
        return sum(max(u + x, 0.0) for u in inputs) / len(inputs)

    def drive(self, output: float, load: float) -> float:
        """Return the x [N] under which the muscles give `output` [m] and bear `load` [N] each."""
        def lacking(x):
            return load - self.share(self.inputs(output, load - x), x)

        middle = load - sum(operator.input for operator in self.operators) / len(self.operators)
        return self._root(lacking, middle, 1.0)

    def settle(self, state, x: float, low: float, high: float, near: float,
               scale: float) -> tuple[float, list[float]]:
        """
        Return where the muscles carry what they have to, and their inputs; commits nothing.

        Parameters
        ----------
        state : callable
            Gives output [m] and load [N] for each muscle at a place; both never fall with it.
        x : float
            Output of the first stage.
        low, high, near : float
            Limits of the place, and where to look first.
        scale : float
            About how far the place moves for 1 N that is missing.
        """
        found = []

        def lacking(place):
            output, load = state(place)
            found[:] = self.inputs(output, load - x)
            return load - self.share(found, x)

        # The last call of the search is at the place that it finds.
        return self._root(lacking, min(max(near, low), high), scale, low, high), found

    def _root(self, lacking, near, scale, *limits):
        here = lacking(near)
        if abs(here) <= self.tolerance:
            return near
        points = bracket(lacking, near, here, scale * self._gain * here, *limits)
        if points[1] * points[3] > 0.0:
            return points[2]
        found = illinois(lacking, *points, self.tolerance)
        self._gain = min(max(abs((found - near) / (scale * here)), 0.01), 100.0)
        return found
