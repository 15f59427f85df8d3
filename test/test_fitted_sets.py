# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is kept of the sets of effects that were fitted to a recording."""

import dataclasses
import types

from model_support import bicep_model, effect_of, runs
import numpy as np
import pytest

from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.fitted_sets import FittedSets, subsets
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.selection import Selection
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import catalogue

NAMES = frozenset(['payload_error'])


@pytest.fixture(scope='module')
def fitter():
    """Return a fitter for settled trials of an arm that carries 15 g more."""
    model = bicep_model()
    measured = runs(model.with_effects([effect_of(model, 'payload_error', dm=15.0)]), rows=30)
    return Selection(problem_for(model, [measured], NAMES), Settings(),
                     np.random.default_rng(0), lambda items, total: items).fitter


@pytest.fixture
def sets(fitter):
    """Return an empty collection."""
    return FittedSets(fitter, Settings(), np.random.default_rng(0))


def fitted(fitter, steps=12):
    """Return the payload, fitted from 5 g in so many steps at most."""
    payload = effect_of(fitter.problem.model, 'payload_error', dm=5.0)
    fit, = fitter.fit([[payload]], fitter.covariance.points[1], steps)
    return fit


def test_of_each_set_the_most_probable_fit_is_kept(fitter, sets):
    """Whichever comes first."""
    poor, good = fitted(fitter, 0), fitted(fitter)
    assert poor.log_evidence < good.log_evidence
    for order in ((poor, good), (good, poor)):
        for fit in order:
            sets.keep(fit)
        assert sets.fits[NAMES] is good
        sets.fits.clear()


def test_an_effect_in_a_rarer_form_is_less_probable_by_its_odds(fitter, sets, monkeypatch):
    sets.keep(fitted(fitter))
    usual = sets.log_posterior(NAMES)
    monkeypatch.setattr(catalogue()['payload_error'], 'prior_odds', 0.1)
    assert sets.log_posterior(NAMES) == pytest.approx(usual + np.log(0.1))


@pytest.mark.parametrize('of_alloy, known, odds', [
    (True, True, 0.2), (True, False, 1.0), (False, True, 1.0)])
def test_what_the_bench_has_shown_of_the_alloy_is_seldom_another_on_the_arm(
        fitter, sets, monkeypatch, of_alloy, known, odds):
    fit = fitted(fitter)
    sets.keep(fit)
    usual = sets.log_posterior(NAMES)
    monkeypatch.setattr(catalogue()['payload_error'], 'of_alloy', of_alloy)
    if known:
        monkeypatch.setattr(fitter.problem, 'model', fitter.problem.model.with_effects(fit.effects))
    own = FittedSets(fitter, Settings(), np.random.default_rng(0))
    own.keep(fit)
    assert own.log_posterior(NAMES) == pytest.approx(usual + np.log(odds))


def test_the_alloy_shifts_and_grows_with_the_load_and_has_its_phases():
    """Crimps and cables of an arm stretch as they are, and muscles creep as they are used."""
    assert {name for name, effect in catalogue().items() if effect.of_alloy} == {
        'stress_dependence', 'stress_dependent_strain', 'r_phase'}


def test_the_error_of_a_set_is_the_smallest_that_was_found(fitter, sets):
    """Also where a smaller one is found after it was asked for, and no larger one counts."""
    sets.keep(fitted(fitter))
    before, measured = sets.error(NAMES), fitter.problem.measured
    assert 0.0 < before < 0.01
    sets.keep_least(NAMES, measured + 0.5 * before)
    assert sets.error(NAMES) == pytest.approx(0.5 * before)
    sets.keep_least(NAMES, measured + 1.0)
    assert sets.error(NAMES) == pytest.approx(fitter.error(sets.fits[NAMES].predicted))


def test_what_martensite_keeps_is_no_part_of_the_models_own_error(fitter, sets, monkeypatch):
    """Whatever its share, and however large it is; of another course nothing is taken off."""
    course = np.linspace(-1.0, 1.0, len(fitter.problem.measured)) ** 3
    monkeypatch.setattr(fitter.covariance, 'discrepancy', dataclasses.replace(
        fitter.covariance.discrepancy, courses=course[:, None]))
    sets.keep(fitted(fitter))
    sets.keep_least(NAMES, fitter.problem.measured - 0.7 * course)
    assert sets.own_error(NAMES) == pytest.approx(0.0, abs=1e-12)
    monkeypatch.setattr(fitter.covariance, 'discrepancy', dataclasses.replace(
        fitter.covariance.discrepancy, courses=0.0 * course[:, None]))
    other = FittedSets(fitter, Settings(), np.random.default_rng(0))
    other.keep(fitted(fitter))
    assert other.own_error(NAMES) == other.error(NAMES) > 1e-5


def test_what_martensite_keeps_does_not_raise_what_the_model_may_be_off_by(fitter, monkeypatch):
    without = FittedSets(fitter, Settings(), np.random.default_rng(0)).largest_rmse
    monkeypatch.setattr(fitter.covariance, 'discrepancy', dataclasses.replace(
        fitter.covariance.discrepancy, courses=np.ones((len(fitter.problem.measured), 1))))
    assert FittedSets(fitter, Settings(), np.random.default_rng(0)).largest_rmse == without


def test_fits_are_judged_anew_with_each_covariance_that_is_added(fitter, sets):
    sets.keep(dataclasses.replace(fitted(fitter), log_evidence=-np.inf))
    sets.judge_all()
    assert sets.fits[NAMES].log_evidence == pytest.approx(fitted(fitter).log_evidence)


def test_the_subsets_of_a_set_lack_one_effect_each():
    assert set(subsets(frozenset('abc'))) == {frozenset('ab'), frozenset('ac'), frozenset('bc')}
    assert subsets(frozenset()) == []


@pytest.mark.parametrize('jobs', [1, 2])
def test_all_are_judged_as_each_by_itself(fitter, sets, monkeypatch, jobs, forkable):
    """Under covariances that came later, along a way of their own or not."""
    monkeypatch.setattr(fitter.problem, 'jobs', jobs)
    fit = fitted(fitter)
    sets.fits = {frozenset(['one']): fit, frozenset(['two']): fitter.along(fit)}
    before = dict(sets.fits)
    monkeypatch.setattr(fitter.covariance, 'points', [*fitter.covariance.points])
    fitter.covariance.add(fitter.covariance.start(0.05, 0.02))
    sets.judge_all()
    for names, found in sets.fits.items():
        alone = fitter.judge(before[names])
        assert (found.log_evidence, found.judged) == (alone.log_evidence, alone.judged)
        assert np.array_equal(found.values, alone.values)
        assert np.array_equal(found.spread, alone.spread)
        assert found.predicted is before[names].predicted
        assert found.covariance is before[names].covariance


def test_noise_is_judged_by_the_same_draws_whatever_else_was_judged(fitter):
    p_values = []
    for others in (0, 2):
        sets = FittedSets(fitter, Settings(), np.random.default_rng(0))
        rng = np.random.default_rng(5)
        for names in [frozenset([str(other)]) for other in range(others)] + [NAMES]:
            fit = fitted(fitter)
            noise = rng.standard_normal(len(fit.predicted)) if names != NAMES else 0.1 * np.sin(
                np.arange(len(fit.predicted)))
            sets.fits[names] = dataclasses.replace(fit, predicted=fit.predicted + noise)
            found = sets._noise_p_value(names)
        p_values.append(found)
    assert p_values[0] == p_values[1]


@pytest.mark.parametrize('wave, at_least, at_most', [(0.0, 19, 20), (0.035, 0, 1)])
def test_what_may_be_noise_is_not_held_against_the_model(
        fitter, sets, monkeypatch, wave, at_least, at_most):
    """
    Two degrees of white noise are known to a few percent: of 20 recordings 19 have nothing else.

    As much that lasts from row to row is seen.
    """
    sets.largest_rmse, sufficient = 0.008, 0
    base, rng = fitted(fitter, 0), np.random.default_rng(6)
    row = np.arange(len(base.predicted))
    for _ in range(20):
        residual = 0.035 * rng.standard_normal(len(row)) + wave * np.sin(row / 4.0)
        monkeypatch.setattr(fitter.problem, 'measured', base.predicted + residual)
        values = fitter.covariance.fit(residual)
        fit = dataclasses.replace(base, values=values, predicted=base.predicted.copy())
        sets.fits[frozenset()] = fit
        sets.keep_least(frozenset(), fit.predicted)
        sufficient += sets.sufficient(frozenset())
    assert at_least <= sufficient <= at_most


@pytest.mark.parametrize('own, suffices, remembers, stays', [
    (0.7, True, False, False), (0.7, False, False, True), (0.7, True, True, True),
    (1.1, True, False, True)])
def test_a_set_has_to_explain_more_than_fewer_effects_that_suffice(
        sets, monkeypatch, own, suffices, remembers, stays):
    """Whether or not they are among its own."""
    one, two = frozenset(['encoder_offset']), frozenset(['geometry_error', 'supply_limit'])
    errors = {one: own, two: 0.2}
    always = types.SimpleNamespace(implausible=list, effects=[])
    for name, value in (
            ('fits', dict.fromkeys(errors, always)), ('ranked', lambda: [two, one]),
            ('p_values', {'encoder_offset': 0.01}), ('own_error', errors.get),
            ('sufficient', lambda names: suffices or names == two),
            ('_each_matters', lambda names: True), ('_surpassed', lambda names, others: False),
            ('_remembers', lambda names, fewer: remembers),
            ('_clearly_more_probable', lambda names, fewer: True),
            ('covariance', types.SimpleNamespace(size=1.0))):
        monkeypatch.setattr(sets, name, value)
    assert sets.valid() == ([two, one] if stays else [one])
    # Whether none suffices is asked of each effect of a set.
    none = frozenset()
    monkeypatch.setattr(sets, 'ranked', lambda: [two, none])
    monkeypatch.setitem(errors, none, 0.7)
    monkeypatch.setitem(sets.fits, none, always)
    assert sets.valid() == [two, none]


@pytest.mark.parametrize('low, valid', [(0.02, False), (0.04, True)])
def test_the_size_of_a_form_has_to_be_determined(sets, monkeypatch, low, valid):
    """A muscle that is only longer from a moment on has lost no stroke then."""
    lost, yields = (catalogue()['overload'](**values) for values in (
        {'lost': 0.06, 't': 75.0}, {'Fy': 1.0, 'compliance': 3.0}))
    lost.intervals['lost'] = low, 0.08
    # Of another effect only what it explains counts.
    offset = catalogue()['encoder_offset'](offset=1.0)
    for effect in (offset, yields):
        size = effect.parameters[0]
        effect.intervals[size.name] = -size.high if size.both_signs else 0.0, size.high
        assert not_determined(effect, 'arm')
    names = [frozenset([name]) for name in ('lost', 'yields')]
    for name, value in (
            ('fits', {one: types.SimpleNamespace(effects=effects, implausible=list)
                      for one, effects in zip(names, ([lost, offset], [yields]))}),
            ('ranked', lambda: names), ('_each_matters', lambda names: True),
            ('_surpassed', lambda names, others: False)):
        monkeypatch.setattr(sets, name, value)
    monkeypatch.setattr(sets.fitter, 'with_intervals', lambda fit: fit.effects)
    monkeypatch.setattr(sets, 'p_values', {'lost': 0.01, 'yields': 0.01})
    assert sets.valid() == (names if valid else names[1:])
