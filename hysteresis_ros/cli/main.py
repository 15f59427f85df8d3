# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line `hysteresis`: finds the command, reports errors in one line."""

import argparse
from collections.abc import Sequence
import atexit
import gc
import importlib.util
import os
import sys
from typing import TextIO
import warnings

from hysteresis_ros import __version__
from hysteresis_ros.cli.common import one_line
from hysteresis_ros.cli.outputs import check_paths
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.measurements import MeasurementWarning

COMMANDS = ('identify', 'compare', 'diagnose', 'extend', 'invert', 'predict', 'simulate',
            'effects', 'columns', 'operators', 'table1', 'demo', 'studio')

PACKAGE = 'hysteresis_ros'

DONE, FAILED, INTERRUPTED = 0, 1, 130
# Objects that are made between two looks for cycles of them; some ten megabytes.
SELDOM = 100_000


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run one command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the name of the program; those of the process by default.

    Returns
    -------
    int
        0 done, 1 it could not be done (one line on standard error says why). Wrong usage leaves
        through SystemExit with status 2.

    """
    if arguments is None:
        # A process of its own, which makes many objects and few cycles: to look for these as often
        # as usual takes a twentieth of its time.
        gc.set_threshold(SELDOM)
        # Else Python looks through all modules, too, before it ends: a third of a second.
        atexit.register(gc.freeze)
        arguments = sys.argv[1:]
    parser = build_parser(arguments)
    args = parser.parse_args(arguments)
    args.words = list(arguments)
    with warnings.catch_warnings():
        warnings.simplefilter('always', MeasurementWarning)
        warnings.showwarning = show_warning
        try:
            check_paths(args)
            return args.run(args) or DONE
        except BrokenPipeError:
            # The reader of our output has left; nothing more can be said to it.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except (HysteresisError, OSError) as error:
            print(f'hysteresis {args.command}: error: {one_line(described(error))}',
                  file=sys.stderr)
            return FAILED
        except ModuleNotFoundError as error:
            if (error.name or PACKAGE).split('.')[0] == PACKAGE:
                raise
            print(f'hysteresis {args.command}: error: the Python package {error.name} is not '
                  f'installed; pip install {error.name}', file=sys.stderr)
            return FAILED
        except KeyboardInterrupt:
            print(f'hysteresis {args.command}: interrupted', file=sys.stderr)
            return INTERRUPTED


def build_parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    """
    Return the parser; only the command that is called is imported.

    Parameters
    ----------
    arguments : list of str

    Returns
    -------
    argparse.ArgumentParser

    """
    parser = argparse.ArgumentParser(
        prog='hysteresis', description='Hysteresis models of artificial muscles: identify them, '
        'compare them with measurements, and find the physics that they miss.',
        epilog='hysteresis COMMAND --help explains a command.')
    parser.add_argument('--version', action='version', version=f'hysteresis_ros {__version__}')
    subparsers = parser.add_subparsers(dest='command', metavar='COMMAND', required=True)
    called = next((word for word in arguments if not word.startswith('-')), None)
    for name in [called] if called in COMMANDS else COMMANDS:
        if importlib.util.find_spec(f'hysteresis_ros.cli.{name}') is None:
            continue
        command = importlib.import_module(f'hysteresis_ros.cli.{name}')
        command.add_parser(subparsers).set_defaults(run=command.run)
    return parser


def described(error: BaseException) -> str:
    """Return what an error says; for one of the system the file comes first."""
    if isinstance(error, IsADirectoryError) and error.filename:
        return f'{error.filename}: is a folder; name a file'
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f'{error.filename}: {error.strerror}'
    return str(error) or type(error).__name__


def show_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int,
                 file: TextIO | None = None, line: str | None = None) -> None:
    """Print a warning in one line; ours without the place in the code."""
    where = '' if issubclass(category, MeasurementWarning) else f'{filename}:{lineno}: '
    print(f'hysteresis: warning: {one_line(where + str(message))}', file=sys.stderr)
