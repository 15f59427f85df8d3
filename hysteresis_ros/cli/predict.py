# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis predict`: the response to a recording's inputs."""

import argparse

from hysteresis_ros.cli.common import add_data, add_model, read_all, Subparsers
from hysteresis_ros.cli.outputs import OutputFile


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'predict', help="simulate the response to a recording's inputs",
        description='Adds predicted_force, predicted_length, predicted_strain or predicted_angle '
        'to a table, simulated from its inputs alone with the memory wiped before each trial.')
    add_model(parser)
    add_data(parser)
    parser.add_argument('--method', choices=('preisach', 'linear'), default='preisach',
                        help='the hysteresis model with its effects (default), or the linear one')
    parser.add_argument('-o', '--output', type=OutputFile, required=True, metavar='OUT.csv')
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.errors import ParameterError
    from hysteresis_ros.measurements import write_csv
    from hysteresis_ros.model import MuscleModel

    if len(args.data) > 1:
        raise ParameterError('predict takes one measurement; call it once for each')
    model = MuscleModel.load(args.model)
    measurement, = read_all(args.data, args)
    predicted = model.predict(measurement, method=args.method)
    write_csv({**measurement.columns, f'predicted_{measurement.response}': predicted},
              args.output)
    print(f'{args.output}: {measurement.rows} rows with predicted_{measurement.response}')
