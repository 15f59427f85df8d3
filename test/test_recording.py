# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recorded session writes into its bag."""

import time

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
        self.written.append((name, message.data))


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
