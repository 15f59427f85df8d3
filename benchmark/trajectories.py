# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A sine as one trajectory, beside the same sine published angle by angle, on the simulated arm."""

from collections.abc import Callable, Sequence
import os
from pathlib import Path
import tempfile
import time

from builtin_interfaces.msg import Duration, Time
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from benchmark.child import own_domain
from benchmark.nodes import PATIENCE
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.nodes.qos import COMMANDS
from hysteresis_ros.nodes.reference import seconds
from hysteresis_ros.nodes.session import Processes

# The nodes on a simulated arm at 60 times real time; the muscle has a time constant of 5 s.
SETTINGS = {'port': 'sim://bicep?speed=60&seed=1', 'use_sim_time': True,
            'initialise_heat_time': 10.0, 'initialise_cool_time': 20.0}
MIDDLE, AMPLITUDE, PERIOD = 2.0, 0.25, 30.0     # rad, rad, s
REPEATS = 5
INTERVAL = 0.1      # s between two target angles
SPACING = 1.0       # s between two points of the trajectory
SETTLE = 20.0       # s in the middle before it begins


def trajectory_benchmarks(quick: bool) -> dict:
    """
    Measure the error of a sine sent as a trajectory over that of one sent as target angles.

    Returns
    -------
    dict
        RMS errors of the best of several runs, and their ratio; nothing if `quick`, as even one
        run takes ten seconds.
    """
    if quick:
        return {}
    domain = own_domain()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = rclpy.create_node('commander', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def until(condition: Callable[[], object], what: str, patience: float = PATIENCE) -> None:
        deadline = time.monotonic() + patience
        while not condition():
            if time.monotonic() > deadline:
                raise HysteresisError(f'benchmark of trajectories: waited in vain for {what}')
            executor.spin_once(timeout_sec=0.05)
    with tempfile.TemporaryDirectory() as folder:
        processes = Processes(SETTINGS, Path(folder) / 'nodes.log')
        try:
            sine = Sine(node, until)
            runs = [(sine.by_trajectory(), sine.by_angles()) for _ in range(REPEATS)]
        finally:
            processes.stop()
            executor.shutdown()
            node.destroy_node()
            rclpy.shutdown(context=context)
    whole, angles = np.min(runs, axis=0)
    return {'sine_by_trajectory_rmse_rad': float(whole),
            'sine_by_target_angle_rmse_rad': float(angles),
            'sine_by_trajectory_over_target_angle_rmse_ratio': float(whole / angles)}


class Sine:
    """
    A commander that has the arm follow a sine and measures its error.

    Parameters
    ----------
    node : rclpy.node.Node
        Publishes and listens; somebody spins it.
    until : callable
        Spins until a condition holds: ``until(condition, what, patience)``.
    """

    def __init__(self, node: Node, until: Callable[..., None]) -> None:
        self._until = until
        self._angles: list[tuple[float, float]] = []
        node.create_subscription(JointState, 'joint_states', lambda message: self._angles.append(
            (seconds(message.header.stamp), message.position[0])), qos_profile_sensor_data)
        self._trajectories = node.create_publisher(JointTrajectory, 'target_trajectory', COMMANDS)
        self._targets = node.create_publisher(Float64, 'target_angle', COMMANDS)
        self._services = [node.create_client(Trigger, name) for name in (
            'hardware_bridge/initialise', 'hysteresis_compensator/reset')]
        until(lambda: self._angles and self._trajectories.get_subscription_count()
              and self._targets.get_subscription_count()
              and all(service.service_is_ready() for service in self._services), 'the nodes', 60.0)

    @property
    def now(self) -> float:
        """Time of the arm [s]."""
        return self._angles[-1][0]

    def by_angles(self) -> float:
        """Publish the sine angle by angle, and return its RMS error [rad]."""
        start = last = self._begin()
        while last < start + PERIOD:
            self._wait(last + INTERVAL)
            last = self.now
            self._targets.publish(Float64(data=float(self._sine(last - start))))
        return self._error(start)

    def by_trajectory(self) -> float:
        """Publish the sine as one trajectory, and return its RMS error [rad]."""
        start = self._begin()
        times = np.arange(0.0, PERIOD + 0.5 * SPACING, SPACING)
        rate = 2.0 * np.pi / PERIOD
        self._trajectories.publish(trajectory(
            times.tolist(), self._sine(times).tolist(),
            (AMPLITUDE * rate * np.cos(rate * times)).tolist(), start=start))
        self._wait(start + PERIOD)
        return self._error(start)

    def _begin(self) -> float:
        """Heat and cool, go to the middle, and return the time."""
        for service in self._services:
            future = service.call_async(Trigger.Request())
            self._until(future.done, 'the answer of a service', 60.0)
            if not future.result().success:
                raise HysteresisError(f'benchmark of trajectories: {future.result().message}')
        self._targets.publish(Float64(data=MIDDLE))
        self._wait(self.now + SETTLE)
        return self.now

    def _wait(self, end: float) -> None:
        self._until(lambda: self.now >= end, f'{end} s', 60.0)

    def _sine(self, elapsed: np.ndarray | float) -> np.ndarray:
        return MIDDLE + AMPLITUDE * np.sin(2.0 * np.pi * np.asarray(elapsed) / PERIOD)

    def _error(self, start: float) -> float:
        elapsed, angle = np.array(self._angles).T - [[start], [0.0]]
        during = (elapsed >= 0.0) & (elapsed <= PERIOD)
        return float(np.sqrt(np.mean((angle - self._sine(elapsed))[during] ** 2)))


def trajectory(times: Sequence[float], angles: Sequence[float],
               velocities: Sequence[float] = (), names: Sequence[str] = ('elbow',),
               start: float = 0.0) -> JointTrajectory:
    """
    Return a message with one joint's way points.

    Parameters
    ----------
    times, angles, velocities : sequence of float
        Times from the start [s], angles [rad], and velocities [rad/s] or none.
    names : sequence of str
        Joints that it is for.
    start : float
        Stamp [s]; zero for at once.
    """
    points = [JointTrajectoryPoint(
        positions=[angle], time_from_start=Duration(sec=int(t), nanosec=round(1e9 * (t % 1.0))))
        for t, angle in zip(times, angles)]
    for point, velocity in zip(points, velocities):
        point.velocities = [velocity]
    message = JointTrajectory(joint_names=list(names), points=points)
    message.header.stamp = Time(sec=int(start), nanosec=round(1e9 * (start % 1.0)))
    return message
