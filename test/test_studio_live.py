# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The recording of a running arm that `hysteresis studio --live` looks at."""

import math
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from node_support import Graph
import numpy as np
import pytest
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.nodes.live import Listener
from hysteresis_ros.nodes.qos import MEASUREMENTS

DEADLINE = 15.0


class Bridge:
    """The topics of a bridge, published by a test, and a listener to them."""

    def __init__(self, graph, listener):
        self.graph, self.listener = graph, listener
        self._joints, self._voltages, self._ambients, self._statuses = (
            graph.publisher(kind, topic, MEASUREMENTS) for kind, topic in (
                (JointState, 'joint_states'), (Float64, 'applied_voltage'),
                (Temperature, 'ambient_temperature'), (DiagnosticArray, '/diagnostics')))

    def sample(self, stamp, voltage, angle, joint='elbow'):
        """Publish one sample, which the listener has taken in when this returns."""
        self._voltages.publish(Float64(data=float(voltage)))
        self.until(lambda: list(self.listener._voltage[1][-1:]) == [voltage])
        message = JointState(name=[joint], position=[angle])
        message.header.stamp.sec = int(stamp)
        message.header.stamp.nanosec = round(1e9 * (stamp % 1.0))
        self._joints.publish(message)

    def status(self, state):
        """Publish what the bridge does; the listener has taken it in when this returns."""
        before = len(self.listener._initialising[0])
        self._statuses.publish(DiagnosticArray(status=[DiagnosticStatus(
            name='hardware_bridge: arm', values=[KeyValue(key='state', value=state)])]))
        self.until(lambda: len(self.listener._initialising[0]) > before)

    def ambient(self, value):
        """Publish the temperature of the air."""
        self._ambients.publish(Temperature(temperature=value))
        self.until(lambda: len(self.listener._ambient[0]) > 0)

    def rows(self, count):
        """Wait until the recording has that many rows, and return it."""
        self.until(lambda: getattr(self.listener.recording(), 'rows', 0) == count)
        return self.listener.recording()

    @staticmethod
    def until(condition):
        """Wait, as the listener spins itself."""
        end = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < end
            time.sleep(0.01)


@pytest.fixture
def bridge(domain_id):
    """Return a bridge whose topics a listener hears."""
    with Graph(domain_id) as graph, Listener('live.csv', domain_id=domain_id) as listener:
        yield Bridge(graph, listener)


def test_a_recording_grows_with_what_the_bridge_says(bridge):
    assert bridge.listener.recording() is None
    bridge.ambient(21.5)
    for row in range(10):
        bridge.sample(100.0 + row, 0.5 * row, 1.5 + 0.01 * row)
    found = bridge.rows(10)
    np.testing.assert_allclose(found.time, np.arange(10.0))
    np.testing.assert_allclose(found.column('voltage'), 0.5 * np.arange(10.0))
    np.testing.assert_allclose(found.column('angle'), 1.5 + 0.01 * np.arange(10.0))
    np.testing.assert_allclose(found.column('ambient_temperature'), 21.5)
    assert found.source == 'live.csv' and found.kind == 'arm'
    # Nearer to each other than a muscle changes, or without a number: no rows.
    bridge.sample(109.05, 4.5, 1.7)
    bridge.sample(109.5, 4.5, math.nan)
    bridge.sample(110.0, 4.5, 1.65)
    assert bridge.rows(11).column('angle')[-1] == 1.65


def test_a_heat_and_cool_cycle_begins_a_new_trial(bridge):
    for row in range(9):
        bridge.sample(row, 2.0, 1.5)
    bridge.rows(9)
    bridge.status('initialising')
    bridge.sample(10.0, 6.0, 2.0)
    bridge.sample(20.0, 0.0, 1.0)
    bridge.until(lambda: len(bridge.listener._angle[0]) == 11)
    bridge.status('running')
    bridge.sample(30.0, 1.0, 1.1)
    found = bridge.rows(10)
    assert list(found.trials) == [0.0, 1.0] and found.time[-1] == 0.0


def test_another_run_of_the_arm_begins_a_new_recording(bridge):
    for start in (500.0, 0.0):
        for row in range(9):
            bridge.sample(start + row, 1.0 + row, 1.5)
        if start:
            bridge.rows(9)
    bridge.until(lambda: list(bridge.listener._angle[1]) == list(range(9)))
    found = bridge.rows(9)
    np.testing.assert_allclose(found.column('voltage'), 1.0 + np.arange(9.0))


def test_an_arm_without_an_elbow_is_told(bridge):
    bridge.sample(1.0, 1.0, 1.5)
    message = JointState(name=['wrist', 'knee'], position=[1.0, 2.0])
    bridge._joints.publish(message)
    bridge.until(lambda: bridge.listener._trouble)
    with pytest.raises(MeasurementError, match='wrist'):
        bridge.listener.recording()
    bridge.sample(2.0, 1.0, 1.5)
    bridge.until(lambda: not bridge.listener._trouble)
