# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Nodes and commands as processes: how soon they are ready, and how long they take.

Starts are compared with the least that a process of their kind can do. What computes for long is
compared with one pass of the uncompiled arm over as many rows, which scales with the machine.
"""

import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from benchmark.arm import arm_model, arm_run, reference, SETTLED
from hysteresis_ros.errors import HysteresisError

ROUNDS, QUICK_ROUNDS = 6, 1
# The first round compiles what no other command has needed so far.
WARM_ROUNDS = 2
PLAIN_ROWS = 3000
NODE = """
import rclpy
{imports}
rclpy.init()
node = {make}
print('ready', flush=True)
node.destroy_node()
rclpy.try_shutdown()
"""
NODES = {
    'bare': ('', "rclpy.create_node('bare')"),
    'compensator': ('from hysteresis_ros.nodes.compensator_node import CompensatorNode',
                    'CompensatorNode()'),
    'monitor': ('from hysteresis_ros.nodes.monitor_node import MonitorNode', 'MonitorNode()'),
}
# What is hidden in a recording: name to protocol and options of `hysteresis simulate`.
RECORDINGS = {
    'settled_strong': ('arm-steps', ['--effect', 'payload_error']),
    'settled_unknown': ('arm-steps', ['--effect', 'unlisted_stiffening_cable']),
    'moving_lag': ('arm-dynamic', ['--effect', 'thermal_lag']),
    'moving_viscous': ('arm-dynamic', ['--effect', 'viscous_friction']),
    'moving_pair': ('arm-dynamic', ['--effect', 'thermal_lag', '--effect', 'viscous_friction']),
}


def start_benchmarks(quick: bool) -> dict[str, float]:
    """
    Measure warm starts: the second and later ones, with caches filled.

    Returns
    -------
    dict
        Seconds until nodes are ready, over those of a bare node; seconds of `hysteresis --help`
        and of `hysteresis compare` on 240 rows, over those of Python importing NumPy.
    """
    rounds = QUICK_ROUNDS if quick else ROUNDS
    nodes = {name: [sys.executable, '-c', NODE.format(imports=imports, make=make)]
             for name, (imports, make) in NODES.items()}
    with tempfile.TemporaryDirectory() as folder:
        arm, model = Path(folder, 'arm'), Path(folder, 'model.yaml')
        run(hysteresis('simulate', 'arm-steps', '-o', arm))
        arm_model({}).save(model)
        commands = {
            'numpy': [sys.executable, '-c', 'import numpy'],
            'help': hysteresis('--help'),
            'compare_240_rows': hysteresis('compare', '--model', model, '--data',
                                           arm / 'train.csv')}
        times = fastest({**nodes, **commands}, rounds)
    results = {}
    for name, bare in (('compensator', 'bare'), ('monitor', 'bare'), ('help', 'numpy'),
                       ('compare_240_rows', 'numpy')):
        kind = 'node' if bare == 'bare' else 'command'
        results[f'{name}_{kind}_warm_start_s'] = times[name]
        results[f'{name}_{kind}_warm_start_over_{bare}_ratio'] = times[name] / times[bare]
    return results


def diagnosis_benchmarks(quick: bool) -> dict[str, float]:
    """
    Measure `identify --effects auto` and `diagnose`, which take long: not in the quick form.

    Returns
    -------
    dict
        Seconds with compiled kernels, and how many passes of the reference over the recording's
        rows they are worth.
    """
    if quick:
        return {}
    model = arm_model({})
    plain, _ = reference(model, arm_run(model, PLAIN_ROWS, SETTLED), SETTLED)
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        bench = Path(folder, 'bench')
        run(hysteresis('simulate', 'bench', '-o', bench, '--seed', '3'))
        seconds = warm(hysteresis(
            'identify', '--force', bench / 'force.csv', '--length', bench / 'length.csv',
            '--force-trials', '0', '--length-trials', '0-3', '--geometry',
            bench / 'geometry.yaml', '--effects', 'auto', '-o', bench / 'model.yaml'))
        rows = count_rows(bench / 'length.csv')
        results['identify_effects_auto_s'] = seconds
        results['identify_effects_auto_over_reference_pass_ratio'] = (
            seconds / (plain / PLAIN_ROWS * rows))
        for name, (protocol, options) in RECORDINGS.items():
            arm = Path(folder, name)
            run(hysteresis('simulate', protocol, '-o', arm, '--seed', '3', *options))
            seconds = warm(hysteresis('diagnose', '--model', bench / 'model.yaml', '--data',
                                      arm / 'train.csv', '--jobs', '2'))
            rows = count_rows(arm / 'train.csv')
            results[f'diagnose_{name}_s'] = seconds
            results[f'diagnose_{name}_rows_count'] = rows
            results[f'diagnose_{name}_over_reference_pass_ratio'] = (
                seconds / (plain / PLAIN_ROWS * rows))
    return results


def hysteresis(*arguments) -> list[str]:
    """Return the command line of one of our commands."""
    return [sys.executable, '-m', 'hysteresis_ros', *map(str, arguments)]


def fastest(commands: dict[str, list[str]], rounds: int) -> dict[str, float]:
    """Return the least time [s] of each command; they go in turn."""
    times = {name: [] for name in commands}
    for _ in range(rounds):
        for name, command in commands.items():
            times[name].append(run(command))
    return {name: min(values) for name, values in times.items()}


def warm(command: list[str]) -> float:
    """Return the seconds that a command takes whose kernels are compiled."""
    return fastest({'command': command}, WARM_ROUNDS)['command']


def run(command: list[str]) -> float:
    """Return the seconds until a process says that it is ready, or ends; it has to end well."""
    environment = dict(os.environ, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    start = time.perf_counter()
    with subprocess.Popen(command, env=environment, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE) as process:
        if process.stdout.readline() == 'ready\n':
            seconds = time.perf_counter() - start
            _, errors = process.communicate()
        else:
            _, errors = process.communicate()
            seconds = time.perf_counter() - start
    if process.returncode:
        raise HysteresisError(f'benchmark of {" ".join(command[1:4])!r}: {errors.strip()}')
    return seconds


def count_rows(path: Path) -> int:
    """Return the rows of a table below its header."""
    with open(path, encoding='utf-8') as table:
        return sum(1 for _ in table) - 1
