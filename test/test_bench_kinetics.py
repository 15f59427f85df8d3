# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Minor loops that do not close, on a bench: in the fit of its weights, found, and said."""

import dataclasses
import types

from model_support import autoregressive, effect_of, with_noise
import numpy as np
import pytest

from hysteresis_ros.diagnosis import bench_effects, bench_kinetics
from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_kinetics import shown_kinetics
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.report.commands import after_diagnosis
from hysteresis_ros.report.provenance import Origin
from hysteresis_ros.report.words import verdict_in_words

TRIALS = {'length_trials': range(4), 'force_trials': [0]}
USUAL = ['stress_dependence', 'stress_dependent_strain', 'series_compliance']
NOISE = 2e-5
LOADS, ROWS = (1.2, 3.1, 5.1, 7.0), 120
CORNERS = (0.0, 6.0, 0.0, *np.tile([4.2, 2.8], 5), 6.0, *np.tile([1.8, 3.4], 5))


@pytest.fixture(scope='module')
def force():
    """Return the force table of a bench."""
    return Measurement.from_columns(bench_tables({}, 11)['force.csv'])


@pytest.fixture(scope='module')
def usual(force):
    """Return a model of its wire with what every loaded muscle has, whose loops close."""
    length = Measurement.from_columns(bench_tables({}, 11)['length.csv'])
    plain = identify(length, force, **TRIALS).model
    return add_effects(plain, length, force, USUAL, **TRIALS)[0]


def made(model, share, rho=0.0, seed=0, noise=NOISE, loads=LOADS, corners=CORNERS):
    """Return lengths of a wire of which a share follows its kinetics, with small loops repeated."""
    drive = np.interp(np.linspace(0.0, len(corners) - 1.0, ROWS), np.arange(len(corners)), corners)
    columns = {'trial': np.repeat(np.arange(float(len(loads))), ROWS),
               'voltage': np.tile(drive, len(loads)), 'force': np.repeat(loads, ROWS)}
    clean = Measurement.from_columns({**columns, 'length': np.zeros(ROWS * len(loads))})
    own = [effect_of(model, 'kinetics', share=share)] if share else []
    lengths = model.with_effects([*model.effects, *own]).predict(clean)
    return with_noise(Measurement.from_columns({**columns, 'length': lengths}),
                      noise * autoregressive(
                          np.random.default_rng(seed), len(loads), ROWS, rho))


def fitter_of(model, measured, **changes):
    """Return a fitter of lengths with another model, as that without effects by default."""
    bare = dataclasses.replace(model, replicates=[], **{'effects': [], **changes})
    return BenchFitter(problem_for(bare, [measured]).finer())


def test_weights_and_kinetics_are_fitted_to_each_other(usual):
    """What a bench with kinetics is fitted to is what the completed model predicts of it."""
    length = made(usual, 0.8)
    kinetics = effect_of(usual, 'kinetics', share=0.8)
    problem = problem_for(dataclasses.replace(usual, effects=[], replicates=[]), [length])
    without, response = (problem.simulate(effects) - problem.measured for effects in (
        usual.effects, [*usual.effects, kinetics]))
    assert np.std(response) < 2.1 * NOISE and np.std(without) > 3.5 * NOISE
    whole = problem.completed([*usual.effects, kinetics])
    assert np.std(whole.predict(length) - length.column('length')) < 2.0 * NOISE
    # As without that effect where none follows the kinetics.
    none = effect_of(usual, 'kinetics', share=0.0)
    assert problem.simulate([*usual.effects, none]) == pytest.approx(without + problem.measured)


@pytest.mark.long
def test_effects_of_the_phase_get_that_of_the_kinetics(usual):
    creeping = usual.with_effects([*usual.effects, effect_of(usual, 'creep', c=0.5)])
    length, kinetics = made(creeping, 0.9), effect_of(usual, 'kinetics', share=0.9)
    problem = problem_for(dataclasses.replace(usual, effects=[], replicates=[]), [length])
    whole = problem.completed([*creeping.effects, kinetics])
    assert np.std(whole.predict(length) - length.column('length')) < 2.5 * NOISE


def test_rows_held_out_are_the_same_whatever_was_fitted_before(usual):
    fitter = fitter_of(usual, made(usual, 0.8))
    weak, strong = (fitter.fit([*usual.effects, effect_of(usual, 'kinetics', share=share)], 1)
                    for share in (0.3, 0.9))
    alone = fitter_of(usual, made(usual, 0.8)).cross_validate(strong).held_out
    fitter.cross_validate(weak)
    assert np.array_equal(fitter.cross_validate(strong).held_out, alone)


@pytest.mark.parametrize('share', [0.3, pytest.param(0.9, marks=pytest.mark.long)])
def test_rows_left_out_tell_the_share(usual, share):
    length = made(usual, share)
    fitter = fitter_of(usual, length)
    # However little of the range it is: on an arm that goes to and fro it is more.
    least = 0.01 * np.ptp(length.column('length'))
    assert fitter.error(fitter.fit(usual.effects).predicted) < least
    shown = shown_kinetics(fitter, usual.effects)
    assert {effect.id for effect in shown.effects} == {*USUAL, 'kinetics'}
    assert all(effect.intervals for effect in shown.effects)
    kinetics = shown.effects[-1]
    assert kinetics.share == pytest.approx(share, abs=0.16)
    low, high = kinetics.intervals['share']
    # It comes out a little too small on a grid that is not the wire's; tried are eighths.
    assert low < share < high + 0.125 and high - low < 0.4
    assert shown.after < 0.9 * shown.before


@pytest.mark.parametrize('rho, seed', [
    (0.0, 0), *(pytest.param(*other, marks=pytest.mark.long)
                for other in ((0.0, 1), (0.9, 0), (0.9, 1)))])
def test_no_bench_whose_loops_close_shows_them(usual, rho, seed):
    """Whatever its noise, which may last for ten rows."""
    length = made(usual, 0.0, rho, seed, 2e-4)
    assert shown_kinetics(fitter_of(usual, length), usual.effects) is None


def test_no_bench_without_minor_loops_shows_them(usual, monkeypatch):
    """Under a load whose cold wire has not transformed altogether they may predict it better."""
    once, turned = (made(usual, 0.8, corners=corners) for corners in (
        (0.0, 6.0, 0.0), (0.0, 6.0, 0.0, 2.0)))
    monkeypatch.setattr(BenchFitter, 'fit', lambda *_: pytest.fail('sought'))
    assert shown_kinetics(fitter_of(usual, once), usual.effects) is None
    still = fitter_of(usual, turned)
    still.problem.signals = {'load': still.problem.signals['load']}
    assert shown_kinetics(still, usual.effects) is None
    with pytest.raises(pytest.fail.Exception, match='sought'):
        shown_kinetics(fitter_of(usual, turned), usual.effects)


def test_weights_that_follow_steps_show_them_too(monkeypatch):
    """On a steep wire coarse ones may be off by more than loops do not close."""
    tables = bench_tables({}, 1, 'tanaka')
    length, own = (Measurement.from_columns(tables[name]) for name in ('length.csv', 'force.csv'))
    names = ['stress_dependence', 'series_compliance', 'phase_modulus', 'transformation_slopes',
             'thermal_expansion']
    model = add_effects(identify(length, own, **TRIALS).model, length, own, names, **TRIALS)[0]
    fitted = length.select(range(4))
    shown = shown_kinetics(fitter_of(model, fitted), model.effects)
    assert shown.effects[-1].share >= 0.75
    assert {effect.id for effect in shown.effects} == {*names, 'kinetics'}
    monkeypatch.setattr(BenchProblem, 'finest', lambda problem, _: problem)
    assert shown_kinetics(fitter_of(model, fitted), model.effects) is None


def test_they_are_sought_once_and_where_a_muscle_can_have_them(usual, monkeypatch):
    length = made(usual, 0.8)
    monkeypatch.setattr(BenchProblem, 'finest', lambda problem, _: problem)
    own = effect_of(usual, 'kinetics', share=0.3)
    assert shown_kinetics(fitter_of(usual, length), [*usual.effects, own]) is None
    assert shown_kinetics(fitter_of(usual, length, effects=[own]), usual.effects) is None
    pushed = fitter_of(usual, length)
    pushed.problem.model = dataclasses.replace(usual, sign=1)
    assert shown_kinetics(pushed, usual.effects) is None
    monkeypatch.setattr(Fit, 'implausible', lambda fit: ['stress_dependence.C'])
    assert shown_kinetics(fitter_of(usual, length), usual.effects) is None


@pytest.mark.long
def test_a_row_left_out_may_be_predicted_better_by_chance(usual, monkeypatch):
    monkeypatch.setattr(BenchProblem, 'finest', lambda problem, _: problem)
    monkeypatch.setattr(bench_kinetics, 'schwarz_log_odds', lambda *_: -0.1)
    assert shown_kinetics(fitter_of(usual, made(usual, 0.8)), usual.effects) is None


def test_a_diagnosis_of_a_bench_says_what_they_explain(usual):
    length = made(usual, 0.8)
    found = diagnose(usual, [length])
    assert (found.verdict, found.missing) == ('adequate', [])
    kinetics = found.to_dict()['kinetics']
    assert kinetics['effect'] == 'kinetics' and kinetics['share'] == pytest.approx(0.8, abs=0.1)
    assert 1.8 * kinetics['rmse_after'] < kinetics['rmse_before']
    words = verdict_in_words(found)
    assert 'Minor loops show' in words and '`extend --add kinetics` adds it' in words
    command = after_diagnosis(found, 'm.yaml', ['l.csv'], Origin())
    assert 'extend --model m.yaml --add kinetics ' in command
    more = dataclasses.replace(found, verdict='missing', missing=['creep'], alternatives=[[]])
    assert '--add creep,kinetics ' in after_diagnosis(more, 'm.yaml', ['l.csv'], Origin())
    arm = dataclasses.replace(more, pooled_before=None)
    assert '--add creep ' in after_diagnosis(arm, 'm.yaml', ['a.csv'], Origin())
    # Who names effects asks for no other.
    assert diagnose(usual, [length], ['creep']).kinetics is None


@pytest.fixture(scope='module')
def tables(usual):
    """Return lengths with kinetics, of which the last trial verifies."""
    return made(usual, 0.8, loads=(*LOADS, 4.0))


@pytest.mark.long
def test_identification_adds_them_to_what_the_bench_proves(usual, force, tables, monkeypatch):
    plain = identify(tables, force, **TRIALS).model
    monkeypatch.setattr(
        bench_effects, 'diagnose', lambda *_, **__: types.SimpleNamespace(effects=usual.effects))
    whole, added = add_effects(plain, tables, force, **TRIALS)
    # Different moduli of the phases are what every wire has.
    assert {effect.id for effect in added} - {'phase_modulus'} == {*USUAL, 'kinetics'}
    assert added[-1].share == pytest.approx(0.8, abs=0.1)
    before = add_effects(plain, tables, force, USUAL, **TRIALS)[0]
    assert (whole.metrics['length']['verification']['rmse']
            < 0.5 * before.metrics['length']['verification']['rmse'])
    assert all('kinetics' in {effect.id for effect in one.effects} for one in whole.replicates)


@pytest.mark.long
def test_an_effect_that_is_left_out_is_not_sought_again(usual, force, tables):
    plain = identify(tables, force, **TRIALS).model
    problem = problem_for(plain, [tables.select(range(4))])
    for excluded in ([], ['kinetics']):
        added = bench_effects._extended_without(excluded, plain, usual.effects, problem)[1]
        assert ('kinetics' in {effect.id for effect in added}) == (not excluded)
