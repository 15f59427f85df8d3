# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A Preisach operator of which a share follows the kinetics of a transformation, on packed arrays.

What transforms is in proportion to what has still to transform. While the input rises from u0 to u,
``1 - y = (1 - y0) (1 - R(u)) / (1 - R(u0))`` with the rising branch R of the major loop; while it
falls, ``y = y0 D(u) / D(u0)`` with the falling branch D. A branch that begins inside the major loop
never meets the one it came from, and loops shift until they fit in between (Tanaka, Res Mechanica
18 (1986) 251; Liang and Rogers, J. Intell. Mater. Syst. Struct. 1 (1990) 207). While nothing goes
back, nothing can form anew: an input that falls without reaching D, and rises again, goes on where
it was, as in these papers. So R(u0) and D(u0) are those of the farthest input of this direction,
which begins anew by as much as has transformed in the other one.

A low load orients but a share g of the martensite that forms, and the rest of it is twinned and
gives no strain. Of what is not oriented, be it austenite or twinned, each branch orients that share
anew (Brinson, J. Intell. Mater. Syst. Struct. 4 (1993) 229): the oriented share P goes as y does,
with min(R, g) in the place of R, and the output is that of y = P / g.

Table, after what every table begins with: the share, what the major loop gives beyond the output
with all relays down, nodes per unit of the input, number of nodes; R and D at the nodes, evenly
spaced from the lower end of the range, from 0 to 1; the table of the Preisach operator. Memory: P;
g, which is the load's and stays when the history is forgotten; R and D of the farthest inputs; the
memory of the Preisach operator.
"""

import math

import numpy as np

from . import preisach
from .layout import (
    DIRECTION, INPUT, LOWER, MEMORY, OUTPUT, SATURATED, SIGN, TABLE, TOLERANCE, UPPER)
from .lean import lean

SHARE, TOP, SCALE, COUNT = range(TABLE, TABLE + 4)
BRANCHES = TABLE + 4
TRANSFORMED, ORIENTED, FORMED, REVERTED = range(MEMORY, MEMORY + 4)
INNER = MEMORY + 4

# Shares of what transforms from which on none counts as left.
LEAST = 1e-9
# The other direction begins anew but for (1 - q)^ANEW where a share q has transformed. With weights
# on 30 to 50 levels the end of a branch is smoothed over two or three hundredths; with 100 the
# response turns so sharply that fits of the weights get stuck on Brinson's and Tanaka's wires.
ANEW = 30.0
# Outputs that the inverse evaluates at most: by halves alone an input would be exact to 2^-60.
MOST = 60


@lean
def _inner(table: np.ndarray) -> int:
    """Return the place of the Preisach operator's table."""
    return BRANCHES + 2 * int(table[COUNT])


@lean
def _branch(table: np.ndarray, first: int, u: float) -> float:
    """Return a branch of the major loop, whose values begin at a place, at an input."""
    last = int(table[COUNT]) - 1
    place = min(max((u - table[LOWER]) * table[SCALE], 0.0), float(last))
    node = min(int(place), last - 1)
    part = place - node
    return (1.0 - part) * table[first + node] + part * table[first + node + 1]


@lean
def _moved(table: np.ndarray, memory: np.ndarray, u: float) -> tuple[float, float, float]:
    """Return P, and R and D of the farthest inputs, once the input is at one inside the range."""
    rising, falling = BRANCHES, BRANCHES + int(table[COUNT])
    before, y, oriented = memory[INPUT], memory[TRANSFORMED], memory[ORIENTED]
    formed, reverted = memory[FORMED], memory[REVERTED]
    branch, high = _branch(table, rising, u), _branch(table, falling, u)
    low = min(branch, oriented)
    if u > before:
        counted = min(max(formed, _branch(table, rising, before)), oriented)
        if low > counted and 1.0 - counted > LEAST:
            left = (1.0 - low) / (1.0 - counted)
            y = 1.0 - (1.0 - y) * left
            reverted = 1.0 - (1.0 - reverted) * left ** ANEW
        formed = max(formed, branch)
    elif u < before:
        counted = min(reverted, _branch(table, falling, before))
        if high < counted and counted > LEAST:
            left = high / counted
            y *= left
            formed *= left ** ANEW
        reverted = min(reverted, high)
    return min(max(y, low), high), formed, reverted


@lean
def output(table: np.ndarray, given: float, y: float) -> float:
    """Return the output where the Preisach operator gives one, and y = P / g."""
    base = table[_inner(table) + preisach.BASE]
    scaled = base + table[SIGN] * table[TOP] * y
    return given + table[SHARE] * (scaled - given)


@lean
def orient(table: np.ndarray, memory: np.ndarray, oriented: float) -> None:
    """Let a load orient a share of what forms from now on, and commit nothing else."""
    if oriented != memory[ORIENTED]:
        memory[ORIENTED] = oriented
        memory[OUTPUT] = output(table, memory[INNER + OUTPUT],
                                _moved(table, memory, memory[INPUT])[0] / oriented)


@lean
def reset(table: np.ndarray, memory: np.ndarray) -> None:
    """Forget the history: nothing has transformed, input at the lower end; the load stays."""
    preisach.reset(table[_inner(table):], memory[INNER:])
    memory[INPUT] = table[LOWER]
    memory[TRANSFORMED] = memory[SATURATED] = memory[DIRECTION] = 0.0
    memory[FORMED] = memory[REVERTED] = 0.0
    memory[OUTPUT] = output(table, memory[INNER + OUTPUT], 0.0)


@lean
def step(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Commit an input and return the output; see `HysteresisOperator.step`."""
    memory[SATURATED] = 0.0 if table[LOWER] <= u <= table[UPPER] else 1.0
    if not math.isnan(u):
        u = min(max(u, table[LOWER]), table[UPPER])
        memory[TRANSFORMED], memory[FORMED], memory[REVERTED] = _moved(table, memory, u)
        if u != memory[INPUT]:
            memory[DIRECTION] = 1.0 if u > memory[INPUT] else -1.0
        memory[INPUT] = u
        given = preisach.step(table[_inner(table):], memory[INNER:], u)
        memory[OUTPUT] = output(table, given, memory[TRANSFORMED] / memory[ORIENTED])
    return memory[OUTPUT]


@lean
def peek(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Return the output that `step` would give, and commit nothing."""
    if math.isnan(u):
        return memory[OUTPUT]
    u = min(max(u, table[LOWER]), table[UPPER])
    given = preisach.peek(table[_inner(table):], memory[INNER:], u)
    return output(table, given, _moved(table, memory, u)[0] / memory[ORIENTED])


@lean
def solve(table: np.ndarray, memory: np.ndarray, y: float) -> tuple[float, float, bool]:
    """Return the nearest input that gives a finite output, what it gives, and if out of reach."""
    tolerance = table[TOLERANCE]
    near, here = memory[INPUT], memory[OUTPUT] - y
    if abs(here) <= tolerance:
        return near, memory[OUTPUT], False
    # Twinned martensite leaves room beyond the range of the major loop, and the more the less often
    # it was oriented.
    far = table[UPPER] if here * table[SIGN] < 0.0 else table[LOWER]
    there = peek(table, memory, far) - y
    if here * there > 0.0:
        return far, there + y, abs(there) > tolerance
    # False position that halves the error of the end which stays (the Illinois algorithm).
    stays = 0
    for evaluated in range(MOST):
        if abs(there) <= tolerance:
            near, here = far, there
            break
        u = near + (far - near) * here / (here - there)
        if evaluated % 4 == 3 or not min(near, far) < u < max(near, far):
            u = 0.5 * (near + far)
        if u == near or u == far:
            break
        error = peek(table, memory, u) - y
        if error * here > 0.0:
            near, here = u, error
            there *= 0.5 if stays == 1 else 1.0
            stays = 1
        else:
            far, there = u, error
            here *= 0.5 if stays == -1 else 1.0
            stays = -1
    u = near if abs(peek(table, memory, near) - y) <= abs(peek(table, memory, far) - y) else far
    return u, peek(table, memory, u), False
