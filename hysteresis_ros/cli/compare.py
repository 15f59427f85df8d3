# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis compare`: model against measurement."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hysteresis_ros.atomic import write_bytes, write_text
from hysteresis_ros.cli.common import (
    add_data, add_json, add_model, add_report, add_settled, add_trials, origin, read_all, say,
    Steps, Subparsers, warn, warn_of_loads, write_json)
from hysteresis_ros.cli.outputs import OutputFolder

if TYPE_CHECKING:
    from hysteresis_ros.comparison.compare import Comparison
    from hysteresis_ros.measurements import Measurement


# Names of the pictures that there can be; see `report.plots.figures`.
PICTURES = ('overlay', 'signals', 'loop', 'waterfall', 'plane', 'since_step', 'correlogram',
            'coverage')


class PicturesFolder(OutputFolder):
    """A folder for the pictures of a comparison."""

    names = tuple(f'{name}.png' for name in PICTURES)


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'compare', help='model against measurement: errors, where it fails, plots',
        description='Simulates the response from the inputs alone and compares it with what was '
        'measured: errors (Eqs. 23 and 24, RMSE) of the model, of each effect added to it, and '
        'of the linear model; where the model fails; pictures.')
    add_model(parser)
    add_data(parser)
    add_settled(parser)
    add_trials(parser, 'the others are not looked at')
    add_json(parser)
    add_report(parser)
    parser.add_argument('--plots', type=PicturesFolder, metavar='DIR',
                        help='write the pictures as PNG files')
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.comparison.compare import compare
    from hysteresis_ros.model import MuscleModel

    steps = Steps()
    model = MuscleModel.load(args.model)
    measurements = read_all(args.data, args, args.trials)
    comparison = compare(model, measurements, steps)
    known = {note for measurement in measurements for note in measurement.warnings}
    steps.clear()
    for note in comparison.warnings:
        if note not in known:
            warn(note)
    warn_of_loads(model, measurements)
    say(args, comparison.to_text())
    if args.plots:
        Path(args.plots).mkdir(parents=True, exist_ok=True)
    if args.json:
        write_json(args.json, comparison.to_dict())
    if args.report or args.plots:
        draw(args, comparison, measurements, steps)


def draw(args: argparse.Namespace, comparison: Comparison, measurements: Sequence[Measurement],
         steps: Steps) -> None:
    """Write the page and the pictures that were asked for."""
    from hysteresis_ros.report.comparison_page import comparison_page, rendered
    from hysteresis_ros.report.plots import figures

    steps('drawing')
    pictures = rendered(figures(comparison))
    if args.plots:
        for name, picture in pictures.items():
            write_bytes(Path(args.plots) / f'{name}.png', picture)
    if args.report:
        write_text(args.report, comparison_page(comparison, pictures, args.model, origin(args),
                                                measurements))
    steps.clear()
