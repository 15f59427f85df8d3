# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
An arm in motion, over one dt.

The muscle pulls with what the arm asks for at rest, less what friction and inertia take:
``n F r(theta) g = tau(theta) - tau_c - b dtheta/dt - I d2theta/dt2``, where g is what a cable makes
of a tension of one. It gives way as always, so an acceleration also stretches what is elastic in
it, and an arm that swings faster than its muscle shortens leaves the muscle loose.
"""

import math

from . import grid, root
from .arm import (
    Arm, INSIDE, LENGTH, LEVERAGE, LOOP, LOOSER, MOMENT, moved, NEAR_LENGTH, NEAR_LOAD,
    REST_SEARCH, SCALE, State, STRETCH, SWING_GAIN, THETA)
from .bundle import orient_under, TYPICAL_COMPLIANCE
from .clip import clip
from .formation import keep, parts
from .lean import inlined, lean
from .load_play import held
from .operator import last_input, last_output, peek, step

# Least share of a load that is missing by which the load changes in a dt.
LEAST_GAIN = 1e-3
# How exactly an elongation [m] is met.
EXACT = 1e-9


@inlined
def swing(arm: Arm, state: State, x: float, offset: float, factor: float, friction: float,
          grip: float, dt: float) -> tuple[int, float]:
    """
    Commit what the muscle does within dt and return the place at which the arm ends.

    Parameters
    ----------
    arm, state : Arm, State
    x : float
        Output of the first stage.
    offset, factor : float
        What time and use add to the elongation [m] and do to the stroke.
    friction : float
        Moment of dry friction against the motion [N m].
    grip : float
        Tension at the arm over that of the muscle.
    dt : float
        Time [s].
    """
    table, memory, motion = arm.wires.table, state.memories[0], state.motion
    # Friction and inertia are linear in the angle at the end of dt.
    speed, acceleration = moved(motion, 0.0, dt)
    faster, more = moved(motion, 1.0, dt)
    drag = friction + arm.viscous * speed + arm.inertia * acceleration
    slope = arm.viscous * (faster - speed) + arm.inertia * (more - acceleration)
    tolerance = LOOSER * arm.tolerance
    start = u = last_input(table, memory)
    k, share, here = _lacking(arm, state, u, x, offset, factor, drag, slope, grip)
    if abs(here) > tolerance:
        u = root.begin(motion, REST_SEARCH, u, here, here * motion[SWING_GAIN], -math.inf,
                       math.inf, tolerance)
        while root.searching(motion, REST_SEARCH):
            k, share, missing = _lacking(arm, state, u, x, offset, factor, drag, slope, grip)
            u = root.proceed(motion, REST_SEARCH, missing)
        motion[SWING_GAIN] = min(max((u - start) / here, LEAST_GAIN), 1.5)
    if u + x < arm.loads[0, INSIDE]:
        u = arm.loads[0, INSIDE] - x
        k, share = _fly(arm, drag, slope)
    orient_under(arm.wires, memory, state.muscles, 0, u + x)
    step(table, memory, _input(arm, state, u, x))
    if arm.wires.kept != 0.0:
        n, part = _load_at(arm, state, u, x)
        keep(state.muscles, 0, last_output(table, memory) - arm.base,
             grid.between(arm.loads, SCALE, n, max(part, 0.0)), arm.wires.anew)
    return k, share


@lean
def load_at(arm: Arm, state: State, x: float, offset: float, factor: float, k: int, share: float
            ) -> float:
    """Return the load that the muscle bears at a place of the arm under a new x."""
    table, memory, motion = arm.wires.table, state.memories[0], state.motion
    wanted = grid.between(arm.grid, LENGTH, k, share)
    u = last_input(table, memory)
    load, length = _muscle(arm, state, u, x, offset, factor)
    here = wanted - length
    if here != 0.0:
        last = len(arm.loads) - 1
        u = root.begin(motion, REST_SEARCH, u, here, here / TYPICAL_COMPLIANCE,
                       arm.loads[0, INSIDE] - x, arm.loads[last, INSIDE] - x, EXACT)
        while root.searching(motion, REST_SEARCH):
            load, length = _muscle(arm, state, u, x, offset, factor)
            u = root.proceed(motion, REST_SEARCH, wanted - length)
    return load


@inlined
def _lacking(arm: Arm, state: State, u: float, x: float, offset: float, factor: float, drag: float,
             slope: float, grip: float) -> tuple[int, float, float]:
    """Return the place where the muscle with the input u is, and the load missing there."""
    load, length = _muscle(arm, state, u, x, offset, factor)
    k = grid.interval(arm.grid, LENGTH, length, int(state.motion[NEAR_LENGTH]))
    state.motion[NEAR_LENGTH] = k
    share = (length - arm.grid[k - 1, LENGTH]) / (
        arm.grid[k, LENGTH] - arm.grid[k - 1, LENGTH])
    share = clip(share, 0.0, 1.0)
    return k, share, _needed(arm, k, share, drag, slope, grip) - load


@inlined
def _muscle(arm: Arm, state: State, u: float, x: float, offset: float, factor: float
            ) -> tuple[float, float]:
    """Return the load of the muscle that is u beyond x, as it feels it, and its elongation."""
    n, part = _load_at(arm, state, u, x)
    load = (n - 1 + part) * arm.spacing
    # A loose muscle's load goes on falling, so that the root can be found.
    part = clip(part, 0.0, math.inf)
    scale = grid.between(arm.loads, SCALE, n, part)
    orient_under(arm.wires, state.memories[0], state.muscles, 0, u + x)
    output = peek(arm.wires.table, state.memories[0], _input(arm, state, u, x))
    strained, held = parts(arm.wires.kept, state.muscles, 0, output - arm.base)
    return load, (arm.base + (scale * factor * strained + factor * held)
                  + grid.between(arm.loads, STRETCH, n, part) + offset)


@inlined
def _load_at(arm: Arm, state: State, u: float, x: float) -> tuple[int, float]:
    """Return the place in the table of loads of the muscle that is u beyond x."""
    n = grid.interval(arm.loads, INSIDE, u + x, int(state.motion[NEAR_LOAD]))
    state.motion[NEAR_LOAD] = n
    return n, (u + x - arm.loads[n - 1, INSIDE]) / (
        arm.loads[n, INSIDE] - arm.loads[n - 1, INSIDE])


@inlined
def _input(arm: Arm, state: State, u: float, x: float) -> float:
    """Return the input of H2 for a load that is u beyond x, as the transformation feels it."""
    if not arm.plays:
        return u
    n, part = _load_at(arm, state, u, x)
    loop = clip(grid.between(arm.loads, LOOP, n, part), 0.0, math.inf)
    return held(last_input(arm.wires.table, state.memories[0]), u, loop)


@inlined
def _pull(arm: Arm, k: int, share: float, drag: float, slope: float) -> float:
    """Return the moment that the muscles have to hold at a place where the arm may end."""
    return (grid.between(arm.grid, MOMENT, k, share) - drag
            - slope * grid.between(arm.grid, THETA, k, share))


@inlined
def _needed(arm: Arm, k: int, share: float, drag: float, slope: float, grip: float) -> float:
    """Return the load that the arm asks of the muscle there."""
    return _pull(arm, k, share, drag, slope) / (
        grid.between(arm.grid, LEVERAGE, k, share) * grip)


@lean
def _fly(arm: Arm, drag: float, slope: float) -> tuple[int, float]:
    """Return the place of an arm without a pull."""
    low, high = 0, len(arm.grid) - 1
    if _pull(arm, 1, 0.0, drag, slope) <= 0.0:
        return 1, 0.0
    if _pull(arm, high, 1.0, drag, slope) >= 0.0:
        return high, 1.0
    while high - low > 1:
        middle = (low + high) // 2
        if _pull(arm, middle, 1.0, drag, slope) > 0.0:
            low = middle
        else:
            high = middle
    above, below = _pull(arm, high, 0.0, drag, slope), _pull(arm, high, 1.0, drag, slope)
    return high, above / (above - below)
