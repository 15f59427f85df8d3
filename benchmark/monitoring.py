# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What `monitor_node` takes of a core beside an arm that its model does not explain.

The arm lives ten times as fast as the wall's clock, with a sample in each second of its own: as
many in a second of the wall as a real arm's ten, and ten times as many holds to diagnose.
"""

from collections.abc import Callable
import contextlib
import os
from pathlib import Path
import time

from benchmark.child import child, own_domain
from benchmark.nodes import NODE
from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.nodes.qos import COMMANDS
from hysteresis_ros.nodes.reference import seconds

BRIDGE = {'port': 'sim://bicep?speed=10&seed=1&encoder_offset=1&backlash=1&effects_after=300',
          'telemetry_rate': 1.0, 'telemetry_timeout': 10.0, 'setpoint_timeout': 60.0,
          'encoder_check': 'false', 'use_sim_time': 'true'}
ARM_TIME, QUICK_ARM_TIME = 3000.0, 60.0         # s
HOLD = 30.0                 # s of the arm at one voltage
VOLTAGES = 2.4, 5.6         # V
PATIENCE = 60.0             # s for a node to come up or a hold to pass


def monitoring_benchmarks(quick: bool) -> dict:
    """
    Measure the share of a core of `monitor_node` and of the process that diagnoses for it.

    Returns
    -------
    dict
        Share of a core, samples a second of the wall and number of diagnoses.
    """
    domain = own_domain()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    environment = dict(os.environ, ROS_DOMAIN_ID=str(domain))
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    with contextlib.ExitStack() as stack:
        stack.callback(rclpy.shutdown, context=context)
        stack.enter_context(child(NODE.format('bridge'), ros_arguments(BRIDGE), environment))
        monitor = stack.enter_context(child(
            NODE.format('monitor'), ros_arguments({'use_sim_time': 'true'}), environment))
        watcher = stack.enter_context(Watcher(context))
        # It has to see the arm cold, or it does not know what the muscle remembers.
        watcher.until(lambda: watcher.times and int(watcher.said.get('angles predicted', 0)),
                      'the nodes')
        begun, samples = time.monotonic(), len(watcher.times)
        spent = processor_time(monitor.pid)
        watcher.drive(QUICK_ARM_TIME if quick else ARM_TIME)
        passed = time.monotonic() - begun
        spent = processor_time(monitor.pid) - spent
        samples = len(watcher.times) - samples
        diagnoses = int(watcher.said['diagnoses'])
    return {'monitor_share_of_core_ratio': spent / passed,
            'monitor_samples_per_s': samples / passed,
            'monitor_diagnoses_count': diagnoses}


def ros_arguments(parameters: dict) -> list[str]:
    """Return what a node's command line needs for parameters, and silence."""
    words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    return ['--ros-args', *words, '--log-level', 'fatal']


def processor_time(pid: int) -> float:
    """Return what a process, its children and those that have ended took of a core, in s."""
    stat = Path(f'/proc/{pid}/stat').read_text(encoding='ascii').rpartition(')')[2].split()
    ticks = sum(map(int, stat[11:15]))
    children = [child for task in Path(f'/proc/{pid}/task').iterdir()
                for child in (task / 'children').read_text(encoding='ascii').split()]
    return ticks / os.sysconf('SC_CLK_TCK') + sum(map(processor_time, map(int, children)))


class Watcher:
    """
    Asks for voltages, and listens.

    Attributes
    ----------
    times : list of float
        Of the angles that were measured, in s of the arm.
    said : dict
        Latest values in the monitor's diagnostics.
    """

    def __init__(self, context: rclpy.Context) -> None:
        self.times: list[float] = []
        self.said: dict[str, str] = {}
        self._node = rclpy.create_node('watcher', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._setpoints = self._node.create_publisher(Float64, 'voltage_setpoint', COMMANDS)
        self._node.create_subscription(
            JointState, 'joint_states', self._take, qos_profile_sensor_data)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 100)

    def __enter__(self) -> 'Watcher':
        return self

    def __exit__(self, *error: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()

    def until(self, condition: Callable[[], object], what: str) -> None:
        """Spin until something is so."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > deadline:
                raise HysteresisError(f'benchmark of the monitor: waited in vain for {what}')
            self._executor.spin_once(timeout_sec=0.05)

    def drive(self, duration: float) -> None:
        """Hold voltages at random for so long [s of the arm]."""
        rng = np.random.default_rng(1)
        end = self.times[-1] + duration
        while self.times[-1] < end:
            self._setpoints.publish(Float64(data=float(rng.uniform(*VOLTAGES))))
            until = self.times[-1] + HOLD
            self.until(lambda until=until: self.times[-1] >= until, 'the end of a hold')

    def _take(self, message: JointState) -> None:
        self.times.append(seconds(message.header.stamp))

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.endswith('model_monitor'):
                self.said = {pair.key: pair.value for pair in status.values}
