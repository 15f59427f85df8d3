# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parallel muscles of unequal length, which share the load as their own memories allow.

A muscle that lacks dL_i is stretched further than the mean one and bears more. What it bears more
strains its wire further, and stretches it elastically:
``S(F_i) (H2[u_i] - L0) + c (F_i - F') = S(F) (H - L0) - dL_i``, with S the factor on the strain
under a load, c the compliance, F the load of the mean muscle at rest, H what the transformation
gives under that load, and F' the load under which the mean wire is not stretched any further: F,
or where the wires' own compliance is not known the load of the mean muscle in motion. Where
martensite keeps a share of its strain, ``S(F_i) (H2[u_i] - L0)`` is what `formation` says instead.
u_i follows ``v_i = F_i - x`` with the play that its own load says (`load_play`).
"""

from typing import NamedTuple

import numpy as np

from . import root
from .clip import clip
from .formation import keep, LOAD, ORIENTED, parts, SIZE
from .jit import remember_types
from .lean import inlined, lean
from .load_play import held
from .operator import last_input, last_output, orient, peek, step

# About how far muscles go for a load that is missing [m/N], to begin a search with.
TYPICAL_COMPLIANCE = 1e-3
# What the search needs in an array: its own entries and the factor on the first step.
GAIN = root.SIZE
SEARCH = root.SIZE + 1
# Evaluations in the search for the input of one muscle.
MOST_EVALUATIONS = 60


@remember_types
class Wires(NamedTuple):
    """
    Parallel muscles, each with a memory of its own.

    `table` is that of H2 and `base` [m] its least output; `offsets` (M,) [m] are the excess
    lengths, `compliance` [m/N] that of a wire, and `tolerance` [N] the load that may be missing.
    `scales` (m,) is the factor on the strain, and `widths` (m,) by how much the loop is wider than
    that of H2, at loads `spacing` [N] apart from `lightest` on, as the transformation feels them.
    `oriented` (m,) is the share of what forms that these loads orient, where `orients` says that it
    counts (see `kinetics`). `elastic` says whether the compliance is the wires' own, not a typical
    one. `kept` is the share of the strain that martensite keeps (see `formation`), `anew` whether a
    heavier load orients it anew, and `cooled` whether what is there at the start formed on the way
    down to rest.
    """

    table: np.ndarray
    base: float
    offsets: np.ndarray
    compliance: float
    tolerance: float
    scales: np.ndarray
    widths: np.ndarray
    oriented: np.ndarray
    lightest: float
    spacing: float
    orients: bool
    elastic: bool
    kept: float
    anew: bool
    cooled: bool


@inlined
def scale_at(wires: Wires, load: float) -> float:
    """Return the factor on the strain under a load, as the transformation feels it."""
    return _looked_up(wires, wires.scales, load)


@inlined
def width_at(wires: Wires, load: float) -> float:
    """Return by how much the loop is wider than that of H2, under a load as it feels it."""
    return _looked_up(wires, wires.widths, load)


@inlined
def orient_under(wires: Wires, memory: np.ndarray, muscles: np.ndarray, i: int, load: float
                 ) -> None:
    """Let a load, as the transformation feels it, orient its share of what forms in a muscle."""
    if wires.orients:
        muscles[i, ORIENTED] = _looked_up(wires, wires.oriented, load)
        orient(wires.table, memory, muscles[i, ORIENTED])


@inlined
def _looked_up(wires: Wires, values: np.ndarray, load: float) -> float:
    """Return the value of a table (m,) under a load, as the transformation feels it."""
    last = len(values) - 1
    if last == 0:
        return values[0]
    place = clip((load - wires.lightest) / wires.spacing, 0.0, float(last))
    k = min(int(place), last - 1)
    return values[k] + (place - k) * (values[k + 1] - values[k])


@inlined
def input_for(wires: Wires, memory: np.ndarray, v: float, x: float) -> float:
    """Return the input of H2 of a muscle with ``v = F - x``."""
    return held(last_input(wires.table, memory), v, width_at(wires, v + x))


@inlined
def loads_for(wires: Wires, memories: np.ndarray, output: float, load: float, moving: float,
              x: float, muscles: np.ndarray) -> None:
    """
    Put each muscle's ``v_i = F_i - x`` for an output under a mean load into `muscles`.

    `load` is that of the arm at rest, and `moving` that of the arm in motion. What `muscles` holds
    is where the search begins; its other columns say what martensite keeps.
    """
    unstretched = load if wires.elastic else moving
    for i in range(len(wires.offsets)):
        muscles[i, LOAD] = _load_for(wires, memories[i], muscles, i, output, load, unstretched, x)


@inlined
def _load_for(wires: Wires, memory: np.ndarray, muscles: np.ndarray, i: int, output: float,
              load: float, unstretched: float, x: float) -> float:
    """Return v of one muscle, by stepping outward and then by false position."""
    tolerance = wires.tolerance * wires.compliance
    near = muscles[i, LOAD]
    here = _excess(wires, memory, muscles, i, near, output, load, unstretched, x)
    if abs(here) <= tolerance:
        return near
    # The elastic part alone brings a muscle where it has to be on this way.
    limit = near - here * scale_at(wires, load) / wires.compliance
    stride = -here / TYPICAL_COMPLIANCE
    far, there, count = near, here, 0
    while here * there > 0.0 and abs(there) > tolerance and count < MOST_EVALUATIONS:
        near, here = far, there
        far = near + stride
        far = min(far, limit) if stride > 0.0 else max(far, limit)
        there = _excess(wires, memory, muscles, i, far, output, load, unstretched, x)
        stride = root.outward(near, here, far, there, stride)
        count += 1
    while abs(there) > tolerance and there != here and count < MOST_EVALUATIONS:
        point = far - there * (far - near) / (there - here)
        value = _excess(wires, memory, muscles, i, point, output, load, unstretched, x)
        if value * there < 0.0:
            near, here = far, there
        else:
            here *= root.retained_factor(there, value)
        far, there = point, value
        count += 1
    return far


@inlined
def _excess(wires: Wires, memory: np.ndarray, muscles: np.ndarray, i: int, v: float,
            output: float, load: float, unstretched: float, x: float) -> float:
    """Return how much longer a muscle with a load v + x is than the others let it be [m]."""
    orient_under(wires, memory, muscles, i, v + x)
    mean, given = scale_at(wires, load), peek(wires.table, memory, input_for(wires, memory, v, x))
    strained, held = parts(wires.kept, muscles, i, given - wires.base)
    return (scale_at(wires, v + x) * strained + held + wires.compliance * (v + x - unstretched)
            + wires.offsets[i]) / mean - (output - wires.base)


@lean
def mean_load(muscles: np.ndarray, x: float) -> float:
    """Return the mean load for each muscle's v; a wire cannot push."""
    total = 0.0
    for i in range(len(muscles)):
        total += max(muscles[i, LOAD] + x, 0.0)
    return total / len(muscles)


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
        total += last_output(wires.table, memories[i])
    return total / len(wires.offsets)


@lean
def commit(wires: Wires, memories: np.ndarray, muscles: np.ndarray, x: float) -> None:
    """Commit each muscle's v."""
    for i in range(len(wires.offsets)):
        v = muscles[i, LOAD]
        orient_under(wires, memories[i], muscles, i, v + x)
        step(wires.table, memories[i], input_for(wires, memories[i], v, x))
        if wires.kept != 0.0:
            keep(muscles, i, last_output(wires.table, memories[i]) - wires.base,
                 scale_at(wires, v + x), wires.anew)


@lean
def keep_gain(search: np.ndarray, at: int, moved: float, scale: float, here: float) -> None:
    """Remember how far the root was against what the scale said."""
    search[at + GAIN] = min(max(abs(moved / (scale * here)), 0.01), 100.0)


@lean
def drive(wires: Wires, memories: np.ndarray, search: np.ndarray, output: float, load: float,
          muscles: np.ndarray) -> float:
    """Return the x [N] under which the muscles give `output` [m] and bear `load` [N] each."""
    near = load - mean_input(wires, memories)
    loads_for(wires, memories, output, load, load, near, muscles)
    here = load - mean_load(muscles, near)
    if abs(here) <= wires.tolerance:
        return near
    x = root.begin(search, 0, near, here, search[GAIN] * here, -np.inf, np.inf, wires.tolerance)
    while root.searching(search, 0):
        loads_for(wires, memories, output, load, load, x, muscles)
        x = root.proceed(search, 0, load - mean_load(muscles, x))
    keep_gain(search, 0, x - near, 1.0, here)
    return x


@lean
def respond(wires: Wires, memories: np.ndarray, search: np.ndarray, x: float, load: float,
            low: float, high: float, near: float, muscles: np.ndarray, following: np.ndarray
            ) -> float:
    """
    Return the output [m] that the muscles give under x and a load.

    Commits nothing; the output is looked for between `low` and `high`, first at `near`. The input
    of each muscle and what its martensite keeps then go to `following`, shape (muscles, 5).
    """
    output = near = min(max(near, low), high)
    loads_for(wires, memories, near, load, load, x, muscles)
    here = load - mean_load(muscles, x)
    if abs(here) > wires.tolerance:
        output = root.begin(search, 0, near, here, TYPICAL_COMPLIANCE * search[GAIN] * here, low,
                            high, wires.tolerance)
        while root.searching(search, 0):
            loads_for(wires, memories, output, load, load, x, muscles)
            output = root.proceed(search, 0, load - mean_load(muscles, x))
        if low < output < high:
            keep_gain(search, 0, output - near, TYPICAL_COMPLIANCE, here)
    for i in range(len(muscles)):
        v = muscles[i, LOAD]
        u = input_for(wires, memories[i], v, x)
        orient_under(wires, memories[i], muscles, i, v + x)
        for k in range(SIZE):
            following[i, k] = muscles[i, k]
        following[i, LOAD] = u
        if wires.kept != 0.0:
            keep(following, i, peek(wires.table, memories[i], u) - wires.base,
                 scale_at(wires, v + x), wires.anew)
    return output
