# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where compiled functions are kept, and that they are never old, broken or anybody else's."""

import os
import shutil
import subprocess
import sys
import tempfile

import numba
import pytest

from hysteresis_ros.kernels import cache_folder as folders

INNER = 'from hysteresis_ros.kernels.jit import jit\n\n\n@jit\ndef inner(x):\n    return {} * x\n'
OUTER = ('from hysteresis_ros.kernels.inner import inner\nfrom hysteresis_ros.kernels.jit '
         'import jit\n\n\n@jit\ndef outer(x):\n    return inner(x) + 1\n')
RUN = """
from hysteresis_ros.kernels.outer import outer
print(outer(2.0), sum(outer.stats.cache_hits.values()), sum(outer.stats.cache_misses.values()))
"""


@pytest.fixture
def package(root, tmp_path):
    """Return a folder with a package of two functions in two files, compiled as ours are."""
    folder = tmp_path / 'site'
    kernels = folder / 'hysteresis_ros' / 'kernels'
    kernels.mkdir(parents=True)
    (folder / 'hysteresis_ros' / '__init__.py').touch()
    for name in ('__init__.py', 'jit.py', 'compiler.py', 'cache_folder.py'):
        shutil.copy(root / 'hysteresis_ros' / 'kernels' / name, kernels)
    (kernels / 'inner.py').write_text(INNER.format(2))
    (kernels / 'outer.py').write_text(OUTER)
    return folder


@pytest.fixture
def home(monkeypatch, tmp_path):
    """Make an empty home folder and an empty folder for temporary files, and return both."""
    places = tmp_path / 'user', tmp_path / 'temporary'
    for place in places:
        place.mkdir()
    monkeypatch.setenv('HOME', str(places[0]))
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    monkeypatch.delenv('NUMBA_CACHE_DIR', raising=False)
    monkeypatch.setattr(numba.config, 'CACHE_DIR', '')
    monkeypatch.setattr(tempfile, 'tempdir', str(places[1]))
    return places


def start(package, code=RUN, **environment):
    """Start Python on a package of its own."""
    return subprocess.Popen(
        [sys.executable, '-B', '-c', code], cwd=package, text=True,
        env={**os.environ, 'PYTHONPATH': str(package), **environment},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def finished(process):
    """Return the words that a process printed; it has to end well and without a warning."""
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 0 and not errors, errors
    return output.split()


def find():
    """Return the cache's folder for the environment as it is now."""
    return folders.cache_folder.__wrapped__()


def test_a_second_start_compiles_nothing(package, home):
    """And nothing is written beside the sources, which root may own."""
    assert finished(start(package)) == ['5.0', '0', '1']
    assert finished(start(package)) == ['5.0', '1', '0']
    assert sorted(path.name for path in package.rglob('*.nb*')) == []
    assert list((home[0] / '.cache' / 'hysteresis_ros').glob('kernels-*/outer*.nbi'))


def test_what_is_compiled_already_runs_without_what_compiles(package, home):
    """Its imports would be a fifth of the time that a command takes; later they are made up for."""
    code = """
import sys
from hysteresis_ros.kernels.outer import outer
print(outer(2.0), 'numba.np.npyimpl' in sys.modules)
print(outer(2), 'numba.np.npyimpl' in sys.modules)
"""
    assert finished(start(package, code)) == ['5.0', 'True', '5', 'True']
    assert finished(start(package, code)) == ['5.0', 'False', '5', 'False']
    code = code.replace('outer(2)', 'outer(2 + 0j)')
    assert finished(start(package, code)) == ['5.0', 'False', '(5+0j)', 'True']


def test_a_change_in_a_called_function_is_seen(package, home):
    """Numba alone compares the file of the outer function only."""
    finished(start(package))
    (package / 'hysteresis_ros' / 'kernels' / 'inner.py').write_text(INNER.format(3))
    assert finished(start(package)) == ['7.0', '0', '1']


def test_a_copy_in_another_place_compiles_nothing(package, home, tmp_path):
    """What was installed from a checkout has the same sources, with other times."""
    finished(start(package))
    copy = tmp_path / 'copy'
    shutil.copytree(package, copy, copy_function=shutil.copyfile)
    for path in copy.rglob('*.py'):
        os.utime(path, (0, 0))
    assert finished(start(copy)) == ['5.0', '1', '0']


def test_without_the_compiler_functions_are_plain_python(package, home):
    """The same source, for a debugger or for a comparison."""
    code = 'from hysteresis_ros.kernels.outer import outer\nprint(type(outer).__name__, outer(2))'
    assert finished(start(package, code, NUMBA_DISABLE_JIT='1')) == ['function', '5']
    assert not (home[0] / '.cache').exists()


def test_without_numba_functions_are_plain_python(package, home):
    """Slow, and one line says what to do about it."""
    code = ("import sys\nsys.modules['numba'] = None\n"
            'from hysteresis_ros.kernels.outer import outer\nprint(type(outer).__name__, outer(2))')
    output, errors = start(package, code).communicate(timeout=120)
    assert output.split() == ['function', '5'], errors
    assert errors.count('\n') == 1 and 'pip install numba' in errors


def test_two_processes_that_compile_at_once_keep_both_results(package, home):
    """Each reads the index before the other writes it: the worst that can happen."""
    slow = """
import time
from numba.core.caching import IndexDataCacheFile
save = IndexDataCacheFile._save_index
def slowly(self, overloads):
    time.sleep(1.5)
    save(self, overloads)
IndexDataCacheFile._save_index = slowly
from hysteresis_ros.kernels.outer import outer
print(outer({}))
"""
    both = [start(package, slow.format(value)) for value in ('2.0', '2')]
    assert [finished(process) for process in both] == [['5.0'], ['5']]
    code = RUN.replace('outer(2.0)', 'outer(2.0), outer(2)')
    assert finished(start(package, code)) == ['5.0', '5', '2', '0']


@pytest.mark.parametrize('pattern', ['outer*.nbi', 'outer*.nbc'])
def test_a_damaged_file_is_compiled_anew(package, home, pattern):
    """A power failure may leave an empty file behind; a node has to start all the same."""
    finished(start(package))
    for path in (home[0] / '.cache').rglob(pattern):
        path.write_bytes(b'')
    output, errors = start(package).communicate(timeout=120)
    assert output.split() == ['5.0', '0', '1']
    assert errors.count('\n') == 1 and 'could not be read' in errors
    assert finished(start(package)) == ['5.0', '1', '0']


def test_other_packages_keep_their_own_cache(package, home):
    """The setting is numba's for the whole process, and only borrowed."""
    code = """
import numba
before = numba.config.CACHE_DIR
from hysteresis_ros.kernels.outer import outer
outer(2.0)
print(numba.config.CACHE_DIR == before, 'kernels-' in outer.stats.cache_path)
"""
    chosen = home[0] / 'chosen'
    assert finished(start(package, code, NUMBA_CACHE_DIR=str(chosen))) == ['True', 'True']
    assert list(chosen.glob('hysteresis_ros/kernels-*/outer*.nbi'))
    assert not (home[0] / '.cache').exists()
    assert finished(start(package, code)) == ['True', 'True']


def test_the_users_cache_folder_is_taken(home, monkeypatch, tmp_path):
    """XDG_CACHE_HOME where it is set to an absolute path, as its specification says."""
    assert find().parent == home[0] / '.cache' / 'hysteresis_ros'
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'xdg'))
    assert find().parent == tmp_path / 'xdg' / 'hysteresis_ros'
    monkeypatch.setenv('XDG_CACHE_HOME', 'relative')
    assert find().parent == home[0] / '.cache' / 'hysteresis_ros'


def test_without_a_home_there_is_a_private_folder_among_the_temporary_files(home, monkeypatch):
    """A service's user has no home, or one that cannot be written."""
    monkeypatch.setenv('HOME', os.path.join(os.devnull, 'home'))
    found = find()
    assert found.parent == home[1] / f'hysteresis_ros-{os.getuid()}'
    assert found.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize('trap', ['open', 'link'])
def test_a_folder_that_others_could_write_is_not_used(home, monkeypatch, caplog, trap):
    """Whoever writes into it runs code here; without a folder, one line says what follows."""
    monkeypatch.setenv('HOME', os.path.join(os.devnull, 'home'))
    theirs = home[1] / f'hysteresis_ros-{os.getuid()}'
    if trap == 'open':
        theirs.mkdir()
        theirs.chmod(0o777)
    else:
        (home[1] / 'elsewhere').mkdir()
        theirs.symlink_to(home[1] / 'elsewhere')
    assert find() is None
    assert len(caplog.records) == 1 and 'NUMBA_CACHE_DIR' in caplog.text


def test_without_any_folder_functions_are_compiled_all_the_same(package, tmp_path):
    """Slow starts, not failing ones."""
    nowhere = os.path.join(os.devnull, 'home')
    code = ('import tempfile\ntempfile.tempdir = ' + repr(nowhere) + '\n'
            'from hysteresis_ros.kernels.outer import outer\nprint(outer(2.0))')
    process = start(package, code, HOME=nowhere, XDG_CACHE_HOME='', NUMBA_CACHE_DIR='')
    output, errors = process.communicate(timeout=120)
    assert output.split() == ['5.0'], errors
    assert errors.count('\n') == 1 and 'each start' in errors


def test_old_folders_go_and_the_few_used_last_stay(home):
    """Every version of the sources has a folder; what is not ours is left alone."""
    current = find()
    others = []
    for number in range(folders.KEPT + 3):
        folder = current.parent / f'kernels-{number:016x}'
        folder.mkdir()
        (folder / 'file').touch()
        os.utime(folder, (number, number))
        others.append(folder)
    foreign = current.parent / 'notes'
    foreign.mkdir()
    os.utime(foreign, (0, 0))
    os.utime(current, (0, 0))
    assert find() == current
    assert [path for path in others if path.exists()] == others[4:]
    assert foreign.exists() and current.exists()
    assert current.stat().st_mtime > 1e9
