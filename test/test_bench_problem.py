# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The rows of a bench: which count less, and what one left out is off by."""

import dataclasses

import numpy as np
import pytest

from hysteresis_ros.diagnosis import bench_problem
from hysteresis_ros.diagnosis.bench_design import operator_with
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.extend import extended_model
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.laboratory.plant import bench_of
from hysteresis_ros.laboratory.sequences import random_moves
from hysteresis_ros.measurements import Measurement

TRIALS = {'length_trials': range(4), 'force_trials': [0]}
USUAL = ['stress_dependence', 'stress_dependent_strain', 'series_compliance']


@pytest.fixture(scope='module')
def tables():
    """Return lengths and forces of a bench."""
    return [Measurement.from_columns(bench_tables({}, 11)[name])
            for name in ('length.csv', 'force.csv')]


@pytest.fixture(scope='module')
def model(tables):
    """Return a model of it with what every loaded muscle has."""
    return add_effects(identify(*tables, **TRIALS).model, *tables, USUAL, **TRIALS)[0]


def problem_of(model, tables, off=0.0):
    """Return the rows, those of the third load jumping to and fro at random."""
    fitted = tables[0].select(range(4))
    columns = {name: np.array(values) for name, values in fitted.columns.items()}
    jumps = np.random.default_rng(1).choice([-off, off], len(columns['length']))
    columns['length'] = columns['length'] + jumps * (columns['trial'] == 2.0)
    bare = dataclasses.replace(model, effects=[], replicates=[])
    return problem_for(bare, [Measurement.from_columns(columns)])


def test_loads_that_are_fitted_well_count_alike(model, tables):
    problem = problem_of(model, tables)
    balanced = problem.balanced(model.effects)
    assert np.ptp(balanced.emphasis) == 0.0
    assert balanced.simulate(model.effects) == pytest.approx(problem.simulate(model.effects))


def test_a_load_that_is_off_counts_less(model, tables):
    clean, problem = problem_of(model, tables), problem_of(model, tables, 2e-3)
    balanced = problem.balanced(model.effects)
    third = problem.trial == 2
    assert np.mean(balanced.emphasis ** 2) == pytest.approx(1.0)
    assert np.ptp(balanced.emphasis[third]) == 0.0
    assert balanced.emphasis[third][0] < 0.4 * balanced.emphasis[~third].min()
    # The others are as they were before, in the search and in the model.
    errors = [np.std((one.simulate(model.effects) - clean.measured)[~third])
              for one in (clean, problem, balanced)]
    assert errors[0] < errors[2] < 0.5 * errors[1]
    whole = [one.completed(model.effects).predict(tables[0].select(range(4)))
             for one in (clean, problem, balanced)]
    errors = [np.std((one - clean.measured)[~third]) for one in whole]
    assert errors[2] < 0.6 * errors[1]


def test_rows_that_are_not_fitted_do_not_decide_what_counts(model, tables):
    train = problem_of(model, tables).trial != 2
    one, other = (problem_of(model, tables, off).balanced(model.effects, train)
                  for off in (0.0, 2e-3))
    assert one.emphasis[train] == pytest.approx(other.emphasis[train])
    assert np.ptp(problem_of(model, tables, 2e-3).balanced(model.effects).emphasis[train]) > 0.1


def test_a_row_left_out_is_off_by_more_the_more_rows_the_weights_follow(model, tables):
    """The share that they follow is how far they go with each row, on average."""
    problem = problem_of(model, tables)
    predicted = problem.simulate(model.effects)
    step, followed = 1e-7, []
    for row, measured in enumerate(problem.measured.copy()):
        problem.measured[row] = measured + step
        followed.append((problem.simulate(model.effects) - predicted)[row] / step)
        problem.measured[row] = measured
    error = np.sqrt(np.mean((problem.measured - predicted) ** 2))
    expected = error / (1.0 - np.mean(followed))
    assert problem.left_out_rmse(model.effects) == pytest.approx(expected, rel=0.02)
    assert 0.05 < np.mean(followed) < 0.5


def test_weights_follow_what_lies_between_the_rows():
    """Better than those that are chosen for trials left out, at voltages that were not fitted."""
    lengths, forces = (Measurement.from_columns(bench_tables({}, 11, 'lagoudas')[name])
                       for name in ('length.csv', 'force.csv'))
    model = add_effects(identify(lengths, forces, **TRIALS).model, lengths, forces,
                        [*USUAL, 'transformation_slopes'], **TRIALS)[0]
    fitted = lengths.select(range(4))
    problem = problem_for(dataclasses.replace(model, effects=[], replicates=[]), [fitted])
    fit, design = problem.fit_stage(model.effects, problem.levels)
    by_trials = dataclasses.replace(model, replicates=[], length_stage=operator_with(
        design.nodes, fit.weights, fit.bias))
    plant, loads = bench_of(11, muscle='lagoudas'), np.unique(fitted.column('force'))
    moves = random_moves(4 * 60, np.random.default_rng(4))
    others = Measurement.from_columns({
        'trial': np.repeat(np.arange(4.0), 60), 'step': np.tile(np.arange(60.0), 4),
        'voltage': moves, 'force': np.repeat(loads, 60), 'length': np.concatenate([
            plant.length_trial(part, load) for part, load in zip(np.split(moves, 4), loads)])})

    def off(one):
        return np.sqrt(np.mean((one.predict(others) - others.column('length')) ** 2))
    completed = problem.completed(model.effects)
    assert off(completed) < 0.8 * off(by_trials)
    # Those of a replicate are found alike.
    stage = completed.length_stage
    again = problem.stage(model.effects, len(stage.nodes) - 1, problem.trial >= 0)
    assert again.weights == pytest.approx(stage.weights, rel=1e-6, abs=1e-9 * stage.weights.max())
    # What trials left out are off by is told by weights that suit these.
    assert completed.metrics['length']['left_out']['rmse'] in [
        problem.fit_stage(model.effects, round(factor * problem.levels))[0].held_out_rmse
        for factor in bench_problem.FINER]
    # Kinetics are sought with weights that follow as much.
    as_fine = problem.fit_stage(model.effects, len(stage.nodes) - 1)[0]
    finest = problem.finest(model.effects)
    assert finest.levels == len(stage.nodes) - 1
    error = finest.simulate(model.effects) - finest.measured
    assert np.sqrt(np.mean(error ** 2)) < 0.8 * as_fine.rmse


def test_weights_of_a_sweep_are_chosen_for_trials_left_out(model, tables):
    """Its rows leave nothing between them that a finer grid could follow."""
    problem = problem_of(model, tables)
    assert problem.rows_are_sparse(model.effects)
    there, loads = np.linspace(0.0, 6.0, 50), np.unique(tables[0].column('force'))
    fine = {'trial': np.repeat(np.arange(4.0), 100), 'step': np.tile(np.arange(100.0), 4),
            'voltage': np.tile(np.append(there, there[::-1]), 4), 'force': np.repeat(loads, 100),
            'length': np.zeros(400)}
    fine['length'] = model.predict(Measurement.from_columns(fine))
    bare = dataclasses.replace(model, effects=[], replicates=[])
    sweep = problem_for(bare, [Measurement.from_columns(fine)])
    assert not sweep.rows_are_sparse(model.effects)
    assert len(sweep.completed(model.effects).length_stage.nodes) < len(
        problem.completed(model.effects).length_stage.nodes)


def test_effects_are_fitted_to_what_counts(model, tables, monkeypatch):
    """Lengths of a load as if it were twice as heavy bend the effects, but by its own variance."""
    fitted = tables[0].select(range(4))
    columns = {name: np.array(values) for name, values in fitted.columns.items()}
    third = columns['trial'] == 2.0
    heavier = Measurement.from_columns(
        {**columns, 'force': np.where(third, 2.0 * columns['force'], columns['force'])})
    columns['length'] = np.where(third, model.predict(heavier), columns['length'])
    table = Measurement.from_columns(columns)
    bare = dataclasses.replace(model, effects=[], replicates=[])
    problem = problem_for(bare, [table])
    effects = BenchFitter(problem.finer()).fit(model.effects).effects
    balanced = problem.balanced(effects).finer()

    def cost(found):
        return np.mean((balanced.emphasis * (balanced.measured - balanced.simulate(found))) ** 2)
    assert cost(BenchFitter(balanced).fit(effects).effects) < 0.99 * cost(effects)

    # With next to no weight on it they follow the others.
    balanced = balanced.with_emphasis(np.where(balanced.trial == 2, 1e-4, 1.0))

    def off_on_others(found):
        return np.std((balanced.measured - balanced.simulate(found))[balanced.trial != 2])
    assert off_on_others(BenchFitter(balanced).fit(effects).effects) < 0.5 * off_on_others(effects)

    def off_elsewhere():
        found = extended_model(bare, USUAL, [table])[0]
        return np.std((found.predict(table) - columns['length'])[~third])
    balanced_model = off_elsewhere()
    monkeypatch.setattr(BenchProblem, 'balanced', lambda problem, *_: problem)
    assert balanced_model < 0.8 * off_elsewhere()
