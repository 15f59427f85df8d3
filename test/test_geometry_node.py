# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node bicep_geometry: target angle to muscle reference."""

import dataclasses
import math
import signal

from node_support import GEOMETRY_OF_TESTS, Graph, process, small_model
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from hysteresis_ros.effects import catalogue
from hysteresis_ros.nodes.geometry_node import GeometryNode


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


class Bicep:
    """The node between a publisher of targets and a list of references."""

    def __init__(self, graph, model=None, **parameters):
        self._graph = graph
        self.node = graph.make(GeometryNode, model, **parameters)
        self.references = graph.collect(JointState, 'muscle_reference')
        self.statuses = graph.status()
        self._targets = graph.publisher(Float64, 'target_angle')
        graph.listening(self.node, 'muscle_reference', '/diagnostics')

    def aim(self, *angles):
        """Publish target angles."""
        for angle in angles:
            self._targets.publish(Float64(data=angle))

    def warned(self):
        """Return whether the last status is a warning or worse."""
        return bool(self.statuses) and self.statuses[-1].level != b'\0'

    def wait(self, count):
        """Wait for so many references."""
        self._graph.until(lambda: len(self.references) >= count, f'{count} references')
        assert len(self.references) == count


def test_target_becomes_length_and_force(graph):
    """Eqs. 21 and 22, with name and stamp."""
    bicep = Bicep(graph)
    bicep.aim(1.7)
    bicep.wait(1)
    reference, = bicep.references
    length, force = GEOMETRY_OF_TESTS.reference(1.7)
    assert reference.name == ['muscle']
    assert list(reference.position) == [pytest.approx(length, abs=1e-15)]
    assert list(reference.effort) == [pytest.approx(force, rel=1e-12)]
    assert list(reference.velocity) == []
    assert reference.header.stamp.sec > 0


@pytest.mark.parametrize('target, words', [
    (math.nan, 'finite'), (math.inf, 'finite'), (-math.inf, 'finite'),
    (0.2, 'outside the limits of 1.2000 to 2.2000 rad (68.8 to 126.1 deg)'), (9.0, 'limits')])
def test_target_that_makes_no_sense_is_not_passed_on(graph, target, words):
    """The last good output stays, and the diagnostics give the reason and the range."""
    bicep = Bicep(graph, minimum_angle=1.2, maximum_angle=2.2)
    bicep.aim(1.5, target)
    graph.until(bicep.warned, 'a warning')
    assert words in bicep.statuses[-1].message
    bicep.aim(1.6)
    graph.until(lambda: not bicep.warned(), 'the warning to go')
    bicep.wait(2)
    assert [reference.position[0] for reference in bicep.references] == [
        pytest.approx(GEOMETRY_OF_TESTS.reference(angle).length) for angle in (1.5, 1.6)]
    values = {pair.key: pair.value for pair in bicep.statuses[-1].values}
    assert values == {
        'targets received': '3', 'references published': '2', 'targets refused': '1'}


def test_angle_beyond_the_linkage_is_refused(graph):
    """Also where the limits would allow it."""
    bicep = Bicep(graph, minimum_angle=0.0, maximum_angle=3.14)
    bicep.aim(0.1)
    graph.until(bicep.warned, 'a warning')
    assert "linkage's range" in bicep.statuses[-1].message
    assert bicep.references == []


def test_limits_that_are_the_wrong_way_round_are_refused(graph):
    """A cross check of two parameters, also at run time."""
    bicep = Bicep(graph, maximum_angle=2.5)
    parameter = Parameter('minimum_angle', value=3.0).to_parameter_msg()
    result = graph.call(SetParameters, 'bicep_geometry/set_parameters',
                        SetParameters.Request(parameters=[parameter])).results[0]
    assert not result.successful
    assert 'minimum_angle 3 has to be below' in result.reason
    bicep.aim(1.5)
    bicep.wait(1)


def test_heavier_payload_at_run_time(graph):
    """The geometry follows its parameters: force grows, length stays."""
    bicep = Bicep(graph)
    bicep.aim(1.5)
    bicep.wait(1)
    parameter = Parameter('payload_mass', value=0.2).to_parameter_msg()
    assert graph.call(SetParameters, 'bicep_geometry/set_parameters',
                      SetParameters.Request(parameters=[parameter])).results[0].successful
    bicep.aim(1.5)
    bicep.wait(2)
    light, heavy = bicep.references
    assert heavy.position == light.position
    # The forearm's 40 g count half: (200 + 20) g instead of (100 + 20) g.
    assert heavy.effort[0] == pytest.approx(light.effort[0] * 220.0 / 120.0)


def test_effects_of_arm_and_sensor_are_undone(graph):
    """An encoder that shows too much is aimed at less; the payload of the model counts."""
    surroundings = small_model().surroundings
    effects = [catalogue()['encoder_offset'](surroundings, offset=2.0),
               catalogue()['payload_error'](surroundings, dm=20.0)]
    bicep = Bicep(graph, small_model(effects))
    bicep.aim(1.6)
    bicep.wait(1)
    heavier = dataclasses.replace(
        GEOMETRY_OF_TESTS, payload_mass=GEOMETRY_OF_TESTS.payload_mass + 0.020)
    length, force = heavier.reference(1.6 - math.radians(2.0))
    reference, = bicep.references
    assert reference.position[0] == pytest.approx(length)
    assert reference.effort[0] == pytest.approx(force)


def test_names_are_relative_to_the_namespace(graph):
    """Topics move with the namespace, diagnostics stay where everybody looks."""
    statuses = graph.status()
    graph.add(GeometryNode(context=graph.context, namespace='left'))
    graph.publisher(Float64, 'left/target_angle')
    graph.until(lambda: statuses, 'diagnostics')
    assert statuses[0].name == 'left/bicep_geometry'
    assert statuses[0].hardware_id == 'sma_bicep'


def test_stamps_follow_the_clock_of_the_simulation(graph):
    """With `use_sim_time` and no clock yet, the time is zero."""
    bicep = Bicep(graph, use_sim_time=True)
    bicep.aim(1.5)
    bicep.wait(1)
    stamp = bicep.references[0].header.stamp
    assert (stamp.sec, stamp.nanosec) == (0, 0)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signals_end_the_process_cleanly(graph, number):
    """Status 0 and no traceback, even when Ctrl-C arrives twice as it does from ros2 launch."""
    statuses = graph.status()
    with process('geometry_node') as child:
        graph.until(lambda: statuses, 'the node')
        child.send_signal(number)
        child.send_signal(number)
        _, errors = child.communicate(timeout=30)
        assert child.returncode == 0 and 'waiting for target angles' in errors.splitlines()[-1]
