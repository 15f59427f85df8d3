# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes of a benchmark."""

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import os
import subprocess
import sys

PATIENCE = 60.0             # s for a node to end in order


def own_domain() -> int:
    """Return a ROS domain for this process, far from those that tests take, from 1 on."""
    return 101 - os.getpid() % 50


@contextlib.contextmanager
def child(code: str, arguments: Sequence[str], environment: Mapping[str, str]
          ) -> Iterator[subprocess.Popen]:
    """Run Python code as a process until the context is left; it is killed if it does not end."""
    process = subprocess.Popen([sys.executable, '-c', code, *arguments], env=dict(environment))
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
