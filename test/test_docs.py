# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/: they build without a warning and leave no part of the package out."""

from importlib.util import find_spec
import re
import subprocess
import sys

import pytest

TOOLS = ('sphinx', 'numpydoc', 'myst_parser')
missing = [name for name in TOOLS if find_spec(name) is None]


def packages(root):
    """Return the names of the package's folders."""
    return sorted(path.parent.name for path in (root / 'hysteresis_ros').glob('*/__init__.py'))


@pytest.mark.slow
@pytest.mark.skipif(bool(missing), reason=f'{", ".join(missing)} not installed (extra `docs`)')
def test_pages_build_without_warnings(root, tmp_path):
    """Docstrings, links and tables of contents are right; warnings are errors."""
    done = subprocess.run(
        [sys.executable, '-m', 'sphinx', '-q', '-W', '--keep-going', '-b', 'html',
         '-d', str(tmp_path / 'doctrees'), str(root / 'docs'), str(tmp_path / 'html')],
        cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    readme = (tmp_path / 'html' / 'readme.html').read_text(encoding='utf-8')
    assert 'id="two-commands"' in readme and 'href="protocol.html"' in readme
    board = (tmp_path / 'html' / 'api' / 'bridge.html').read_text(encoding='utf-8')
    assert 'id="hysteresis_ros.bridge.board.Board.set_voltage"' in board


def test_architecture_names_every_package(root):
    """The table and the picture show every folder of the package."""
    page = (root / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    picture = (root / 'docs' / 'architecture.svg').read_text(encoding='utf-8')
    for name in packages(root):
        assert f'| `{name}/` |' in page, name
        assert f'>{name}/</' in picture, name


def test_files_that_the_architecture_names_exist(root):
    """A file that moves takes its mention along."""
    page = (root / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    named = re.findall(r'`((?:\w+/)+\w+\.(?:py|yaml))`', page)
    assert len(named) > 5
    for name in named:
        assert (root / name).is_file() or (root / 'hysteresis_ros' / name).is_file(), name


def test_every_documented_module_is_on_a_page_of_the_contents(root):
    """No page of the programming interface is written and then not linked."""
    contents = (root / 'docs' / 'index.md').read_text(encoding='utf-8')
    for page in (root / 'docs' / 'api').glob('*.md'):
        assert f'\napi/{page.stem}\n' in contents, page.name


def test_every_module_is_on_a_page(root):
    """Whoever looks for a module finds it; one that is gone is on no page."""
    pages = ''.join(page.read_text(encoding='utf-8')
                    for page in sorted((root / 'docs' / 'api').glob('*.md')))
    listed = re.findall(r'^\.\. automodule:: hysteresis_ros\.([\w.]+)$', pages, re.MULTILINE)
    files = [path.relative_to(root / 'hysteresis_ros').with_suffix('')
             for path in (root / 'hysteresis_ros').rglob('*.py')]
    there = {'.'.join(path.parts) for path in files if not path.name.startswith('__')}
    folders = {'.'.join(path.parent.parts) for path in files}
    assert sorted(set(listed) - folders) == sorted(there)
    assert len(listed) == len(set(listed))
