# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectories between way points, and a target that moves no faster than the muscle."""

import math

import numpy as np
import pytest

from hysteresis_ros.bicep.follower import Follower, HEAD_START
from hysteresis_ros.bicep.trajectory import Trajectory
from hysteresis_ros.errors import RangeError

TIMES = 0.5, 1.25, 3.0


def sampled(function, *orders):
    """Return a trajectory through a polynomial and its derivatives of these orders."""
    return Trajectory(TIMES, *(function.deriv(order)(np.array(TIMES)) for order in orders))


@pytest.mark.parametrize('degree, orders', [(1, (0,)), (3, (0, 1)), (5, (0, 1, 2))])
def test_points_are_joined_by_polynomials(degree, orders):
    """Linear, cubic, quintic: each is exact for a polynomial of its degree, between points too."""
    function = np.polynomial.Polynomial([1.9, 0.3, -0.2, 0.15, -0.05, 0.01][:degree + 1])
    trajectory = sampled(function, *orders)
    for time in np.linspace(TIMES[0], TIMES[-1], 29):
        assert trajectory.angle(time) == pytest.approx(function(time), abs=1e-12)
    assert trajectory.angle(0.0) == pytest.approx(function(TIMES[0]))
    assert trajectory.angle(9.0) == pytest.approx(function(TIMES[-1]))
    times = np.linspace(TIMES[0], TIMES[-1], 2001)
    assert trajectory.extent() == pytest.approx(
        (function(times).min(), function(times).max()), abs=1e-3)
    assert trajectory.speed() == pytest.approx(
        np.abs(function.deriv()(times)).max(), abs=1e-3)


def test_extent_sees_what_lies_between_the_points():
    """A cubic that overshoots leaves limits that its points respect."""
    overshooting = Trajectory([0.0, 1.0], [1.9, 1.9], [4.0, 4.0])
    assert overshooting.extent()[1] > 2.2
    assert overshooting.speed() == pytest.approx(4.0)


@pytest.mark.parametrize('points, words', [
    (([], []), 'no points'),
    (([0.0, math.nan], [1.9, 1.8]), 'point 2 of the trajectory has the time nan'),
    (([0.0, 1.0], [1.9, math.inf]), 'point 2 of the trajectory has the position inf'),
    (([0.0, 1.0], [1.9, 1.8], [0.0, math.nan]), 'point 2 of the trajectory has the velocity nan'),
    (([-1.0, 1.0], [1.9, 1.8]), 'begins at -1 s'),
    (([0.0, 1.0, 1.0], [1.9, 1.8, 1.7]), 'point 3 of the trajectory is at 1 s, not after point 2'),
])
def test_trajectory_that_makes_no_sense_is_refused(points, words):
    """The message names the point."""
    with pytest.raises(RangeError, match=words):
        Trajectory(*points)


def along(follower, times):
    """Return the targets at these times."""
    return [follower.step(time) for time in times]


def test_follower_goes_from_where_the_arm_is_to_the_first_point():
    """From the target before; without one from the measured angle; else it waits there."""
    way = Trajectory([1.0, 2.0], [1.8, 1.7])
    times = 100.0, 100.5, 101.0, 101.5, 102.0, 103.0
    follower = Follower()
    follower.stop(2.0)
    follower.follow(way, 100.0, 100.0, measured=2.4)
    assert along(follower, times) == pytest.approx([2.0, 1.9, 1.8, 1.75, 1.7, 1.7])
    assert not follower.moving
    follower = Follower()
    follower.follow(way, 100.0, 100.0, measured=2.2)
    assert follower.step(100.5) == pytest.approx(2.0)
    follower = Follower()
    follower.follow(way, 100.0, 100.0)
    assert follower.step(100.5) == 1.8


def test_follower_waits_for_the_start():
    """Nothing is asked of the cold arm before."""
    follower = Follower()
    follower.follow(Trajectory([0.0, 1.0], [1.8, 1.7]), 10.0, 8.0)
    assert along(follower, (8.0, 9.9, 10.0, 10.5)) == [None, None, 1.8, pytest.approx(1.75)]
    follower = Follower()
    follower.follow(Trajectory([1.0], [1.8]), 10.0, 8.0, measured=2.0)
    assert along(follower, (8.0, 9.9, 10.5)) == [None, None, pytest.approx(1.9)]
    follower = Follower()
    follower.stop(2.0)
    follower.follow(Trajectory([0.0], [1.8]), 10.0, 8.0)
    assert along(follower, (8.0, 10.0)) == [2.0, 1.8]


def test_follower_survives_a_clock_that_is_set_back():
    """As by a recording that begins anew."""
    follower = Follower(maximum_speed=0.2)
    follower.stop(2.0)
    follower.follow(Trajectory([0.0], [1.0]), 500.0, 500.0)
    follower.step(500.0)
    follower.follow(Trajectory([0.0], [1.0]), 3.0, 3.0)
    assert along(follower, (3.0, 4.0))[-1] == pytest.approx(2.0 - 0.2 * (1.0 + HEAD_START))


def test_follower_joins_a_trajectory_that_has_begun():
    """As ros2_control does with a stamp in the past."""
    follower = Follower()
    follower.stop(2.0)
    follower.follow(Trajectory([0.0, 10.0], [2.0, 1.0]), 0.0, 5.0)
    assert follower.step(5.0) == pytest.approx(1.5)


def test_follower_is_no_faster_than_the_muscle():
    """It comes late to the same place, and says so meanwhile."""
    follower = Follower(maximum_speed=0.2)
    follower.stop(2.0)
    follower.follow(Trajectory([0.0, 1.0], [2.0, 1.0]), 0.0, 0.0)
    times = np.arange(0.0, 8.0, 0.1)
    targets = np.array(along(follower, times[1:40]))
    assert np.abs(np.diff(targets)).max() <= 0.2 * 0.1 + 1e-12
    assert follower.late == pytest.approx(5.0 - HEAD_START - 3.9) and follower.moving
    assert along(follower, times[40:])[-1] == 1.0
    assert not follower.late and not follower.moving


def test_follower_that_stood_still_gets_no_head_start():
    """An hour of rest does not allow a jump to the next command."""
    follower = Follower(maximum_speed=0.2)
    follower.stop(2.0)
    follower.follow(Trajectory([0.0], [2.0]), 0.0, 0.0)
    assert follower.step(0.0) == 2.0
    follower.follow(Trajectory([0.0], [1.5]), 3600.0, 3600.0)
    assert follower.step(3600.0) == pytest.approx(2.0 - 0.2 * HEAD_START)


def test_single_commands_at_the_speed_of_the_muscle_are_followed_without_delay():
    """A stream of 50 commands a second that is just slow enough."""
    follower = Follower(maximum_speed=0.2)
    follower.stop(2.0)
    for time in np.arange(1, 200) / 50.0:
        follower.follow(Trajectory([0.0], [2.0 - 0.19 * time]), time, time)
        assert follower.step(time) == pytest.approx(2.0 - 0.19 * time)
        assert not follower.late
