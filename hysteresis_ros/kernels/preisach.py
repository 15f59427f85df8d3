# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Preisach operator's step, response and exact inverse on packed arrays.

The memory's staircase is a list of corners ``upper, lower, maximum, minimum, maximum, ...`` that
narrows from both sides, even places are maxima, each with the level (the output's share that the
weight gives) at it. A minimum on top means that the input is rising. An input that passes a corner
wipes out that corner and the one above it. The weight between the last corner and the present input
is the Everett function E of `operators.everett`.

Table, after what every table begins with: number of levels N, output with all relays down, span of
the output, intervals per unit of the input; N + 1 nodes; half the weight on the diagonal and the
reversible weight of each interval; for each cell (a, b) at a N + b corner, row, column and density
of E. Memory: level at the present input, number of corners, each corner with its level,
and room to thin them out.
"""

import math

import numpy as np

from .layout import (
    DIRECTION, INPUT, LOWER, MEMORY, OUTPUT, SATURATED, SIGN, TABLE, TOLERANCE, UPPER)
from .lean import lean

LEVELS, BASE, SPAN, SCALE = range(TABLE, TABLE + 4)
NODES = TABLE + 4
LEVEL, COUNT = MEMORY, MEMORY + 1
CORNERS = MEMORY + 2

# Corners passed one by one before a search by halves takes over.
_WALK = 8


def memory_size(corners: int) -> int:
    """Return how many entries a memory needs for a number of corners, and to thin them out."""
    return CORNERS + (corners + 2) * 9 // 4 + 1


@lean
def capacity(memory: np.ndarray) -> int:
    """Return how many corners a memory of `memory_size` has room for; one more for a moment."""
    return (len(memory) - CORNERS) * 4 // 9 - 2


@lean
def reset(table: np.ndarray, memory: np.ndarray) -> None:
    """Forget the history: all relays down, input at the lower end."""
    # As if the input had come down from saturation.
    memory[CORNERS], memory[CORNERS + 1] = table[UPPER], table[SPAN]
    memory[CORNERS + 2], memory[CORNERS + 3] = table[LOWER], 0.0
    memory[COUNT] = 2.0
    _commit(table, memory, table[LOWER], 0.0)
    memory[DIRECTION] = 0.0


@lean
def _commit(table: np.ndarray, memory: np.ndarray, u: float, level: float) -> None:
    memory[INPUT] = u
    memory[LEVEL] = level
    memory[OUTPUT] = table[BASE] + table[SIGN] * level
    memory[SATURATED] = 0.0


@lean
def interval(table: np.ndarray, u: float) -> int:
    """Return the interval of the grid that an input lies in; a node belongs to the one above."""
    levels = int(table[LEVELS])
    k = int((u - table[LOWER]) * table[SCALE])
    if 0 <= k < levels and table[NODES + k] <= u < table[NODES + k + 1]:
        return k
    low, high = 0, levels
    while high - low > 1:
        middle = (low + high) // 2
        if table[NODES + middle] <= u:
            low = middle
        else:
            high = middle
    return low


@lean
def _halves(table: np.ndarray) -> int:
    """Return the place of the half weights on the diagonal; the reversible ones follow."""
    return NODES + int(table[LEVELS]) + 1


@lean
def _cell(table: np.ndarray, a: int, b: int) -> int:
    levels = int(table[LEVELS])
    return NODES + 1 + 3 * levels + 4 * (a * levels + b)


@lean
def everett(table: np.ndarray, alpha: float, beta: float) -> float:
    """Return E at one point, first node <= beta <= alpha <= last node."""
    halves = _halves(table)
    a = interval(table, alpha)
    b = interval(table, beta)
    if a == b:
        d = alpha - beta
        return d * (table[halves + int(table[LEVELS]) + a] + table[halves + a] * d)
    cell = _cell(table, a, b)
    p = alpha - table[NODES + a]
    q = table[NODES + b + 1] - beta
    return (table[cell] + p * (table[cell + 1] + table[cell + 3] * q + table[halves + a] * p)
            + q * (table[cell + 2] + table[halves + b] * q))


@lean
def _root(rest: float, slope: float, bend: float, width: float) -> float:
    """Return d in [0, width] with slope d + bend d^2 = rest; all arguments non-negative."""
    if rest <= 0.0:
        return 0.0
    denominator = slope + math.sqrt(slope * slope + 4.0 * bend * rest)
    rest += rest
    # Also where a weight is so small that its square is lost and the denominator is 0.
    return rest / denominator if rest < width * denominator else width


@lean
def find_alpha(table: np.ndarray, target: float, beta: float, tolerance: float
               ) -> tuple[float, float]:
    """
    Solve E(alpha, beta) = target for the smallest alpha.

    Parameters
    ----------
    table : ndarray
        The operator's.
    target : float
        Sought value.
    beta : float
        The fixed corner.
    tolerance : float
        A value that falls short of the target by less counts as reaching it, so that rounding
        does not send the solution across a plateau.

    Returns
    -------
    alpha, value : float
        The solution, or the last node if the target is beyond, and E there.

    """
    if target <= tolerance:
        return beta, 0.0
    levels = int(table[LEVELS])
    halves = _halves(table)
    b = interval(table, beta)
    q = table[NODES + b + 1] - beta
    half = table[halves + b]
    slope = table[halves + levels + b]
    first = q * (slope + half * q)
    if target - tolerance <= first:
        p = _root(target, slope, half, q)
        return beta + p, p * (slope + half * p)
    low, high = b + 1, levels
    if low == high:
        return table[NODES + high], first
    bend = half * q * q
    sought = target - tolerance - bend
    while high - low > 1:
        middle = (low + high) // 2
        cell = _cell(table, middle, b)
        if table[cell] + table[cell + 2] * q < sought:
            low = middle
        else:
            high = middle
    cell = _cell(table, low, b)
    half = table[halves + low]
    start = bend + table[cell] + table[cell + 2] * q
    slope = table[cell + 1] + table[cell + 3] * q
    p = _root(target - start, slope, half, table[NODES + high] - table[NODES + low])
    return table[NODES + low] + p, start + p * (slope + half * p)


@lean
def find_beta(table: np.ndarray, target: float, alpha: float, tolerance: float
              ) -> tuple[float, float]:
    """Solve E(alpha, beta) = target for the largest beta; see `find_alpha`."""
    if target <= tolerance:
        return alpha, 0.0
    levels = int(table[LEVELS])
    halves = _halves(table)
    a = interval(table, alpha)
    p = alpha - table[NODES + a]
    half = table[halves + a]
    slope = table[halves + levels + a]
    first = p * (slope + half * p)
    if target - tolerance <= first:
        q = _root(target, slope, half, p)
        return alpha - q, q * (slope + half * q)
    low, high = 0, a
    if low == high:
        return table[NODES], first
    bend = half * p * p
    sought = target - tolerance - bend
    while high - low > 1:
        middle = (low + high) // 2
        cell = _cell(table, a, middle - 1)
        if table[cell] + table[cell + 1] * p < sought:
            high = middle
        else:
            low = middle
    cell = _cell(table, a, low)
    x = table[NODES + low + 1]
    half = table[halves + low]
    start = bend + table[cell] + table[cell + 1] * p
    slope = table[cell + 2] + table[cell + 3] * p
    q = _root(target - start, slope, half, x - table[NODES + low])
    return x - q, start + q * (slope + half * q)


@lean
def beyond(entries: np.ndarray, offset: int, depth: int, bound: float, rising: bool) -> int:
    """
    Return how many corners survive a movement up (down) to a bound.

    Parameters
    ----------
    entries : ndarray
        The memory.
    offset : int
        Place of the first corner, or of the level at it: maxima descend, minima ascend, towards
        the top, in steps of two places.
    depth : int
        Number of corners to start from; the one on top is of the kind that the branch starts
        from (a minimum when rising). It may count one beyond the end, for a corner to come.
    bound : float
        Where the movement ends. A corner that it reaches is wiped out.
    rising : bool
        Direction of the movement.

    """
    side = 1.0 if rising else -1.0
    least = 2 if rising else 3
    stop = max(depth - 2 * _WALK, 2)
    while depth > stop and side * (entries[offset + 2 * (depth - 2)] - bound) <= 0.0:
        depth -= 2
    if depth > least and side * (entries[offset + 2 * (depth - 2)] - bound) <= 0.0:
        odd = least - 2
        low, high = 0, (depth - least) // 2
        while high - low > 1:
            middle = (low + high) // 2
            if side * (entries[offset + 2 * (2 * middle + odd)] - bound) <= 0.0:
                high = middle
            else:
                low = middle
        depth = 2 * high + odd
    return depth


@lean
def trace(table: np.ndarray, memory: np.ndarray, u: float) -> tuple[float, int, bool]:
    """
    Follow the memory to an input strictly inside the range.

    Returns
    -------
    level : float
        Level there.
    depth : int
        Number of corners that survive.
    turned : bool
        Whether the present input becomes a corner on top of them.

    """
    depth = int(memory[COUNT])
    here = memory[INPUT]
    turned = False
    if depth & 1:
        rising = u > here
        if not rising:
            if u <= memory[CORNERS + 2 * (depth - 2)]:
                depth = beyond(memory, CORNERS, depth, u, False)
        elif u < memory[CORNERS + 2 * (depth - 1)]:
            turned = True
        else:
            depth = beyond(memory, CORNERS, depth + 1, u, True)
    else:
        rising = u >= here
        if rising:
            if u >= memory[CORNERS + 2 * (depth - 2)]:
                depth = beyond(memory, CORNERS, depth, u, True)
        elif u > memory[CORNERS + 2 * (depth - 1)]:
            turned = True
        else:
            depth = beyond(memory, CORNERS, depth + 1, u, False)
    if turned:
        corner, level = here, memory[LEVEL]
    else:
        corner = memory[CORNERS + 2 * (depth - 1)]
        level = memory[CORNERS + 2 * (depth - 1) + 1]
    if rising:
        return level + everett(table, u, corner), depth, turned
    return level - everett(table, corner, u), depth, turned


@lean
def step(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Commit an input and return the output; see `HysteresisOperator.step`."""
    if table[LOWER] < u < table[UPPER]:
        level, depth, turned = trace(table, memory, u)
        if turned:
            memory[CORNERS + 2 * depth] = memory[INPUT]
            memory[CORNERS + 2 * depth + 1] = memory[LEVEL]
            depth += 1
            if depth > capacity(memory):
                depth = thin(table, memory, depth)
        memory[COUNT] = depth
        _commit(table, memory, u, level)
    elif u >= table[UPPER]:
        memory[COUNT] = 2.0
        _commit(table, memory, table[UPPER], table[SPAN])
        memory[SATURATED] = 1.0 if u > table[UPPER] else 0.0
    elif u <= table[LOWER]:
        reset(table, memory)
        memory[SATURATED] = 1.0 if u < table[LOWER] else 0.0
    else:
        memory[SATURATED] = 1.0
    return memory[OUTPUT]


@lean
def peek(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Return the output that `step` would give, and commit nothing."""
    if table[LOWER] < u < table[UPPER]:
        return table[BASE] + table[SIGN] * trace(table, memory, u)[0]
    if u >= table[UPPER]:
        return table[BASE] + table[SIGN] * table[SPAN]
    return table[BASE] if u <= table[LOWER] else memory[OUTPUT]


@lean
def solve(table: np.ndarray, memory: np.ndarray, y: float) -> tuple[float, float, bool]:
    """Return the nearest input that gives a finite output, what it gives, and if out of reach."""
    sign, base, tolerance = table[SIGN], table[BASE], table[TOLERANCE]
    target = sign * (y - base)
    saturated = False
    if target < 0.0:
        saturated = target < -tolerance
        target = 0.0
    elif target > table[SPAN]:
        saturated = target > table[SPAN] + tolerance
        target = table[SPAN]
    change = target - memory[LEVEL]
    if -tolerance <= change <= tolerance:
        return memory[INPUT], memory[OUTPUT], saturated

    # Find the corner that the branch is measured from where it meets the target, and the two
    # corners between which it is measured from that one.
    up = change > 0.0
    held = int(memory[COUNT])
    # If the input has to turn, it makes a corner of its own on top of the others.
    depth = held + 1 if (held & 1 == 1) == up else held
    depth = beyond(memory, CORNERS + 1, depth, target - tolerance if up else target + tolerance, up)
    if depth > held:
        corner, level = memory[INPUT], memory[LEVEL]
    else:
        corner = memory[CORNERS + 2 * (depth - 1)]
        level = memory[CORNERS + 2 * (depth - 1) + 1]
    passed = memory[CORNERS + 2 * depth] if depth < held else memory[INPUT]
    coming = memory[CORNERS + 2 * (depth - 2)]
    if up:
        u, rise = find_alpha(table, target - level, corner, tolerance)
        if not passed <= u <= coming:
            u = min(max(u, passed), coming)
            rise = everett(table, u, corner)
        return u, base + sign * (level + rise), saturated
    u, fall = find_beta(table, level - target, corner, tolerance)
    if not coming <= u <= passed:
        u = max(min(u, passed), coming)
        fall = everett(table, corner, u)
    return u, base + sign * (level - fall), saturated


@lean
def recall(table: np.ndarray, memory: np.ndarray, u: float) -> None:
    """Compute the levels of corners that were put into the memory, and commit an input on top."""
    memory[CORNERS], memory[CORNERS + 1] = table[UPPER], table[SPAN]
    memory[CORNERS + 2], memory[CORNERS + 3] = table[LOWER], 0.0
    count = int(memory[COUNT])
    level = 0.0
    for k in range(2, count + 1):
        here = u if k == count else memory[CORNERS + 2 * k]
        below, last = memory[CORNERS + 2 * (k - 1) + 1], memory[CORNERS + 2 * (k - 1)]
        if here >= table[UPPER]:
            level = table[SPAN]
        elif k & 1:
            level = below - everett(table, last, here)
        else:
            level = below + everett(table, here, last)
        if k < count:
            memory[CORNERS + 2 * k + 1] = level
    _commit(table, memory, u, level)


@lean
def thin(table: np.ndarray, memory: np.ndarray, depth: int) -> int:
    """
    Merge neighbouring steps of a staircase that has become too long.

    Ever shrinking loops could nest without end. Two steps become one with its minimum where the
    weight below the staircase stays the same, so the present output and the level at every
    corner that is left do not change. What can change is the output inside the merged step, by
    at most the weight of the rectangle between the two. The smallest rectangles go first. With
    32768 nested loops such a rectangle holds less than 1e-9 of the weight, unless that is
    concentrated in very few cells.

    Parameters
    ----------
    table, memory : ndarray
        The operator's. About a fifth of the corners goes.
    depth : int
        Number of corners.

    Returns
    -------
    depth : int
        Number of corners left.

    """
    count = (depth - 2) // 2
    pairs = (count - 1) // 2
    # Step k reaches from maximum k down to maximum k + 1 and has minimum k.
    first = CORNERS + 4
    sizes = len(memory) - pairs
    for n in range(pairs):
        memory[sizes + n] = _rectangle(table, memory, first + 8 * n)
    heap_sort(memory, sizes, pairs)
    merges = pairs * 4 // 5
    largest = memory[sizes + merges - 1]
    into = first
    for n in range(pairs):
        k = first + 8 * n
        if merges > 0 and _rectangle(table, memory, k) <= largest:
            merges -= 1
            share = (memory[k + 4] - memory[k + 8]) / (memory[k] - memory[k + 8])
            low = memory[k + 2] + share * (memory[k + 6] - memory[k + 2])
            level = memory[k + 1] - everett(table, memory[k], low)
            memory[into], memory[into + 1] = memory[k], memory[k + 1]
            memory[into + 2], memory[into + 3] = low, level
            into += 4
        else:
            for place in range(k, k + 8):
                memory[into] = memory[place]
                into += 1
    # The last steps stay as they are.
    for place in range(first + 8 * pairs, CORNERS + 2 * depth):
        memory[into] = memory[place]
        into += 1
    return (into - CORNERS) // 2


@lean
def _rectangle(table: np.ndarray, memory: np.ndarray, k: int) -> float:
    """Return the size by which steps are merged: that of the rectangle between two of them."""
    # Inside one cell the weight is uniform and its mean is exact: such steps come first.
    size = (memory[k] - memory[k + 4]) * (memory[k + 6] - memory[k + 2])
    uniform = (interval(table, memory[k]) == interval(table, memory[k + 8])
               and interval(table, memory[k + 2]) == interval(table, memory[k + 6]))
    return -1.0 / (1.0 + size) if uniform else size


@lean
def heap_sort(values: np.ndarray, start: int, count: int) -> None:
    """Sort `count` values from a place on, in place: a kernel that steps must not allocate."""
    for parent in range(count // 2 - 1, -1, -1):
        _sift(values, start, parent, count)
    for end in range(count - 1, 0, -1):
        values[start], values[start + end] = values[start + end], values[start]
        _sift(values, start, 0, end)


@lean
def _sift(values: np.ndarray, start: int, parent: int, end: int) -> None:
    """Let a value sink to its place in a heap whose largest is on top."""
    value = values[start + parent]
    child = 2 * parent + 1
    while child < end:
        if child + 1 < end and values[start + child + 1] > values[start + child]:
            child += 1
        if values[start + child] <= value:
            break
        values[start + parent] = values[start + child]
        parent, child = child, 2 * child + 1
    values[start + parent] = value
