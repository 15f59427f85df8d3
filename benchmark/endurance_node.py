# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
An hour of the arm's time through `bridge_node` as a process, over DDS, with random faults.

The simulated board lives behind a pseudo-terminal at sixty times real time; setpoints are
published, whatever switches the output off is enabled again by ``~/enable``, and a recorder writes
what the node publishes into a bag. At the end the node is deactivated, so that what it says to have
taken and published is what it has.
"""

import contextlib
import os
from pathlib import Path
import random
import tempfile
import time

from benchmark.child import child, own_domain
from benchmark.watched_arm import CABLE, memory, WatchedArm
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.laboratory.board.port import SimulatedPort
from hysteresis_ros.laboratory.board.terminal import PortOnTerminal
from hysteresis_ros.measurements.bag_storage import open_bag
from hysteresis_ros.nodes.qos import COMMANDS, RECORDED
from hysteresis_ros.nodes.session import Bag

SPEED = 60.0                # s of the arm a second of the wall
WATCHDOG = 0.5              # s, as `board_watchdog`
ARM_TIME, QUICK_ARM_TIME = 3600.0, 240.0            # s
RATE = 500.0                # setpoints a second of the wall
MOST_AT_ONCE = 100
MOST_WAITING = 3000         # of which the node has not yet said that it has taken them
ENABLE_PERIOD = 0.2         # s between two calls of ~/enable
PATIENCE = 60.0             # s for the node to come up, and to say what it has done
TIMES = 10.0                # that the arm's time may take, on a machine that is slow
TOPICS = {'applied_voltage': Float64, 'joint_states': JointState,
          'ambient_temperature': Temperature}
NODE = 'import sys; from hysteresis_ros.nodes.bridge_node import main; sys.exit(main())'


def endurance_node_benchmarks(quick: bool) -> dict:
    """
    Drive the arm through the node, with faults.

    Returns
    -------
    dict
        Setpoints, faults, lost messages, missed watchdogs and growth of the node's memory.
    """
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    domain = own_domain()
    port = SimulatedPort(f'sim://bicep?speed={SPEED:g}&{CABLE}')
    arm = WatchedArm(port.cable, WATCHDOG * SPEED, random.Random(2))
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()), 'bag')
        terminal = stack.enter_context(PortOnTerminal(port))
        context = rclpy.Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        stack.callback(rclpy.shutdown, context=context)
        recorder = stack.enter_context(Recorder(context, folder))
        parameters = {'port': terminal.name, 'telemetry_rate': 1.0, 'telemetry_timeout': 2.0,
                      'board_watchdog': WATCHDOG, 'autostart': 'false'}
        words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
        process = stack.enter_context(child(
            NODE, ['--ros-args', *words, '--log-level', 'fatal'],
            dict(os.environ, ROS_DOMAIN_ID=str(domain))))
        recorder.begin()
        growth = recorder.drive(arm, QUICK_ARM_TIME if quick else ARM_TIME, process.pid)
        said = recorder.stand_still()
        recorder.close()
        with open_bag(folder) as bag:
            found = sum(1 for _ in bag.messages(list(bag.topics)))
    published = int(said['measurements published'])
    return {
        'endurance_node_arm_time_s': arm.time,
        'endurance_node_setpoints_count': recorder.setpoints,
        'endurance_node_setpoints_lost_count': recorder.setpoints - int(said['setpoints taken'])
        - int(said['setpoints refused']),
        'endurance_node_faults_count': arm.faults,
        'endurance_node_enabled_again_count': recorder.enabled_again,
        'endurance_node_published_count': published,
        'endurance_node_lost_in_the_bag_count': published - found,
        'endurance_node_heated_ratio': arm.heated,
        'endurance_node_missed_watchdogs_count': arm.missed,
        'endurance_node_memory_growth_MB': growth / 1e6}


class Recorder:
    """
    Publishes setpoints, enables the output again, and writes what the node publishes into a bag.

    Parameters
    ----------
    context : rclpy.Context
    folder : Path
        Of the bag.

    Attributes
    ----------
    setpoints, enabled_again : int
        How many were published, and how often the output was enabled after it had been off.
    """

    def __init__(self, context: rclpy.Context, folder: Path) -> None:
        self.setpoints = self.enabled_again = 0
        self._bag: Bag | None = Bag(folder)
        self._rng = random.Random(1)
        self._node = rclpy.create_node('recorder', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._said: dict[str, str] = {}
        self._publisher = self._node.create_publisher(Float64, 'voltage_setpoint', COMMANDS)
        self._enable = self._node.create_client(SetBool, 'hardware_bridge/enable')
        self._change = self._node.create_client(ChangeState, 'hardware_bridge/change_state')
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 100)
        for name, kind in TOPICS.items():
            self._node.create_subscription(
                kind, name, lambda message, name=name: self._record(name, message), RECORDED)

    def __enter__(self) -> 'Recorder':
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
        self._executor.shutdown()
        self._node.destroy_node()

    def begin(self) -> None:
        """Wait until the node is there and knows who listens, then activate it."""
        self._until(lambda: self._change.service_is_ready() and self._enable.service_is_ready()
                    and self._publisher.get_subscription_count(), 'the node')
        self._transit(Transition.TRANSITION_CONFIGURE)
        self._until(lambda: all(self._node.count_publishers(name) for name in TOPICS), 'topics')
        self._spin(1.0)
        self._transit(Transition.TRANSITION_ACTIVATE)

    def drive(self, arm: WatchedArm, arm_time: float, process: int) -> float:
        """Publish setpoints for so long; return by how much the node's memory has grown."""
        start, began = time.monotonic(), arm.time
        settled, asked, published, answer = 0, start, start, None
        while not arm.heated or arm.time - began < arm_time:
            now = time.monotonic()
            # Diagnostics come every second; a machine that is slow gets fewer setpoints.
            if now - published > 1.0 / RATE and self.setpoints - self._counted() < MOST_WAITING:
                for _ in range(min(int(RATE * (now - published)), MOST_AT_ONCE)):
                    self._publisher.publish(Float64(data=self._rng.uniform(0.0, 5.0)))
                    self.setpoints += 1
                published = now
            self._spin(0.005)
            arm.disturb()
            if answer is not None and answer.done():
                answer = None
            if answer is None and now - asked > ENABLE_PERIOD:
                if self._said.get('enabled') == 'False':
                    answer = self._enable.call_async(SetBool.Request(data=True))
                    self.enabled_again += 1
                asked = now
            if not settled and arm.time - began > 0.2 * arm_time:
                settled = memory(process)
            if now - start > TIMES * arm_time / SPEED:
                raise HysteresisError(f'endurance of the node: only {arm.time - began:.0f} s of '
                                      f'{arm_time:g} s in time')
        return memory(process) - settled

    def stand_still(self) -> dict[str, str]:
        """Let the node take what was published, deactivate it, and return what it says then."""
        self._until(lambda: self._counted() == self.setpoints, 'the last setpoint', demand=False)
        self._transit(Transition.TRANSITION_DEACTIVATE)
        self._spin(2.5)         # what is on its way, and diagnostics, which come every second
        return self._said

    def close(self) -> None:
        """Finish the bag."""
        if self._bag is not None:
            self._bag.close()
            self._bag = None

    def _counted(self) -> int:
        return sum(int(self._said.get(f'setpoints {what}', 0)) for what in ('taken', 'refused'))

    def _record(self, name: str, message: object) -> None:
        if self._bag is not None:
            self._bag.write(name, time.time_ns(), message)

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._said.update((pair.key, pair.value) for pair in status.values)

    def _transit(self, transition: int) -> None:
        answer = self._change.call_async(ChangeState.Request(transition=Transition(id=transition)))
        self._until(answer.done, f'transition {transition}')
        if not answer.result().success:
            raise HysteresisError(f'endurance of the node: transition {transition} has failed')

    def _until(self, condition, what: str, demand: bool = True) -> None:
        end = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > end:
                if demand:
                    raise HysteresisError(f'endurance of the node: waited in vain for {what}')
                return
            self._executor.spin_once(timeout_sec=0.05)

    def _spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (pause := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=pause)
