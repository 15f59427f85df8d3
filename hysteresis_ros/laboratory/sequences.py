# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Voltage sequences of the experiments: what is applied, step by step or sample by sample."""

import numpy as np

HIGHEST = 6.0
# Between these voltages the arm moves [V].
LOW, HIGH = 2.4, 5.6
# Swings of the damped oscillation: where each ends [V], and in how many steps.
SWINGS = ((6.0, 5), (0.0, 5), (5.25, 5), (0.75, 5), (4.5, 4), (1.5, 4), (4.0, 3), (2.0, 2),
          (3.5, 2), (3.0, 1))
SAMPLING = 0.1


def damped_oscillation() -> np.ndarray:
    """Return the 37 steps of Fig. 7(a) [V], an oscillation that shrinks towards 3 V."""
    voltages = [0.0]
    for end, steps in SWINGS:
        voltages.extend(np.linspace(voltages[-1], end, steps + 1)[1:])
    return np.round(voltages, 4)


def random_steps(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return random steps over the whole range [V], shape (count,)."""
    return np.round(rng.uniform(0.0, HIGHEST, count), 3)


def sinusoid(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return two and a half periods of a sinusoid whose amplitude shrinks [V]."""
    middle, amplitude = rng.uniform(3.7, 4.0), rng.uniform(1.7, 2.0)
    turn = 2.0 * np.pi * np.linspace(0.0, 2.5, count)
    return np.round(middle - amplitude * np.linspace(1.0, 0.6, count) * np.cos(turn), 3)


def random_moves(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return random steps where the arm moves, now and then to an end of the range [V]."""
    voltages = rng.uniform(LOW, HIGH, count)
    ends = rng.random(count) < 0.08
    voltages[ends] = rng.choice([0.0, 1.2, HIGHEST], np.count_nonzero(ends))
    return np.round(voltages, 3)


def staircase(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return one way up to 6 V and back down in equal steps [V]."""
    up = np.linspace(rng.uniform(0.2, 0.5), HIGHEST, count // 2)
    down = np.linspace(HIGHEST, 0.0, count - len(up) + 1)[1:]
    return np.round(np.concatenate((up, down)), 3)


def up_and_down(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return ramps between random turning points [V]."""
    voltages: list[float] = []
    here = rng.uniform(LOW, 3.4)
    rising = True
    while len(voltages) < count:
        there = rng.uniform(4.2, HIGHEST) if rising else rng.uniform(LOW, 3.8)
        steps = int(rng.integers(4, 9))
        voltages.extend(np.linspace(here, there, steps + 1)[1:])
        here, rising = there, not rising
    return np.round(voltages[:count], 3)


def _samples(seconds: float) -> int:
    return max(int(round(seconds / SAMPLING)), 1)


def steps_of_all_speeds(rng: np.random.Generator, seconds: float = 240.0) -> np.ndarray:
    """Return random levels, some held for a second, some for a quarter of a minute [V]."""
    voltages: list[float] = []
    while len(voltages) < _samples(seconds):
        hold = float(np.exp(rng.uniform(np.log(1.0), np.log(16.0))))
        level = float(random_moves(1, rng)[0])
        voltages.extend([level] * _samples(hold))
    return np.array(voltages[:_samples(seconds)])


def ramps(rng: np.random.Generator, seconds: float = 220.0) -> np.ndarray:
    """Return ramps between random turning points, from 0.05 to 2 V/s [V]."""
    voltages: list[float] = []
    here, rising = 0.0, True
    while len(voltages) < _samples(seconds):
        there = rng.uniform(4.3, HIGHEST) if rising else rng.uniform(2.0, 3.7)
        rate = float(np.exp(rng.uniform(np.log(0.05), np.log(2.0))))
        count = _samples(abs(there - here) / rate)
        voltages.extend(np.linspace(here, there, count + 1)[1:])
        voltages.extend([there] * _samples(rng.uniform(0.5, 3.0)))
        here, rising = there, not rising
    return np.round(voltages[:_samples(seconds)], 3)


def repeated_loop(rng: np.random.Generator, repeats: int = 6) -> np.ndarray:
    """Return the same loop again and again, with a hold at its middle going up and down [V]."""
    low, middle, high = rng.uniform(2.3, 2.8), rng.uniform(3.8, 4.2), rng.uniform(5.2, 5.8)
    loop: list[float] = []
    for start, end in ((low, middle), (middle, high), (high, middle), (middle, low)):
        loop.extend(np.linspace(start, end, _samples(6.0) + 1)[1:])
        loop.extend([end] * _samples(4.0))
    return np.round(np.concatenate(([low] * _samples(4.0), np.tile(loop, repeats))), 3)


def long_holds(rng: np.random.Generator) -> np.ndarray:
    """Return levels held for 110 s, reached from below and from above [V]."""
    levels = [rng.uniform(3.9, 4.3), HIGHEST, rng.uniform(3.5, 4.0)]
    holds = [110.0, 10.0, 120.0]
    return np.round(np.concatenate(
        [[level] * _samples(hold) for level, hold in zip(levels, holds)]), 3)
