# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A bench model without each of the bench's loads: what an arm may be off by everywhere at once."""

import dataclasses

from hidden_cases import bench_model, TRIALS
from model_support import bicep_model, effect_of, runs
import numpy as np
import pytest

from hysteresis_ros.diagnosis import discrepancy
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.bench_error import missing_load
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.extend import extend, extend_by_hand
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.load_history import load_history
from hysteresis_ros.diagnosis.replicates import with_replicates
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model.replicates import Replicate
from hysteresis_ros.operators import Preisach

SEED = 61


@pytest.fixture(scope='module')
def tables():
    """Return the length and the force table of a bench."""
    found = experiment_tables('bench', {}, SEED)
    return [Measurement.from_columns(found[name]) for name in ('length.csv', 'force.csv')]


@pytest.fixture(scope='module')
def model():
    """Return a bench model with effects, fitted to four loads."""
    return bench_model(SEED)


def predicted(model, replicate, table):
    """Return the lengths [m] that a replicate gives."""
    return dataclasses.replace(model, length_stage=replicate.length_stage,
                               effects=replicate.effects).predict(table)


def test_there_is_one_for_each_load_and_it_misses_that_load_most(model, tables):
    fitted = tables[0].select(range(4))
    trial = fitted.column('trial')
    assert len(model.replicates) == 4
    for left_out, replicate in enumerate(model.replicates):
        error = predicted(model, replicate, fitted) - fitted.column('length')
        by_trial = [np.sqrt(np.mean(error[trial == number] ** 2)) for number in range(4)]
        assert np.argmax(by_trial) == left_out


def test_a_load_says_nothing_of_the_model_without_it(model, tables):
    """With lengths of one load that are wrong by half a millimetre the others' replicates move."""
    fitted = tables[0].select(range(4))
    columns = {name: np.array(values) for name, values in fitted.columns.items()}
    columns['length'][columns['trial'] == 2.0] += 5e-4
    base = identify(tables[0], tables[1], **TRIALS).model
    found = [with_replicates(dataclasses.replace(
        base, effects=model.effects, length_stage=model.length_stage),
        BenchProblem(base, [table])).replicates
        for table in (fitted, Measurement.from_columns(columns))]
    moved = [float(np.max(np.abs(predicted(model, one, fitted) - predicted(model, other, fitted))))
             for one, other in zip(*found)]
    assert moved[2] < 1e-9 < 1e-4 < min(moved[:2] + moved[3:])


def test_trials_are_left_out_where_all_have_one_load_and_parts_of_a_single_trial(tables):
    length = tables[0].select(range(4))
    base = identify(tables[0], tables[1], **TRIALS).model
    groups = BenchProblem(base, [length]).left_out_together
    assert len(np.unique(groups)) == 4
    both = BenchProblem(base, [tables[0]])       # another trial under each load
    assert len(np.unique(both.left_out_together)) == 4 < len(np.unique(both.trial))
    one = {name: np.array(values) for name, values in length.columns.items()}
    one['force'][:] = 3.0
    same = BenchProblem(base, [Measurement.from_columns(one)])
    assert np.array_equal(same.left_out_together, same.trial)
    single = BenchProblem(base, [length.select([0])])
    assert len(with_replicates(base, single).replicates) > 1


@pytest.mark.slow
@pytest.mark.long
def test_effects_of_a_bench_are_the_same_to_the_bit_whatever_the_jobs(tables, forkable):
    """Weights begin with those found before all fits that are shared, not with the last one's."""
    rows = tables[0].select(range(4))
    base = identify(*tables, length_trials=range(4), levels=(12, 12)).model
    found = [add_effects(base, rows, jobs=jobs)[0] for jobs in (1, 2)]
    alone, shared = found
    assert len(alone.effects) > 1
    assert [one.to_dict() for one in shared.effects] == [one.to_dict() for one in alone.effects]
    for one, two in zip(alone.replicates, shared.replicates):
        assert np.array_equal(one.length_stage.weights, two.length_stage.weights)


@pytest.mark.slow
def test_extending_a_bench_model_identifies_its_replicates_anew(model, tables):
    fitted = tables[0].select(range(4))
    base = model.with_effects([one for one in model.effects if one.id != 'series_compliance'])
    extended = extend(base, ['series_compliance'], [fitted]).model
    assert [[one.id for one in replicate.effects] for replicate in extended.replicates] == [
        [one.id for one in extended.effects]] * 4


def test_values_given_by_hand_stay_in_the_replicates(model, tables):
    fitted = tables[0].select(range(4))
    base = model.with_effects([one for one in model.effects if one.id != 'series_compliance'])
    given = effect_of(model, 'series_compliance', compliance=0.3)
    extended = extend_by_hand(base, [given], [fitted]).model
    for replicate in extended.replicates:
        assert [one.values for one in replicate.effects] == [
            one.values for one in extended.effects]
    error = [np.sqrt(np.mean((predicted(extended, one, fitted) - fitted.column('length')) ** 2))
             for one in extended.replicates]
    assert len(set(error)) == 4     # the weights are not the same


def test_a_model_without_effects_has_none(tables):
    base = identify(*tables, **TRIALS).model
    assert add_effects(base, *tables, [], **TRIALS)[0].replicates == []


def test_model_files_keep_them_and_older_ones_have_none(model, tmp_path):
    path = tmp_path / 'model.yaml'
    model.save(path)
    loaded = MuscleModel.load(path)
    for one, other in zip(loaded.replicates, model.replicates, strict=True):
        assert [effect.values for effect in one.effects] == [
            effect.values for effect in other.effects]
        assert one.length_stage.to_dict() == other.length_stage.to_dict()
    text = path.read_text()
    begin, end = text.index('replicates:'), text.index('provenance:')
    path.write_text(text[:begin] + text[end:])
    assert MuscleModel.load(path).replicates == []


def small_model():
    """Return a model with effects and two replicates, made by formula."""
    model = bicep_model()
    model = model.with_effects([effect_of(model, 'stress_dependence', C=1.0),
                                effect_of(model, 'series_compliance', compliance=0.05)])
    replicates = [Replicate(model.length_stage, [
        effect_of(model, 'stress_dependence', C=C),
        effect_of(model, 'series_compliance', compliance=0.1)]) for C in (0.8, 1.3)]
    return dataclasses.replace(model, replicates=replicates)


def test_what_is_fitted_anew_on_an_arm_keeps_its_values():
    model = small_model()
    replicate, own = model.replicates[0], model.effects
    same, = replicate.instead_of(own, own[:1])
    assert same.values == {**own[0].values, 'C': 0.8}
    # The share by which an arm's load counts more is a matter of the arm, C is not.
    shifted, = replicate.instead_of(own, [own[0].with_values(shift=0.1)])
    assert (shifted.C, shifted.shift) == (0.8, 0.1)
    softer, = replicate.instead_of(own, [own[1].with_values(compliance=0.3)])
    assert softer.compliance == 0.3
    lag = effect_of(model, 'encoder_offset', offset=2.0)
    assert replicate.instead_of(own, [lag]) == [lag]


def test_what_an_arm_has_shown_stays_in_the_replicates_of_the_extended_model():
    """Else the next diagnosis would take it for an error that the model may have of itself."""
    model = small_model()
    shifted = model.with_effects([model.effects[0].with_values(shift=0.1), model.effects[1]])
    run = runs(dataclasses.replace(shifted, replicates=[]))
    extended = extend(model, ['stress_dependence'], [run]).model
    found, = [one for one in extended.effects if one.id == 'stress_dependence']
    assert found.shift == pytest.approx(0.1, abs=0.02)
    for replicate, before in zip(extended.replicates, model.replicates):
        values = {one.id: one.values for one in replicate.effects}
        assert values['stress_dependence'] == {
            **before.effects[0].values, 'shift': found.shift}
        assert values['series_compliance'] == before.effects[1].values


def test_the_discrepancy_has_the_mean_square_of_what_a_load_left_out_changes():
    model = small_model()
    problem = problem_for(model, [runs(model)])
    own = problem.simulate(model.effects)
    changes = np.stack([
        problem_for(dataclasses.replace(model, replicates=[]), [runs(model)]).simulate(
            replicate.effects) - own for replicate in model.replicates])
    assert np.sqrt(np.mean(changes ** 2)) > 1e-3
    with_them, without = (discrepancy.discrepancy_along(
        problem_for(one, [runs(model)]), model.effects, own, Settings()).matrix()
        for one in (model, dataclasses.replace(model, replicates=[])))
    np.testing.assert_allclose(with_them - without, changes.T @ changes / 2.0, atol=1e-12)


def test_what_a_load_left_out_changes_counts_as_far_as_the_load_is_from_the_others():
    """At a load of the bench nothing, in the middle between two of equal distance a half."""
    model, loads = small_model(), (1.0, 3.0, 5.0, 9.0)
    known = dataclasses.replace(
        model, replicates=2 * model.replicates, metrics={'length': {'left_out': {
            'rmse': 1e-4, 'loads': list(loads), 'rmse_by_load': 4 * [1e-4]}}})
    asked = np.array([3.0, 4.0, 7.0, 11.0, 0.5])
    expected = np.array([0.0, 1.0, 2.0, 2.0, 0.5])[:, None] / np.array([2.0, 2.0, 2.0, 4.0])
    np.testing.assert_allclose(missing_load(known, asked), expected)
    # Where a replicate lacks a trial or two loads, or there are no loads between others.
    for other in (model, dataclasses.replace(known, replicates=model.replicates),
                  dataclasses.replace(known, metrics={})):
        assert np.all(missing_load(other, asked) == 1.0)
        assert missing_load(other, asked).shape == (5, len(other.replicates))
    problem = problem_for(known, [runs(known)])
    load = load_history(problem, known.effects).load
    own = problem.simulate(known.effects)
    changes = (problem.simulate_replicates(known.effects) - own).T / 2.0
    along = discrepancy.discrepancy_along(problem, known.effects, own, Settings())
    np.testing.assert_allclose(along.common, changes * missing_load(known, load), atol=1e-12)
    assert np.max(np.abs(along.common)) > 1e-4


def test_another_operator_of_a_replicate_counts():
    model = small_model()
    stage = model.length_stage
    shorter = Preisach(stage.nodes, 0.9 * stage.weights, stage.bias)
    one = dataclasses.replace(model, replicates=[
        Replicate(shorter, model.effects)])
    problem = problem_for(one, [runs(model)])
    expected = problem_for(dataclasses.replace(model, length_stage=shorter, replicates=[]),
                           [runs(model)]).simulate(model.effects)
    np.testing.assert_allclose(problem.simulate_replicates(model.effects), expected[None],
                               atol=1e-12)
