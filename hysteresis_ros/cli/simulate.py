# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis simulate`: measurements of the virtual laboratory."""

import argparse
import math

from hysteresis_ros.cli.common import Subparsers
from hysteresis_ros.cli.outputs import OutputFolder

DESCRIPTION = """\
Carries out an experiment in the virtual laboratory, on physics that shares nothing with the
models, and writes the tables that a user would have. No file says what was hidden in it.
"""


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    from hysteresis_ros.laboratory.muscles import MUSCLES, SOFT_MUSCLES

    soft = ' or '.join(SOFT_MUSCLES)
    parser = subparsers.add_parser(
        'simulate', help='measurements of the virtual laboratory', description=DESCRIPTION)
    parser.add_argument('protocol', metavar='PROTOCOL',
                        help=f'bench, arm-steps, arm-dynamic; of {soft} also bench-dynamic')
    parser.add_argument('-o', '--output', type=OutputFolder, required=True, metavar='DIR')
    parser.add_argument('--effect', action='append', default=[], type=effect,
                        metavar='NAME[=STRENGTH]',
                        help='hide an effect; strength 1 is strong (default), 0.4 weak')
    parser.add_argument('--muscle', default='grains', metavar='MODEL',
                        help=f'constitutive model of the wires: {", ".join(MUSCLES)} (default: '
                        f'grains); for the bench also {soft}, which are no wires')
    parser.add_argument('--seed', type=seed, default=0,
                        help='of specimen, noise and random sequences')
    return parser


def effect(text: str) -> tuple[str, float]:
    """Read `NAME` or `NAME=strength`."""
    name, given, strength = text.partition('=')
    try:
        value = float(strength) if given else 1.0
    except ValueError:
        value = math.nan
    if not name or not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'{text!r} is not NAME or NAME=strength')
    return name, value


def seed(text: str) -> int:
    """Read a number that can start a random sequence."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'{text!r} is no whole number from 0 up')
    return int(text)


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.laboratory.experiments import write_experiment

    for path in write_experiment(args.protocol, args.output, dict(args.effect), args.seed,
                                 args.muscle):
        print(path)
