# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes: declared once, described, refused with the reason."""

import math
import re
import signal

from node_support import Graph, process, small_model
import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
import yaml

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import linkage as laboratory
from hysteresis_ros.nodes import (
    bridge_node, compensator_node, geometry_node, marker_node, monitor_node)
from hysteresis_ros.nodes.bridge_parameters import PARAMETERS, PROTECTION
from hysteresis_ros.nodes.parameters import (
    check_limits, GEOMETRY, NAMES, Parameters, Spec, VOLTAGE_LIMITS)

NODES = {'bicep_geometry': geometry_node.GeometryNode,
         'hysteresis_compensator': compensator_node.CompensatorNode,
         'hardware_bridge': bridge_node.BridgeNode,
         'model_monitor': monitor_node.MonitorNode,
         'arm_markers': marker_node.MarkerNode}


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


class Holder(Node):
    """A node with nothing but parameters."""

    def __init__(self, context=None, parameter_overrides=(), model=None):
        super().__init__('holder', context=context, parameter_overrides=parameter_overrides)
        self.changes = []
        self.parameters = Parameters(
            self, VOLTAGE_LIMITS + NAMES + (Spec('count', 3, 'A number of things', '', 1, 9),),
            check=lambda values: check_limits(values, 'voltage'),
            changed=lambda values: self.changes.append(dict(values)))


@pytest.mark.parametrize('given, words', [
    ({'maximum_voltage': 6}, 'maximum_voltage is 6; it has to be a number with a decimal point'),
    ({'maximum_voltage': 480.0}, 'from 0 to 48 V'),
    ({'maximum_voltage': math.nan}, 'from 0 to 48 V'),
    ({'maximum_voltage': -0.1}, 'from 0 to 48 V'),
    ({'maximum_voltage': 'six'}, "maximum_voltage is 'six'"),
    ({'count': 10}, 'a whole number from 1 to 9'),
    ({'count': 2.0}, 'a whole number'),
    ({'minimum_voltage': 6.0}, 'minimum_voltage 6 has to be below maximum_voltage 6'),
])
def test_wrong_value_at_start_is_refused(graph, given, words):
    """The node does not start, and the message says what would be right."""
    with pytest.raises(ParameterError, match=words.replace('(', r'\(')):
        graph.make(Holder, **given)


def test_set_refuses_with_the_reason_and_takes_what_is_right(graph):
    """Range, type, cross check and read-only ones, over the service that `ros2 param` uses."""
    node = graph.make(Holder)

    def set_parameter(name, value):
        parameter = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[parameter])
        return graph.call(SetParameters, 'holder/set_parameters', request).results[0]

    assert 'out of range' in set_parameter('maximum_voltage', 99.0).reason
    assert 'out of range' in set_parameter('maximum_voltage', math.nan).reason
    assert 'Wrong parameter type' in set_parameter('maximum_voltage', 5).reason
    assert 'below maximum_voltage' in set_parameter('minimum_voltage', 7.0).reason
    assert 'read-only' in set_parameter('muscle_name', 'biceps').reason
    assert not set_parameter('nonsense', 1.0).successful
    assert node.changes == []
    assert dict(node.parameters) == {
        'minimum_voltage': 0.0, 'maximum_voltage': 6.0, 'count': 3, 'muscle_name': 'muscle',
        'joint_name': 'elbow', 'hardware_id': 'sma_bicep'}
    assert set_parameter('maximum_voltage', 5.0).successful
    assert [change['maximum_voltage'] for change in node.changes] == [5.0]
    assert node.parameters['maximum_voltage'] == 5.0


@pytest.mark.parametrize('name', NODES)
def test_every_node_tells_its_parameters(graph, name):
    """`ros2 param get` on each: an attribute of ours that hides one of rclpy's would end it."""
    model = {'model': small_model()} if name in (
        'hysteresis_compensator', 'model_monitor') else {}
    graph.add(NODES[name](context=graph.context, **model))
    wanted = [spec.name for spec in NODES[name].PARAMETERS]
    values = graph.call(GetParameters, f'{name}/get_parameters',
                        GetParameters.Request(names=wanted)).values
    assert [parameter_value_to_python(value) for value in values] == [
        spec.default for spec in NODES[name].PARAMETERS]


def test_every_parameter_is_described(graph):
    """Description, unit and range are there for `ros2 param describe`."""
    graph.make(Holder)
    request = DescribeParameters.Request(names=['maximum_voltage', 'muscle_name', 'count'])
    voltage, name, count = graph.call(
        DescribeParameters, 'holder/describe_parameters', request).descriptors
    assert voltage.description.endswith('[V]')
    assert voltage.type == ParameterType.PARAMETER_DOUBLE
    assert (voltage.floating_point_range[0].from_value,
            voltage.floating_point_range[0].to_value) == (0.0, 48.0)
    assert (count.integer_range[0].from_value, count.integer_range[0].to_value) == (1, 9)
    assert name.read_only and not voltage.read_only


def declared(kind):
    """Return the specs of a node of the package by name."""
    return {spec.name: spec for spec in kind.PARAMETERS}


@pytest.fixture
def common(root):
    """Return the parameters of config/bicep.yaml."""
    content = yaml.safe_load((root / 'config' / 'bicep.yaml').read_text(encoding='utf-8'))
    assert list(content) == ['/**'] and list(content['/**']) == ['ros__parameters']
    return content['/**']['ros__parameters']


def test_the_file_holds_every_parameter_of_every_node(common):
    """No key that no node knows, and no parameter that the file keeps silent about."""
    known = {name for kind in NODES.values() for name in declared(kind)}
    assert set(common) == known


@pytest.mark.parametrize('name', NODES)
def test_the_file_gives_the_defaults(common, name):
    """A node that is started alone does what one started with the file does."""
    for spec in NODES[name].PARAMETERS:
        value = common[spec.name]
        assert (type(value), value) == (type(spec.default), spec.default), spec.name


@pytest.mark.parametrize('name', NODES)
def test_every_spec_makes_sense(name):
    """Described, no name twice, and the default within the range."""
    names = [spec.name for spec in NODES[name].PARAMETERS]
    assert len(names) == len(set(names))
    for spec in NODES[name].PARAMETERS:
        assert spec.description and not spec.description.endswith('.'), spec.name
        if isinstance(spec.default, (int, float)) and not isinstance(spec.default, bool):
            assert spec.low <= spec.default <= spec.high, spec.name


def test_defaults_are_an_arm():
    """The geometry's defaults are complete, and they are the virtual laboratory's."""
    geometry = BicepGeometry.from_mapping({spec.name: spec.default for spec in GEOMETRY})
    assert geometry.to_mapping() == laboratory.GEOMETRY


@pytest.mark.parametrize('arguments, words', [
    (['-p', 'payload_mass:=50.0'], 'error: parameter payload_mass is 50.0; it has to be'),
    (['-p', 'model_file:=/nowhere/model.yaml'], '/nowhere/model.yaml'),
    (['--params-file', '/nowhere/bicep.yaml'], '/nowhere/bicep.yaml'),
])
def test_a_node_that_cannot_start_says_so_in_one_line(domain_id, arguments, words):
    """Exit status 1 and no traceback."""
    with process('geometry_node', '--ros-args', *arguments) as child:
        output, errors = child.communicate(timeout=30)
    lines = [line for line in errors.splitlines() if not line.startswith('[ERROR]')]
    assert child.returncode == 1
    assert len(lines) == 1 and words in lines[0]
    assert output == ''


def test_a_misspelt_parameter_is_pointed_out(domain_id):
    """ROS 2 would ignore it without a word; SIGTERM ends the node with status 0."""
    with process('geometry_node', '--ros-args', '-p', 'payload_mas:=0.2') as child:
        line = child.stderr.readline()
        child.send_signal(signal.SIGTERM)
        assert child.wait(timeout=30) == 0
    assert 'payload_mas is not known' in line and 'did you mean payload_mass?' in line


def test_the_limits_that_protect_the_muscle_are_on_their_page(root):
    """Each of them with its default, and the README names some and leads there."""
    page = (root / 'docs' / 'safety.md').read_text(encoding='utf-8')
    limits, = re.findall(r'## What the muscle stands\n(.*?)\n## ', page, re.DOTALL)
    for spec in PROTECTION:
        assert f'`{spec.name}`' in limits, spec.name
        default = str(spec.default).lower() if spec.default is True else f'{spec.default:g}'
        line, = (line for line in limits.splitlines() if f'`{spec.name}`' in line)
        assert re.search(rf'(?<![\d.]){default}\b', line), spec.name
    readme = (root / 'README.md').read_text(encoding='utf-8')
    item, = re.findall(r'\* \*\*Limits\*\*:(.*?)\n\* ', readme, re.DOTALL)
    named = set(re.findall(r'`(\w+)`', item)) - {'bridge_node', 'false'}
    assert named <= {spec.name for spec in PARAMETERS}
    assert {'rms_voltage_limit', 'maximum_temperature', 'full_heat_time', 'soft_start_time',
            'encoder_check', 'angle_latency'} <= named
    assert '(docs/safety.md)' in item
