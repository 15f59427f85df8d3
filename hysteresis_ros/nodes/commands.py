# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What others ask of the joint: messages of ros2_control and MoveIt, read and checked."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

from hysteresis_ros.bicep.trajectory import Trajectory
from hysteresis_ros.errors import RangeError

if TYPE_CHECKING:
    from builtin_interfaces.msg import Duration
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def read_command(message: JointState, joint: str) -> float:
    """
    Take one joint's commanded angle [rad] out of a `sensor_msgs.msg.JointState`.

    Other joints of the message are those of a larger robot.

    Raises
    ------
    RangeError
        If it does not name the joint, or gives no finite position for it.
    """
    if joint not in message.name:
        raise RangeError(f'the joint command names {list(message.name)}, not {joint!r}')
    index = message.name.index(joint)
    if len(message.position) <= index:
        raise RangeError(f'the joint command gives no position for {joint!r}; velocities and '
                         'efforts are not followed')
    angle = message.position[index]
    if not math.isfinite(angle):
        raise RangeError(f'the joint command asks for {angle} rad; it has to be a finite number')
    return angle


def read_trajectory(message: JointTrajectory, joint: str) -> Trajectory:
    """
    Take the trajectory of the arm's one joint out of a message.

    Raises
    ------
    RangeError
        If it names another joint, has no points, or a point makes no sense.
    """
    names = list(message.joint_names)
    if names != [joint]:
        raise RangeError(f'the trajectory is for the joints {names}; this arm has {joint!r} alone')
    points = message.points
    for number, point in enumerate(points, 1):
        for name in ('positions', 'velocities', 'accelerations'):
            count = len(getattr(point, name))
            if count > 1 or (name == 'positions' and count == 0):
                raise RangeError(f'point {number} of the trajectory has {count} {name} for one '
                                 'joint')
    return Trajectory([_seconds(point.time_from_start) for point in points],
                      [point.positions[0] for point in points],
                      _derivative(points, 'velocities'), _derivative(points, 'accelerations'))


def _derivative(points: Sequence[JointTrajectoryPoint], name: str) -> list[float] | None:
    """Return one value a point, or None where a point has none."""
    values = [getattr(point, name)[0] for point in points if len(getattr(point, name))]
    return values if len(values) == len(points) else None


def _seconds(duration: Duration) -> float:
    return duration.sec + 1e-9 * duration.nanosec
