# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What `make test` runs side by side, and when it fails."""

import subprocess

import pytest

# Stands for pytest: says its arguments, and fails where the environment names one of them.
PYTEST = 'case $2 in not*) part=core ;; *) part=nodes ;; esac; echo "$part: $2"; ' \
    'test "$FAILING" != "$part"'


@pytest.fixture
def run(root, tmp_path):
    """Return a function that runs the script with another pytest, of which a part may fail."""
    script = tmp_path / 'pytest'
    script.write_text(f'#!/bin/sh\n{PYTEST}\n')
    script.chmod(0o755)
    return lambda failing: subprocess.run(
        [str(root / 'tools/quick_tests.sh'), str(script)], capture_output=True, text=True,
        check=False, timeout=60, env={'FAILING': failing, 'PATH': '/usr/bin:/bin'})


@pytest.mark.parametrize('failing, status', [('', 0), ('core', 1), ('nodes', 1)])
def test_it_fails_when_either_part_does(run, failing, status):
    assert run(failing).returncode == status


def test_every_test_that_is_not_slow_is_in_one_part(run):
    """What nodes print comes after the rest, and is told last."""
    core, nodes, left_out = run('').stdout.splitlines()
    assert core == 'core: not (nodes or linter) and not slow'
    assert nodes == 'nodes: (nodes or linter) and not slow'
    assert 'make test-all' in left_out
