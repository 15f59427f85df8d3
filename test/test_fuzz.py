# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The fuzzers for a moment: they build, run, and find nothing at once; `make fuzz` is longer."""

import shutil
import subprocess
import sys

from firmware_support import make
import pytest


def test_the_firmware_stands_a_moment_of_fuzzing(tmp_path):
    """Some thousand inputs for the decoder, some hundred for the whole board."""
    if shutil.which('clang') is None:
        pytest.skip('clang is not installed: sudo apt install clang libclang-rt-dev')
    made = subprocess.run(['clang', '-fsanitize=fuzzer', '-x', 'c', '-', '-o', tmp_path / 'one'],
                          input='int LLVMFuzzerTestOneInput(const char *d, long n)'
                          '{ (void)d; (void)n; return 0; }', text=True, capture_output=True,
                          check=False)
    if made.returncode != 0:
        pytest.skip('libFuzzer is not installed: sudo apt install libclang-rt-dev')
    make('fuzz', f'BUILD={tmp_path}', 'RUNS=20000', 'BOARD_RUNS=300')


def test_the_decoder_stands_a_moment_of_fuzzing(root, tmp_path):
    """Where atheris is installed."""
    pytest.importorskip('atheris', reason='pip install atheris')
    done = subprocess.run(
        [sys.executable, 'tools/fuzz_decoder.py', '-runs=2000', '-max_len=512', '-seed=1',
         f'-artifact_prefix={tmp_path}/'], cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
