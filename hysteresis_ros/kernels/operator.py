# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A compiled operator of any kind: what the arm and the operators' classes call."""

import numpy as np

from . import kinetics, linear, play, preisach
from .jit import jit
from .layout import INPUT, KIND, KINETIC, OUTPUT, PLAY, PREISACH
from .lean import lean


@lean
def reset(table: np.ndarray, memory: np.ndarray) -> None:
    """Forget the history."""
    if table[KIND] == PREISACH:
        preisach.reset(table, memory)
    elif table[KIND] == PLAY:
        play.reset(table, memory)
    elif table[KIND] == KINETIC:
        kinetics.reset(table, memory)
    else:
        linear.reset(table, memory)


@lean
def orient(table: np.ndarray, memory: np.ndarray, oriented: float) -> None:
    """Let a load orient a share of what forms, where what has formed is scaled by kinetics."""
    if table[KIND] == KINETIC:
        kinetics.orient(table, memory, oriented)


@lean
def step(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Commit an input and return the output."""
    if table[KIND] == PREISACH:
        return preisach.step(table, memory, u)
    if table[KIND] == PLAY:
        return play.step(table, memory, u)
    if table[KIND] == KINETIC:
        return kinetics.step(table, memory, u)
    return linear.step(table, memory, u)


@lean
def peek(table: np.ndarray, memory: np.ndarray, u: float) -> float:
    """Return the output that `step` would give, and commit nothing."""
    if table[KIND] == PREISACH:
        return preisach.peek(table, memory, u)
    if table[KIND] == PLAY:
        return play.peek(table, memory, u)
    if table[KIND] == KINETIC:
        return kinetics.peek(table, memory, u)
    return linear.peek(table, memory, u)


@lean
def solve(table: np.ndarray, memory: np.ndarray, y: float) -> tuple[float, float, bool]:
    """Return the nearest input that gives a finite output, what it gives, and if out of reach."""
    if table[KIND] == PREISACH:
        return preisach.solve(table, memory, y)
    if table[KIND] == PLAY:
        return play.solve(table, memory, y)
    if table[KIND] == KINETIC:
        return kinetics.solve(table, memory, y)
    return linear.solve(table, memory, y)


@jit
def simulate(table: np.ndarray, memory: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Commit a sequence of inputs, shape (n,), and return the outputs, shape (n,)."""
    outputs = np.empty(len(inputs))
    if table[KIND] == PREISACH:
        for n in range(len(inputs)):
            outputs[n] = preisach.step(table, memory, inputs[n])
    else:
        for n in range(len(inputs)):
            outputs[n] = step(table, memory, inputs[n])
    return outputs


@lean
def last_input(table: np.ndarray, memory: np.ndarray) -> float:
    """Return the input committed last."""
    return memory[INPUT]


@lean
def last_output(table: np.ndarray, memory: np.ndarray) -> float:
    """Return the output for it."""
    return memory[OUTPUT]
