# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The straight line on packed arrays. Table, after the common part: slope and intercept."""

import math

import numpy as np

from .layout import (
    DIRECTION, HIGH, INPUT, LOW, LOWER, OUTPUT, SATURATED, TABLE, TOLERANCE, UPPER)
from .lean import lean

SLOPE, INTERCEPT = TABLE, TABLE + 1


@lean
def at(table: np.ndarray, u: float) -> float:
    """Return the output at an input inside the range."""
    return table[INTERCEPT] + table[SLOPE] * u


@lean
def reset(table: np.ndarray, memory: np.ndarray) -> None:
    """Go back to the lower end of the range."""
    memory[INPUT] = table[LOWER]
    memory[OUTPUT] = at(table, table[LOWER])
    memory[SATURATED] = memory[DIRECTION] = 0.0


@lean
def step(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Commit an input and return the output."""
    memory[SATURATED] = 0.0 if table[LOWER] <= u <= table[UPPER] else 1.0
    if not math.isnan(u):
        u = min(max(u, table[LOWER]), table[UPPER])
        if u != memory[INPUT]:
            memory[DIRECTION] = 1.0 if u > memory[INPUT] else -1.0
        memory[INPUT] = u
        memory[OUTPUT] = at(table, u)
    return memory[OUTPUT]


@lean
def peek(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Return the output that `step` would give, and commit nothing."""
    if math.isnan(u):
        return memory[OUTPUT]
    return at(table, min(max(u, table[LOWER]), table[UPPER]))


@lean
def solve(table: np.ndarray, memory: np.ndarray, y: float) -> tuple[float, float, bool]:
    """Return the nearest input that gives a finite output, what it gives, and if out of reach."""
    low, high, tolerance = table[LOW], table[HIGH], table[TOLERANCE]
    saturated = not low - tolerance <= y <= high + tolerance
    y = min(max(y, low), high)
    if abs(y - memory[OUTPUT]) <= tolerance:
        return memory[INPUT], memory[OUTPUT], saturated
    u = min(max((y - table[INTERCEPT]) / table[SLOPE], table[LOWER]), table[UPPER])
    return u, at(table, u), saturated
