# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Run every benchmark and write one flat mapping: `python -m benchmark [--quick] benchmark.json`.

A benchmark is a function of a module in this folder whose name ends in ``_benchmarks``. It takes
whether few repetitions will do, and returns a mapping from a name, with its unit as suffix, to a
number.
"""

import argparse
from importlib import import_module
import json
import math
from pathlib import Path
import pkgutil
import subprocess
import sys

import benchmark
from hysteresis_ros.errors import HysteresisError

ONE = ('import importlib, json, sys; function = getattr(importlib.import_module(sys.argv[1]), '
       'sys.argv[2]); print(json.dumps(function(sys.argv[3] == "quick")))')


def discover():
    """Return the benchmark functions of this folder's modules, in the order of their names."""
    functions = []
    for module in sorted(info.name for info in pkgutil.iter_modules(benchmark.__path__)):
        if module == '__main__':
            continue
        home = f'benchmark.{module}'
        functions += [function for name, function in vars(import_module(home)).items()
                      if name.endswith('_benchmarks') and function.__module__ == home]
    return functions


def in_own_process(function, quick):
    """
    Run a benchmark where nothing but what it needs is imported.

    Beside all that the others import, a row of an arm took half as long again.

    Parameters
    ----------
    function : callable
        A benchmark.
    quick : bool
        Whether few repetitions will do.

    Returns
    -------
    dict
        Name to number.

    Raises
    ------
    HysteresisError
        If it fails; what it says goes to the terminal.
    """
    done = subprocess.run(
        [sys.executable, '-c', ONE, function.__module__, function.__name__,
         'quick' if quick else 'whole'], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise HysteresisError(f'{function.__module__}.{function.__name__} ended with '
                              f'{done.returncode}')
    return json.loads(done.stdout.splitlines()[-1])


def merge(results, new):
    """
    Add one benchmark's numbers to those of the others.

    Parameters
    ----------
    results : dict
        Name to number; it is changed.
    new : mapping
        Name to number.

    Raises
    ------
    HysteresisError
        If a name is taken already, or a value is no finite number.
    """
    for name, value in new.items():
        if name in results:
            raise HysteresisError(f'benchmark {name} is measured twice: give one another name')
        if not math.isfinite(value):
            raise HysteresisError(f'benchmark {name} gave {value}: it has to be a finite number')
        results[name] = round(float(value), 9)


def main(path, quick=False, measure=in_own_process):
    """
    Run all benchmarks, print them as they come, and write them to a file.

    Parameters
    ----------
    path : str
        JSON file to write.
    quick : bool
        Few repetitions, and without what takes long: to see that all of it runs.
    measure : callable
        ``measure(function, quick)`` returns what a benchmark measures.

    Returns
    -------
    int
        Exit status: 0, or 1 when a benchmark failed.
    """
    results = {}
    try:
        functions = discover()
        if not functions:
            raise HysteresisError('no function named *_benchmarks in the folder benchmark')
        for function in functions:
            new = measure(function, quick)
            merge(results, new)
            for name in new:
                print(f'{name:55s} {results[name]:.6g}', flush=True)
    except HysteresisError as error:
        print(f'error: {error}', file=sys.stderr)
        return 1
    Path(path).write_text(json.dumps(results, indent=2) + '\n', encoding='utf-8')
    print(f'{len(results)} numbers in {path}')
    return 0


if __name__ == '__main__':
    parser = argparse.ArgumentParser(prog='python -m benchmark', description='Measure it all.')
    parser.add_argument('--quick', action='store_true',
                        help='few repetitions, and without what takes long')
    parser.add_argument('path', nargs='?', default='benchmark.json', help='JSON file to write')
    args = parser.parse_args()
    sys.exit(main(args.path, args.quick))
