# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node arm_markers: what RViz shows of target, measurement and prediction."""

import math

from node_support import GEOMETRY_OF_TESTS, Graph
import pytest
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from hysteresis_ros.nodes import marker_node
from hysteresis_ros.nodes.marker_node import MarkerNode


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


def latest(arrays):
    """Return what is drawn after all messages so far, by namespace and identity."""
    drawn = {}
    for array in arrays:
        for marker in array.markers:
            if marker.action == Marker.ADD:
                drawn[marker.ns, marker.id] = marker
            else:
                drawn.pop((marker.ns, marker.id), None)
    return drawn


def test_each_forearm_is_drawn_where_it_is(graph, monkeypatch):
    """Lines from the elbow in the base frame; the silent ones go, the target stays."""
    monkeypatch.setitem(marker_node.FOREARMS, 'measured', marker_node.Forearm(
        'joint_states', (0.0, 0.0, 1.0, 1.0), 0.01, 0.3))
    graph.make(MarkerNode, marker_rate=50.0)
    arrays = graph.collect(MarkerArray, 'arm_markers')
    angles = {'target': 1.7, 'measured': 1.8, 'predicted': 1.75}
    for name, topic in (('target', 'target_joint_states'), ('measured', 'joint_states'),
                        ('predicted', 'predicted_joint_states')):
        publisher = graph.publisher(JointState, topic)
        publisher.publish(JointState(name=['elbow'], position=[math.nan]))
        publisher.publish(JointState(name=['elbow'], position=[angles[name]]))
    graph.until(lambda: len(latest(arrays)) == 7, 'three forearms with text, and the muscles')
    drawn = latest(arrays)
    assert {marker.header.frame_id for marker in drawn.values()} == {'base_link'}
    for name, angle in angles.items():
        elbow, tip = drawn[name, 0].points
        assert (elbow.x, elbow.y, elbow.z) == (0.0, 0.0, 0.0)
        length = GEOMETRY_OF_TESTS.forearm_length
        assert (tip.x, tip.z) == pytest.approx(
            (length * math.sin(angle), length * math.cos(angle)), abs=1e-12)
        assert drawn[name, 1].text == f'{name} {math.degrees(angle):.1f} deg'
    points = drawn['muscles', 0].points
    assert len(points) == 2 * GEOMETRY_OF_TESTS.muscle_count
    for anchor, clamp in zip(points[::2], points[1::2]):
        length = math.dist((anchor.x, anchor.y, anchor.z), (clamp.x, clamp.y, clamp.z))
        assert length == pytest.approx(float(GEOMETRY_OF_TESTS.muscle_length(1.8)), abs=1e-9)
    graph.until(lambda: ('measured', 0) not in latest(arrays), 'the measured arm to go')
    assert ('muscles', 0) not in latest(arrays) and ('target', 0) in latest(arrays)
