# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Run every benchmark and write one flat mapping: `python -m benchmark benchmark.json`.

A benchmark is a function of a module in this folder whose name ends in ``_benchmarks``. It takes
nothing and returns a mapping from a name, with its unit as suffix, to a number.
"""

from importlib import import_module
import json
import math
from pathlib import Path
import pkgutil
import sys

import benchmark
from hysteresis_ros.errors import HysteresisError


def discover():
    """Return the benchmark functions of this folder's modules, in the order of their names."""
    functions = []
    for module in sorted(info.name for info in pkgutil.iter_modules(benchmark.__path__)):
        if module == '__main__':
            continue
        contents = vars(import_module(f'benchmark.{module}'))
        functions += [function for name, function in contents.items()
                      if name.endswith('_benchmarks') and callable(function)]
    return functions


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


def main(path):
    """
    Run all benchmarks, print them as they come, and write them to a file.

    Parameters
    ----------
    path : str
        JSON file to write.

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
            new = function()
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
    sys.exit(main(sys.argv[1]))
