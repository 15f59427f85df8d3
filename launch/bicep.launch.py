# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Start the arm: board, compensator, geometry, and the model that runs along.

Alone it starts the simulated arm; ``port:=/dev/ttyUSB0`` the real one. When board or compensator
end, everything ends: neither can come back alone, because the muscle's memory and the model's
would no longer agree. The geometry has no memory and is started again.

``rviz:=true`` shows the arm, ``description:=true`` publishes it for others to show.
"""

from pathlib import Path
import shlex
from urllib.parse import parse_qsl, urlsplit

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
import yaml

from hysteresis_ros.share import share_path

PACKAGE = 'hysteresis_ros'

ARGUMENTS = {
    'port': ('', 'Device or URL of the board, such as /dev/ttyUSB0 or sim://bicep?speed=60; '
             'empty: as in params_file'),
    'model_file': ('', 'Model file of the muscle; empty: as in params_file'),
    'params_file': (str(share_path('config/bicep.yaml')), 'Parameters of all nodes'),
    'namespace': ('', 'Namespace of all nodes and topics'),
    'feedback': ('', 'true: the measured angle corrects the setpoint slowly; empty: as in '
                 'params_file'),
    'autostart': ('', 'false: bridge and compensator wait for `ros2 lifecycle set`; empty: as in '
                  'params_file'),
    'monitor': ('true', 'Whether the model runs along and its residual is published'),
    'use_sim_time': ('', 'Whether all nodes follow /clock; empty: if the port is a simulated '
                     'board that does not live at real time'),
    'description': ('false', 'Whether robot_description, the frames of the arm and markers of '
                    'target, measured and predicted forearm are published'),
    'rviz': ('false', 'Whether RViz shows the arm; starts what it needs'),
    'aggregator': ('false', 'Whether diagnostic_aggregator sorts the diagnostics'),
}
# Each arm has its frames in its own namespace.
TRANSFORMS = [('/tf', 'tf'), ('/tf_static', 'tf_static')]


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and what they start."""
    arguments = [DeclareLaunchArgument(name, default_value=default, description=description)
                 for name, (default, description) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=start)])


def start(context, *_) -> list:
    """Return the nodes for the arguments as given."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    overrides = {name: given[name] for name in ('port', 'model_file') if given[name]}
    overrides.update({name: is_true(name, given[name])
                      for name in ('feedback', 'autostart', 'use_sim_time') if given[name]})
    if not given['use_sim_time'] and has_own_time(given['port'] or port_in(given['params_file'])):
        overrides['use_sim_time'] = True

    def node(executable, **options):
        return Node(package=PACKAGE, executable=executable, namespace=given['namespace'],
                    parameters=[given['params_file'], overrides], output='screen', **options)

    nodes = [
        node('bridge_node', on_exit=Shutdown(reason='the bridge has ended')),
        node('compensator_node', on_exit=Shutdown(reason='the compensator has ended')),
        node('geometry_node', respawn=True, respawn_delay=1.0),
    ]
    if is_true('monitor', given['monitor']):
        nodes.append(node('monitor_node'))
    clock = {name: overrides[name] for name in ('use_sim_time',) if name in overrides}
    rviz = is_true('rviz', given['rviz'])
    if is_true('description', given['description']) or rviz:
        nodes += [node('marker_node'), publisher(given, clock)]
    if rviz:
        nodes.append(Node(
            package='rviz2', executable='rviz2', namespace=given['namespace'],
            arguments=['-d', str(share_path('config/bicep.rviz'))], parameters=[clock],
            remappings=TRANSFORMS))
    if is_true('aggregator', given['aggregator']):
        nodes.append(Node(
            package='diagnostic_aggregator', executable='aggregator_node',
            parameters=[str(share_path('config/diagnostics.yaml'))], output='screen'))
    return nodes


def publisher(given: dict, clock: dict) -> Node:
    """Return the node that publishes the description and the frames of the arm."""
    description = ' '.join(['xacro', shlex.quote(str(share_path('urdf/bicep.urdf.xacro'))),
                            shlex.quote(f'params_file:={given["params_file"]}')])
    return Node(
        package='robot_state_publisher', executable='robot_state_publisher',
        namespace=given['namespace'], output='screen', remappings=TRANSFORMS,
        parameters=[{'robot_description': ParameterValue(Command(description), value_type=str)},
                    clock])


def port_in(params_file: str) -> str:
    """Return the port that a parameter file gives, or nothing."""
    content = yaml.safe_load(Path(params_file).read_text(encoding='utf-8')) or {}
    ports = [section.get('ros__parameters', {}).get('port') for section in content.values()]
    return next((port for port in ports if port), '')


def has_own_time(port: str) -> bool:
    """Whether the port is a simulated board that runs faster or slower than the wall's clock."""
    parts = urlsplit(port)
    speed = dict(parse_qsl(parts.query)).get('speed', '1')
    return parts.scheme == 'sim' and speed not in ('1', '1.0')


def is_true(name: str, text: str) -> bool:
    """Read a launch argument that says yes or no."""
    if text.lower() not in ('true', 'false'):
        raise ValueError(f'{name}:={text} has to be true or false')
    return text.lower() == 'true'
