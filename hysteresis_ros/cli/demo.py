# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis demo`: the whole system on the simulated arm, from the bench to the comparison."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
import dataclasses
from pathlib import Path
import shutil
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.atomic import AnyPath, write_bytes, write_text
from hysteresis_ros.cli.common import (
    add_json, count, progress, say, seed, Subparsers, write_json)
from hysteresis_ros.cli.outputs import OutputFolder
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.measurements import Measurement, settled_rows
from hysteresis_ros.spelling import unknown

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel

# Angles of the arm [rad], shape (n,), by the name of the sequence.
Angles = dict[str, np.ndarray]

VALUES = 40
# Says that the demo may remove its own entries of this folder; others are never touched.
MARK = '.hysteresis_demo'
ENTRIES = ('bench', 'model.yaml', 'run', 'run.log', 'extended.yaml', 'run_extended',
           'run_extended.log', 'demo.png')


class DemoFolder(OutputFolder):
    """The folder of a demo, with what it writes there."""

    names = (MARK, *ENTRIES)


# Time for which a target is held [s]: until the arm rests, or while it is still on its way, at
# which the arm's time may not run much faster than the nodes can follow.
SETTLED_HOLD = 30.0
PASSING_HOLD, PASSING_SPEED = 6.0, 12.0
# The arm's time against the wall clock's.
SIMULATED_SPEED = 60.0
# The port with the firmware in simavr. A chip in software is slow, so that it is driven through a
# few targets, after short cycles of heating and cooling.
AVR = 'avr://'
AVR_SPEED, AVR_VALUES = 0.8, 4
AVR_CYCLE = {'initialise_heat_time': 10.0, 'initialise_cool_time': 30.0}
LATEST_ANGLE = 5.0      # s; --hidden latency makes them late


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'demo', help='the whole system on the simulated arm',
        description='Identifies the simulated bench, drives the simulated arm with the three nodes '
        'as processes through a sinusoidal and a random sequence of target angles, records a '
        'rosbag2 bag, reads it back, and compares: the rows of Table I for the arm. With --hidden '
        'a physical effect is hidden in the arm, found, added to the model, and the arm driven '
        'again.')
    parser.add_argument('-o', '--output', type=DemoFolder, default='demo', metavar='DIR',
                        help='folder for everything that is written (default: demo)')
    parser.add_argument('--seed', type=seed, default=1, metavar='S', help='of arm and sequences')
    parser.add_argument('--speed', type=float, metavar='X',
                        help="the arm's time against the wall clock's (default: 60)")
    parser.add_argument('--port', metavar='PORT',
                        help='avr://, the firmware for the board in simavr, at --speed 0.8 and '
                        'with 4 --values unless others are given; default: the simulated board')
    parser.add_argument('--values', type=count, metavar='N',
                        help='targets in each sequence (default: 40)')
    parser.add_argument('--effects', choices=('none', 'auto'), default='none',
                        help="none: the paper's model (default); auto: with what the bench proves")
    parser.add_argument('--hidden', metavar='EFFECT', nargs='?', const='random',
                        help='hide an effect in the arm; without a name one is drawn by the seed '
                        'and told at the end')
    parser.add_argument('--strength', type=float, default=1.0, help=argparse.SUPPRESS)
    add_json(parser)
    return parser


# Effects whose inverse makes the arm better: in settled steps, and on its way. One is drawn.
SETTLED = ('payload_error', 'supply_sag', 'encoder_offset', 'coulomb_friction', 'frame_tilt',
           'airflow', 'backlash')
PASSING = ('thermal_lag', 'heating_cooling_asymmetry')


@dataclasses.dataclass
class Pace:
    """
    How fast the targets follow each other.

    Attributes
    ----------
    hold : float
        Time for each target [s of the arm's clock].
    speed : float
        The arm's time against the wall clock's.
    settled : bool
        Whether only rows count in which the arm rests.
    """

    hold: float
    speed: float
    settled: bool

    def rows(self, bag: Measurement) -> Measurement:
        """Return what is compared and diagnosed of a recording."""
        return (settled_rows(bag) or bag) if self.settled else bag


def pace_of(args: argparse.Namespace, hidden: str | None) -> Pace:
    """Return a pace at which the hidden effect matters."""
    if hidden in PASSING:
        return Pace(PASSING_HOLD, min(args.speed, PASSING_SPEED), False)
    return Pace(SETTLED_HOLD, args.speed, True)


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.comparison.compare import compare
    from hysteresis_ros.measurements import read_measurement

    if args.port not in (None, AVR):
        raise ParameterError(f'--port {args.port}: the demo knows {AVR}, and the simulated board '
                             'without --port')
    if args.speed is None:
        args.speed = AVR_SPEED if args.port else SIMULATED_SPEED
    if args.values is None:
        args.values = AVR_VALUES if args.port else VALUES
    if args.port and (args.hidden or args.speed > 1.2):
        raise ParameterError(f'--port {AVR}: without --hidden, and no faster than --speed 1.2')
    if args.values < 4:
        raise ParameterError('--values must be at least 4')
    if not 0.1 <= args.speed <= 200.0:
        raise ParameterError('--speed must be from 0.1 to 200')
    hidden = drawn(args)
    pace = pace_of(args, hidden)
    folder = Path(args.output)
    prepare(folder)
    model = bench_model(args, folder)
    sequences = target_sequences(model, args)
    result: dict[str, Any] = {'runs': []}
    runs = drive(args, folder / 'run', sequences, folder / 'model.yaml', hidden, pace)
    result['runs'].append(summary('the identified model', sequences, runs))
    linear = linear_runs(args, model, sequences, hidden, pace)
    result['linear'] = summary('the linear model', sequences, linear)
    say(args, table(result))
    data = [pace.rows(read_measurement(folder / 'run'))]
    comparison = compare(model, data)
    say(args, '\n' + comparison.to_text())
    again = None
    if hidden:
        again = find_and_extend(args, folder, model, sequences, data, hidden, pace, result)
    draw(folder / 'demo.png', sequences, runs, linear, again, pace)
    say(args, f'\nPicture: {folder / "demo.png"}; recording: {folder / "run"} (rosbag2, mcap)')
    if args.json:
        write_json(args.json, result)


def prepare(folder: Path) -> None:
    """Make the folder, or remove what an earlier demo wrote into it and nothing else."""
    if folder.exists() and not (folder / MARK).exists() and any(folder.iterdir()):
        raise ParameterError(f'{folder}: not empty and not a demo; name another folder with -o')
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / MARK, 'Written by `hysteresis demo`, which replaces its files here.\n')
    for entry in (folder / name for name in ENTRIES):
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink(missing_ok=True)


def bench_model(args: argparse.Namespace, folder: Path) -> MuscleModel:
    """Identify the simulated bench and save the model."""
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.identification.bench import identify
    from hysteresis_ros.diagnosis.bench_effects import add_effects
    from hysteresis_ros.laboratory.experiments import write_experiment
    from hysteresis_ros.measurements import read_measurement

    write_experiment('bench', folder / 'bench', {}, args.seed)
    force, length = (read_measurement(folder / 'bench' / name)
                     for name in ('force.csv', 'length.csv'))
    model = identify(length, force, force_trials=[0], length_trials=range(4),
                     geometry=BicepGeometry.from_yaml(folder / 'bench' / 'geometry.yaml')).model
    if args.effects == 'auto':
        model, _ = add_effects(model, length, force, length_trials=range(4), force_trials=[0],
                               jobs=-1)
    model.save(folder / 'model.yaml')
    say(args, 'Bench identified: ' + ', '.join(
        f'{name} {part} {values[part]["model"]["mean_percent"]:.2f} %'
        for name, values in model.metrics.items() for part in values if 'model' in values[part]))
    return model


def drawn(args: argparse.Namespace) -> str | None:
    """Return the effect to hide, or None."""
    from hysteresis_ros.laboratory.hidden_physics import EFFECTS

    if args.hidden is None or args.hidden in EFFECTS:
        return args.hidden
    if args.hidden != 'random':
        raise ParameterError(f'--hidden: {unknown("effect", args.hidden, EFFECTS)}')
    return str(np.random.default_rng([args.seed, 77]).choice([*SETTLED, *PASSING]))


def target_sequences(model: MuscleModel, args: argparse.Namespace) -> Angles:
    """Return the sinusoidal and the random sequence [rad], inside what the muscle reaches."""
    from hysteresis_ros.measurements.table import Measurement

    limits = np.array([0.0, model.ranges['voltage'][1]])
    ends = model.predict(Measurement.from_columns(
        {'time': [30.0, 60.0], 'trial': [0.0, 0.0], 'voltage': limits, 'angle': [0.0, 0.0]}))
    margin = 0.06 * np.ptp(ends)
    low, high = ends.min() + margin, ends.max() - margin
    phase = 2.0 * np.pi * np.arange(args.values) / args.values * 2.0
    sinusoid = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(phase)
    rng = np.random.default_rng([args.seed, 78])
    return {'sinusoidal': sinusoid, 'random': rng.uniform(low, high, args.values)}


def drive(args: argparse.Namespace, folder: Path, sequences: Angles, model_file: AnyPath,
          hidden: str | None, pace: Pace) -> Angles:
    """Drive the arm with the three nodes and return the angles reached, by sequence."""
    try:
        from hysteresis_ros.nodes.session import record
    except ImportError as error:
        raise ParameterError(f'the demo needs ROS 2: {error}; run it with `make demo`') from None

    port = f'sim://bicep?speed={pace.speed:g}&seed={args.seed}'
    if hidden:
        port += f'&{hidden}={args.strength:g}'
    own: dict[str, Any] = {}
    if args.port:
        from hysteresis_ros.laboratory.plant import Plant

        port = f'{AVR}bicep?speed={pace.speed:g}&seed={args.seed}'
        # The chip counts from where the arm is when it is switched on.
        own = {'encoder_zero': float(Plant(args.seed).arm.angle), **AVR_CYCLE}
    parameters = {
        'port': port, 'model_file': str(Path(model_file).resolve()), 'use_sim_time': True,
        'telemetry_rate': 2.0, 'horizon': min(5.0, 0.7 * pace.hold),
        'republish_period': min(5.0, pace.hold / 6.0), 'setpoint_timeout': 60.0,
        'telemetry_timeout': 30.0, 'board_watchdog': 30.0, 'angle_latency': LATEST_ANGLE,
        **own}
    steps = iter(progress(range(len(sequences) * args.values), 'driving',
                          len(sequences) * args.values))
    reached = record(folder, list(sequences.values()), parameters, pace.hold,
                     lambda: next(steps, None))
    return dict(zip(sequences, reached))


def linear_runs(args: argparse.Namespace, model: MuscleModel, sequences: Angles,
                hidden: str | None, pace: Pace) -> Angles:
    """Apply the linear model's voltages to the same simulated arm, without nodes."""
    from hysteresis_ros.laboratory.plant import Plant

    geometry, line = model.require_geometry(), model.linear
    if line is None:
        raise ParameterError('the model has no linear part; identify it again')
    low, high = model.ranges['voltage']
    reached = {}
    for name, targets in sequences.items():
        voltages = np.clip(line.drive_for_length(
            geometry.length(targets), geometry.force(targets)), low, high)
        plant = Plant(args.seed, {hidden: args.strength} if hidden else {})
        reached[name] = plant.arm_trial(voltages, hold=pace.hold)['angle']
    return reached


def summary(name: str, sequences: Angles, runs: Angles) -> dict[str, Any]:
    """Errors of one way of driving [deg]: Eqs. 23 and 24 without the division by the range."""
    rows = {}
    for sequence, targets in sequences.items():
        error = np.degrees(runs[sequence] - targets)
        rows[sequence] = {'mean_deg': float(np.mean(np.abs(error))),
                          'std_deg': float(np.std(error))}
    return {'driven_by': name, **rows}


PAPER = {'sinusoidal': (1.8, 0.8, 3.4, 1.7), 'random': (1.6, 1.1, 4.2, 2.9)}


def table(result: Mapping[str, Any]) -> str:
    """Return Table I's rows for the arm."""
    from hysteresis_ros.comparison.compare import layout

    rows = [['arm [deg]', 'mean, model', 'std', 'mean, linear', 'std', 'paper: mean', 'std',
             'linear', 'std']]
    for name, paper in PAPER.items():
        ours, linear = result['runs'][-1][name], result['linear'][name]
        rows.append([name, *(f'{value:.2f}' for value in (
            ours['mean_deg'], ours['std_deg'], linear['mean_deg'], linear['std_deg'])),
            *(f'{value:.1f}' for value in paper)])
    return '\n'.join(layout(rows))


def find_and_extend(args: argparse.Namespace, folder: Path, model: MuscleModel, sequences: Angles,
                    data: list[Measurement], hidden: str, pace: Pace,
                    result: dict[str, Any]) -> Angles | None:
    """Diagnose the recording, extend the model, drive again; return the angles reached then."""
    from hysteresis_ros.cli.diagnose import to_text
    from hysteresis_ros.diagnosis.diagnose import diagnose
    from hysteresis_ros.diagnosis.extend import extend

    found = diagnose(model, data, jobs=-1,
                     progress=lambda items, total: progress(items, 'effects', total))
    say(args, '\n' + to_text(found, 'angle'))
    again = None
    result['found'] = found.missing
    if found.missing:
        extension = extend(model, found.missing, data, force=True)
        extension.model.save(folder / 'extended.yaml')
        again = drive(args, folder / 'run_extended', sequences, folder / 'extended.yaml', hidden,
                      pace)
        result['runs'].append(summary('the extended model', sequences, again))
        say(args, '\nDriven again with the extended model:\n' + table(result))
    result['hidden'] = hidden
    say(args, f'\nHidden was: {hidden}')
    return again


def draw(path: Path, sequences: Angles, runs: Angles, linear: Angles, again: Angles | None,
         pace: Pace) -> None:
    """Save the picture: targets and angles reached, and the errors with their means."""
    from hysteresis_ros.report.drawing import new_figure, png

    made = new_figure(10.0, 6.2, 2, len(sequences), sharex='col')
    figure, axes = made[0], np.asarray(made[1]).reshape(2, -1)
    styles = [('linear model', linear, '#b0b0b0'), ('identified model', runs, '#1f77b4')]
    if again is not None:
        styles.append(('extended model', again, '#2ca02c'))
    for (name, targets), (upper, lower) in zip(sequences.items(), axes.T):
        index = np.arange(1, len(targets) + 1)
        upper.step(index, np.degrees(targets), where='mid', color='black', lw=1.2, label='target')
        for label, angles, colour in styles:
            error = np.degrees(angles[name] - targets)
            style = {'marker': 'o', 'ms': 3, 'lw': 0.8, 'color': colour}
            upper.plot(index, np.degrees(angles[name]), label=label, **style)
            lower.plot(index, error, label=f'{np.mean(np.abs(error)):.2f} deg', **style)
        lower.axhline(0.0, color='black', lw=0.8)
        upper.set_title(f'{name} sequence, {len(targets)} values held for {pace.hold:g} s', pad=20)
        # Legends stand above the axes, where they cover no point.
        above = {'loc': 'lower center', 'bbox_to_anchor': (0.5, 0.98), 'frameon': False,
                 'fontsize': 8, 'title_fontsize': 8, 'handlelength': 1.3, 'columnspacing': 1.2}
        upper.legend(ncol=1 + len(styles), **above)
        lower.legend(ncol=len(styles), title='mean error', **above)
        lower.set_xlabel('index')
    axes[0, 0].set_ylabel('angle [deg]')
    axes[1, 0].set_ylabel('error [deg]')
    write_bytes(path, png(figure))
