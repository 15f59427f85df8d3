# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What docs/first_hour.md tells a person to type exists; its times and numbers are the code's."""

import os
import re
import shlex
import subprocess
import sys

import numpy as np
import pytest
import yaml

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.cli.main import build_parser
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import MeasurementError, ParameterError
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.laboratory.plant import Plant
from hysteresis_ros.measurements import read_measurement
from hysteresis_ros.measurements.table import SETTLED_HOLD
from hysteresis_ros.share import share_path


@pytest.fixture(scope='module')
def page(root):
    """Return the page's text."""
    return (root / 'docs' / 'first_hour.md').read_text(encoding='utf-8')


def blocks(page, language):
    """Return the fenced blocks of a language."""
    found = re.findall(r'^```(\w*)\n(.*?)^```$', page, re.MULTILINE | re.DOTALL)
    return [text for name, text in found if name == language]


def commands(page, program):
    """Return the commands of a program, in blocks and in the running text, as arguments."""
    typed = [line for block in blocks(page, '') for line in block.splitlines()]
    prose = re.sub(r'^```.*?^```$', '', page, flags=re.MULTILINE | re.DOTALL)
    typed += [' '.join(line.split()) for line in re.findall(r'`([^`]+)`', prose)]
    return [shlex.split(line)[1:] for line in typed if line.startswith(f'{program} ')]


@pytest.fixture(scope='module')
def settings():
    """Return the parameters of config/bicep.yaml, which are the nodes' defaults."""
    text = share_path('config/bicep.yaml').read_text(encoding='utf-8')
    return yaml.safe_load(text)['/**']['ros__parameters']


def test_the_command_line_takes_every_command_of_the_page(page):
    """Options, protocols and effects are as they are written there."""
    typed = commands(page, 'hysteresis')
    assert {words[0] for words in typed} == {
        'simulate', 'identify', 'compare', 'diagnose', 'extend', 'columns', 'effects'}
    for words in typed:
        args = build_parser(words).parse_args(words)
        assert words[0] != 'extend' or set(args.add.split(',')) <= set(catalogue())


def test_the_times_are_those_of_the_steps_and_of_the_cycle(page, settings):
    """Steps of the tables, the hold of the script, and heating and cooling as configured."""
    steps, (recorded,) = len(bench_steps()), re.findall(r'train.csv 1 20 (\d+)', page)
    margin, = re.findall(r'float\(seconds\) \+ ([\d.]+)', page)
    cycle = settings['initialise_heat_time'] + settings['initialise_cool_time']
    assert f'{steps} steps of 20 s each, and a heat and cool cycle of {cycle:.0f} s' in page
    hold = SETTLED_HOLD + float(margin)
    bench, arm = 3 * (steps * hold + cycle), int(recorded) * hold + cycle
    assert f'before each | {bench / 60:.0f} min |' in page
    assert f'such a cycle | {arm / 60:.0f} min |' in page
    assert f'Measuring takes {(bench + arm) / 60:.0f} minutes' in page
    for loads, seconds, minutes in re.findall(
            r'^\| ([\d., ]+)\b.*?\| (\d\d) s \| (\d\d) min \|', page, re.MULTILINE):
        asked = float(seconds) + (float(margin) if seconds == '20' else 0.0)
        count = len(loads.split(','))
        assert minutes == f'{count * (steps * asked + cycle) / 60:.0f}', loads


def bench_steps():
    """Return the voltages of trial 0 of the length table [V]."""
    table = bench_tables({}, 0)['length.csv']
    return table['voltage'][table['trial'] == 0]


def test_good_tables_look_as_the_page_says():
    """Cold and hot lengths, the return to 0 V, and the loop, of the specimen that it names."""
    table = bench_tables({}, 3)['length.csv']
    trials = [1e3 * table['length'][table['trial'] == trial] for trial in range(4)]
    voltage = table['voltage'][:11]
    assert voltage[[0, 5, 10]] == pytest.approx([0.0, 6.0, 0.0]) and voltage[3] == voltage[7] == 3.6
    assert [round(float(length[0]), 1) for length in trials] == [1.2, 3.8, 5.4, 6.6]
    hot = [round(float(length[5]), 1) for length in trials]
    assert (min(hot), max(hot)) == (-9.5, -8.7)
    assert max(abs(length[10] - length[0]) for length in trials) < 0.05
    loops = [abs(length[7] - length[3]) for length in trials]
    assert 1.5 < min(loops) and max(loops) < 5.0


def test_the_angle_falls_as_the_wire_heats(page, root):
    """Which decides the encoder's direction: level is a right angle, contracting goes below."""
    cold, hot = Plant(3, {}).arm_trial([0.0, 5.0])['angle']
    assert hot < cold - 0.5
    geometry = BicepGeometry.from_yaml(share_path('config/bicep.yaml'))
    assert geometry.length(np.pi / 2 - 0.1) < geometry.length(np.pi / 2)
    assert 'a muscle that contracts makes it smaller' in page
    firmware = (root / 'firmware' / 'README.md').read_text(encoding='utf-8')
    assert 'The angle has to fall with the heat' in firmware


def test_the_page_links_to_what_is_there(page, root):
    """Files, and headings of other pages."""
    links = re.findall(r'\]\(([^)]+)\)', page)
    for link in links:
        path, _, anchor = link.partition('#')
        target = root / 'docs' / (path or 'first_hour.md')
        assert target.is_file(), link
        if anchor:
            headings = re.findall(r'^#+ (.+)$', target.read_text(encoding='utf-8'), re.MULTILINE)
            assert anchor in [heading.lower().replace(' ', '-').replace(':', '')
                              for heading in headings], link
    readme = (root / 'README.md').read_text(encoding='utf-8')
    assert '](docs/first_hour.md)' in readme and '](docs/notebook.ipynb)' in readme


def test_arm_yaml_is_understood_by_the_command_line_and_names_parameters(page, settings, tmp_path):
    """The values that the page changes are parameters, of their type, in the copied file."""
    fragment, = blocks(page, 'yaml')
    changed = yaml.safe_load(fragment)['/**']['ros__parameters']
    for name, value in changed.items():
        assert type(value) is type(settings[name]), name
    (tmp_path / 'arm.yaml').write_text(yaml.safe_dump(
        {'/**': {'ros__parameters': {**settings, **changed}}}), encoding='utf-8')
    assert BicepGeometry.from_yaml(tmp_path / 'arm.yaml').resting_length == 0.27
    for name in re.findall(r'`((?:encoder|initialise|setpoint|supply|pwm|maximum)_\w+)`', page):
        assert name in {**settings, **catalogue()}, name


def test_the_example_of_a_table_is_one(page, tmp_path):
    """The rows of length.csv."""
    rows, = (block for block in blocks(page, '') if block.startswith('trial,'))
    (tmp_path / 'length.csv').write_text(rows, encoding='utf-8')
    assert read_measurement(tmp_path / 'length.csv').response == 'length'


def test_nodes_topics_and_services_of_the_page_exist(page, root):
    """What `ros2` is told."""
    nodes = '\n'.join(path.read_text(encoding='utf-8')
                      for path in (root / 'hysteresis_ros' / 'nodes').glob('*.py'))
    typed = commands(page, 'ros2')
    assert {words[0] for words in typed} == {'run', 'topic', 'bag', 'service', 'launch'}
    for words in typed:
        if words[0] == 'topic':
            name = next(word for word in words if word.startswith('/'))
            assert f"'{name[1:]}'" in nodes, name
        if words[0] == 'service':
            node, service = words[2][1:].split('/')
            assert f"__init__('{node}'" in nodes and f"'~/{service}'" in nodes
        if words[0] == 'launch':
            launch = (root / 'launch' / words[2]).read_text(encoding='utf-8')
            for name in re.findall(r'(\w+):=', ' '.join(words)):
                assert f"'{name}'" in launch, name
        if words[0] == 'run':
            assert (root / 'hysteresis_ros' / 'nodes' / f'{words[2]}.py').is_file()


def test_the_script_holds_the_voltages_on_the_simulated_board(page, tmp_path, domain_id):
    """
    With the parameters of the page; the arm lifts when heated, and all is recorded in order.

    No faster than ten times: a busy machine would let setpoints expire between two of the script's.
    """
    pytest.importorskip('rclpy', reason='the nodes need ROS 2')
    from node_support import Graph, process
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64
    script, = blocks(page, 'python')
    (tmp_path / 'hold_voltages.py').write_text(script, encoding='utf-8')
    (tmp_path / 'arm.yaml').write_text(blocks(page, 'yaml')[0], encoding='utf-8')
    (tmp_path / 'length.csv').write_text(
        'trial,step,voltage,force,length\n0,0,9,1,0\n1,0,2,1,0\n1,1,5,1,0\n1,2,3,1,0\n',
        encoding='utf-8')
    with Graph(domain_id) as graph, process(
            'bridge_node', '--ros-args', '--params-file', str(tmp_path / 'arm.yaml'),
            '-p', 'port:=sim://bicep?speed=10&seed=3') as bridge:
        voltages = graph.collect(Float64, 'applied_voltage')
        angles = graph.collect(JointState, 'joint_states')
        graph.until(lambda: angles, 'the bridge', deadline=60.0)
        assert bridge.poll() is None
        with subprocess.Popen(
                [sys.executable, 'hold_voltages.py', 'length.csv', '1', '1.2', '2'], cwd=tmp_path,
                env={**os.environ, 'ROS_DOMAIN_ID': str(domain_id)}, stdout=subprocess.PIPE,
                text=True) as child:
            graph.until(lambda: child.poll() is not None, 'the end of the script',
                        deadline=60.0)
            said = child.stdout.read()
        graph.until(lambda: voltages[-1].data == 0.0, 'the end of the last hold')
    assert child.returncode == 0 and said.splitlines() == [
        f'trial 1, step {step}: {voltage} V; read the instrument now'
        for step, voltage in enumerate((2, 5))]
    applied = np.round([message.data for message in voltages], 2)
    levels = applied[np.flatnonzero(np.diff(applied, prepend=-1.0))]
    assert levels.tolist() == [0.0, 2.0, 5.0, 0.0]
    assert min(message.position[0] for message in angles) < angles[0].position[0] - 0.3


def test_what_goes_wrong_is_said_in_the_words_of_the_page(page, tmp_path):
    """The messages in the first lines of its table."""
    run, arm = tmp_path / 'run.csv', tmp_path / 'arm.yaml'
    run.write_text('time,trial,voltage,angle\n30,0,2,144.4\n60,0,4,120\n', encoding='utf-8')
    with pytest.raises(MeasurementError) as degrees:
        read_measurement(run)
    run.write_text('time,trial,voltage,angle\n' + ''.join(
        f'{time},0,{volts},2\n' for time, volts in ((0, 2), (20, 3), (25, 4), (30, 4))),
        encoding='utf-8')
    with pytest.raises(MeasurementError) as short:
        read_measurement(run, settled=True)
    arm.write_text('clamp_distance: 17\n', encoding='utf-8')
    with pytest.raises(ParameterError) as metres:
        BicepGeometry.from_yaml(arm)
    rows = re.findall(r'^\| `([^`]+)` \|', page, re.MULTILINE)
    for row, raised in zip(rows, (degrees, metres, short)):
        assert row in str(raised.value)
