# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the virtual laboratory: sequences and the tables that they write."""

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import (
    EFFECTS, experiment_tables, GEOMETRY, sequences, write_experiment)
from hysteresis_ros.laboratory.experiments import LOADS
from hysteresis_ros.measurements.csv import read_csv
import numpy as np
import pytest
import yaml


def test_damped_oscillation():
    """Fig. 7(a): 37 steps from 0 V over the whole range, swings that shrink."""
    voltages = sequences.damped_oscillation()
    assert len(voltages) == 37 and voltages[0] == 0.0 and voltages.max() == 6.0
    turns = np.flatnonzero(np.diff(np.sign(np.diff(voltages))) != 0) + 1
    swings = np.abs(np.diff(voltages[turns]))
    assert len(turns) >= 7 and np.all(np.diff(swings) < 0.0)


@pytest.mark.parametrize('kind', [sequences.sinusoid, sequences.random_moves, sequences.staircase,
                                  sequences.up_and_down, sequences.random_steps])
def test_step_sequences(kind):
    """As many as asked for, inside the range, the same for the same seed."""
    voltages = [kind(60, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert voltages[0].shape == (60,)
    assert 0.0 <= voltages[0].min() and voltages[0].max() <= 6.0
    np.testing.assert_array_equal(voltages[0], voltages[1])
    assert np.any(voltages[0] != voltages[2])


def test_continuous_sequences():
    """Fast and slow steps, ramps of all rates, the same loop again, holds of over 100 s."""
    rng = np.random.default_rng(3)
    steps = sequences.steps_of_all_speeds(rng)
    holds = np.diff(np.flatnonzero(np.diff(steps)))
    assert holds.min() < 25 and holds.max() > 100
    rates = np.abs(np.diff(sequences.ramps(rng))) / sequences.SAMPLING
    assert np.any((rates > 0.03) & (rates < 0.1)) and np.any(rates > 0.8)
    loop = sequences.repeated_loop(rng)
    period = (len(loop) - 40) // 6
    np.testing.assert_array_equal(loop[40:40 + period], loop[-period:])
    holding = sequences.long_holds(rng)
    edges = np.flatnonzero(np.diff(holding))
    assert edges[0] >= 1000 and len(holding) - edges[-1] >= 1000


def test_bench_tables(tmp_path):
    """Force and length tables with the paper's numbers of steps, and the geometry."""
    files = write_experiment('bench', tmp_path / 'new', seed=3)
    assert [file.name for file in files] == ['force.csv', 'length.csv', 'geometry.yaml']
    force, length = read_csv(files[0]), read_csv(files[1])
    assert (force.kind, force.response, force.rows) == ('bench', 'force', 37 + 74)
    assert (length.kind, length.response, length.rows) == ('bench', 'length', 4 * (37 + 51))
    trials = length.column('trial')
    for trial in range(8):
        assert np.unique(length.column('force')[trials == trial]) == LOADS[trial % 4]
    assert 3.136 in LOADS
    assert yaml.safe_load(files[2].read_text()) == GEOMETRY


@pytest.mark.parametrize(('name', 'least', 'most'), [('arm-steps', 220, 260),
                                                     ('arm-dynamic', 6000, 12000)])
def test_arm_tables(tmp_path, name, least, most):
    """Two recordings of several trials each, settled ones 30 s apart, others at 10 Hz."""
    files = write_experiment(name, tmp_path)
    assert [file.name for file in files] == ['train.csv', 'test.csv']
    for file in files:
        table = read_csv(file)
        assert (table.kind, table.response) == ('arm', 'angle')
        assert table.settled == (name == 'arm-steps')
        assert least <= table.rows <= most
        assert list(table.columns) == ['time', 'trial', 'voltage', 'angle', 'ambient_temperature',
                                       'supply_voltage']
        assert len(table.trials) >= 4
        for _, rows in table.split():
            step = np.diff(table.time[rows])
            np.testing.assert_allclose(step, 30.0 if name == 'arm-steps' else 0.1, atol=1e-6)
        angle = np.degrees(table.column('angle'))
        assert 90.0 < angle.min() < 97.0 and 139.0 < angle.max() < 145.0
        assert abs(np.mean(table.column('ambient_temperature')) - 22.0) < 0.05
        assert abs(np.mean(table.column('supply_voltage')) - 12.0) < 0.01


@pytest.mark.parametrize('name', [
    'bench', pytest.param('arm-steps', marks=pytest.mark.long)])
def test_same_seed_same_tables(name):
    """The tables are those of the seed; train and test differ."""
    tables = [experiment_tables(name, {'creep': 0.4}, seed) for seed in (6, 6, 7)]
    for file, columns in tables[0].items():
        for column, values in columns.items():
            np.testing.assert_array_equal(values, tables[1][file][column])
    file = list(tables[0])[-1]
    assert np.any(tables[0][file]['voltage'] != tables[2][file]['voltage'])
    if name != 'bench':
        assert np.any(tables[0]['train.csv']['voltage'] != tables[0]['test.csv']['voltage'])


def test_files_do_not_name_the_hidden_effects(tmp_path):
    """Neither names nor headers nor the drive say which effect is hidden."""
    texts = []
    for effects in ({}, {'payload_error': 1.0}):
        files = write_experiment('arm-steps', tmp_path / str(len(effects)), effects, seed=1)
        texts.append([file.read_text() for file in files])
    for plain, hidden in zip(*texts):
        assert plain != hidden
        assert plain.splitlines()[0] == hidden.splitlines()[0]
        assert not any(name in hidden for name in EFFECTS if name != 'ambient_temperature')
        drive = [[line.split(',')[:3] for line in text.splitlines()] for text in (plain, hidden)]
        assert drive[0] == drive[1]


def test_unknown_experiments_are_refused(tmp_path):
    """The message lists those that exist, and nothing is written."""
    with pytest.raises(ParameterError, match='arm-dynamic'):
        write_experiment('dance', tmp_path / 'none')
    assert not (tmp_path / 'none').exists()
