# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The arm's URDF against the geometry that the nodes compute with, and what shows the arm."""

import io
import json
import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from hysteresis_ros.bicep.geometry import BicepGeometry

xacro = pytest.importorskip('xacro', reason='xacro is not installed (extra `test`)')

AGREEMENT = 1e-6    # m
ANOTHER = {'clamp_distance': 0.031, 'clamp_height': 0.0123, 'anchor_height': 0.21,
           'forearm_length': 0.27, 'payload_mass': 0.35, 'forearm_mass': 0.08,
           'minimum_angle': 0.7, 'maximum_angle': 2.9, 'joint_name': 'left_elbow'}


def expand(root, **arguments):
    """Return the URDF that xacro makes of the description."""
    return xacro.process_file(
        str(root / 'urdf' / 'bicep.urdf.xacro'), mappings=arguments).toxml()


@pytest.fixture(params=['defaults', 'another arm'])
def arm(request, root, tmp_path):
    """Return the parameters of an arm, and its URDF."""
    common = yaml.safe_load((root / 'config' / 'bicep.yaml').read_text(encoding='utf-8'))
    values = common['/**']['ros__parameters']
    if request.param == 'defaults':
        return values, expand(root)
    path = tmp_path / 'mine.yaml'
    # The section of a node counts as the common one does; what is not given has its default.
    geometry = dict(list(ANOTHER.items())[:4])
    rest = dict(list(ANOTHER.items())[4:])
    path.write_text(yaml.safe_dump({
        '/**': {'ros__parameters': geometry}, 'bicep_geometry': {'ros__parameters': rest}}),
        encoding='utf-8')
    return {**values, **ANOTHER}, expand(root, params_file=str(path))


@pytest.fixture
def robot(arm):
    """Return the arm as yourdfpy reads it."""
    yourdfpy = pytest.importorskip('yourdfpy', reason='yourdfpy is not installed (extra `test`)')
    return yourdfpy.URDF.load(io.StringIO(arm[1]), load_meshes=False)


def test_muscles_and_payload_are_where_the_geometry_has_them(arm, robot):
    """Over the whole range, to a thousandth of a millimetre."""
    values, _ = arm
    geometry = BicepGeometry.from_mapping(values)

    def place(link):
        return robot.get_transform(link, 'base_link')[:3, 3]
    for theta in np.linspace(*geometry.angle_range, 25):
        robot.update_cfg({values['joint_name']: theta})
        muscle = np.linalg.norm(place('anchor') - place('clamp'))
        assert abs(muscle - float(geometry.muscle_length(theta))) < AGREEMENT
        assert abs(muscle - geometry.resting_length - float(geometry.length(theta))) < AGREEMENT
        for link, point in (
                ('clamp', geometry.point(theta, geometry.clamp_distance, geometry.clamp_height)),
                ('payload', geometry.point(theta, geometry.forearm_length))):
            assert np.abs(place(link) - point).max() < AGREEMENT
        # The angle is measured from the upward vertical, and a larger one is lower in front.
        x, _, z = place('payload')
        assert math.atan2(x, z) == pytest.approx(theta, abs=1e-9)


def test_masses_make_the_moment_of_the_geometry(arm, robot):
    """What a simulator feels at the elbow is what the reference force is computed for."""
    values, _ = arm
    geometry = BicepGeometry.from_mapping(values)
    for theta in (0.9, 1.6, 2.4):
        robot.update_cfg({values['joint_name']: theta})
        moment = 0.0
        for name, link in robot.link_map.items():
            if link.inertial is not None:
                centre = robot.get_transform(name, 'base_link') @ link.inertial.origin \
                    if link.inertial.origin is not None else robot.get_transform(name, 'base_link')
                moment += link.inertial.mass * values['gravity'] * centre[0, 3]
        assert moment == pytest.approx(float(geometry.load_moment(theta)), rel=1e-9)


def test_limits_are_those_of_the_nodes(arm):
    """What MoveIt plans is not refused: the linkage's range within the limits, and the speed."""
    values, text = arm
    joint, = [joint for joint in ElementTree.fromstring(text).iter('joint')
              if joint.get('type') == 'revolute']
    assert joint.get('name') == values['joint_name']
    low, high = BicepGeometry.from_mapping(values).angle_range
    limit = joint.find('limit')
    assert float(limit.get('lower')) == pytest.approx(max(low, values['minimum_angle']))
    assert float(limit.get('upper')) == pytest.approx(min(high, values['maximum_angle']))
    assert float(limit.get('velocity')) == values['maximum_speed']
    assert float(limit.get('effort')) > 0.0


def test_ros2_control_is_in_it_on_demand(root):
    """The plug-in with our topics, always sending, and the joint that the controllers name."""
    assert ElementTree.fromstring(expand(root)).find('ros2_control') is None
    block = ElementTree.fromstring(
        expand(root, ros2_control='true', joint_commands_topic='/left/joint_commands')
    ).find('ros2_control')
    assert block.findtext('hardware/plugin') == (
        'joint_state_topic_hardware_interface/JointStateTopicSystem')
    given = {param.get('name'): param.text for param in block.findall('hardware/param')}
    assert given == {'joint_commands_topic': '/left/joint_commands',
                     'joint_states_topic': 'joint_states',
                     'trigger_joint_command_threshold': '-1'}
    joint = block.find('joint')
    controllers = yaml.safe_load(
        (root / 'config' / 'ros2_control.yaml').read_text(encoding='utf-8'))
    controller = controllers['arm_controller']['ros__parameters']
    assert controller['joints'] == [joint.get('name')] == ['elbow']
    assert controller['command_interfaces'] == [
        interface.get('name') for interface in joint.findall('command_interface')]
    assert controller['state_interfaces'] == [
        interface.get('name') for interface in joint.findall('state_interface')]


def published(root):
    """Return the topics that the nodes of the package name in their sources."""
    sources = ''.join(path.read_text(encoding='utf-8')
                      for path in sorted((root / 'hysteresis_ros' / 'nodes').glob('*_node.py')))
    return set(re.findall(r"create_publisher\(\s*\w+, '(/?\w+)'", sources))


def test_layouts_show_topics_that_there_are(root):
    """RViz, Foxglove and PlotJuggler; a renamed topic would leave them empty."""
    topics = published(root) | {'robot_description'}
    rviz = yaml.safe_load((root / 'config' / 'bicep.rviz').read_text(encoding='utf-8'))
    displays = {display['Name']: display for display in rviz['Visualization Manager']['Displays']}
    assert displays['Arm']['Description Topic']['Value'] == 'robot_description'
    assert displays['Target, measured, predicted']['Topic']['Value'] in topics
    assert rviz['Visualization Manager']['Global Options']['Fixed Frame'] == 'base_link'

    foxglove = json.loads((root / 'config' / 'foxglove.json').read_text(encoding='utf-8'))
    panels = foxglove['configById']
    paths = [path['value'] for panel in panels.values() for path in panel.get('paths', [])]
    assert len(paths) == 6
    used = {path.split('.')[0].lstrip('/') for path in paths}
    used |= {topic.lstrip('/') for topic in panels['3D!arm']['topics']}
    assert used <= topics

    def leaves(tree):
        return [tree] if isinstance(tree, str) else leaves(tree['first']) + leaves(tree['second'])
    assert sorted(leaves(foxglove['layout'])) == sorted(panels)

    juggler = ElementTree.parse(root / 'config' / 'plotjuggler.xml').getroot()
    curves = {curve.get('name').split('/')[1] for curve in juggler.iter('curve')}
    assert curves == {topic.get('name').lstrip('/') for topic in juggler.iter('topic')}
    assert curves <= topics


def test_every_node_has_an_analyser(root):
    """By the names that the nodes give their diagnostics."""
    common = yaml.safe_load((root / 'config' / 'diagnostics.yaml').read_text(encoding='utf-8'))
    analysers = [entry for entry in common['/**']['ros__parameters'].values()
                 if isinstance(entry, dict)]
    matched = [name for analyser in analysers for name in analyser['contains']]
    sources = {path: path.read_text(encoding='utf-8')
               for path in (root / 'hysteresis_ros' / 'nodes').glob('*_node.py')}
    with_diagnostics = [re.search(r"__init__\('(\w+)'", text).group(1)
                        for text in sources.values() if 'Diagnostics(' in text]
    assert sorted(matched) == sorted(with_diagnostics)
