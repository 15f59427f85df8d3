# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which of the sets that were fitted may be the answer."""

import dataclasses
import json

from model_support import bicep_model, effect_of, runs
import numpy as np
import pytest
from selection_support import heavier, NOISE, recording, selection, TRIED

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.measurements import Measurement


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


@pytest.fixture(scope='module')
def payload(model):
    """Return what is found in an arm that carries more."""
    return heavier(model)


def test_a_set_suffices_as_far_as_model_and_equation_may_be_off(payload, monkeypatch):
    """Along the way that the arm takes with the set: 95 % of draws of that error are smaller."""
    names = frozenset(['payload_error'])
    matrix = payload.fitter.discrepancy(payload.sets.fits[names]).matrix(courses=False)
    rng = np.random.default_rng(8)
    draws = rng.multivariate_normal(np.zeros(len(matrix)), matrix, 4000, method='eigh')
    sizes = np.sqrt(np.mean(draws ** 2, axis=1)) * np.exp(
        payload.settings.scale_spread * rng.standard_normal(4000))
    limit = np.quantile(sizes, 0.95)
    assert limit < payload.sets.largest_rmse
    for share, enough in ((0.9, True), (1.1, False)):
        monkeypatch.setattr(payload.sets, 'noise_free_rmse', lambda one, left=share * limit: left)
        assert bool(payload.sets.sufficient(names)) is enough


@pytest.mark.parametrize('explained', [0.0, 0.5, 1.0, 2.0, 50.0])
def test_what_an_effect_makes_uncertain_counts_as_far_as_it_explains_more(payload, monkeypatch,
                                                                          explained):
    """
    Of the square by which the model may be off further, half counts where it explains twice.

    Where it explains less than that, a quarter of what it explains counts.
    """
    sets, names = payload.sets, frozenset(['payload_error'])
    own = 3.0 * sets.largest_rmse
    further = own ** 2 - sets.largest_rmse ** 2
    monkeypatch.setattr(sets, '_largest_errors', {})
    monkeypatch.setattr(sets, '_largest_error', lambda covariance: own)
    errors = {frozenset(): np.sqrt(1.0 + explained * further), names: 1.0}
    monkeypatch.setattr(sets, 'own_error', lambda one: errors[one])
    counts = {0.0: 0.0, 0.5: 0.125, 1.0: 0.25, 2.0: 0.5, 50.0: 0.98}[explained]
    limit = np.sqrt(sets.largest_rmse ** 2 + counts * further)
    for share, enough in ((0.999, True), (1.001, False)):
        monkeypatch.setattr(sets, 'noise_free_rmse', lambda one, left=share * limit: left)
        assert bool(sets.sufficient(names)) is enough


@pytest.mark.parametrize('share', [0.3, 1.0, 1e4])
def test_equations_may_be_off_by_their_share_of_what_they_explain_together(
        payload, monkeypatch, share):
    """
    Or by less; but not by what each changes alone: changes that cancel would explain anything.

    Nearly all of that share is beyond doubt, next to what is explained.
    """
    sets, names = payload.sets, frozenset(['payload_error'])
    explained = 9.0 * sets.largest_rmse ** 2
    most = sets.settings.form ** 2 * explained
    monkeypatch.setattr(sets, '_largest_errors', {names: (
        sets.fits[names].covariance, sets.largest_rmse,
        np.sqrt(sets.largest_rmse ** 2 + share * most))})
    errors = {frozenset(): np.sqrt(1.0 + explained), names: 1.0}
    monkeypatch.setattr(sets, 'own_error', lambda one: errors[one])
    counts = min(share, 1.0) * most
    limit = np.sqrt(sets.largest_rmse ** 2 + counts * (1.0 - counts / explained))
    for factor, enough in ((0.9999, True), (1.0001, False)):
        monkeypatch.setattr(sets, 'noise_free_rmse', lambda one, left=factor * limit: left)
        assert bool(sets.sufficient(names)) is enough


@pytest.mark.parametrize('own, surpassed', [(0.3, False), (0.45, True)])
def test_the_equation_of_an_effect_may_be_off_by_a_share_of_all_that_there_was(
        payload, monkeypatch, own, surpassed):
    """Also of what the shares of courses would have explained without it."""
    sets, size = payload.sets, payload.sets.covariance.size
    names, other = frozenset(['payload_error']), frozenset(['encoder_offset'])
    whole = 100.0 * size
    errors = {frozenset(): 0.1 * whole, names: own * 0.25 * whole, other: 0.5 * size}
    monkeypatch.setattr(sets, 'own_error', lambda one: errors[one])
    monkeypatch.setattr(sets, 'error', lambda one: whole)
    monkeypatch.setattr(sets, 'settings', dataclasses.replace(sets.settings, form=0.1))
    assert sets._surpassed(names, [other, names]) is surpassed


@pytest.mark.parametrize('share, enough', [(0.45, False), (0.55, True)])
def test_a_set_that_fails_in_rows_held_out_does_not_suffice(payload, monkeypatch, share, enough):
    """However little it leaves in those fitted: half of what it explains there is asked for."""
    sets, names = payload.sets, frozenset(['payload_error'])
    measured, fit = payload.problem.measured, sets.fits[names]
    before, fitted = (np.mean((measured - one.predicted) ** 2) for one in (sets.base, fit))
    held_out = measured - np.sqrt(before - share * (before - fitted))
    monkeypatch.setattr(sets, '_predicts', {})
    monkeypatch.setattr(sets.fitter, 'cross_validate', lambda fits: [
        dataclasses.replace(one, held_out=held_out) for one in fits])
    assert sets.noise_free_rmse(names) < sets._allowed(names)
    assert bool(sets.sufficient(names)) is enough


def test_a_set_without_effects_suffices_as_far_as_the_model_may_be_off(payload, monkeypatch):
    for share, enough in ((0.99, True), (1.01, False)):
        monkeypatch.setattr(payload.sets, 'noise_free_rmse',
                            lambda one, left=share * payload.sets.largest_rmse: left)
        assert bool(payload.sets.sufficient(frozenset())) is enough


def test_an_effect_that_contains_another_one_counts_as_both(model):
    """A lag that is no other when hot is a lag, though its equation can be bent to fit as well."""
    lag = effect_of(model, 'thermal_lag', time_constant=6.0)
    clean = runs(model.with_effects([lag]), rows=60, dt=3.0)
    noise = NOISE * np.random.default_rng(3).standard_normal(clean.rows)
    found = selection(model, Measurement.from_columns(
        {**clean.columns, 'angle': clean.column('angle') + noise}), ('thermal_lag', 'heat_loss'))
    simple, bent = (frozenset([name]) for name in ('thermal_lag', 'heat_loss'))
    assert found.sets.error(bent) < 1.1 * found.sets.error(simple)
    assert found.sets.valid()[0] == simple
    sets = found.sets
    gain = (sets.fits[bent].log_evidence - sets.fits[simple].log_evidence) / sets.temper
    odds = np.log(found.settings.prior / (1.0 - found.settings.prior))
    assert sets.log_posterior(bent) - sets.log_posterior(simple) == pytest.approx(gain + odds)


def test_a_larger_set_is_no_answer_where_a_smaller_one_suffices(payload):
    """Each of its effects would have to matter, and next to the planted one nothing does."""
    payload.grow(frozenset(['payload_error']))
    larger = [names for names in payload.sets.fits if len(names) > 1 and 'payload_error' in names]
    assert larger
    assert not set(larger) & set(payload.sets.valid())


def test_a_smaller_set_that_is_implausible_would_not_do(payload, monkeypatch):
    """It can be no answer itself, so that a larger one with it may be."""
    payload.grow(frozenset(['payload_error']))
    small = frozenset(['payload_error'])
    larger = next(names for names in payload.sets.fits if small < names)
    assert payload.sets._would_do(small, larger)
    fit = payload.sets.fits[small]
    too_heavy = fit.effects[0].with_values(dm=400.0)
    monkeypatch.setitem(payload.sets.fits, small, dataclasses.replace(fit, effects=[too_heavy]))
    assert payload.sets.fits[small].implausible() and not payload.sets._would_do(small, larger)


def test_a_larger_set_may_be_the_answer_where_only_it_leaves_no_more_than_the_models_own_error(
        payload, monkeypatch):
    """However much more probable it is; where both do, it has to be clearly more probable."""
    payload.grow(frozenset(['payload_error']))
    small = frozenset(['payload_error'])
    larger = next(names for names in payload.sets.fits if small < names)
    least = payload.sets.log_posterior(small)
    largest = 1.5 * payload.sets.largest_rmse
    monkeypatch.setitem(payload.sets._largest_errors, small,
                        (payload.sets.fits[small].covariance, largest, largest))
    for odds, small_error, would_do in ((0.1, 1.2, False), (0.1, 0.9, True), (-0.1, 1.2, True)):
        own = payload.sets.largest_rmse
        errors = {small: small_error * own, larger: 0.8 * own}
        monkeypatch.setattr(payload.sets, 'noise_free_rmse', lambda names: errors.get(names, 1.0))
        monkeypatch.setattr(payload.sets, 'log_posterior', {small: least, larger: least + odds}.get)
        assert payload.sets._would_do(small, larger) == would_do


def test_an_effect_has_to_matter_by_a_practical_size(model):
    """One that is certainly there but takes off a few per cent is no answer to a user."""
    measured = recording(model, [effect_of(model, 'payload_error', dm=15.0)], noise=0.02)
    found = selection(model, measured, ('payload_error',))
    planted = frozenset(['payload_error'])
    assert planted in found.sets.valid()
    gain = 1.0 - found.sets.error(planted) / found.sets.error(frozenset())
    assert 0.1 < gain < 0.99
    found.sets.settings = dataclasses.replace(found.settings, practical=gain + 0.01)
    assert planted not in found.sets.valid()


@pytest.mark.parametrize(('name', 'values', 'named'), [
    ('backlash', {'B': 2.0}, True), ('coulomb_friction', {'tau_c': 0.015}, False),
    ('payload_error', {'dm': 5.0}, False)])
def test_an_effect_within_the_models_own_error_needs_a_memory_of_its_own(model, name, values,
                                                                         named):
    """What the model gets wrong repeats itself with the drive, as friction and a payload do."""
    found = selection(model, recording(model, [effect_of(model, name, **values)]),
                      ('payload_error', 'encoder_offset', 'backlash', 'coulomb_friction'))
    before, after = (found.sets.own_error(names) for names in (frozenset(), frozenset([name])))
    assert 0.0 < before ** 2 - after ** 2 < found.covariance.size ** 2
    assert found.sets.sufficient(frozenset())
    assert (found.sets.valid()[0] == {name}) == named


@pytest.mark.parametrize('suffices, odds, named', [
    (True, 3.0, False), (True, 5.0, True), (False, 3.0, True)])
def test_a_single_effect_has_to_be_clearly_more_probable_than_a_model_that_may_do(
        payload, monkeypatch, suffices, odds, named):
    """Odds of fifty to one are a logarithm of 3.9."""
    single = frozenset(['payload_error'])
    monkeypatch.setattr(payload.sets, 'sufficient', lambda names: names == single or suffices)
    monkeypatch.setattr(payload.sets, 'log_posterior', lambda names: odds * (names == single))
    monkeypatch.setattr(payload.sets, 'noise_free_rmse', lambda names: 0.0)
    assert (single in payload.sets.valid()) == named


def test_an_equation_that_contains_anothers_is_no_smaller_set_than_both(payload, monkeypatch):
    """It says that both act, as in the probability of a set."""
    model = payload.problem.model
    lag, both = frozenset(['thermal_lag', 'latency']), frozenset(['heat_loss'])
    fits = {frozenset(): payload.sets.base}
    for names in (lag, both):
        fits[names] = payload.fitter.judge(payload.fitter.fit(
            [[effect_of(model, name) for name in sorted(names)]], payload.fitting.metric, 0)[0])
    monkeypatch.setattr(payload.sets, 'fits', fits)
    assert payload.sets.acting(lag) == payload.sets.acting(both) == 2
    assert payload.sets.acting(frozenset()) == 0
    assert 'thermal_lag' in fits[both].effects[0].replaces
    monkeypatch.setattr(payload.sets, '_each_matters', lambda names: True)
    monkeypatch.setattr(payload.sets, '_surpassed', lambda names, others: False)
    monkeypatch.setattr(payload.sets, '_hardly_better', lambda names, fewer: True)
    monkeypatch.setattr(payload.sets, 'sufficient', lambda names: True)
    monkeypatch.setattr(payload.sets, 'p_values', {'heat_loss': 0.01})
    assert {lag, both} <= {*payload.sets.valid()}
    monkeypatch.setattr(payload.sets, 'acting', len)
    assert lag not in payload.sets.valid()


def test_an_effect_that_has_no_fit_of_its_own_is_judged_in_a_set(payload, monkeypatch):
    pair, single = frozenset(['payload_error', 'frame_tilt']), frozenset(['payload_error'])
    fits = {frozenset(): payload.sets.base, single: payload.sets.fits[single]}
    both, = payload.fitter.fit([[*fits[single].effects, effect_of(
        payload.problem.model, 'frame_tilt', phi=2.0)]], payload.fitting.metric, 0)
    monkeypatch.setattr(payload.sets, 'fits', {**fits, pair: payload.fitter.judge(both)})
    monkeypatch.setattr(payload.sets, 'own_error', lambda names: 1.0 / (1 + len(names)))
    monkeypatch.setattr(payload.sets, 'sufficient', lambda names: False)
    monkeypatch.setattr(payload.covariance, 'size', 10.0)
    assert payload.sets.valid() == [frozenset()]


def test_an_implausible_set_is_no_answer_however_well_it_explains(model):
    """A payload that is too heavy by more than its range is something else."""
    far = effect_of(model, 'payload_error', dm=15.0)
    high = next(p for p in far.parameters if p.name == 'dm').high
    measured = recording(model, [effect_of(model, 'payload_error', dm=1.5 * high)])
    found = selection(model, measured, ('payload_error',))
    fit = found.sets.fits[frozenset(['payload_error'])]
    assert fit.implausible() == ['payload_error.dm']
    assert found.sets.error(frozenset(['payload_error'])) < 0.3 * found.sets.error(frozenset())
    assert found.sets.valid() == [frozenset()]
    told = diagnose(model, [measured], ['payload_error'])
    assert (told.verdict, told.missing) == ('unknown', [])
    assert told.resembles == ['payload_error']


@pytest.mark.parametrize('lasting, verdict', [(True, 'adequate'), (False, 'unknown')])
def test_noise_that_comes_and_goes_has_a_cause(model, lasting, verdict):
    """Larger than the model's own error: at all times, or in every other ten rows."""
    clean = recording(model, noise=0.0)
    noise = np.random.default_rng(2).standard_normal(clean.rows)
    strength = 1.0 if lasting else np.sqrt(2.0) * (np.arange(clean.rows) // 10 % 2)
    measured = Measurement.from_columns({
        **clean.columns, 'angle': clean.column('angle') + 0.1 * strength * noise})
    told = diagnose(model, [measured], TRIED)
    assert (told.verdict, told.missing, told.uneven) == (verdict, [], not lasting)
    # As plain types, not numpy's.
    assert json.loads(json.dumps(told.to_dict()))['uneven'] is not lasting


def test_noise_is_no_evidence_for_any_effect(model):
    """Two degrees of white noise, and no set is an answer; the model itself suffices."""
    found = selection(model, recording(model, noise=0.035))
    assert found.sets.valid() == [frozenset()]
    assert found.sets.ranked()[0] == frozenset()
    assert found.sets.base.noise == pytest.approx(0.035, rel=0.2)
