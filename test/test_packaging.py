# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The built workspace, the wheel, and what the package says it needs."""

import ast
from configparser import ConfigParser
from distutils.core import run_setup
from importlib import import_module
import os
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile

from catkin_pkg.package import parse_package
from packaging.requirements import Requirement
import pytest

import hysteresis_ros

NODES = {'geometry_node': 'bicep_geometry', 'compensator_node': 'hysteresis_compensator',
         'bridge_node': 'hardware_bridge', 'monitor_node': 'model_monitor',
         'marker_node': 'arm_markers'}
EXECUTABLES = ['hysteresis', *NODES]
# rosdep's names of what is imported under another name.
ROSDEP = {'serial': 'python3-serial', 'yaml': 'python3-yaml'}


@pytest.fixture(scope='module')
def description(root):
    """Return what setup.py hands to setuptools."""
    before = Path.cwd()
    os.chdir(root)
    try:
        return run_setup('setup.py', stop_after='init')
    finally:
        os.chdir(before)


def environment(prefix):
    """Return the environment of a user who has sourced the workspace."""
    site = prefix / f'lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages'
    joined = {
        'PYTHONPATH': [str(site), os.environ.get('PYTHONPATH', '')],
        'AMENT_PREFIX_PATH': [str(prefix), os.environ.get('AMENT_PREFIX_PATH', '')]}
    return {**os.environ,
            **{name: os.pathsep.join(filter(None, paths)) for name, paths in joined.items()}}


def test_every_executable_is_where_ros2_run_looks(prefix):
    """`ros2 run` knows only the folder named after the package."""
    folder = prefix / 'lib' / 'hysteresis_ros'
    assert sorted(path.name for path in folder.iterdir()) == sorted(EXECUTABLES)
    assert all(os.access(folder / name, os.X_OK) for name in EXECUTABLES)


def test_every_executable_has_a_main(description):
    """Each entry point names a function that is there."""
    scripts = dict(line.split(' = ') for line in description.entry_points['console_scripts'])
    assert sorted(scripts) == sorted(EXECUTABLES)
    for target in scripts.values():
        module, function = target.split(':')
        assert callable(getattr(import_module(module), function)), target


def test_the_ament_index_knows_the_package(prefix, monkeypatch):
    """Launch files find the share directory through it."""
    index = pytest.importorskip('ament_index_python.packages')
    monkeypatch.setenv('AMENT_PREFIX_PATH', environment(prefix)['AMENT_PREFIX_PATH'])
    assert Path(index.get_package_prefix('hysteresis_ros')) == prefix
    assert Path(index.get_package_share_directory('hysteresis_ros')) == (
        prefix / 'share' / 'hysteresis_ros')


def test_share_holds_parameters_and_launch_files(prefix, root):
    """All that the checkout has of them is installed."""
    share = prefix / 'share' / 'hysteresis_ros'
    for pattern in ('config/*', 'launch/*.py', 'urdf/*.xacro'):
        expected = sorted(path.name for path in root.glob(pattern))
        assert expected
        assert sorted(path.name for path in share.glob(pattern)) == expected
    assert (share / 'config' / 'bicep.yaml').is_file()
    assert (share / 'launch' / 'bicep.launch.py').is_file()
    assert (share / 'package.xml').is_file()


def test_the_command_line_answers(prefix, tmp_path):
    """The installed command works from any folder."""
    done = subprocess.run([prefix / 'lib/hysteresis_ros/hysteresis', '--help'], cwd=tmp_path,
                          env=environment(prefix), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 'identify' in done.stdout


@pytest.mark.parametrize('path', ['bin/hysteresis', 'lib/hysteresis_ros/hysteresis'])
def test_the_command_line_answers_where_nothing_is_sourced(prefix, tmp_path, path):
    """The installed script finds the package beside itself."""
    plain = {name: value for name, value in os.environ.items()
             if name not in ('PYTHONPATH', 'AMENT_PREFIX_PATH')}
    done = subprocess.run([prefix / path, 'columns'], cwd=tmp_path, env=plain,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 'ambient_temperature' in done.stdout


def test_a_sourced_workspace_has_the_command(prefix):
    """As the README and `make help` say."""
    done = subprocess.run(['sh', '-c', '. ./local_setup.sh && command -v hysteresis'],
                          cwd=prefix.parent, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == str(prefix / 'bin' / 'hysteresis'), done.stderr


def test_make_help_says_how_to_get_the_command(root):
    # The make that runs this test may have been given another interpreter, which it hands down.
    outside = {name: value for name, value in os.environ.items()
               if not name.startswith(('MAKE', 'MFLAGS')) and name not in ('PYTHON', 'CONSTRAINTS')}
    done = subprocess.run(['make', '-s', 'help'], cwd=root, capture_output=True, text=True,
                          check=True, env=outside)
    assert '. install/local_setup.sh' in done.stdout
    assert 'install/hysteresis_ros/bin/hysteresis' in done.stdout


@pytest.mark.parametrize('executable', sorted(NODES))
def test_a_node_starts_alone_and_ends_on_interrupt(prefix, tmp_path, domain_id, executable):
    """Each node comes up with its defaults and goes down on Ctrl-C, without a traceback."""
    rclpy = pytest.importorskip('rclpy')
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain_id)
    watcher = rclpy.create_node('watcher', context=context)
    # Its own namespace, so that nobody else's node of that name is taken for it: a signal that
    # comes before the node is there ends Python with a traceback.
    namespace = f'/started_by_{os.getpid()}'
    node = subprocess.Popen(
        [prefix / 'lib/hysteresis_ros' / executable, '--ros-args', '-r', f'__ns:={namespace}'],
        cwd=tmp_path, env=environment(prefix),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        deadline = time.monotonic() + 60
        while (NODES[executable], namespace) not in watcher.get_node_names_and_namespaces():
            assert node.poll() is None, node.communicate()[0]
            assert time.monotonic() < deadline, f'{executable} did not come up'
            time.sleep(0.05)
        node.send_signal(signal.SIGINT)
        output = node.communicate(timeout=60)[0]
    finally:
        node.kill()
        watcher.destroy_node()
        rclpy.try_shutdown(context=context)
    assert node.returncode == 0, output
    assert 'Traceback' not in output, output


@pytest.fixture(scope='module')
def wheel(root, tmp_path_factory):
    """Build a wheel from a copy of the sources, as pip does, and return its path."""
    folder = tmp_path_factory.mktemp('wheel')
    source = folder / 'source'
    source.mkdir()
    for name in ('setup.py', 'setup.cfg', 'package.xml', 'LICENSE'):
        shutil.copy(root / name, source)
    for name in ('hysteresis_ros', 'config', 'launch', 'resource', 'urdf'):
        shutil.copytree(root / name, source / name,
                        ignore=shutil.ignore_patterns('__pycache__'))
    done = subprocess.run(
        [sys.executable, '-m', 'pip', 'wheel', '--no-deps', '--no-build-isolation', '--no-index',
         '--wheel-dir', str(folder), str(source)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return next(folder.glob('*.whl'))


def test_pip_installs_what_ros2_run_needs(wheel, tmp_path):
    """pip puts commands into bin, so launchers stand where `ros2 run` looks."""
    done = subprocess.run(
        [sys.executable, '-m', 'pip', 'install', '--no-deps', '--no-index', '--ignore-installed',
         '--prefix', str(tmp_path), str(wheel)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    prefix = next(tmp_path.rglob('lib/hysteresis_ros/hysteresis')).parents[2]
    for name in EXECUTABLES:
        assert os.access(prefix / 'lib/hysteresis_ros' / name, os.X_OK)
    assert (prefix / 'share/ament_index/resource_index/packages/hysteresis_ros').is_file()
    assert (prefix / 'share/hysteresis_ros/config/bicep.yaml').is_file()
    site = next(prefix.rglob('hysteresis_ros/__init__.py')).parents[1]
    done = subprocess.run(
        [prefix / 'lib/hysteresis_ros/hysteresis', '--help'], cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': str(site)}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 'identify' in done.stdout


def test_type_checkers_of_users_see_our_hints(wheel):
    """The marker of PEP 561 comes with the package."""
    with zipfile.ZipFile(wheel) as archive:
        assert 'hysteresis_ros/py.typed' in archive.namelist()


def test_style_and_script_of_pages_are_installed(wheel, prefix, root):
    """By pip and by colcon."""
    for room, expected in (('report', {'page.css', 'chart.js'}), ('studio', {'studio.css'})):
        web = f'hysteresis_ros/{room}/web'
        names = {path.name for path in (root / web).iterdir()}
        with zipfile.ZipFile(wheel) as archive:
            packed = {name.rpartition('/')[2] for name in archive.namelist()
                      if f'{web}/' in name}
        built = next(prefix.glob(f'lib/python*/site-packages/{web}'))
        assert packed == {path.name for path in built.iterdir()} == names
        assert expected <= names


def test_the_wheel_holds_the_package_alone(wheel):
    """Tests, tools and benchmarks stay in the checkout."""
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.split('/')[0] for name in archive.namelist()}
    assert len(tops) == 3, tops
    assert 'hysteresis_ros' in tops
    assert all(re.match(r'hysteresis_ros($|-)', top) for top in tops)


def test_one_version_everywhere(root, description):
    """package.xml, setup.py and the package say the same."""
    assert parse_package(str(root / 'package.xml')).version == hysteresis_ros.__version__
    assert description.metadata.version == hysteresis_ros.__version__


def imported(root):
    """Return the top-level modules that the package imports from elsewhere."""
    found = set()
    for path in (root / 'hysteresis_ros').rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.split('.')[0])
    return found - set(sys.stdlib_module_names) - {'hysteresis_ros'}


def test_every_import_is_a_declared_dependency(root, description):
    """What the sources import, rosdep and pip are told."""
    package = parse_package(str(root / 'package.xml'))
    rosdep = {depend.name for depend in package.exec_depends}
    modules = imported(root)
    pip = {Requirement(line).name.lower() for line in description.install_requires}
    for extra in ('bags', 'cluster', 'studio'):
        pip |= {Requirement(line).name.lower() for line in description.extras_require[extra]}
    # No rosdep keys. rosbag2_py does what rosbags does; the studio is a command of its own; the
    # others make things faster.
    optional = {'rosbags', 'dask', 'distributed', 'threadpoolctl', 'nicegui', 'starlette'}
    by_rosdep = {name for name in modules
                 if ROSDEP.get(name, f'python3-{name}') in rosdep or name in rosdep}
    assert modules - by_rosdep - optional == set()
    pip_names = {'serial': 'pyserial', 'yaml': 'pyyaml', 'distributed': 'dask'}
    from_ros = {name for name in modules if name in rosdep}
    assert {pip_names.get(name, name) for name in modules - from_ros} <= pip


def test_rosdep_knows_every_key_for_jazzy_on_noble(root):
    """A key that the list does not have has to be looked up; one from pip would bar a release."""
    lines = (root / 'test/rosdep_jazzy_noble.txt').read_text(encoding='utf-8').splitlines()
    known = dict(line.split() for line in lines if line and not line.startswith('#'))
    package = parse_package(str(root / 'package.xml'))
    keys = {depend.name for depend in (
        *package.build_depends, *package.exec_depends, *package.test_depends)}
    assert keys - set(known) == set()
    assert set(known) - keys == set(), 'keys that nothing depends on any more'
    for key, debian in known.items():
        assert not key.endswith('-pip')
        assert debian == (key if '-' in key else f'ros-jazzy-{key.replace("_", "-")}')


def test_what_rosdep_does_not_know_can_be_missing(root):
    """The command line works without the packages that rosdep cannot install."""
    code = """
import sys

for name in ('threadpoolctl', 'rosbags', 'dask', 'distributed', 'xacro', 'yourdfpy', 'nicegui'):
    sys.modules[name] = None
from hysteresis_ros.cli.main import main
from hysteresis_ros.workers import delayed, in_parallel
assert list(in_parallel([delayed(max)(1, 2)], 1)) == [2]
sys.exit(main(['columns']))
"""
    done = subprocess.run([sys.executable, '-c', code], cwd=root, capture_output=True, text=True,
                          check=False, env={**os.environ, 'PYTHONPATH': str(root)})
    assert done.returncode == 0, done.stderr


def test_the_quality_declaration_says_what_holds(root):
    """Its level is one that REP-2004 grants this version, and the README links to it."""
    text = (root / 'QUALITY_DECLARATION.md').read_text(encoding='utf-8')
    level = int(re.search(r'Quality Level (\d)\*\*', text).group(1))
    stable = int(hysteresis_ros.__version__.split('.')[0]) >= 1
    assert level == 4 or stable
    assert '](QUALITY_DECLARATION.md)' in (root / 'README.md').read_text(encoding='utf-8')
    for name in re.findall(r'\]\(([^)#:]+)\)', text):
        assert (root / name).exists(), name


def constraints(path):
    """Return the requirements that a constraints file holds."""
    lines = [line.split('#')[0].strip() for line in path.read_text(encoding='utf-8').splitlines()]
    return [Requirement(line) for line in lines if line]


def test_ubuntus_set_is_within_the_bounds_of_setup(root, description):
    """All that the package needs to run is pinned, to versions that setup.py allows."""
    pins = {}
    for line in constraints(root / 'constraints/ubuntu-24.04.txt'):
        pins.setdefault(line.name.lower(), []).append(next(iter(line.specifier)).version)
    for line in map(Requirement, description.install_requires):
        assert pins[line.name.lower()]
        assert all(line.specifier.contains(version) for version in pins[line.name.lower()])


def test_setup_cfg_sends_executables_where_ros2_run_looks(root):
    """Both of colcon's ways of installing, by copy and by link."""
    config = ConfigParser(interpolation=None)
    config.read(root / 'setup.cfg', encoding='utf-8')
    assert config['install']['install_scripts'] == '$base/lib/hysteresis_ros'
    assert config['develop']['script_dir'] == '$base/lib/hysteresis_ros'
