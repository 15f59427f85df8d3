# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis identify`: from bench tables to a model."""

from hysteresis_ros.cli.common import (
    add_json, numbers, progress, read_all, say, Steps, warn, write_json)
from hysteresis_ros.cli.outputs import InputPath, OutputFile
from hysteresis_ros.errors import MeasurementError, ParameterError

OPERATORS = ('two-stage', 'preisach', 'play', 'bouc-wen', 'linear')


def add_parser(subparsers):
    """Declare the command."""
    parser = subparsers.add_parser(
        'identify', help='fit a model to bench tables',
        description='Fits H1 to the force table, H2 to the length table and the linear model to '
        'both, on the trials named, verifies on the others, and prints the rows of Table I.')
    parser.add_argument('--force', type=InputPath, metavar='F.csv', help='force at resting length')
    parser.add_argument('--length', type=InputPath, metavar='L.csv',
                        help='length under constant loads')
    parser.add_argument('--force-trials', type=numbers, metavar='0',
                        help='trials of the force table to fit (default: all)')
    parser.add_argument('--length-trials', type=numbers, metavar='0-3',
                        help='trials of the length table to fit (default: all)')
    parser.add_argument('--geometry', type=InputPath, metavar='G.yaml',
                        help='the arm that the muscle will move')
    parser.add_argument('--levels', nargs=2, type=int, default=(10, 20), metavar=('N1', 'N2'),
                        help='levels of H1 and H2 (default: 10 20)')
    parser.add_argument('--operator', choices=OPERATORS,
                        help='default: two-stage with a force table, preisach without a load, '
                        'else what predicts held-out trials better')
    parser.add_argument('--effects', default='none', metavar='none|auto|A,B',
                        help="effects of the catalogue to add: none (default, the paper's model), "
                        'those that the tables prove (auto), or those named')
    parser.add_argument('--anchored', action='store_true',
                        help='tie H1(0) to the pretension and H2(0) to zero')
    parser.add_argument('-o', '--output', type=OutputFile, required=True, metavar='MODEL.yaml')
    add_json(parser)
    return parser


def run(args):
    """Do it."""
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.identification.bench import identify
    from hysteresis_ros.model.loads import reached_angles
    from hysteresis_ros.report.words import load_in_words

    if args.force is None and args.length is None:
        raise ParameterError('nothing to identify; give --length, --force or both')
    steps = Steps()
    geometry = BicepGeometry.from_yaml(args.geometry) if args.geometry else None
    force = table(args.force, ('force',))
    length = table(args.length, ('length', 'strain'))
    steps('identifying')
    found = identify(length, force, force_trials=args.force_trials,
                     length_trials=args.length_trials, geometry=geometry, levels=args.levels,
                     operator=args.operator, anchored=args.anchored)
    steps.clear()
    model, added = found.model, []
    if args.effects != 'none':
        model, added = with_effects(args, model, force, length)
    model.save(args.output)
    say(args, report(model, found, added))
    if geometry is not None and model.response == 'length':
        warn(load_in_words(model, reached_angles(model)))
    say(args, f'\nWritten to {args.output}')
    if args.json:
        write_json(args.json, {
            'model': args.output, 'kind': model.kind, 'metrics': model.metrics,
            'effects': [effect.to_dict() for effect in model.effects]})


def table(path, responses):
    """Read a bench table and check that it is of the kind that its option asks for."""
    if path is None:
        return None
    measurement, = read_all([path])
    if measurement.response not in responses:
        swapped = measurement.response in ('force', 'length', 'strain')
        raise MeasurementError(
            f'{path}: the table measures {measurement.response}, but {" or ".join(responses)} is '
            'needed here; ' + ('are --force and --length swapped?' if swapped
                               else 'identify takes bench tables'))
    return measurement


def with_effects(args, model, force, length):
    """Add effects to the bench model, fitted to the trials that are fitted."""
    from hysteresis_ros.diagnosis.bench_effects import add_effects

    if length is None:
        raise ParameterError('--effects needs a length table, in which effects of the load show')
    names = None if args.effects == 'auto' else args.effects.split(',')
    return add_effects(model, length, force, names, length_trials=args.length_trials,
                       force_trials=args.force_trials, progress=lambda items, total: progress(
                           items, 'effects', total))


def report(model, found, added):
    """Return the rows of Table I and what the fits say, for a terminal."""
    from hysteresis_ros.comparison.compare import layout
    from hysteresis_ros.report.words import parameters_in_words

    rows = [['Table I', 'mean, model', 'linear', 'std, model', 'linear', 'rows']]
    for name, letter in (('force', 'F'), ('length', 'L')):
        for part, values in model.metrics.get(name, {}).items():
            if not isinstance(values, dict) or 'model' not in values:
                continue
            cells = [values[of][key] for key in ('mean_percent', 'std_percent')
                     for of in ('model', 'linear')]
            rows.append([f'{letter}-q {part}', *(
                '-' if cell is None else f'{cell:.2f} %' for cell in cells), str(values['rows'])])
    lines = layout(rows)
    for name, fit in (('H1', found.force_fit), ('H2', found.length_fit)):
        # With effects H2 was fitted once more; what its first fit said no longer holds.
        if fit is not None and not (added and name == 'H2'):
            lines.append(f'{name}: {len(fit.weights)} weights, rank {fit.rank}, '
                         f'{len(fit.never_excited)} cells never excited, bias {fit.bias:.4g}')
    for effect in added:
        lines.append(f'+ {effect.id}: {parameters_in_words(effect.to_dict()["parameters"])}')
    return '\n'.join(lines)
