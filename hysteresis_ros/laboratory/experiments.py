# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whole experiments, written as the tables that a user would have. None says what is hidden in it.

============== =====================================================================================
bench          force.csv: trial 0 the damped oscillation, trial 1 random; length.csv: trials 0 to 3
               the damped oscillation under four loads, trials 4 to 7 random; geometry.yaml, where
               the muscle is a wire
bench-dynamic  length.csv: a muscle that is no wire under three loads, steps of all speeds,
               sampled at 5 Hz
arm-steps      train.csv, test.csv: sinusoid, random, staircase, ramps, each step held for 30 s
arm-dynamic    train.csv, test.csv: steps, ramps, a repeated loop and long holds, sampled at 10 Hz
============== =====================================================================================
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import yaml

from hysteresis_ros.atomic import AnyPath, write_text
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import sequences
from hysteresis_ros.laboratory.bench import HOLD
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import bench_of, BRISK, MUSCLES, Plant, SOFT_MUSCLES
from hysteresis_ros.laboratory.soft_bench import SoftBench
from hysteresis_ros.laboratory.wire import Material
from hysteresis_ros.measurements.csv import write_csv
from hysteresis_ros.spelling import unknown

# Weights on the bench with a wire [N].
LOADS = Material.loads
FORCE_STEPS, LENGTH_STEPS = 74, 51
ARM_STEPS = 60
GEOMETRY_FILE = 'geometry.yaml'
# Of a continuous recording on the bench: time between samples, and of a trial [s].
SLOW_SAMPLING, RUN = 0.2, 120.0

Table = dict[str, np.ndarray]


def bench_tables(effects: Mapping[str, float], seed: int,
                 muscle: str = 'grains') -> dict[str, Table]:
    """Return the tables of the bench, by file name."""
    bench = bench_of(seed, effects, muscle=muscle)
    material = bench.material
    name, scale = material.drive, material.highest_drive / sequences.HIGHEST
    rng = np.random.default_rng([seed, 21])
    oscillation = scale * sequences.damped_oscillation()
    force, length = [], []
    for drive in (oscillation, scale * sequences.random_steps(FORCE_STEPS, rng)):
        force.append({'step': np.arange(len(drive)), name: drive,
                      'force': bench.force_trial(drive)})
    for random in (False, True):
        for load in material.loads:
            drive = scale * sequences.random_steps(LENGTH_STEPS, rng) if random else oscillation
            length.append({'step': np.arange(len(drive)), name: drive,
                           'force': np.full(len(drive), load),
                           'length': bench.length_trial(drive, load)})
    return {'force.csv': _stack(force, ['trial', 'step', name, 'force']),
            'length.csv': _stack(length, ['trial', 'step', name, 'force', 'length'])}


def bench_dynamic_tables(effects: Mapping[str, float], seed: int,
                         muscle: str = 'mckibben') -> dict[str, Table]:
    """Return the table of continuous recordings on the bench, by file name."""
    bench = bench_of(seed, effects, muscle=muscle)
    if not isinstance(bench, SoftBench):
        raise ParameterError(f'laboratory: bench-dynamic is for {" and ".join(SOFT_MUSCLES)}, not '
                             f'for {muscle}; record wires on the arm, with arm-dynamic')
    material, rng = bench.material, np.random.default_rng([seed, 24])
    every = round(SLOW_SAMPLING / sequences.SAMPLING)
    length = []
    for load in material.loads[:3]:
        drive = material.highest_drive / sequences.HIGHEST * np.concatenate((
            np.zeros(10), sequences.steps_of_all_speeds(rng, RUN)[::every]))
        length.append({'time': np.round(SLOW_SAMPLING * np.arange(1, len(drive) + 1), 3),
                       material.drive: drive, 'force': np.full(len(drive), load),
                       'length': bench.length_run(SLOW_SAMPLING, drive, load)})
    return {'length.csv': _stack(length, ['time', 'trial', material.drive, 'force', 'length'])}


def arm_step_tables(effects: Mapping[str, float], seed: int,
                    muscle: str = 'grains') -> dict[str, Table]:
    """Return the tables of settled steps of the arm, by file name."""
    kinds = (sequences.sinusoid, sequences.random_moves, sequences.staircase,
             sequences.up_and_down)

    def record(recording: int) -> list[Table]:
        rng = np.random.default_rng([seed, recording, 22])
        plant = Plant(seed, effects, recording=recording, muscle=muscle,
                      recording_time=HOLD * ARM_STEPS * len(kinds))
        return [plant.arm_trial(kind(ARM_STEPS, rng)) for kind in kinds]
    return _recordings(record)


def arm_dynamic_tables(effects: Mapping[str, float], seed: int,
                       muscle: str = 'grains') -> dict[str, Table]:
    """Return the tables of continuous recordings of the arm, by file name."""
    kinds = (sequences.steps_of_all_speeds, sequences.repeated_loop, sequences.ramps,
             sequences.long_holds)

    def record(recording: int) -> list[Table]:
        rng = np.random.default_rng([seed, recording, 23])
        runs = [kind(rng) for kind in kinds]
        plant = Plant(seed, effects, heat_time_constant=BRISK, recording=recording,
                      recording_time=sequences.SAMPLING * sum(len(run) for run in runs),
                      muscle=muscle)
        return [plant.arm_run(np.round(sequences.SAMPLING * np.arange(1, len(run) + 1), 3), run)
                for run in runs]
    return _recordings(record)


def _recordings(record: Callable[[int], list[Table]]) -> dict[str, Table]:
    columns = ['time', 'trial', 'voltage', 'angle', 'ambient_temperature', 'supply_voltage']
    return {f'{name}.csv': _stack(record(recording), columns)
            for recording, name in enumerate(('train', 'test'))}


def _stack(trials: list[Table], columns: list[str]) -> Table:
    trials = [{'trial': np.full(len(next(iter(table.values()))), number), **table}
              for number, table in enumerate(trials)]
    return {name: np.concatenate([table[name] for table in trials]) for name in columns}


EXPERIMENTS = {'bench': bench_tables, 'bench-dynamic': bench_dynamic_tables,
               'arm-steps': arm_step_tables, 'arm-dynamic': arm_dynamic_tables}


def experiment_tables(name: str, effects: Mapping[str, float] | None = None,
                      seed: int = 0, muscle: str = 'grains') -> dict[str, Table]:
    """
    Carry an experiment out and return its tables.

    Parameters
    ----------
    name : str
        A key of `EXPERIMENTS`.
    effects : mapping of str to float
        Strengths of hidden effects. On the bench only those of the wire itself act.
    seed : int
        Of specimen, noise and random sequences.
    muscle : str
        Constitutive model of the wires, a key of `MUSCLES`; for the bench also a muscle that is no
        wire, a key of `SOFT_MUSCLES`.

    Returns
    -------
    dict of str to dict of str to ndarray
        Columns by file name.

    Raises
    ------
    ParameterError
        For an experiment, an effect or a muscle that does not exist, or an effect that the muscle
        cannot have.
    """
    if name not in EXPERIMENTS:
        raise ParameterError(f'laboratory: {unknown("protocol", name, EXPERIMENTS)}')
    return EXPERIMENTS[name](effects or {}, seed, muscle)


def write_experiment(name: str, directory: AnyPath, effects: Mapping[str, float] | None = None,
                     seed: int = 0, muscle: str = 'grains') -> list[Path]:
    """
    Carry an experiment out and write its tables.

    Parameters
    ----------
    name, effects, seed, muscle
        As for `experiment_tables`.
    directory : str or Path
        Made where it is missing.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ParameterError
        For an experiment, an effect or a muscle that does not exist, or an effect that the muscle
        cannot have.
    OSError
        If a file cannot be written.
    """
    tables = experiment_tables(name, effects, seed, muscle)
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    for file, columns in tables.items():
        write_csv(_printable(columns), folder / file)
    files = [folder / file for file in tables]
    if name == 'bench' and muscle in MUSCLES:
        files.append(folder / GEOMETRY_FILE)
        write_text(files[-1], yaml.safe_dump(GEOMETRY, sort_keys=False))
    return files


def _printable(columns: Table) -> Table:
    # What an instrument prints: more digits than it resolves, not all that a float has.
    return {name: values if values.dtype.kind == 'i' else np.round(values, 7)
            for name, values in columns.items()}
