# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The root of a falling function that costs much and changes little from one sample to the next.

A compiled function takes no other function as an argument at a price that is worth it, so the
caller evaluates: `begin` says where first, and `proceed` takes the value and says where next, as
long as `searching`. The last place that was asked for is the root::

    point = begin(memory, at, start, value, step, low, high, tolerance)
    while searching(memory, at):
        point = proceed(memory, at, function(point))

The search first steps outward until the sign changes, then goes on by false position that cannot
stall at one end (Anderson and Bjorck, BIT 13, 1973), the fastest choice for a function without
steep places.
"""

import math

import numpy as np

from .clip import clip
from .lean import lean


# What a search keeps, from a place in an array on: two points with their values, the last step,
# the ends of the range, the size of a value at which to stop, what comes next, and how often.
_NEAR, _HERE, _FAR, _THERE, _STEP, _LOW, _HIGH, _TOLERANCE, _PHASE, _COUNT = range(10)
SIZE = 10
# Phases.
_DONE, _OUTWARD, _BETWEEN = 0.0, 1.0, 2.0
MOST_ITERATIONS = 60


@lean
def begin(memory: np.ndarray, at: int, start: float, here: float, step: float, low: float,
          high: float, tolerance: float) -> float:
    """
    Begin where the last root was and return the first place to evaluate.

    Parameters
    ----------
    memory : ndarray
        Holds the search from the place `at` on.
    at : int
        That place.
    start, here : float
        Where to begin, and the function's value there.
    step : float
        About how far the root is; of the value's sign.
    low, high : float
        Ends of the range. If there is no root inside, the nearer end is the answer.
    tolerance : float
        Size of the value at which to stop.

    """
    memory[at + _NEAR], memory[at + _HERE] = start, here
    memory[at + _FAR] = clip(start + step, low, high)
    memory[at + _STEP], memory[at + _LOW], memory[at + _HIGH] = step, low, high
    memory[at + _TOLERANCE] = tolerance
    memory[at + _PHASE], memory[at + _COUNT] = _OUTWARD, 0.0
    return memory[at + _FAR]


@lean
def between(memory: np.ndarray, at: int, near: float, here: float, far: float, there: float,
            tolerance: float) -> float:
    """Begin between two points on both sides of the root; evaluated last was `far`."""
    memory[at + _NEAR], memory[at + _HERE] = near, here
    memory[at + _FAR], memory[at + _THERE] = far, there
    memory[at + _TOLERANCE] = tolerance
    memory[at + _PHASE], memory[at + _COUNT] = _BETWEEN, 0.0
    return _next(memory, at)


@lean
def searching(memory: np.ndarray, at: int) -> bool:
    """Return whether the function has to be evaluated once more."""
    return memory[at + _PHASE] != _DONE


@lean
def proceed(memory: np.ndarray, at: int, value: float) -> float:
    """Return where to evaluate next, given the value at the place before."""
    near, here, far = memory[at + _NEAR], memory[at + _HERE], memory[at + _FAR]
    if memory[at + _PHASE] == _BETWEEN:
        # `_STEP` holds the place where the value was taken.
        if value * memory[at + _THERE] < 0.0:
            memory[at + _NEAR], memory[at + _HERE] = far, memory[at + _THERE]
        else:
            memory[at + _HERE] = retained_factor(memory[at + _THERE], value) * here
        memory[at + _FAR], memory[at + _THERE] = memory[at + _STEP], value
        return _next(memory, at)
    memory[at + _THERE] = value
    ended = (far == memory[at + _LOW] or far == memory[at + _HIGH]
             or memory[at + _COUNT] >= MOST_ITERATIONS)
    if value * here <= 0.0:
        memory[at + _PHASE], memory[at + _COUNT] = _BETWEEN, 0.0
        return _next(memory, at)
    if ended:
        memory[at + _PHASE] = _DONE
        return far
    step = outward(near, here, far, value, memory[at + _STEP])
    memory[at + _NEAR], memory[at + _HERE] = far, value
    memory[at + _STEP] = step
    memory[at + _FAR] = clip(far + step, memory[at + _LOW], memory[at + _HIGH])
    memory[at + _COUNT] += 1.0
    return memory[at + _FAR]


@lean
def outward(near: float, here: float, far: float, there: float, step: float) -> float:
    """
    Return the next step outward, of a function whose sign has not changed yet.

    Parameters
    ----------
    near, here : float
        The last place but one, and the function's value there.
    far, there : float
        The last place, and the value there.
    step : float
        The last step.
    """
    # A little further than the straight line through both says.
    fall, last = here - there, abs(step)
    reach = abs(1.3 * there / fall * (far - near)) if fall * here > 0.0 else math.inf
    return math.copysign(clip(reach, 0.1 * last, 8.0 * last), step)


@lean
def retained_factor(before: float, value: float) -> float:
    """
    Return the factor on the value at the retained end, after two values of the same sign.

    That of Anderson and Bjorck, but at least a quarter.

    Parameters
    ----------
    before, value : float
        The function's values at the last place but one and at the last.
    """
    # On a plateau the other end would come next, again and again.
    return clip(1.0 - value / before, 0.25, math.inf)


@lean
def _next(memory: np.ndarray, at: int) -> float:
    here, far, there = memory[at + _HERE], memory[at + _FAR], memory[at + _THERE]
    if (abs(there) <= memory[at + _TOLERANCE] or there == here
            or memory[at + _COUNT] >= MOST_ITERATIONS):
        memory[at + _PHASE] = _DONE
        return far
    memory[at + _COUNT] += 1.0
    memory[at + _STEP] = far - there * (far - memory[at + _NEAR]) / (there - here)
    return memory[at + _STEP]
