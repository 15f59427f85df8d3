# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectories and joint commands, as MoveIt and ros2_control send them, into the nodes."""

import math
import time

from benchmark.trajectories import Sine, SETTINGS, trajectory
from builtin_interfaces.msg import Time
from node_support import GEOMETRY_OF_TESTS, Graph, small_model
import numpy as np
import pytest
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from hysteresis_ros.nodes.compensator_node import CompensatorNode
from hysteresis_ros.nodes.geometry_node import GeometryNode
from hysteresis_ros.nodes.session import Processes

NOW = 1000      # s, when the clocks of these tests begin
# What JointStateTopicSystem of joint_state_topic_hardware_interface publishes and subscribes with.
PLUGIN_COMMANDS = QoSProfile(depth=1)
PLUGIN_STATES = qos_profile_sensor_data


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


def stamp(seconds):
    """Return a time of this many seconds."""
    return Time(sec=int(seconds), nanosec=round(1e9 * (seconds % 1.0)))


class Arm:
    """The geometry node with a clock that the test moves."""

    def __init__(self, graph, **parameters):
        self.graph = graph
        self.node = graph.make(GeometryNode, use_sim_time=True, **parameters)
        self._clock = graph.publisher(Clock, '/clock')
        self.references = graph.collect(JointState, 'muscle_reference')
        self._targets = graph.collect(JointState, 'target_joint_states')
        self.statuses = graph.status()
        self.ways = graph.publisher(JointTrajectory, 'target_trajectory')
        self.commands = graph.publisher(JointState, 'joint_commands', PLUGIN_COMMANDS)
        self.single = graph.publisher(Float64, 'target_angle')
        graph.listening(self.node, 'muscle_reference', 'target_joint_states', '/diagnostics')
        self.now = NOW
        self.advance(0.0)

    def advance(self, seconds, step=0.1):
        """Move the clock in steps, each of which the node has seen."""
        for _ in range(max(1, round(seconds / step))):
            self.now += step if seconds else 0.0
            self._clock.publish(Clock(clock=stamp(self.now)))
            wanted = round(1e9 * self.now) - 1000
            self.graph.until(
                lambda: self.node.get_clock().now().nanoseconds >= wanted, 'the clock')
            self.graph.spin(0.002)

    @property
    def targets(self):
        """All targets so far [rad]."""
        return [message.position[0] for message in self._targets]

    def wait(self, count):
        """Wait for so many targets."""
        self.graph.until(lambda: len(self._targets) >= count, f'{count} targets')

    def warning(self, words):
        """Wait for a warning with these words, and return its sentence."""
        self.graph.until(lambda: self.statuses and words in self.statuses[-1].message,
                         f'a warning with {words!r}')
        return self.statuses[-1].message


def test_a_trajectory_is_followed_in_time(graph):
    """Length, force and target of each moment; after the end the last ones stay."""
    arm = Arm(graph)
    arm.single.publish(Float64(data=2.0))
    arm.wait(1)
    arm.ways.publish(trajectory([0.0, 2.0, 4.0], [2.0, 1.8, 1.8]))
    graph.until(lambda: arm.node._received == 2, 'the trajectory')
    arm.advance(5.0)
    graph.until(lambda: arm.targets[-1] == 1.8, 'the end')
    targets = np.array(arm.targets)
    # A target that stays is not passed on again.
    assert np.all(np.diff(targets) < 0.0) and len(targets) == 21
    assert np.abs(np.diff(targets)).max() < 0.0101 + 1e-9
    for reference, angle in zip(arm.references, arm.targets):
        assert (reference.position[0], reference.effort[0]) == pytest.approx(
            GEOMETRY_OF_TESTS.reference(angle))
    count = len(arm.references)
    arm.advance(1.0)
    assert len(arm.references) == count


def test_a_new_target_ends_a_trajectory(graph):
    """The last message counts, whatever its topic."""
    arm = Arm(graph)
    arm.ways.publish(trajectory([0.0, 9.0], [2.0, 1.8]))
    arm.wait(1)
    arm.advance(0.5)
    arm.single.publish(Float64(data=1.9))
    graph.until(lambda: arm.targets[-1] == 1.9, 'the target')
    count = len(arm.targets)
    arm.advance(1.0)
    assert len(arm.targets) == count


@pytest.mark.parametrize('message, words', [
    (trajectory([0.0, 1.0], [1.9, 1.8], names=['shoulder']), "joints ['shoulder']; this arm has"),
    (trajectory([0.0], [1.9], names=['elbow', 'wrist']), "joints ['elbow', 'wrist']"),
    (trajectory([], []), 'no points'),
    (trajectory([0.0, 1.0], [1.9, math.nan]), 'the position nan'),
    (trajectory([1.0, 0.5], [1.9, 1.8]), 'not after point 1'),
    (trajectory([0.0, 10.0], [1.9, 1.8], start=NOW - 60.0), 'ended 50.0 s ago'),
    (trajectory([0.0, 1.0], [1.9, 0.1]), 'outside the limits'),
    (trajectory([0.0, 1.0], [2.0, 2.0], [9.0, 9.0]), 'outside the limits'),
    (JointTrajectory(joint_names=['elbow'], points=[JointTrajectoryPoint(velocities=[0.1])]),
     'point 1 of the trajectory has 0 positions'),
])
def test_a_wrong_trajectory_is_refused_in_one_line(graph, capfd, message, words):
    """Nothing of it is followed, and the cold arm stays cold."""
    arm = Arm(graph, minimum_angle=0.5, maximum_angle=2.4)
    arm.ways.publish(message)
    assert arm.warning(words).startswith('trajectory not followed: ')
    arm.advance(0.5)
    assert arm.references == []
    assert [line for line in capfd.readouterr().err.splitlines() if 'WARN' in line][1:] == []


def test_a_wrong_trajectory_leaves_the_one_before_in_force(graph):
    """As in ros2_control: what is refused changes nothing."""
    arm = Arm(graph)
    arm.ways.publish(trajectory([0.0, 1.0], [2.0, 1.9]))
    arm.wait(1)
    arm.ways.publish(trajectory([0.0, 1.0], [2.0, math.nan]))
    arm.warning('position nan')
    arm.advance(1.5)
    graph.until(lambda: arm.targets[-1] == 1.9, 'the end')


def test_a_trajectory_faster_than_the_muscle_comes_late(graph, capfd):
    """Clipped to the speed of the muscle, with one line that says so before."""
    arm = Arm(graph, maximum_speed=0.1)
    arm.ways.publish(trajectory([0.0, 1.0], [2.0, 1.7]))
    arm.wait(1)
    arm.advance(2.0)
    assert arm.targets[-1] > 1.75
    assert np.abs(np.diff(arm.targets)).max() <= 0.0101
    arm.advance(2.0)
    graph.until(lambda: arm.targets[-1] == 1.7, 'the end')
    said = capfd.readouterr().err
    assert said.count('moves at up to 0.300 rad/s, the muscle at 0.100 rad/s') == 1


def test_commands_of_a_controller_are_followed(graph):
    """With the plug-in's QoS; other joints of the same robot are not ours."""
    arm = Arm(graph, maximum_speed=10.0)
    arm.commands.publish(JointState(name=['wrist', 'elbow'], position=[0.3, 1.95]))
    arm.wait(1)
    arm.advance(0.5)
    arm.commands.publish(JointState(name=['elbow'], position=[1.9], velocity=[0.1]))
    graph.until(lambda: arm.targets[-1] == 1.9, 'the second command')


@pytest.mark.parametrize('wrong, words', [
    (JointState(name=['wrist'], position=[1.9]), "names ['wrist'], not 'elbow'"),
    (JointState(name=['elbow'], velocity=[0.1]), 'gives no position'),
    (JointState(name=['elbow'], position=[math.nan]), 'asks for nan rad'),
    (JointState(name=['elbow'], position=[0.0]), "linkage's range")])
def test_a_commander_with_nonsense_counts_as_silent(graph, capfd, wrong, words):
    """It is refused in one line, and after the watchdog's time the muscle is let go."""
    arm = Arm(graph, command_timeout=0.5)
    arm.commands.publish(JointState(name=['elbow'], position=[1.9]))
    arm.wait(1)
    begin = time.monotonic()

    def elapsed():
        return time.monotonic() - begin
    while arm.references[-1].position and elapsed() < 10.0:
        arm.commands.publish(wrong)
        arm.advance(0.1)
    arm.warning(words)
    said = [line for line in capfd.readouterr().err.splitlines() if words in line]
    assert 1 <= len([line for line in said if 'WARN' in line]) <= 1 + elapsed() / 5.0
    assert list(arm.references[-1].name) == ['muscle']
    assert list(arm.references[-1].position) == list(arm.references[-1].effort) == []
    arm.warning('no joint command for')
    # The next good command takes up again, from where the arm is.
    arm.commands.publish(JointState(name=['elbow'], position=[1.9]))
    graph.until(lambda: arm.references[-1].position, 'a reference')


@pytest.mark.parametrize('moving', [False, True])
def test_a_node_that_ends_lets_go_of_what_it_was_moving(graph, moving):
    """A single target stays in force, as the compensator holds it; a way is not left half done."""
    arm = Arm(graph)
    if moving:
        arm.ways.publish(trajectory([0.0, 9.0], [2.0, 1.8]))
    else:
        arm.single.publish(Float64(data=2.0))
    arm.wait(1)
    arm.node.on_shutdown()
    arm.single.publish(Float64(data=1.9))
    graph.until(lambda: arm.targets[-1] == 1.9, 'the target after it')
    graph.until(lambda: len(arm.references) >= 2 + moving, 'all references')
    assert [len(reference.position) for reference in arm.references] == (
        [1, 0, 1] if moving else [1, 1])


def test_the_watchdog_goes_by_the_slower_clock(graph):
    """A simulation that runs at 60 times real time does not drop the arm for a hiccup of 50 ms."""
    arm = Arm(graph, command_timeout=1.0)
    arm.commands.publish(JointState(name=['elbow'], position=[1.9]))
    arm.wait(1)
    arm.advance(10.0, step=1.0)
    assert arm.references[-1].position


def test_the_compensator_lets_go(graph):
    """A reference without numbers: 0 V once, no repeats, and the memory of a cold muscle."""
    node = graph.make(CompensatorNode, small_model(), republish_period=0.1)
    setpoints = graph.collect(Float64, 'voltage_setpoint')
    references = graph.publisher(JointState, 'muscle_reference')
    graph.listening(node, 'voltage_setpoint')
    fresh = GEOMETRY_OF_TESTS.reference(1.7)
    wanted = JointState(name=['muscle'], position=[fresh.length], effort=[fresh.force])
    references.publish(wanted)
    graph.until(lambda: len(setpoints) >= 3, 'a setpoint and repeats')
    first = setpoints[0].data
    assert first > 1.0
    references.publish(JointState(name=['muscle']))
    graph.until(lambda: setpoints[-1].data == 0.0, 'zero')
    count = len(setpoints)
    graph.spin(0.4)
    assert len(setpoints) == count
    references.publish(wanted)
    graph.until(lambda: len(setpoints) > count, 'a setpoint')
    assert setpoints[count].data == first


@pytest.fixture
def chain(graph, tmp_path):
    """Start the nodes as processes of their own, as the simulation leaves one no time for more."""
    processes = Processes(SETTINGS, tmp_path / 'nodes.log')
    try:
        yield Sine(graph.probe, graph.until)
    finally:
        processes.stop()


@pytest.mark.slow
def test_a_sine_as_a_trajectory_is_as_good_as_angle_by_angle(graph, chain):
    """30 s on the simulated arm; then a controller that dies leaves it without voltage."""
    voltages = graph.collect(Float64, 'applied_voltage', PLUGIN_STATES)
    targets = graph.collect(JointState, 'target_joint_states')
    # A busy machine delays one or the other: it may try again.
    for _ in range(3):
        ratio = chain.by_trajectory() / chain.by_angles()
        if ratio <= 1.2:
            break
    assert ratio <= 1.2
    commands = graph.publisher(JointState, 'joint_commands', PLUGIN_COMMANDS)

    def commanded():
        commands.publish(JointState(name=['elbow'], position=[1.8]))
        return targets[-1].position[0] == 1.8
    graph.until(commanded, 'the commanded angle')
    assert voltages[-1].data > 1.0
    silent = time.monotonic()
    graph.until(lambda: voltages[-1].data == 0.0, 'zero')
    assert 1.0 < time.monotonic() - silent < 6.0     # 2 s, on a busy machine
    count, cold = len(voltages), chain.now
    graph.until(lambda: chain.now > cold + 20.0, '20 s')
    assert len(voltages) > count
    assert {voltage.data for voltage in voltages[count:]} == {0.0}
