# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The launch file: what it starts for which arguments.

`launch` comes with ROS 2 but not from PyPI. Where it is missing, small records stand in for its
classes, so that the file's own part is tested everywhere.
"""

import ast
import importlib.util
import shlex
import sys
import types

import pytest

from hysteresis_ros.nodes import (
    bridge_node, compensator_node, geometry_node, marker_node, monitor_node)

PARAMETERS = {spec.name for kind in (
    bridge_node.BridgeNode, compensator_node.CompensatorNode, geometry_node.GeometryNode,
    marker_node.MarkerNode, monitor_node.MonitorNode) for spec in kind.PARAMETERS}


class Record:
    """What a class of `launch` was called with."""

    def __init__(self, *given, **named):
        self.given, self.named = given, named


class Configuration(Record):
    """A launch argument's value; the context is a mapping here."""

    def perform(self, context):
        """Look the argument up."""
        return context[self.given[0]]


@pytest.fixture
def file(root, monkeypatch):
    """Return the launch file as a module, with records for launch's classes."""
    stand_ins = {
        'launch': {'LaunchDescription': Record},
        'launch.actions': {'DeclareLaunchArgument': Record, 'OpaqueFunction': Record,
                           'Shutdown': Record},
        'launch.substitutions': {'Command': Record, 'LaunchConfiguration': Configuration},
        'launch_ros': {}, 'launch_ros.actions': {'Node': Record},
        'launch_ros.parameter_descriptions': {'ParameterValue': Record}}
    for name, contents in stand_ins.items():
        module = types.ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location('bicep_launch', root / 'launch/bicep.launch.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def start(file, **arguments):
    """Return the started nodes by executable, for these launch arguments and the defaults."""
    context = {name: default for name, (default, _) in file.ARGUMENTS.items()} | arguments
    return {node.named['executable']: node.named for node in file.start(context)}


def overrides(file, **arguments):
    """Return what is set beside the parameter file; it is the same for all nodes."""
    nodes = start(file, **arguments).values()
    parameters = [node['parameters'] for node in nodes]
    assert all(pair == parameters[0] for pair in parameters)
    return parameters[0][1]


def test_it_declares_its_arguments_and_starts_with_a_function(file):
    """Every argument has a default, so that the file starts alone."""
    *declared, function = file.generate_launch_description().given[0]
    assert [argument.given[0] for argument in declared] == list(file.ARGUMENTS) == [
        'port', 'model_file', 'params_file', 'namespace', 'feedback', 'autostart', 'monitor',
        'use_sim_time', 'description', 'rviz', 'aggregator']
    assert all(argument.named['description'] for argument in declared)
    assert function.named['function'] is file.start


def test_alone_it_starts_the_simulated_arm(file, root):
    """All nodes from this package's executables, with the common file and nothing else."""
    nodes = start(file)
    assert list(nodes) == ['bridge_node', 'compensator_node', 'geometry_node', 'monitor_node']
    for node in nodes.values():
        assert node['package'] == 'hysteresis_ros' and node['namespace'] == ''
        assert node['parameters'] == [str(root / 'config' / 'bicep.yaml'), {}]


def test_only_what_has_no_memory_is_started_again(file):
    """A new bridge or compensator would not know the muscle's history."""
    nodes = start(file)
    assert [name for name, node in nodes.items() if node.get('respawn')] == ['geometry_node']
    assert [name for name, node in nodes.items() if 'on_exit' in node] == [
        'bridge_node', 'compensator_node']


def test_arguments_reach_the_nodes(file):
    """Under the names that the nodes declare."""
    values = overrides(file, port='/dev/ttyUSB0', model_file='arm.yaml', feedback='true')
    assert values == {'port': '/dev/ttyUSB0', 'model_file': 'arm.yaml', 'feedback': True}
    assert set(values) <= PARAMETERS
    assert overrides(file, feedback='False') == {'feedback': False}
    assert 'monitor_node' not in start(file, monitor='false')
    assert all(node['namespace'] == 'left' for node in start(file, namespace='left').values())


@pytest.mark.parametrize('port, follows', [
    ('', None), ('/dev/ttyUSB0', None), ('sim://bicep', None), ('sim://bicep?seed=1', None),
    ('sim://bicep?speed=1', None), ('sim://bicep?speed=1.0&seed=2', None),
    ('sim://bicep?speed=60', True), ('sim://bicep?seed=3&speed=0.5', True)])
def test_simulated_time_is_followed_where_the_board_has_its_own(file, port, follows):
    """And nowhere else, unless asked for."""
    assert overrides(file, port=port).get('use_sim_time') is follows
    assert overrides(file, port=port, use_sim_time='false')['use_sim_time'] is False
    assert overrides(file, port=port, use_sim_time='true')['use_sim_time'] is True


def test_the_port_may_stand_in_the_parameter_file(file, tmp_path):
    """The clock is followed all the same."""
    path = tmp_path / 'mine.yaml'
    path.write_text('/**:\n  ros__parameters:\n    port: sim://bicep?speed=20\n', encoding='utf-8')
    assert overrides(file, params_file=str(path)) == {'use_sim_time': True}
    assert 'use_sim_time' not in overrides(file, params_file=str(path), port='/dev/ttyUSB0')


def test_an_argument_that_is_neither_true_nor_false(file):
    """The message names it."""
    with pytest.raises(ValueError, match='feedback:=maybe has to be true or false'):
        start(file, feedback='maybe')


def test_the_arm_is_described_where_that_is_wanted(file, root, tmp_path):
    """From the parameters that the nodes have, in the arm's own frames, by the nodes' clock."""
    path = tmp_path / 'my arm.yaml'
    path.write_text('/**:\n  ros__parameters:\n    payload_mass: 0.2\n', encoding='utf-8')
    nodes = start(file, description='true', params_file=str(path), namespace='left',
                  port='sim://bicep?speed=60')
    assert list(nodes)[4:] == ['marker_node', 'robot_state_publisher']
    described = nodes['robot_state_publisher']
    description, clock = described['parameters']
    command, = description['robot_description'].given[0].given
    assert shlex.split(command) == [
        'xacro', str(root / 'urdf' / 'bicep.urdf.xacro'), f'params_file:={path}']
    assert clock == {'use_sim_time': True}
    assert described['namespace'] == 'left'
    assert described['remappings'] == [('/tf', 'tf'), ('/tf_static', 'tf_static')]


def test_rviz_starts_what_it_shows(file, root):
    """Its configuration, and the description with it; the aggregator is a matter of its own."""
    nodes = start(file, rviz='true')
    assert list(nodes)[4:] == ['marker_node', 'robot_state_publisher', 'rviz2']
    assert nodes['rviz2']['arguments'] == ['-d', str(root / 'config' / 'bicep.rviz')]
    assert nodes['rviz2']['parameters'] == [{}]
    assert list(start(file, aggregator='true'))[4:] == ['aggregator_node']


def test_real_launch_reads_it(root):
    """Where ROS 2 is installed, its own classes take the arguments."""
    launch = pytest.importorskip('launch', reason='launch comes with ROS 2 only')
    pytest.importorskip('launch_ros', reason='launch_ros comes with ROS 2 only')
    from launch.launch_description_sources import get_launch_description_from_python_launch_file
    description = get_launch_description_from_python_launch_file(
        str(root / 'launch' / 'bicep.launch.py'))
    context = launch.LaunchContext()
    entities = description.entities
    for entity in entities[:-1]:
        entity.execute(context)
    assert len(entities[-1].execute(context)) == 4


def test_it_imports_nothing_but_launch_and_the_share_directory(root):
    """`ros2 launch` reads it with the system's Python: NumPy and SciPy have no business there."""
    tree = ast.parse((root / 'launch' / 'bicep.launch.py').read_text(encoding='utf-8'))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import)
                for alias in node.names}
    assert modules == {'pathlib', 'shlex', 'urllib.parse', 'yaml', 'launch', 'launch.actions',
                       'launch.substitutions', 'launch_ros.actions',
                       'launch_ros.parameter_descriptions', 'hysteresis_ros.share'}
