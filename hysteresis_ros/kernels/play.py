# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Play: a piston with clearance that is pulled to and fro, and the weighted sum of many.

Table of the Prandtl-Ishlinskii operator, after the common part: numbers of plays K and of bends L,
bias; K radii, K weights; L thresholds, L bends, L outputs at the thresholds, and the L slopes
above them. Memory: the places of the plays.
"""

import math

import numpy as np

from .jit import jit
from .layout import (
    DIRECTION, HIGH, INPUT, LOW, LOWER, MEMORY, OUTPUT, SATURATED, SIGN, TABLE, TOLERANCE, UPPER)
from .lean import lean

PLAYS, BENDS, BIAS = range(TABLE, TABLE + 3)
RADII = TABLE + 3


@lean
def moved(place: float, u: float, radius: float) -> float:
    """Return the place of a play after a movement of its input."""
    if place < u - radius:
        return u - radius
    return u + radius if place > u + radius else place


@jit
def follow(inputs: np.ndarray, radius: float, place: float) -> np.ndarray:
    """
    Return the course of a play.

    Parameters
    ----------
    inputs : ndarray, shape (n,)
    radius : float
        Half of the clearance.
    place : float
        Where the play is before the first input.

    Returns
    -------
    ndarray, shape (n,)

    """
    course = np.empty(len(inputs))
    for n in range(len(inputs)):
        place = moved(place, inputs[n], radius)
        course[n] = place
    return course


@lean
def total(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Return the weighted sum of the plays after a movement to an input inside the range."""
    plays = int(table[PLAYS])
    x = 0.0
    for k in range(plays):
        x += table[RADII + plays + k] * moved(memory[MEMORY + k], u, table[RADII + k])
    return x


@lean
def bend(table: np.ndarray, x: float) -> float:
    """Return the output for a weighted sum."""
    bends = int(table[BENDS])
    curve = RADII + 2 * int(table[PLAYS])
    y = table[BIAS] + x
    for k in range(bends):
        if x <= table[curve + k]:
            break
        y += table[curve + bends + k] * (x - table[curve + k])
    return y


@lean
def unbend(table: np.ndarray, y: float) -> float:
    """Return the weighted sum that gives an output."""
    bends = int(table[BENDS])
    curve = RADII + 2 * int(table[PLAYS])
    k = 0
    while k < bends and table[curve + 2 * bends + k] < y:
        k += 1
    if k == 0:
        return y - table[BIAS]
    return (table[curve + k - 1]
            + (y - table[curve + 2 * bends + k - 1]) / table[curve + 3 * bends + k - 1])


@lean
def reset(table: np.ndarray, memory: np.ndarray) -> None:
    """Forget the history: the input came down to the lower end from far above."""
    for k in range(int(table[PLAYS])):
        memory[MEMORY + k] = table[LOWER] + table[RADII + k]
    memory[INPUT] = table[LOWER]
    memory[SATURATED] = memory[DIRECTION] = 0.0
    memory[OUTPUT] = bend(table, total(table, memory, table[LOWER]))


@lean
def step(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Commit an input and return the output."""
    memory[SATURATED] = 0.0 if table[LOWER] <= u <= table[UPPER] else 1.0
    if not math.isnan(u):
        u = min(max(u, table[LOWER]), table[UPPER])
        if u != memory[INPUT]:
            memory[DIRECTION] = 1.0 if u > memory[INPUT] else -1.0
        memory[INPUT] = u
        for k in range(int(table[PLAYS])):
            memory[MEMORY + k] = moved(memory[MEMORY + k], u, table[RADII + k])
        memory[OUTPUT] = bend(table, total(table, memory, u))
    return memory[OUTPUT]


@lean
def peek(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Return the output that `step` would give, and commit nothing."""
    if math.isnan(u):
        return memory[OUTPUT]
    return bend(table, total(table, memory, min(max(u, table[LOWER]), table[UPPER])))


@lean
def _starts(table: np.ndarray, memory: np.ndarray, k: int, rising: bool) -> float:
    """
    Return the input at which a play begins to move, the end of the range after the last one.

    Neighbouring plays are never further apart than their radii, so these are in the order in
    which the input meets them.
    """
    if k == int(table[PLAYS]):
        return table[UPPER] if rising else table[LOWER]
    if rising:
        return max(memory[MEMORY + k] + table[RADII + k], memory[INPUT])
    return min(memory[MEMORY + k] - table[RADII + k], memory[INPUT])


@lean
def solve(table: np.ndarray, memory: np.ndarray, y: float) -> tuple[float, float, bool]:
    """Return the nearest input that gives a finite output, what it gives, and if out of reach."""
    low, high, tolerance = table[LOW], table[HIGH], table[TOLERANCE]
    saturated = not low - tolerance <= y <= high + tolerance
    y = min(max(y, low), high)
    if abs(y - memory[OUTPUT]) <= tolerance:
        return memory[INPUT], memory[OUTPUT], saturated
    missing = table[SIGN] * (unbend(table, y) - total(table, memory, memory[INPUT]))
    rising = missing > 0.0
    missing = abs(missing)
    plays = int(table[PLAYS])
    found, slope = _starts(table, memory, plays, rising), 0.0
    for k in range(plays):
        start, following = (_starts(table, memory, k, rising),
                            _starts(table, memory, k + 1, rising))
        slope += abs(table[RADII + plays + k])
        width = abs(following - start)
        if missing <= slope * width + tolerance:
            d = min(missing / slope, width) if slope > 0.0 else 0.0
            found = start + d if rising else start - d
            break
        missing -= slope * width
    found = min(max(found, table[LOWER]), table[UPPER])
    return found, peek(table, memory, found), saturated
