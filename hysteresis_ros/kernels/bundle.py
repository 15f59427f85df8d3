# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parallel muscles of unequal length, which share the load as their own memories allow.

A muscle that lacks dL_i is stretched further than the mean one and bears more. What it bears more
stretches its wire elastically, too: ``H2[u_i] + c (u_i - u) = L - dL_i``, with c the compliance, u
the input that goes with the mean load, and L what the transformation gives under that. A
compliance is a reversible weight, so H2 with it has an exact inverse, which no plateau interrupts.
"""

from typing import NamedTuple

import numpy as np

from . import root
from .lean import lean
from .operator import last_input, last_output, solve, step

# About how far muscles go for a load that is missing [m/N], to begin a search with.
TYPICAL_COMPLIANCE = 1e-3
# What the search needs in an array: its own entries and the factor on the first step.
GAIN = root.SIZE
SEARCH = root.SIZE + 1


class Wires(NamedTuple):
    """
    Parallel muscles, each with a memory of its own.

    `table` is that of H2 with the compliance `inside` [m/N], which is 0 where the wires are
    elastic only beyond what H2 can give; `offsets` (M,) [m] are the excess lengths, `compliance`
    [m/N] that of a wire, `middle` [N] the middle of H2's input range, and `tolerance` [N] the load
    that may be missing.
    """

    table: np.ndarray
    offsets: np.ndarray
    compliance: float
    inside: float
    middle: float
    tolerance: float


@lean
def inputs_for(wires: Wires, memories: np.ndarray, output: float, mean: float, inputs: np.ndarray
               ) -> None:
    """Put each muscle's input ``u_i = F_i - x`` for an output under a mean one into `inputs`."""
    stretched = output + wires.inside * (mean - wires.middle)
    for i in range(len(wires.offsets)):
        wanted = stretched - wires.offsets[i]
        u, given, _ = solve(wires.table, memories[i], wanted)
        inputs[i] = u + (wanted - given) / wires.compliance


@lean
def mean_load(inputs: np.ndarray, x: float) -> float:
    """Return the mean load for each muscle's input; a wire cannot push."""
    total = 0.0
    for i in range(len(inputs)):
        total += max(inputs[i] + x, 0.0)
    return total / len(inputs)


@lean
def mean_input(wires: Wires, memories: np.ndarray) -> float:
    """Return the mean of the inputs committed last."""
    total = 0.0
    for i in range(len(wires.offsets)):
        total += last_input(wires.table, memories[i])
    return total / len(wires.offsets)


@lean
def mean_output(wires: Wires, memories: np.ndarray) -> float:
    """Return what the transformation gives [m], the mean of the muscles."""
    total = 0.0
    for i in range(len(wires.offsets)):
        total += (last_output(wires.table, memories[i])
                  - wires.inside * (last_input(wires.table, memories[i]) - wires.middle))
    return total / len(wires.offsets)


@lean
def mean_offset(wires: Wires) -> float:
    """Return the mean of the excess lengths [m]."""
    total = 0.0
    for i in range(len(wires.offsets)):
        total += wires.offsets[i]
    return total / len(wires.offsets)


@lean
def commit(wires: Wires, memories: np.ndarray, inputs: np.ndarray) -> None:
    """Commit each muscle's input."""
    for i in range(len(wires.offsets)):
        step(wires.table, memories[i], inputs[i])


@lean
def keep_gain(search: np.ndarray, at: int, moved: float, scale: float, here: float) -> None:
    """Remember how far the root was against what the scale said."""
    search[at + GAIN] = min(max(abs(moved / (scale * here)), 0.01), 100.0)


@lean
def drive(wires: Wires, memories: np.ndarray, search: np.ndarray, output: float, load: float,
          inputs: np.ndarray) -> float:
    """Return the x [N] under which the muscles give `output` [m] and bear `load` [N] each."""
    near = load - mean_input(wires, memories)
    inputs_for(wires, memories, output, load - near, inputs)
    here = load - mean_load(inputs, near)
    if abs(here) <= wires.tolerance:
        return near
    x = root.begin(search, 0, near, here, search[GAIN] * here, -np.inf, np.inf, wires.tolerance)
    while root.searching(search, 0):
        inputs_for(wires, memories, output, load - x, inputs)
        x = root.proceed(search, 0, load - mean_load(inputs, x))
    keep_gain(search, 0, x - near, 1.0, here)
    return x


@lean
def respond(wires: Wires, memories: np.ndarray, search: np.ndarray, x: float, load: float,
            low: float, high: float, near: float, inputs: np.ndarray) -> float:
    """
    Return the output [m] that the muscles give under x and a load, and put their inputs in place.

    Commits nothing; the output is looked for between `low` and `high`, first at `near`.
    """
    near = min(max(near, low), high)
    inputs_for(wires, memories, near, load - x, inputs)
    here = load - mean_load(inputs, x)
    if abs(here) <= wires.tolerance:
        return near
    output = root.begin(search, 0, near, here, TYPICAL_COMPLIANCE * search[GAIN] * here, low, high,
                        wires.tolerance)
    while root.searching(search, 0):
        inputs_for(wires, memories, output, load - x, inputs)
        output = root.proceed(search, 0, load - mean_load(inputs, x))
    if low < output < high:
        keep_gain(search, 0, output - near, TYPICAL_COMPLIANCE, here)
    return output
