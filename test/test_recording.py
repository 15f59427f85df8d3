# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recorded session writes into its bag."""

import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hysteresis_ros.errors import BoardError
from hysteresis_ros.nodes.qos import MEASUREMENTS
from hysteresis_ros.nodes.session import Session
import pytest
import rclpy
from std_msgs.msg import Float64

PUBLISHED = 1000        # measurements, of which a node keeps the latest 100


class List:
    """A bag that lists what it gets."""

    def __init__(self):
        self.written = []

    def write(self, name, stamp, message):
        self.written.append((name, getattr(message, 'data', None)))


@pytest.fixture
def session(domain_id):
    rclpy.init(args=[])
    bag = List()
    node = Session(bag, simulated_time=False)
    yield node, bag
    node.destroy_node()
    rclpy.try_shutdown()


def test_what_comes_while_the_recorder_is_held_up_is_recorded(session):
    """A busy machine lets it wait for seconds, and no measurement may be lost."""
    node, bag = session
    publisher = node.create_publisher(Float64, 'applied_voltage', MEASUREMENTS)
    while not publisher.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=0.05)
    for number in range(PUBLISHED):
        publisher.publish(Float64(data=float(number)))
    end = time.monotonic() + 10.0
    while len(bag.written) < PUBLISHED and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
    assert bag.written == [('applied_voltage', float(number)) for number in range(PUBLISHED)]


class AliveProcesses:
    """Nodes that never end."""

    def check(self):
        pass


def test_a_muscle_that_is_switched_off_for_good_ends_the_session(session):
    """Else targets are published to a cold arm until the end, and compared."""
    node, _ = session
    publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
    while not publisher.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=0.05)

    def say(fault):
        publisher.publish(DiagnosticArray(status=[DiagnosticStatus(
            name='hardware_bridge: board', values=[KeyValue(key='fault', value=fault)])]))

    say('none')
    assert list(node.drive([0.5], 0.2, AliveProcesses(), lambda: None)) == [None]
    say('the board was lost')
    with pytest.raises(BoardError, match='switched the muscle off: the board was lost'):
        node.drive([0.5], 5.0, AliveProcesses(), lambda: None)
