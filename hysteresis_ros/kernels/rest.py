# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The arm at rest: where the muscle is as long as the arm lets it, under the load that the arm asks.

``L(theta) = H2[F(theta) - x]``, and the unknown is ``u = F - x``, because H2 then gives all else.
"""

import math

import numpy as np

from . import bundle, grid, root
from .arm import (
    ANGLE, Arm, BUNDLE_SEARCH, DEMAND, demand_at, factor_at, LINE, LOAD, LOOSER, place, present,
    required, REST_GAIN, REST_SEARCH, State, VELOCITY, width)
from .formation import keep, LOAD as BEYOND, parts
from .lean import inlined, lean
from .operator import last_input, last_output, peek, solve, step

# Secants of the load whose play is taken up: the loop's width is nearly a line of the load. Putting
# it in anew ends nowhere where the width falls as fast as the load grows.
SECANTS = 12


@inlined
def settle(arm: Arm, state: State, line: int, x: float, offset: float, factor: float
           ) -> tuple[int, float]:
    """Commit the u next to the present one at which one muscle balances, and return the place."""
    table, memory, motion = arm.wires.table, state.memories[0], state.motion
    start = u = last_input(table, memory)
    here, play = _lacking(arm, state, line, u, x, offset, factor, 0.0), 0.0
    if arm.plays and here > 0.0:
        # On the way to the cold the play is taken up first.
        whole = _lacking(arm, state, line, u, x, offset, factor, 1.0)
        if whole < 0.0:
            _take_up(arm, state, line, u, x, offset, factor, here, whole)
        here, play = max(whole, 0.0), 1.0
    if abs(here) > arm.tolerance:
        u = root.begin(motion, REST_SEARCH, u, here, here * motion[REST_GAIN], -np.inf, np.inf,
                       arm.tolerance)
        while root.searching(motion, REST_SEARCH):
            u = root.proceed(
                motion, REST_SEARCH, _lacking(arm, state, line, u, x, offset, factor, play))
        motion[REST_GAIN] = min(max((u - start) / here, 0.5), 10.0)
        _orient(arm, state, u, x, play)
        step(table, memory, u)
    output = last_output(table, memory) - arm.base
    k, share = _place(arm, state, line, output, offset, factor)
    if arm.wires.kept != 0.0:
        keep(state.muscles, 0, output, factor_at(arm, line, k, share), arm.wires.anew)
    return k, share


@inlined
def _take_up(arm: Arm, state: State, line: int, u: float, x: float, offset: float, factor: float,
             here: float, whole: float) -> None:
    """Let a load that takes up a part of the play orient its share, while H2's input stays."""
    if arm.wires.orients:
        part = root.between(state.motion, REST_SEARCH, 0.0, here, 1.0, whole, arm.tolerance)
        while root.searching(state.motion, REST_SEARCH):
            part = root.proceed(state.motion, REST_SEARCH, _lacking(
                arm, state, line, u, x, offset, factor, part))
        _orient(arm, state, u, x, part)


@inlined
def _place(arm: Arm, state: State, line: int, output: float, offset: float, factor: float
           ) -> tuple[int, float]:
    """Return the place at which one muscle's H2 gives an output above its least [m]."""
    strained, held = parts(arm.wires.kept, state.muscles, 0, output)
    return place(arm, state.motion, line, factor * strained, offset + factor * held)


@inlined
def _lacking(arm: Arm, state: State, line: int, u: float, x: float, offset: float, factor: float,
             play: float) -> float:
    """
    Return the load that the arm asks for beyond the one under which H2 has the input u.

    `play` is the share of the play that is taken up: 0 where the muscle heats, 1 where it cools.
    """
    _orient(arm, state, u, x, play)
    output = peek(arm.wires.table, state.memories[0], u)
    k, share = _place(arm, state, line, output - arm.base, offset, factor)
    load = grid.between(arm.grid, LOAD + LINE * line, k, share)
    return load - play * width(arm, line, k, share) - x - u


@inlined
def _orient(arm: Arm, state: State, u: float, x: float, play: float) -> None:
    """Let the load under which H2 has an input orient its share; see `_lacking`."""
    load = u + x
    if play > 0.0 and arm.wires.orients:
        load = _with_play(arm, load, play)
    bundle.orient_under(arm.wires, state.memories[0], state.muscles, 0, load)


@inlined
def _with_play(arm: Arm, without: float, play: float) -> float:
    """Return the load F for what is left of it without a share of the play, F - play w(F)."""
    before = load = without
    wrong = missing = play * bundle.width_at(arm.wires, load)
    for _ in range(SECANTS):
        if abs(missing) <= arm.tolerance:
            break
        # The first step is the one that a width of its own would take.
        step = missing if load == before else missing * (load - before) / (wrong - missing)
        before, wrong = load, missing
        load += step
        missing = without + play * bundle.width_at(arm.wires, load) - load
        if missing == wrong:
            break
    return load


@inlined
def settle_bundle(arm: Arm, state: State, line: int, x: float, offset: float, factor: float,
                  dt: float) -> tuple[int, float]:
    """Commit what unequal muscles do, and return the place where they balance."""
    motion, last = state.motion, len(arm.grid) - 1
    near = float(last)
    if not math.isnan(motion[ANGLE]):
        k, share = present(arm, motion)
        near = min(max(k - 1 + share, 0.0), float(last))
    point = near
    k, share, here = _lacking_bundle(arm, state, line, point, x, offset, factor, dt)
    tolerance = arm.tolerance if dt == 0.0 else LOOSER * arm.tolerance
    if abs(here) > tolerance:
        # Along the grid the muscles give way by about this much.
        column = DEMAND + LINE * line
        scale = bundle.TYPICAL_COMPLIANCE * last / (
            arm.grid[last, column] - arm.grid[0, column])
        point = root.begin(
            motion, BUNDLE_SEARCH, near, here, scale * motion[BUNDLE_SEARCH + bundle.GAIN] * here,
            0.0, float(last), tolerance)
        while root.searching(motion, BUNDLE_SEARCH):
            k, share, missing = _lacking_bundle(
                arm, state, line, point, x, offset, factor, dt)
            point = root.proceed(motion, BUNDLE_SEARCH, missing)
        if 0.0 < point < last:
            bundle.keep_gain(motion, BUNDLE_SEARCH, point - near, scale, here)
    bundle.commit(arm.wires, state.memories, state.muscles, x)
    return k, share


@inlined
def _lacking_bundle(arm: Arm, state: State, line: int, point: float, x: float, offset: float,
                    factor: float, dt: float) -> tuple[int, float, float]:
    """Return the place at a point of the grid, and the load that is missing there."""
    k = min(int(point), len(arm.grid) - 2) + 1
    share = point - (k - 1)
    load = required(arm, state.motion, line, k, share, dt)
    return k, share, load - _borne(arm, state, line, k, share, load, x, offset, factor)


@lean
def bundle_load_at(arm: Arm, state: State, x: float, offset: float, factor: float, k: int,
                   share: float) -> float:
    """Return the mean load that unequal muscles bear at a place of the arm under a new x."""
    load = required(arm, state.motion, 0, k, share, 0.0)
    return _borne(arm, state, 0, k, share, load, x, offset, factor)


@inlined
def _borne(arm: Arm, state: State, line: int, k: int, share: float, load: float, x: float,
           offset: float, factor: float) -> float:
    """Return the mean load that unequal muscles bear at a place that asks for a load."""
    output = arm.base + demand_at(arm, line, k, share, offset) / factor
    # The demand is that of the arm at rest.
    at_rest = required(arm, state.motion, line, k, share, 0.0)
    bundle.loads_for(arm.wires, state.memories, output, at_rest, load, x, state.muscles)
    return bundle.mean_load(state.muscles, x)


@inlined
def direction(arm: Arm, state: State, x: float, offset: float, factor: float, dt: float) -> int:
    """Return in which direction the arm slides: 1 down, -1 up, 0 where friction holds it."""
    motion = state.motion
    k, share = present(arm, motion)
    # Of what friction can take in motion, so much at rest.
    most = 1.0 + arm.stiction if motion[VELOCITY] == 0.0 else 1.0
    if arm.rigid:
        tension = max(last_input(arm.wires.table, state.memories[0]) + x, 0.0)
        if _required_held(arm, state, 1, k, share, most, dt) - width(arm, 1, k, share) > tension:
            return 1
        return -1 if _required_held(arm, state, 2, k, share, most, dt) < tension else 0
    sinking = _lacking_held(arm, state, k, share, most, x, offset, factor, dt)
    if sinking > 0.0:
        return 1
    rising = _lacking_held(arm, state, k, share, -most, x, offset, factor, dt)
    if rising < 0.0:
        return -1
    drag = root.between(motion, REST_SEARCH, most, sinking, -most, rising, arm.tolerance)
    while root.searching(motion, REST_SEARCH):
        drag = root.proceed(motion, REST_SEARCH, _lacking_held(
            arm, state, k, share, drag, x, offset, factor, dt))
    # The arm stands still, but its load has changed, and with it what the load does.
    bundle.commit(arm.wires, state.memories, state.muscles, x)
    return 0


@inlined
def _lacking_held(arm: Arm, state: State, k: int, share: float, drag: float, x: float,
                  offset: float, factor: float, dt: float) -> float:
    """Return the load that is missing where friction takes a part of that in motion."""
    edge, part = 1 if drag > 0.0 else 2, abs(drag)
    demand = demand_at(arm, 0, k, share, offset)
    demand += part * (demand_at(arm, edge, k, share, offset) - demand)
    load = _required_held(arm, state, edge, k, share, part, dt)
    at_rest = _required_held(arm, state, edge, k, share, part, 0.0)
    output = arm.base + demand / factor
    if (arm.plays or arm.wires.kept != 0.0 or arm.wires.orients
            or len(arm.wires.offsets) > 1):
        bundle.loads_for(arm.wires, state.memories, output, at_rest, load, x, state.muscles)
    else:
        state.muscles[0, BEYOND] = solve(arm.wires.table, state.memories[0], output)[0]
    return load - bundle.mean_load(state.muscles, x)


@inlined
def _required_held(arm: Arm, state: State, edge: int, k: int, share: float, part: float,
                   dt: float) -> float:
    """Return the load that the arm asks for where friction takes a part of that in motion."""
    load = required(arm, state.motion, 0, k, share, dt)
    load += part * (required(arm, state.motion, edge, k, share, dt) - load)
    # A wire cannot push.
    return load if part <= 1.0 else max(load, 0.0)
