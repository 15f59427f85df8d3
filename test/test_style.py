# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The linters: flake8, docstrings, headers and the package's description.

Where ROS 2 brings ament's linters, these run, with the same settings from setup.cfg.
"""

from importlib.util import find_spec
import re
import shutil
import subprocess
import sys
from xml.etree import ElementTree

from catkin_pkg.package import parse_package
from conftest import colcon
import pytest

FOLDERS = ('hysteresis_ros', 'launch', 'benchmark', 'tools', 'test', 'docs')
HEADER = re.compile(r'(#!.*\n)?'
                    r'# Copyright 20\d\d hysteresis_ros contributors\n'
                    r'# SPDX-License-Identifier: Apache-2\.0\n')


def python_files(root):
    """Return every Python file of the project, setup.py among them."""
    files = [path for folder in FOLDERS for path in sorted((root / folder).rglob('*.py'))]
    return [root / 'setup.py', *files]


def run_module(root, *arguments):
    """Run a Python module in the checkout and fail with all that it prints."""
    done = subprocess.run([sys.executable, '-m', *arguments], cwd=root,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.linter
def test_flake8(root):
    """Single quotes, 100 columns, and nothing that flake8 or its plug-ins complain of."""
    paths = [str(path.relative_to(root)) for path in python_files(root)]
    if find_spec('ament_flake8'):
        run_module(root, 'ament_flake8.main', '--config', 'setup.cfg', *paths)
    else:
        run_module(root, 'flake8', *paths)


@pytest.mark.linter
def test_docstrings(root):
    """Everything public is documented, after numpy's conventions."""
    paths = [str(path.relative_to(root)) for path in python_files(root)]
    if find_spec('ament_pep257'):
        run_module(root, 'ament_pep257.main', *paths, '--convention', 'numpy',
                   '--add-ignore', 'D105')
    else:
        run_module(root, 'pydocstyle', '--convention=numpy', '--add-ignore=D105', *paths)


@pytest.mark.linter
@pytest.mark.skipif(find_spec('mypy') is None, reason='mypy is not installed (extra `test`)')
def test_types(root, request):
    """Type hints are complete and true in every folder that setup.cfg does not except."""
    cache = request.config.cache.mkdir('mypy')
    run_module(root, 'mypy', '--config-file', 'setup.cfg', '--cache-dir', str(cache))


def test_headers(root):
    """Every Python file says whose it is and under which license."""
    without = [path for path in python_files(root)
               if not HEADER.match(path.read_text(encoding='utf-8'))]
    assert without == []


def test_sources_are_utf8_with_unix_line_ends(root):
    """No file needs an editor of its own."""
    for path in python_files(root):
        content = path.read_bytes()
        assert b'\r' not in content, path
        assert b'\t' not in content, path
        assert content.endswith(b'\n') and not content.endswith(b'\n\n'), path


def test_license_is_the_one_that_the_package_names(root):
    """The full text of the license comes with the package."""
    package = parse_package(str(root / 'package.xml'))
    assert [str(name) for name in package.licenses] == ['Apache-2.0']
    text = (root / package.licenses[0].file).read_text(encoding='utf-8')
    assert 'Apache License' in text and 'END OF TERMS AND CONDITIONS' in text


def test_package_xml_follows_format_3(root):
    """A fault here makes colcon take the package for plain Python, without its ament hooks."""
    warnings = []
    package = parse_package(str(root / 'package.xml'), warnings=warnings)
    assert warnings == []
    assert package.package_format == 3
    assert package.get_build_type() == 'ament_python'
    assert package.maintainers[0].email


def test_package_xml_names_nothing_twice(root):
    """One dependency, one line."""
    tree = ElementTree.parse(root / 'package.xml').getroot()
    names = [(element.tag, element.text) for element in tree if element.tag.endswith('depend')]
    assert len(names) == len(set(names))


def test_package_xml_is_valid(root):
    """Check the schema, where ament's xmllint and with it the schema is there."""
    if not (find_spec('ament_xmllint') and shutil.which('xmllint')):
        pytest.skip('ament_xmllint is not installed')
    run_module(root, 'ament_xmllint.main', 'package.xml')


def test_colcon_takes_it_for_an_ament_package(root, tmp_path):
    """Only then does the build write what `ros2` needs."""
    listed = colcon(tmp_path, 'list', '--base-paths', str(root))
    assert listed.split()[0] == 'hysteresis_ros'
    assert '(ros.ament_python)' in listed
