# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the kernels of the arm work on: a table of its states, and what it remembers.

A place of the arm is an interval of the grid of angles and a share of it (see `grid`).
"""

from typing import NamedTuple

import numpy as np

from . import grid, root
from .bundle import SEARCH, Wires
from .jit import remember_types
from .lean import lean

# Columns of `Arm.grid`: angle [rad], elongation [m], moment to be held [N m], moment arm times
# number of muscles [m]. Then, for an arm at rest, one that sinks and one that rises against dry
# friction: what the transformation has to give [m], without offset, which never falls; the load
# that it feels; what a moment that resists motion takes off that load; what an offset counts; and
# by how much the loop is wider than that of H2.
THETA, LENGTH, MOMENT, LEVERAGE = range(4)
DEMAND, LOAD, RESIST, STRAIN, WIDTH = range(4, 9)
LINE = 5
# Columns of `Arm.loads`, at loads that are equally far apart: the load as the transformation feels
# it, factor on its strain, elastic stretch [m], and by how much its loop is wider than that of H2.
INSIDE, SCALE, STRETCH, LOOP = range(4)

# Entries of `State.motion`: angle [rad], NaN before the first sample; velocity and acceleration;
# dt, angle and velocity of the sample before, that dt NaN where there was none; x; whether
# the arm rings; its largest moment of inertia of late over the largest moment at rest; factors on
# the first steps of searches; where on the grid each line was looked up last.
(ANGLE, VELOCITY, ACCELERATION, BEFORE_DT, BEFORE_ANGLE, BEFORE_VELOCITY, X, RINGING,
 INERTIAL_RATIO, REST_GAIN, SWING_GAIN, NEAR) = range(12)
NEAR_LENGTH, NEAR_LOAD = NEAR + 3, NEAR + 4
REST_SEARCH = NEAR + 5
BUNDLE_SEARCH = REST_SEARCH + root.SIZE
MOTION = BUNDLE_SEARCH + SEARCH

# Up to this ratio of a dt to the one before backward differences of second order are stable
# (Grigorieff, Numer. Math. 42 (1983) 359): 1 + sqrt(2). Beyond, those of first order are taken.
LARGEST_RATIO = 2.414

# Load that may be missing while the arm moves, over that at rest.
LOOSER = 1e4


@remember_types
class Arm(NamedTuple):
    """
    Arm and parallel muscles, as tables.

    `grid` (n, 9 or 19) and `loads` (m, 4) have the columns above; `spacing` [N] is that of the
    loads. `base` [m] is the least output of H2; `coulomb` [N m], `viscous` [N m s/rad] and
    `inertia` [kg m^2] resist motion, and so do cables that change a tension by exp(-+
    `capstan`); dry friction is larger at rest by the share `stiction`. `tolerance` [N] is the
    load that may be missing at rest. `longest` [s] is the longest dt of an arm that rings,
    `heaviest` [N m] the largest moment at rest, and `calm` a step of x that does not make it
    ring. `sticks` says whether any of the friction is dry, `rigid` whether the demand does not
    depend on that, `strained` whether an offset counts by the load, `dynamic` whether velocity
    or acceleration count, `swings` whether each dt solves the equation of motion, and `plays`
    whether the loop's width depends on the load (see `load_play`).
    """

    wires: Wires
    grid: np.ndarray
    loads: np.ndarray
    spacing: float
    base: float
    coulomb: float
    stiction: float
    capstan: float
    viscous: float
    inertia: float
    tolerance: float
    longest: float
    heaviest: float
    calm: float
    sticks: bool
    rigid: bool
    strained: bool
    dynamic: bool
    swings: bool
    plays: bool


@remember_types
class State(NamedTuple):
    """
    What an arm remembers.

    The memory of each muscle's H2, motion, and the columns of `formation` for each muscle.
    """

    memories: np.ndarray
    motion: np.ndarray
    muscles: np.ndarray


@lean
def place(arm: Arm, motion: np.ndarray, line: int, demand: float, offset: float
          ) -> tuple[int, float]:
    """Return the place at which the transformation gives `demand`, with an offset [m]."""
    last = len(arm.grid) - 1
    column, strain = DEMAND + LINE * line, STRAIN + LINE * line
    near = int(motion[NEAR + line])
    if not arm.strained or offset == 0.0:
        demand += offset
        k = grid.interval(arm.grid, column, demand, near)
        below, above = arm.grid[k - 1, column], arm.grid[k, column]
    else:
        # The offset is not part of the strain that the load scales; it is small, so the place is
        # near the one without it.
        k = grid.interval(arm.grid, column, demand + offset * arm.grid[near, strain], near)
        below = arm.grid[k - 1, column] - offset * arm.grid[k - 1, strain]
        above = arm.grid[k, column] - offset * arm.grid[k, strain]
        while demand >= above and k < last:
            k += 1
            below, above = above, arm.grid[k, column] - offset * arm.grid[k, strain]
        while demand < below and k > 1:
            k -= 1
            below, above = arm.grid[k - 1, column] - offset * arm.grid[k - 1, strain], below
    motion[NEAR + line] = k
    if demand <= below:
        return k, 0.0
    return k, 1.0 if demand >= above else (demand - below) / (above - below)


@lean
def factor_at(arm: Arm, line: int, k: int, share: float) -> float:
    """Return S(F), by which the load at a place makes the strain larger."""
    return 1.0 / grid.between(arm.grid, STRAIN + LINE * line, k, share)


@lean
def demand_at(arm: Arm, line: int, k: int, share: float, offset: float) -> float:
    """Return what the transformation has to give at a place: `place` inverted."""
    demand = grid.between(arm.grid, DEMAND + LINE * line, k, share)
    if arm.strained:
        offset *= grid.between(arm.grid, STRAIN + LINE * line, k, share)
    return demand - offset


@lean
def present(arm: Arm, motion: np.ndarray) -> tuple[int, float]:
    """Return the place of the present angle."""
    angle = motion[ANGLE]
    spacing = arm.grid[1, THETA] - arm.grid[0, THETA]
    k = grid.interval(arm.grid, THETA, angle, int((angle - arm.grid[0, THETA]) / spacing) + 1)
    return k, (angle - arm.grid[k - 1, THETA]) / (arm.grid[k, THETA] - arm.grid[k - 1, THETA])


@lean
def moved(motion: np.ndarray, theta: float, dt: float) -> tuple[float, float]:
    """
    Return velocity and acceleration where the arm gets to `theta` within `dt`.

    By backward differences of second order for any dt, as those of a clock are never quite alike.
    """
    angle, velocity = motion[ANGLE], motion[VELOCITY]
    if motion[RINGING] != 0.0:
        way = theta - angle - dt * velocity
        acceleration = 12.0 * way / dt ** 2 - 5.0 * motion[ACCELERATION]
        return velocity + 0.5 * dt * (motion[ACCELERATION] + acceleration), acceleration
    ratio = dt / motion[BEFORE_DT]
    if ratio < LARGEST_RATIO:
        here, last = (1.0 + 2.0 * ratio) / (1.0 + ratio), ratio * ratio / (1.0 + ratio)
        speed = (here * theta - (1.0 + ratio) * angle + last * motion[BEFORE_ANGLE]) / dt
        return speed, (here * speed - (1.0 + ratio) * velocity
                       + last * motion[BEFORE_VELOCITY]) / dt
    speed = (theta - angle) / dt
    return speed, (speed - velocity) / dt


@lean
def keep_motion(arm: Arm, motion: np.ndarray, angle: float, dt: float) -> None:
    """Note the velocity with which the arm gets to `angle`; none at an end or at rest."""
    if dt == 0.0 or angle == arm.grid[0, THETA] or angle == arm.grid[-1, THETA]:
        motion[VELOCITY] = motion[ACCELERATION] = 0.0
        motion[BEFORE_DT] = np.nan
        return
    velocity, motion[ACCELERATION] = moved(motion, angle, dt)
    motion[BEFORE_DT] = dt
    motion[BEFORE_ANGLE], motion[BEFORE_VELOCITY] = motion[ANGLE], motion[VELOCITY]
    motion[VELOCITY] = velocity


@lean
def width(arm: Arm, line: int, k: int, share: float) -> float:
    """Return by how much the loop is wider than that of H2 at a place."""
    return grid.between(arm.grid, WIDTH + LINE * line, k, share) if arm.plays else 0.0


@lean
def required(arm: Arm, motion: np.ndarray, line: int, k: int, share: float, dt: float) -> float:
    """Return the load that the arm asks for at a place, reached within `dt`."""
    load = grid.between(arm.grid, LOAD + LINE * line, k, share)
    if dt != 0.0:
        theta = grid.between(arm.grid, THETA, k, share)
        speed, acceleration = moved(motion, theta, dt)
        moment = arm.viscous * speed + arm.inertia * acceleration
        load -= moment * grid.between(arm.grid, RESIST + LINE * line, k, share)
    return load
