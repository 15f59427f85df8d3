# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The arm from sample to sample, and over a whole trial.

Dry friction lets the load lie in a band, inside which the arm sticks; viscous friction and inertia
add what the present velocity and acceleration cost: by backward differences of second order, and
while the arm rings by the method of Fox and Goodwin, Newmark's with beta = 1/12,
whose phase is of fourth order.
"""

import math

import numpy as np

from . import bundle, grid
from .arm import (
    ACCELERATION, ANGLE, Arm, BEFORE_DT, BUNDLE_SEARCH, INERTIAL_RATIO, keep_motion, LEVERAGE, LOAD,
    MOMENT, NEAR, NEAR_LENGTH, NEAR_LOAD, place, present, REST_GAIN, RINGING, State, SWING_GAIN,
    THETA, VELOCITY, X)
from .formation import LOAD as BEYOND, SIZE
from .jit import jit
from .lean import inlined, lean, merged
from .operator import last_input, last_output, reset
from .rest import bundle_load_at, direction, settle, settle_bundle
from .swing import load_at, swing

# A dt longer than this [s] is a settled state to which dynamics contribute nothing.
LONGEST_TRANSIENT = 5.0
# What rings so fast that a sample would take more pieces than this has come to rest by its end.
MOST_PIECES = 200
# An arm whose inertia takes less than this share of the largest moment at rest, under a step of x
# that is small, does not ring, and is followed at a longer dt; the share fades from piece to piece.
CALM, FADING = 0.005, 0.97
# Samples in which a muscle that keeps strain cools down before a trial.
COOLING = 40


@lean
def start(arm: Arm, state: State) -> None:
    """Wipe the memory: after a full heat and cool cycle, before the first sample."""
    for i in range(len(arm.wires.offsets)):
        reset(arm.wires.table, state.memories[i])
        for k in range(SIZE):
            state.muscles[i, k] = 0.0
        state.muscles[i, BEYOND] = last_input(arm.wires.table, state.memories[i])
    motion = state.motion
    motion[:] = 0.0
    motion[ANGLE] = motion[BEFORE_DT] = np.nan
    motion[X] = np.inf
    motion[REST_GAIN], motion[SWING_GAIN], motion[BUNDLE_SEARCH + bundle.GAIN] = 1.5, 1.0, 1.0
    motion[NEAR:NEAR + 3] = 1.0
    motion[NEAR_LENGTH] = motion[NEAR_LOAD] = 1.0


@inlined
def output(arm: Arm, state: State) -> float:
    """Return the output of H2 [m]; the mean of the muscles."""
    if len(arm.wires.offsets) > 1:
        return bundle.mean_output(arm.wires, state.memories)
    return last_output(arm.wires.table, state.memories[0])


@merged
def step(arm: Arm, state: State, x: float, dt: float, offset: float, factor: float) -> float:
    """
    Advance to the next sample and return the angle [rad].

    Parameters
    ----------
    arm, state : Arm, State
    x : float
        Output of the first stage, unit of the load.
    dt : float
        Time since the sample before [s].
    offset, factor : float
        What time and use add to the elongation [m] and do to the stroke.
    """
    motion = state.motion
    pieces = 1
    ringing = 0.0 < dt < min(LONGEST_TRANSIENT, MOST_PIECES * arm.longest) and (
        abs(x - motion[X]) > arm.calm or motion[INERTIAL_RATIO] > CALM)
    motion[RINGING] = 1.0 if ringing else 0.0
    if ringing:
        pieces = int(math.ceil(dt / arm.longest))
        if (arm.swings or len(arm.wires.offsets) > 1) and x != motion[X]:
            _kick(arm, state, x, offset, factor)
    motion[X] = x
    angle = motion[ANGLE]
    for _ in range(pieces):
        angle = _advance(arm, state, x, dt / pieces, offset, factor)
    # In the middle of a swing the acceleration is zero for a moment.
    motion[INERTIAL_RATIO] = max(arm.inertia * abs(motion[ACCELERATION]) / arm.heaviest,
                                 FADING ** pieces * motion[INERTIAL_RATIO])
    return angle


@merged
def _kick(arm: Arm, state: State, x: float, offset: float, factor: float) -> None:
    """Begin a dt with the acceleration under a new x."""
    motion = state.motion
    velocity = motion[VELOCITY]
    # An arm that friction holds is not accelerated before it slides.
    if not math.isnan(motion[ANGLE]) and (velocity != 0.0 or not arm.sticks):
        sense = 0.0 if velocity == 0.0 else math.copysign(1.0, velocity)
        drag = arm.viscous * velocity + sense * arm.coulomb
        k, share = present(arm, motion)
        if arm.swings:
            load = load_at(arm, state, x, offset, factor, k, share)
        else:
            load = bundle_load_at(arm, state, x, offset, factor, k, share)
        leverage = grid.between(arm.grid, LEVERAGE, k, share) * math.exp(sense * arm.capstan)
        motion[ACCELERATION] = (grid.between(arm.grid, MOMENT, k, share) - drag
                                - load * leverage) / arm.inertia


@merged
def _advance(arm: Arm, state: State, x: float, dt: float, offset: float, factor: float) -> float:
    motion = state.motion
    begun = not math.isnan(motion[ANGLE])
    moving = arm.dynamic and dt < LONGEST_TRANSIENT and begun
    if moving and dt <= 0.0:
        return motion[ANGLE]
    if not moving:
        dt = 0.0
    drag = 0
    if arm.sticks:
        # At the start the arm has sunk to where it rests, and friction has held it up.
        drag = direction(arm, state, x, offset, factor, dt) if begun else 1
        if drag == 0:
            keep_motion(arm, motion, motion[ANGLE], 0.0)
            return motion[ANGLE]
    line = 2 if drag < 0 else drag
    if moving and arm.swings:
        k, share = swing(arm, state, x, offset, factor, drag * arm.coulomb,
                         math.exp(drag * arm.capstan), dt)
    elif len(arm.wires.offsets) > 1:
        k, share = settle_bundle(arm, state, line, x, offset, factor, dt)
    else:
        k, share = settle(arm, state, line, x, offset, factor)
    angle = grid.between(arm.grid, THETA, k, share)
    keep_motion(arm, motion, angle, dt)
    motion[ANGLE] = angle
    return angle


@inlined
def _cooling(arm: Arm, state: State, x: float) -> tuple[int, float]:
    """Return in how many samples a hot muscle cools down to the state of rest, and x while hot."""
    if arm.wires.kept == 0.0 or not arm.wires.cooled:
        return 1, x
    # What forms on the way down remembers the loads that it meets there.
    k, share = place(arm, state.motion, 0, 0.0, 0.0)
    return COOLING + 1, grid.between(arm.grid, LOAD, k, share) - last_input(
        arm.wires.table, state.memories[0])


@jit
def run(arm: Arm, state: State, begins: bool, cold: float, held: float, ends: np.ndarray,
        x: np.ndarray, dt: np.ndarray, offset: np.ndarray, factor: np.ndarray
        ) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """
    Run whole trials, each from the cold state, or go on from the present one.

    Parameters
    ----------
    arm, state : Arm, State
    begins : bool
        Whether each trial begins in the cold state.
    cold : float
        Output of the first stage there.
    held : float
        Offset in the cold state [m]; see `step`.
    ends : ndarray of int, shape (trials,)
        Where each trial ends and the next begins.
    x, dt, offset, factor : ndarray, shape (rows,)
        As for `step`, for the rows of all trials.

    Returns
    -------
    rest : float
        Angle of rest in the cold state [rad]; NaN where nothing began there.
    angles, outputs, inputs : ndarray, shape (rows,)
        Angle [rad], output of H2 [m], and input of the first muscle's H2.

    """
    rows = len(x)
    angles, outputs, inputs = np.empty(rows), np.empty(rows), np.empty(rows)
    rest, begin = np.nan, 0
    for end in ends:
        samples, hot = 0, cold
        if begins:
            start(arm, state)
            samples, hot = _cooling(arm, state, cold)
        # One call for all: a step is compiled into where it is called.
        for n in range(begin - samples, end):
            if n < begin:
                now, passed, added, shrunk = cold, np.inf, held, 1.0
                if n < begin - 1:
                    share = (n - begin + samples) / COOLING
                    now = max(hot + share * (cold - hot), cold)
            else:
                now, passed, added, shrunk = x[n], dt[n], offset[n], factor[n]
            angle = step(arm, state, now, passed, added, shrunk)
            if n < begin:
                rest = angle
            else:
                angles[n] = angle
                outputs[n] = output(arm, state)
                inputs[n] = last_input(arm.wires.table, state.memories[0])
        begin = end
    return rest, angles, outputs, inputs
