# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
From the arm's target angle to what each muscle has to do: length and force (Eqs. 21 and 22).

Subscribes `target_angle`, publishes `muscle_reference`. A target that is not finite, outside the
limits or out of the linkage's reach is not passed on: the last good reference stays in force, and
log and diagnostics say why. With a model file, the effects of the arm and of its encoder that the
model knows are undone here, the muscle's own in `compensator_node`.

In addition to single targets it takes `target_trajectory` and a stream of `joint_commands`, as a
joint trajectory controller of ros2_control sends it; the last message counts, whatever its topic.
These move the target no faster than ``maximum_speed``. When a stream ends without a word, the
muscle is switched off after ``command_timeout``. The target at each time is published as
`target_joint_states`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import dataclasses
import math
import time
from typing import Any, TYPE_CHECKING

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

from hysteresis_ros.bicep.follower import Follower
from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.bicep.trajectory import Trajectory
from hysteresis_ros.errors import RangeError
from hysteresis_ros.nodes.commands import read_command, read_trajectory
from hysteresis_ros.nodes.alive import promise_life
from hysteresis_ros.nodes.diagnostics import Diagnostics, WARN
from hysteresis_ros.nodes.parameters import (
    ANGLE_LIMITS, check_limits, GEOMETRY, MODEL, NAMES, Parameters, Spec, TARGETS)
from hysteresis_ros.nodes.qos import COMMANDS, LATEST, MEASUREMENTS
from hysteresis_ros.nodes.reference import (
    ArmReference, let_go, load_model, read_angle, seconds)
from hysteresis_ros.nodes.running import run

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel


# Seconds by which a target may be late without a word: a message that was delayed.
LATE = 1.0

MOTION = (
    Spec('maximum_speed', 0.2, 'Largest speed of the target on a trajectory or behind joint '
         'commands: what the muscle follows, heating and cooling', 'rad/s', 0.001, 100.0),
    Spec('trajectory_rate', 10.0, 'How often a target on its way is passed on', 'Hz', 0.1, 200.0,
         read_only=True),
    Spec('command_timeout', 2.0, 'Time without a joint command after which the muscle is switched '
         'off; by the slower of wall clock and node clock', 's', 0.05, 600.0),
)


class GeometryNode(Node):
    """
    The node `bicep_geometry`.

    Parameters
    ----------
    model : MuscleModel, optional
        Used instead of the one that the parameter ``model_file`` names.
    **options
        For `rclpy.node.Node`, such as ``namespace`` or ``parameter_overrides``.
    """

    PARAMETERS = GEOMETRY + ANGLE_LIMITS + TARGETS + MOTION + MODEL + NAMES

    def __init__(self, model: MuscleModel | None = None, **options: Any) -> None:
        super().__init__('bicep_geometry', **options)
        self._follower = Follower()
        parameters = self._settings = Parameters(
            self, self.PARAMETERS, check=_check, changed=self._configure)
        if model is None and parameters['model_file']:
            model = load_model(parameters['model_file'], parameters, self.get_logger())
        self._model = model
        self._passed_on: float | None = None
        self._configure(parameters)
        self._measured: float | None = None
        # When the last joint command came, by both clocks; None while no stream is followed.
        self._commanded: tuple[float, float] | None = None
        self._received = self._published = self._refused = 0
        self._diagnostics = Diagnostics(
            self, parameters['hardware_id'], self._counts, 'passing targets on')
        self._publisher = self.create_publisher(JointState, 'muscle_reference', COMMANDS)
        self._targets = self.create_publisher(JointState, 'target_joint_states', MEASUREMENTS)
        self.create_subscription(Float64, 'target_angle', self._on_target, COMMANDS)
        self.create_subscription(
            JointTrajectory, 'target_trajectory', self._on_trajectory, COMMANDS)
        self.create_subscription(JointState, 'joint_commands', self._on_command, COMMANDS)
        self.create_subscription(JointState, 'joint_states', self._on_joint_states, LATEST)
        self._timer = self.create_timer(1.0 / parameters['trajectory_rate'], self._go_on)
        self._timer.cancel()
        promise_life(self)
        self.get_logger().info('waiting for target angles')

    def on_shutdown(self) -> None:
        """Let the muscle go if somebody was moving it: nobody will take it to the end."""
        if self._commanded is not None or self._follower.moving:
            self._publisher.publish(self._letting_go())

    def _configure(self, parameters: Parameters) -> None:
        self._limits = parameters['minimum_angle'], parameters['maximum_angle']
        self._muscle, self._joint = parameters['muscle_name'], parameters['joint_name']
        self._follower.maximum_speed = parameters['maximum_speed']
        self._geometry = BicepGeometry.from_mapping(parameters)
        if self._model is not None:
            self._model = dataclasses.replace(self._model, geometry=self._geometry)
        self._reference = ArmReference(
            self._geometry, self._model, parameters['target_dead_band']).reference
        self._passed_on = None

    def _now(self) -> float:
        return 1e-9 * self.get_clock().now().nanoseconds

    def _on_target(self, message: Float64) -> None:
        self._received += 1
        if self._pass_on(message.data):
            self._diagnostics.clear('target')
            self._end_commands()
            self._timer.cancel()
            self._follower.stop(message.data)

    def _on_trajectory(self, message: JointTrajectory) -> None:
        self._received += 1
        now = self._now()
        try:
            trajectory = read_trajectory(message, self._joint)
            start = seconds(message.header.stamp) or now
            if start + trajectory.end < now:
                raise RangeError(f'the trajectory ended {now - start - trajectory.end:.1f} s ago; '
                                 'a stamp of zero makes it begin at once')
            for angle in trajectory.extent():
                self._check_target(angle)
                self._geometry.check_angle(angle)
        except RangeError as error:
            self._refuse('trajectory not followed', error)
            return
        self._end_commands()
        speed, limit = trajectory.speed(), self._follower.maximum_speed
        if speed > limit:
            self.get_logger().warning(
                f'the trajectory moves at up to {speed:.3f} rad/s, the muscle at {limit:.3f} rad/s '
                '(maximum_speed): it will be late')
        self._set_out(trajectory, start, now)

    def _on_command(self, message: JointState) -> None:
        self._received += 1
        now = self._now()
        try:
            angle = read_command(message, self._joint)
            self._check_target(angle)
            self._geometry.check_angle(angle)
        except RangeError as error:
            self._refuse('joint command not followed', error)
            return
        self._commanded = now, time.monotonic()
        self._diagnostics.clear('silence')
        self._set_out(Trajectory([0.0], [angle]), now, now)

    def _set_out(self, trajectory: Trajectory, start: float, now: float) -> None:
        self._follower.follow(trajectory, start, now, self._measured)
        self._diagnostics.clear('target')
        self._timer.reset()
        self._move(now)

    def _on_joint_states(self, message: JointState) -> None:
        self._measured = read_angle(message, self._joint)

    def _go_on(self) -> None:
        """Move the target on, and watch over the commander."""
        now = self._now()
        if self._commanded is not None:
            last, heard = self._commanded
            self._commanded = min(last, now), heard     # the node's clock may be set back
            silence = min(now - last, time.monotonic() - heard)
            if silence > self._settings['command_timeout']:
                self._let_go(silence)
                return
        self._move(now)
        if not self._follower.moving and self._commanded is None:
            self._timer.cancel()

    def _move(self, now: float) -> None:
        target = self._follower.step(now)
        # One that stays is held by the compensator, which overdrives for each new one.
        if target is not None and target != self._passed_on:
            self._pass_on(target)
        if self._follower.late > LATE:
            self._diagnostics.set('late', WARN, (
                f'the target is {self._follower.late:.1f} s behind what is asked for: it moves at '
                f'{self._follower.maximum_speed:g} rad/s (maximum_speed)'))
        elif not self._follower.late:
            self._diagnostics.clear('late')

    def _let_go(self, silence: float) -> None:
        self._end_commands()
        self._timer.cancel()
        self._follower.stop()
        self._passed_on = None
        self._publisher.publish(self._letting_go())
        self._diagnostics.set('silence', WARN, f'no joint command for {silence:.1f} s: the muscle '
                              'is switched off until the next command or target')

    def _letting_go(self) -> JointState:
        message = let_go(self._muscle)
        message.header.stamp = self.get_clock().now().to_msg()
        return message

    def _end_commands(self) -> None:
        self._commanded = None
        self._diagnostics.clear('silence')
        self._diagnostics.clear('late')

    def _pass_on(self, angle: float) -> bool:
        """Publish the reference of a target angle [rad], and return whether there is one."""
        self._passed_on = angle
        try:
            self._check_target(angle)
            reference = self._reference(angle)
        except RangeError as error:
            self._refuse('target not passed on', error)
            return False
        stamp = self.get_clock().now().to_msg()
        output = JointState(
            name=[self._muscle], position=[reference.length], effort=[reference.force])
        output.header.stamp = stamp
        self._publisher.publish(output)
        self._published += 1
        target = JointState(name=[self._joint], position=[float(angle)])
        target.header.stamp = stamp
        self._targets.publish(target)
        return True

    def _refuse(self, what: str, error: RangeError) -> None:
        self._refused += 1
        self._diagnostics.set('target', WARN, f'{what}: {error}')

    def _check_target(self, angle: float) -> None:
        low, high = self._limits
        if math.isfinite(angle) and not low <= angle <= high:
            raise RangeError(
                f'target angle {angle:.4f} rad is outside the limits of {low:.4f} to '
                f'{high:.4f} rad ({math.degrees(low):.1f} to {math.degrees(high):.1f} deg)')

    def _counts(self) -> dict[str, Any]:
        return {'targets received': self._received, 'references published': self._published,
                'targets refused': self._refused}


def _check(values: Mapping[str, Any]) -> None:
    check_limits(values, 'angle')
    BicepGeometry.from_mapping(values)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(GeometryNode, args)
