# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Build description of the package, for colcon and for pip."""

from glob import glob
import os
import re
import subprocess
import sys

from setuptools import find_packages, setup

from setuptools.command.install_scripts import install_scripts

from distutils.command.install_data import install_data  # from setuptools: not before its import

PACKAGE = 'hysteresis_ros'

EXECUTABLES = {
    'geometry_node': 'hysteresis_ros.nodes.geometry_node:main',
    'compensator_node': 'hysteresis_ros.nodes.compensator_node:main',
    'bridge_node': 'hysteresis_ros.nodes.bridge_node:main',
    'monitor_node': 'hysteresis_ros.nodes.monitor_node:main',
    'marker_node': 'hysteresis_ros.nodes.marker_node:main',
    'hysteresis': 'hysteresis_ros.cli.main:main',
}

LAUNCHER = """#!/bin/sh
exec "$(dirname "$(readlink -f "$0")")/../../bin/{name}" "$@"
"""


# `hysteresis` on the PATH of whoever sources the workspace, which takes bin/ in.
COMMAND = """#!/bin/sh
exec "$(dirname "$(readlink -f "$0")")/../lib/{package}/{name}" "$@"
"""

# An executable of a workspace that is not sourced looks beside itself for the package.
FIND_PACKAGE = """
import os
import sys

site = os.path.join(
    os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__)))),
    'lib', 'python%d.%d' % sys.version_info[:2], 'site-packages')
if os.path.isdir(site) and site not in sys.path:
    sys.path.insert(0, site)
"""


class InstallScripts(install_scripts):
    """Executables that also start where the workspace is not sourced."""

    def write_script(self, script_name, contents, mode='t', *ignored):
        """Write one; a Python script gets the lines that find the package."""
        first, newline, rest = contents.partition('\n')
        if isinstance(contents, str) and first.startswith('#!') and 'python' in first:
            contents = first + newline + FIND_PACKAGE + rest
        super().write_script(script_name, contents, mode, *ignored)


class InstallData(install_data):
    """
    Data files; in a wheel what `ros2 run` needs, elsewhere compiled functions.

    pip puts executables into bin/ whatever setup.cfg says, while `ros2 run` looks in
    lib/hysteresis_ros/. So a wheel carries small launchers for that folder. colcon follows
    setup.cfg and needs none.
    """

    def run(self):
        """Install the files, then the launchers or the compiled functions."""
        super().run()
        if 'bdist_wheel' in self.distribution.commands:
            self._install_launchers()
        elif not self.root:
            self._install_command()
            self._compile()

    def _install_command(self):
        folder = os.path.join(self.install_dir, 'bin')
        self.mkpath(folder)
        self._write(os.path.join(folder, 'hysteresis'),
                    COMMAND.format(package=PACKAGE, name='hysteresis'))

    def _compile(self):
        """Fill the cache of compiled functions, so that no first call waits for the compiler."""
        installed = self.get_finalized_command('install').install_lib
        path = os.pathsep.join(filter(None, [installed, os.environ.get('PYTHONPATH')]))
        # What is not compiled now is compiled when it is first needed.
        subprocess.run([sys.executable, '-m', f'{PACKAGE}.compile_kernels'], check=False,
                       env={**os.environ, 'PYTHONPATH': path}, cwd=installed,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def _install_launchers(self):
        folder = os.path.join(self.install_dir, 'lib', PACKAGE)
        self.mkpath(folder)
        for name in EXECUTABLES:
            self._write(os.path.join(folder, name), LAUNCHER.format(name=name))

    def _write(self, path, text):
        with open(path, 'w', encoding='utf-8') as launcher:
            launcher.write(text)
        os.chmod(path, 0o755)
        self.outfiles.append(path)


def version():
    """Return the version that package.xml gives, so that there is one place for it."""
    with open('package.xml', encoding='utf-8') as manifest:
        return re.search('<version>(.+)</version>', manifest.read()).group(1)


setup(
    name=PACKAGE,
    version=version(),
    description='Hysteresis models that drive artificial muscles and find the physics they lack',
    author='hysteresis_ros contributors',
    maintainer='hysteresis_ros contributors',
    maintainer_email='maintainers@hysteresis-ros.example',
    license='Apache-2.0',
    keywords=['ROS', 'hysteresis', 'Preisach', 'artificial muscle', 'shape memory alloy'],
    packages=find_packages(include=[PACKAGE, PACKAGE + '.*']),
    # The first tells type checkers that our annotations are meant for them.
    package_data={PACKAGE: ['py.typed', 'report/web/*.css', 'report/web/*.js',
                            'studio/web/*.css']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/config', sorted(glob('config/*'))),
        ('share/' + PACKAGE + '/launch', sorted(glob('launch/*.py'))),
        ('share/' + PACKAGE + '/urdf', sorted(glob('urdf/*.xacro'))),
    ],
    entry_points={
        'console_scripts': [f'{name} = {target}' for name, target in EXECUTABLES.items()],
    },
    python_requires='>=3.10',
    install_requires=[
        'numpy>=1.26',
        'scipy>=1.11',
        'numba>=0.59',
        'matplotlib>=3.6',
        'pyserial>=3.5',
        'PyYAML>=6.0.1',
        'joblib>=1.3',
        'threadpoolctl>=3.1',
        'tqdm>=4.64',
    ],
    extras_require={
        # Reads and writes rosbag2 folders where rosbag2_py is not installed.
        'bags': ['rosbags>=0.10'],
        # Builds docs/ as HTML: numpydoc reads the docstrings, MyST the pages in Markdown. The
        # lower bounds are what Ubuntu 24.04 ships.
        'docs': ['sphinx>=7.2', 'numpydoc>=1.6', 'myst-parser>=2.0'],
        # The page of `hysteresis studio`. With what it brings 104 MB, Dash 136, Panel 296; it holds
        # all that its pages load, and speaks to them over a socket as a slider moves.
        'studio': ['nicegui>=3.0,<4', 'starlette'],
        # Spreads a diagnosis over a laboratory's machines.
        'cluster': ['dask[distributed]>=2024.1'],
        # ROS 2 Jazzy as wheels, for a machine that has no ROS.
        'ros': ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces',
                'ros-jazzy-lifecycle-msgs'],
        'test': [
            # launch_testing's plug-in, which ROS installs, breaks with pytest 9.
            'pytest>=7.4,<9',
            'pytest-cov',
            'dask[distributed]>=2024.1',
            'hypothesis',
            'flake8',
            'flake8-quotes',
            'pydocstyle',
            'mypy',
            # The arm's description against the geometry.
            'xacro>=2.0',
            'yourdfpy>=0.0.56',
        ],
    },
    cmdclass={'install_data': InstallData, 'install_scripts': InstallScripts},
    zip_safe=True,
)
