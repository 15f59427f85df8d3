# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What several commands share: reading files, progress, writing results."""

import argparse
from collections.abc import Iterable, Mapping, Sequence
import contextlib
import csv
import io
import json
import math
import shlex
import sys
from typing import Any, TextIO, TYPE_CHECKING, TypeVar

import numpy as np

from hysteresis_ros.atomic import AnyPath, write_text
from hysteresis_ros.cli.outputs import InputPath, OutputFile, OutputFileOrStdout
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import (
    Mapped, Measurement, parse_columns, read_measurement, SETTLED_HOLD)

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.report.provenance import Origin

Item = TypeVar('Item')
# Options that say how recordings are read, as `read_measurement` has them.
READING = ('namespace', 'columns', 'settled', 'settled_time')
# What `ArgumentParser.add_subparsers` returns; argparse has no public name for it.
Subparsers = argparse._SubParsersAction


def one_line(text: object) -> str:
    """Return text as one line that cannot move a terminal's cursor or set its colours."""
    return ''.join(c if c.isprintable() else ' ' for c in ' '.join(str(text).split()))


def numbers(text: str) -> list[int]:
    """
    Read a list of trials: `0,2,5-7`.

    Parameters
    ----------
    text : str

    Returns
    -------
    list of int

    Raises
    ------
    argparse.ArgumentTypeError
        If it is no such list.

    """
    found: list[int] = []
    try:
        for part in text.split(','):
            low, _, high = part.strip().partition('-')
            last = int(high or low)
            if last < int(low) or last - int(low) > 100_000:
                raise ValueError
            found += range(int(low), last + 1)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f'{text!r} is no list of trials such as 0,2,5-7') from None
    return found


def count(text: str) -> int:
    """Return a positive whole number."""
    number = seed(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f'{text!r} is not a positive whole number')
    return number


def seed(text: str) -> int:
    """Return a whole number from 0 on."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'{text!r} is not a whole number from 0 on')
    return int(text)


def seconds(text: str) -> float:
    """Return a positive time [s]."""
    with contextlib.suppress(ValueError):
        if 0.0 < float(text) < math.inf:
            return float(text)
    raise argparse.ArgumentTypeError(f'{text!r} is not a positive number of seconds')


def processes(text: str) -> int:
    """Return a positive number of processes, or -1 for one on each core."""
    return -1 if text == '-1' else count(text)


def add_data(parser: argparse.ArgumentParser, name: str = '--data', required: bool = True) -> None:
    """Add the option that names measurements, and how bags are read."""
    parser.add_argument(name, nargs='+', type=InputPath, required=required, metavar='FILE',
                        help='CSV files or rosbag2 folders')
    parser.add_argument('--namespace', metavar='NS',
                        help='which arm to take from a bag that recorded several')
    add_columns(parser)


def add_columns(parser: argparse.ArgumentParser) -> None:
    """Add the option that says what the columns of a table mean."""
    parser.add_argument('--columns', type=column_map, default=(), metavar='NAME=COLUMN[:UNIT],...',
                        help='what the columns of the tables mean, such as '
                        'angle=theta:deg,time=t_ms; `hysteresis columns` lists names and units')


def column_map(text: str) -> tuple[Mapped, ...]:
    """Read the option `--columns`; argparse.ArgumentTypeError if it makes no sense."""
    try:
        return parse_columns(text)
    except MeasurementError as error:
        raise argparse.ArgumentTypeError(str(error).removeprefix('--columns: ')) from None


def add_model(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the model."""
    parser.add_argument('--model', type=InputPath, required=True, metavar='M.yaml',
                        help='an identified model')


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add the option that writes the result for programs."""
    parser.add_argument('--json', type=OutputFileOrStdout, metavar='J.json',
                        help='write what is printed for programs; - for standard output')


def add_settled(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what is settled, and reduce continuous runs to that."""
    parser.add_argument('--settled', action='store_true',
                        help='of a continuous run take only the ends of its holds')
    parser.add_argument('--settled-time', type=seconds, default=SETTLED_HOLD, metavar='S',
                        help='how long the drive has to be held until muscle and arm have settled; '
                        'rows of a table that are so far apart are settled states '
                        f'(default: {SETTLED_HOLD:g} s)')


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add the option that writes a page."""
    parser.add_argument('--report', type=OutputFile, metavar='R.html',
                        help='write one page with all pictures')


def add_trials(parser: argparse.ArgumentParser, others: str) -> None:
    """Add the option that takes some trials of each recording; `others` says what the rest is."""
    parser.add_argument('--trials', type=numbers, metavar='LIST',
                        help=f'take only these trials of the recordings of --data; {others}')


def divided(measurements: Sequence[Measurement], trials: Sequence[int] | None
            ) -> tuple[list[Measurement], list[Measurement]]:
    """
    Divide recordings by their trials.

    Parameters
    ----------
    measurements : sequence of Measurement
    trials : sequence of int or None
        Those to take; None for all.

    Returns
    -------
    taken, others : list of Measurement

    Raises
    ------
    MeasurementError
        If a recording lacks one of them.

    """
    if trials is None:
        return list(measurements), []
    taken = [one.select(trials) for one in measurements]
    rest = [[trial for trial in one.trials if trial not in trials] for one in measurements]
    return taken, [one.select(names) for one, names in zip(measurements, rest) if names]


def read_all(paths: Sequence[AnyPath], args: argparse.Namespace,
             trials: Sequence[int] | None = None) -> list[Measurement]:
    """
    Read measurements.

    Parameters
    ----------
    paths : sequence of str
    args : argparse.Namespace
        With those of the options that say how recordings are read which the command has.
    trials : sequence of int, optional
        Those to look at.

    Returns
    -------
    list of Measurement

    Raises
    ------
    MeasurementError
        If one cannot be read, lacks a trial, or has no settled states.

    """
    options = {name: value for name, value in vars(args).items() if name in READING}
    return [read_measurement(path, trials=trials, **options)
            for path in progress(paths, 'reading')]


def bench_tables(args: argparse.Namespace) -> tuple[Measurement | None, Measurement | None]:
    """
    Read the tables of --length and --force, which share the option --columns.

    Returns
    -------
    length, force : Measurement or None
        None for what was not given.

    """
    from hysteresis_ros.api import bench_table, BENCH_RESPONSES

    found = []
    for argument in ('length', 'force'):
        path = getattr(args, argument)
        # A force table has no length, so what the option says of it is not meant for it.
        columns = [entry for entry in args.columns
                   if argument == 'length' or entry.name not in BENCH_RESPONSES['length']]
        found.append(None if path is None
                     else bench_table(read_measurement(path, columns=columns), argument))
    return found[0], found[1]


def progress(items: Iterable[Item], what: str, total: int | None = None) -> Iterable[Item]:
    """
    Iterate with a bar on a terminal, silently elsewhere.

    Parameters
    ----------
    items : iterable
    what : str
        Word before the bar.
    total : int, optional

    Returns
    -------
    iterable

    """
    if not sys.stderr.isatty():
        return items
    try:
        from tqdm import tqdm
    except ImportError:
        return items
    return tqdm(items, desc=what, total=total, leave=False, delay=0.5)


class Steps:
    """
    Shows which part of the work goes on, on a terminal.

    Parameters
    ----------
    stream : file, optional
        Standard error by default.

    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = stream or sys.stderr
        self.shown = self.stream.isatty()

    def __call__(self, what: str) -> None:
        """Replace the line by another part's name."""
        if self.shown:
            self.stream.write(f'\r\x1b[K{one_line(what)} ...')
            self.stream.flush()

    def clear(self) -> None:
        """Leave an empty line behind."""
        if self.shown:
            self.stream.write('\r\x1b[K')
            self.stream.flush()


def write_json(path: str, content: Mapping[str, Any]) -> None:
    """
    Write a result for programs.

    Parameters
    ----------
    path : str
        File, or `-` for standard output.
    content : dict
        Plain types; no NaN, which JSON does not have.

    """
    text = json.dumps(content, indent=2, allow_nan=False)
    if path == '-':
        print(text)
    else:
        write_text(path, text + '\n')


def warn(text: str) -> None:
    """Print a warning of one line on standard error, if there is anything to say."""
    if text:
        print(f'hysteresis: warning: {one_line(text)}', file=sys.stderr)


def warn_of_loads(model: 'MuscleModel', measurements: Sequence[Measurement]) -> None:
    """Say where runs of an arm leave the loads that the model was identified under."""
    from hysteresis_ros.report.words import load_in_words

    angles = [m.column('angle') for m in measurements if m.response == 'angle']
    if angles:
        warn(load_in_words(model, np.concatenate(angles)))


def origin(args: argparse.Namespace) -> 'Origin':
    """Return the command that runs, and its options that say how recordings are read."""
    from hysteresis_ros.report.provenance import Origin

    reading: list[str] = []
    if getattr(args, 'namespace', None):
        reading += ['--namespace', args.namespace]
    if getattr(args, 'columns', ()):
        text = io.StringIO()
        csv.writer(text, lineterminator='').writerow(str(entry) for entry in args.columns)
        reading += ['--columns', text.getvalue()]
    if getattr(args, 'settled', False):
        reading.append('--settled')
    if getattr(args, 'settled_time', SETTLED_HOLD) != SETTLED_HOLD:
        reading += ['--settled-time', f'{args.settled_time:g}']
    words = getattr(args, 'words', None)
    return Origin(shlex.join(['hysteresis', *words]) if words else '', tuple(reading))


def say(args: argparse.Namespace, text: str) -> None:
    """Print for a person, unless standard output is a program's."""
    print(text, file=sys.stderr if getattr(args, 'json', None) == '-' else sys.stdout)
