# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A recorded session with the arm: the nodes as processes, target angles published, a rosbag2 bag.

What a user does by hand with ``ros2 run``, ``ros2 topic pub`` and ``ros2 bag record``.
"""

from collections.abc import Callable, Sequence
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from hysteresis_ros.atomic import AnyPath
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from diagnostic_msgs.msg import DiagnosticArray

from hysteresis_ros.errors import BoardError, ParameterError
from hysteresis_ros.measurements.bag import BRIDGE
from hysteresis_ros.nodes.qos import COMMANDS, RECORDED

TOPICS = {
    'target_angle': ('std_msgs/msg/Float64', Float64, COMMANDS),
    'muscle_reference': ('sensor_msgs/msg/JointState', JointState, COMMANDS),
    'voltage_setpoint': ('std_msgs/msg/Float64', Float64, COMMANDS),
    'applied_voltage': ('std_msgs/msg/Float64', Float64, RECORDED),
    'joint_states': ('sensor_msgs/msg/JointState', JointState, RECORDED),
    'ambient_temperature': ('sensor_msgs/msg/Temperature', Temperature, RECORDED),
    '/diagnostics': ('diagnostic_msgs/msg/DiagnosticArray', DiagnosticArray, 10),
}
# Wall seconds within which a process has to answer.
START_PATIENCE = 60.0
STALL_PATIENCE = 30.0
EXECUTABLES = ('bridge_node', 'geometry_node', 'compensator_node')


class Bag:
    """
    A rosbag2 folder that messages are written to as they come.

    Parameters
    ----------
    folder : path
        Must not exist yet.

    Raises
    ------
    ParameterError
        If the package rosbags is not installed, or the folder exists.
    """

    def __init__(self, folder: AnyPath) -> None:
        try:
            from rosbags.rosbag2 import StoragePlugin, Writer
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise ParameterError('recording needs the package rosbags: pip install rosbags, or '
                                 'record with `ros2 bag record -a`') from None
        folder = Path(folder)
        if folder.exists():
            raise ParameterError(f'{folder}: there is a recording already; name another folder')
        folder.parent.mkdir(parents=True, exist_ok=True)
        store = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        self._connections = {
            name: self._writer.add_connection('/' + name.lstrip('/'), kind, typestore=store)
            for name, (kind, _, _) in TOPICS.items()}
        self.count = 0

    def write(self, name: str, stamp: int, message: Any) -> None:
        """Write one message received at `stamp` [ns]."""
        self._writer.write(self._connections[name], stamp, serialize_message(message))
        self.count += 1

    def close(self) -> None:
        """Finish the file; without it the bag cannot be read."""
        self._writer.close()


class Processes:
    """
    The three nodes of the arm as processes of their own.

    Parameters
    ----------
    parameters : dict of str to (float, str, bool)
        For all nodes.
    log : path
        File that takes what they print.
    """

    def __init__(self, parameters: dict, log: AnyPath) -> None:
        arguments = ['--ros-args']
        for name, value in parameters.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            arguments += ['-p', f'{name}:={text}']
        self._log = open(log, 'w', encoding='utf-8')
        self._log_name = log
        self._running = {}
        for name in EXECUTABLES:
            self._running[name] = subprocess.Popen(
                [*_command(name), *arguments], stdout=self._log, stderr=subprocess.STDOUT,
                start_new_session=True)

    def check(self) -> None:
        """Raise BoardError if one of them has ended."""
        for name, process in self._running.items():
            if process.poll() is not None:
                raise BoardError(f'{name} has ended with status {process.returncode}; see '
                                 f'{self._log_name}')

    def stop(self) -> None:
        """End them as Ctrl-C does, the bridge last, so that the muscle is switched off."""
        for process in reversed(self._running.values()):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                try:
                    process.wait(10.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
        self._log.close()


def _command(name: str) -> list:
    """Return how to start a node: its executable as `ros2 run` finds it, else the module."""
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        path = Path(prefix) / 'lib' / 'hysteresis_ros' / name
        if prefix and path.is_file():
            return [str(path)]
    return [sys.executable, '-c', f'import sys; from hysteresis_ros.nodes.{name} import main; '
            'sys.exit(main())']


class Session(Node):
    """
    Publishes targets, and writes all that is said into a bag.

    Parameters
    ----------
    bag : Bag
    simulated_time : bool
        Whether the bridge publishes /clock.
    """

    def __init__(self, bag: Bag, simulated_time: bool) -> None:
        super().__init__('recorded_session', parameter_overrides=[
            Parameter('use_sim_time', value=simulated_time)])
        self._bag = bag
        self._last_angle: float | None = None
        self._heard = time.monotonic()
        self._fault = ''
        self._publisher = self.create_publisher(Float64, 'target_angle', COMMANDS)
        for name, (_, kind, qos) in TOPICS.items():
            self.create_subscription(
                kind, name, lambda message, name=name: self._record(name, message), qos)
        self._initialise = self.create_client(Trigger, 'hardware_bridge/initialise')
        self._reset = self.create_client(Trigger, 'hysteresis_compensator/reset')

    def _record(self, name: str, message: Any) -> None:
        if name == 'joint_states':
            self._heard = time.monotonic()
            self._last_angle = message.position[0] if message.position else None
        elif name == '/diagnostics':
            self._note_fault(message)
        stamp = self.get_clock().now().nanoseconds
        if stamp > 0:
            self._bag.write(name, stamp, message)

    def _note_fault(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if BRIDGE in status.name:
                fault = next((pair.value for pair in status.values if pair.key == 'fault'), 'none')
                self._fault = '' if fault == 'none' else fault

    def now(self) -> float:
        """Time of the node's clock [s]."""
        return 1e-9 * self.get_clock().now().nanoseconds

    def wait(self, ready: Callable[[], bool], processes: Processes, patience: float,
             what: str) -> None:
        """Spin until `ready()`; BoardError after `patience` wall seconds without it."""
        end = time.monotonic() + patience
        while not ready():
            rclpy.spin_once(self, timeout_sec=0.05)
            processes.check()
            if time.monotonic() > end:
                raise BoardError(f'{what} did not happen within {patience:.0f} s')

    def ready(self, processes: Processes) -> None:
        """Wait until every node is there and listens."""
        def listening() -> bool:
            return (self._initialise.service_is_ready() and self._reset.service_is_ready()
                    and self._publisher.get_subscription_count() >= 2
                    and self.count_subscribers('muscle_reference') >= 2
                    and self.count_subscribers('voltage_setpoint') >= 2
                    and self._last_angle is not None and self.now() > 0.0)
        self.wait(listening, processes, START_PATIENCE, 'the start of the nodes')

    def heat_and_cool(self, processes: Processes) -> None:
        """Wipe the model's memory, then the muscle's; else it would be driven again."""
        for client, what in ((self._reset, 'the reset of the compensator'),
                             (self._initialise, 'the heat and cool cycle')):
            answer = client.call_async(Trigger.Request())
            self.wait(answer.done, processes, 4.0 * START_PATIENCE, what)
            if not answer.result().success:
                raise BoardError(f'{what} was refused: {answer.result().message}')

    def drive(self, targets: np.ndarray, hold: float, processes: Processes,
              progress: Callable[[], object]) -> np.ndarray:
        """
        Publish targets and return the angle at the end of each hold.

        Parameters
        ----------
        targets : ndarray, shape (n,)
            Angles [rad].
        hold : float
            Time for each [s of the node's clock].
        processes : Processes
        progress : callable
            Called after each target.

        Returns
        -------
        ndarray, shape (n,)
            Measured angles [rad].

        Raises
        ------
        BoardError
            If a node ends or falls silent, or the bridge has switched the muscle off for good.
        """
        reached = []
        for target in targets:
            self._publisher.publish(Float64(data=float(target)))
            end = self.now() + hold
            self._heard = time.monotonic()
            while self.now() < end:
                rclpy.spin_once(self, timeout_sec=0.05)
                processes.check()
                if self._fault:
                    raise BoardError(f'the bridge has switched the muscle off: {self._fault}')
                if time.monotonic() - self._heard > STALL_PATIENCE:
                    raise BoardError(f'no joint_states for {STALL_PATIENCE:.0f} s')
            reached.append(self._last_angle)
            progress()
        return np.array(reached)


def record(folder: AnyPath, sequences: Sequence[np.ndarray], parameters: dict, hold: float,
           progress: Callable[[], object] = lambda: None) -> list:
    """
    Run the three nodes through target sequences and record a bag.

    Parameters
    ----------
    folder : path
        Of the bag; the nodes' words go to ``<folder>.log``.
    sequences : sequence of ndarray
        Target angles [rad]; before each the muscle is heated and cooled.
    parameters : dict
        Of the nodes: port, model_file, ...
    hold : float
        Time for each target [s of the arm's clock].
    progress : callable
        Called after each target.

    Returns
    -------
    list of ndarray
        Angle [rad] at the end of each hold, by sequence.

    Raises
    ------
    BoardError
        If a node ends or falls silent, or the bridge has switched the muscle off for good.
    ParameterError
        If the bag cannot be made.
    """
    # Stay on this machine, and out of the way of a robot that is running.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    bag = Bag(folder)
    processes = session = None
    try:
        processes = Processes(parameters, f'{folder}.log')
        rclpy.init()
        session = Session(bag, bool(parameters.get('use_sim_time', False)))
        session.ready(processes)
        reached = []
        for targets in sequences:
            session.heat_and_cool(processes)
            reached.append(session.drive(targets, hold, processes, progress))
        return reached
    finally:
        if session is not None:
            session.destroy_node()
        rclpy.try_shutdown()
        if processes is not None:
            processes.stop()
        bag.close()
