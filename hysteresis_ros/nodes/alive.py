# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Signs of life between nodes: who depends on another node hears within 0.45 s that it died.

A node promises, by a publisher on its topic ``~/alive`` on which nothing is ever published, that
the middleware hears of it every 0.15 s. The middleware's own threads keep the promise, so a
callback that takes long breaks nothing; a process that was killed, stopped or has crashed does.
One that ends in order takes its publisher with it, which is no death.
"""

from collections.abc import Callable

from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSProfile
from std_msgs.msg import Empty

ALIVE = 'alive'
PROMISED = Duration(nanoseconds=150_000_000)
PATIENCE = Duration(nanoseconds=400_000_000)


def promise_life(node: Node) -> None:
    """
    Let others hear when this node dies.

    Parameters
    ----------
    node : rclpy.node.Node
        This node, which keeps the publisher.
    """
    node.create_publisher(Empty, f'~/{ALIVE}', _quality(PROMISED))


def listen_for_death(node: Node, topic: str, died: Callable[[], object]) -> None:
    """
    Call a function when a node that was alive has died.

    Parameters
    ----------
    node : rclpy.node.Node
        Who listens.
    topic : str
        The other's ``~/alive``, relative to the namespace of both.
    died : callable
        Takes nothing; called in the executor. One that ended in order is no death.
    """
    def changed(event: object) -> None:
        if getattr(event, 'not_alive_count_change') > 0:
            died()

    node.create_subscription(
        Empty, topic, lambda message: None, _quality(PATIENCE),
        event_callbacks=SubscriptionEventCallbacks(liveliness=changed))


def _quality(lease: Duration) -> QoSProfile:
    return QoSProfile(depth=1, liveliness=LivelinessPolicy.AUTOMATIC,
                      liveliness_lease_duration=lease)
