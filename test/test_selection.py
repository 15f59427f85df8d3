# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which sets of effects are an answer: on recordings of an arm that the model itself has made."""

import dataclasses
import json

from model_support import bicep_model, effect_of, runs
import numpy as np
import pytest
from scipy import special, stats

from hysteresis_ros.diagnosis import events
from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.discrepancy import discrepancy_along, sensitivity
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.linearised import (
    Linearised, linearised_starts, singles_as_started)
from hysteresis_ros.diagnosis.selection import Selection
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import catalogue
from hysteresis_ros.measurements import Measurement

TRIED = ('payload_error', 'encoder_offset', 'supply_sag', 'frame_tilt')
NOISE = 2e-3


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


def recording(model, effects=(), noise=NOISE, change=0.0, seed=5):
    """Return three settled trials of the arm with effects, with noise and a change of the angle."""
    clean = runs(model.with_effects(list(effects)), rows=30)
    rng = np.random.default_rng(seed)
    angle = clean.column('angle') + noise * rng.standard_normal(clean.rows) + change
    return Measurement.from_columns({**clean.columns, 'angle': angle})


def selection(model, measured, names=TRIED, seed=0, **settings):
    """Return what is found of some effects in a recording."""
    problem = problem_for(model, [measured], names)
    found = Selection(problem, dataclasses.replace(Settings(), **settings),
                      np.random.default_rng(seed), lambda items, total: items)
    found.run()
    return found


@pytest.fixture(scope='module')
def payload(model):
    """Return what is found where the arm carries 15 g more."""
    return selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))


def test_the_planted_effect_is_the_most_probable_answer(payload):
    """With its value, and its residual is no larger than the base model's own error could be."""
    best = payload.sets.valid()[0]
    assert best == {'payload_error'}
    fit = payload.sets.fits[best]
    assert fit.effects[0].values['dm'] == pytest.approx(15.0, abs=2.0)
    assert payload.sets.sufficient(best) and not payload.sets.sufficient(frozenset())
    assert payload.sets.log_posterior(best) > payload.sets.log_posterior(frozenset()) + 5.0


def test_only_the_best_single_effects_are_fitted_to_the_end(payload):
    """The others are begun, and known all the same."""
    quick = selection(payload.problem.model, payload.problem.measurements[0], refits=1, beam=1)
    ended = {names for names, fit in quick.sets.fits.items()
             if len(names) == 1 and fit.covariance is not None}
    known = {frozenset([name]) for name in TRIED}
    assert known <= set(quick.sets.fits) and known <= set(payload.sets.fits)
    assert frozenset(['payload_error']) in ended < known
    assert quick.sets.valid()[0] == payload.sets.valid()[0]


def test_a_fit_that_is_better_from_the_least_squares_on_is_kept(model, monkeypatch):
    """Under a covariance the way to the maximum may be too rough."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
    found.fitting._refined.clear()
    monkeypatch.setattr(found.fitter, 'polished', lambda fit: dataclasses.replace(
        fit, log_evidence=1e6))
    found.fitting.refine(1)
    assert found.sets.fits[frozenset(['payload_error'])].log_evidence == 1e6


def test_what_an_effect_changes_is_as_uncertain_as_its_equation(payload):
    """By the share `form` with two standard deviations, besides the base model's own error."""
    fit = payload.sets.fits[frozenset(['payload_error'])]
    own = discrepancy_along(payload.problem, fit.effects, fit.predicted, payload.settings, TRIED)
    change = fit.predicted - payload.sets.base.predicted
    found = np.diag(payload.fitter.discrepancy(fit).matrix())
    assert found == pytest.approx(
        np.diag(own.matrix()) + (0.5 * payload.settings.form * change) ** 2)
    assert np.max(np.abs(change)) > 0.02


def test_a_set_suffices_as_far_as_model_and_equation_may_be_off(payload, monkeypatch):
    """Along the way that the arm takes with the set: 95 % of draws of that error are smaller."""
    names = frozenset(['payload_error'])
    matrix = payload.fitter.discrepancy(payload.sets.fits[names]).matrix()
    rng = np.random.default_rng(8)
    draws = rng.multivariate_normal(np.zeros(len(matrix)), matrix, 4000, method='eigh')
    sizes = np.sqrt(np.mean(draws ** 2, axis=1)) * np.exp(
        payload.settings.scale_spread * rng.standard_normal(4000))
    limit = np.quantile(sizes, 0.95)
    assert limit < payload.sets.rmse_95
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
    own = 3.0 * sets.rmse_95
    further = own ** 2 - sets.rmse_95 ** 2
    monkeypatch.setattr(sets, '_largest_errors', {})
    monkeypatch.setattr(sets, '_largest_error', lambda covariance: own)
    errors = {frozenset(): np.sqrt(1.0 + explained * further), names: 1.0}
    monkeypatch.setattr(sets, 'own_error', lambda one: errors[one])
    counts = {0.0: 0.0, 0.5: 0.125, 1.0: 0.25, 2.0: 0.5, 50.0: 0.98}[explained]
    limit = np.sqrt(sets.rmse_95 ** 2 + counts * further)
    for share, enough in ((0.999, True), (1.001, False)):
        monkeypatch.setattr(sets, 'noise_free_rmse', lambda one, left=share * limit: left)
        assert bool(sets.sufficient(names)) is enough


def test_a_set_without_effects_suffices_as_far_as_the_model_may_be_off(payload, monkeypatch):
    for share, enough in ((0.99, True), (1.01, False)):
        monkeypatch.setattr(payload.sets, 'noise_free_rmse',
                            lambda one, left=share * payload.sets.rmse_95: left)
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


def test_with_other_effects_the_best_starts_are_still_the_best(model):
    """Chosen by the derivatives that they had alone, and linearised anew."""
    measured = recording(model, [effect_of(model, 'payload_error', dm=15.0),
                                 effect_of(model, 'encoder_eccentricity', e=4.0, phi=1.0)])
    found = selection(model, measured, ('payload_error', 'encoder_eccentricity'))
    fitter, fit = found.fitter, found.sets.fits[frozenset(['payload_error'])]
    names, own = ['encoder_eccentricity'], found.fitter.point(fit)
    residual = found.problem.measured - fit.predicted
    every = Linearised([own], residual, linearised_starts(fitter, fit, names))
    few = Linearised([own], residual, linearised_starts(
        fitter, fit, names, found.alone.starts, own))
    assert len(few.starts) < len(every.starts)
    assert few.singles()[tuple(names)][0] == pytest.approx(every.singles()[tuple(names)][0])


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
    monkeypatch.setitem(payload.sets._largest_errors, small,
                        (payload.sets.fits[small].covariance, 1.5 * payload.sets.rmse_95))
    for odds, small_error, would_do in ((0.1, 1.2, False), (0.1, 0.9, True), (-0.1, 1.2, True)):
        errors = {small: small_error * payload.sets.rmse_95, larger: 0.8 * payload.sets.rmse_95}
        monkeypatch.setattr(payload.sets, 'noise_free_rmse', lambda names: errors.get(names, 1.0))
        monkeypatch.setattr(payload.sets, 'log_posterior', {small: least, larger: least + odds}.get)
        assert payload.sets._would_do(small, larger) == would_do


def two_effects(model):
    """Return a recording of an arm that carries 25 g more, of a supply that sags."""
    return recording(model, [effect_of(model, 'payload_error', dm=25.0),
                             effect_of(model, 'supply_sag', Rs=0.8)])


def test_two_effects_are_found_as_a_pair_where_neither_suffices():
    """A lighter payload hides a sag in part, so that either alone explains nothing."""
    model = bicep_model(metrics={'length': {'verification': {'rmse': 0.0001}}})
    found = selection(model, recording(model, [
        effect_of(model, 'payload_error', dm=-15.0), effect_of(model, 'supply_sag', Rs=0.8)]))
    planted = frozenset(['payload_error', 'supply_sag'])
    assert found.sets.valid()[0] == planted
    assert found.sets.sufficient(planted)
    for name in planted:
        assert not found.sets.sufficient(frozenset([name]))


def test_two_effects_behind_one_are_found_as_a_pair(model):
    """A heavier payload may leave no more than the bench's error, but not with that shape."""
    found = diagnose(model, [two_effects(model)], TRIED)
    assert (found.verdict, set(found.missing)) == ('missing', {'payload_error', 'supply_sag'})


@pytest.mark.slow
@pytest.mark.parametrize('hidden, judged', [
    ({'payload_error': {'dm': -15.0}, 'supply_sag': {'Rs': 0.8}}, None),
    ({'end_stop': {}, 'payload_error': {'dm': 25.0}}, 'payload_error')],
    ids=['all', 'least-squares'])
def test_sets_are_fitted_in_the_units_that_they_are_judged_by(hidden, judged):
    """Fitted once more from their values they gain nothing, where the way there is rough, too."""
    model = bicep_model(metrics={'length': {'verification': {'rmse': 1e-4}}})
    effects = [effect_of(model, name, **values) for name, values in hidden.items()]
    found = selection(model, recording(model, effects),
                      [*TRIED, 'airflow', 'pwm_dead_zone', 'end_stop'])
    for names, fit in found.sets.fits.items():
        if judged is None or names == {judged}:
            assert found.fitter.polished(fit).log_evidence < fit.log_evidence + 1.0, names


def test_a_pair_that_is_stuck_is_fitted_from_all_starts(monkeypatch):
    """The start that is best by linearisation may be one that no fit gets away from."""
    model = bicep_model(metrics={'length': {'verification': {'rmse': 1e-4}}})
    names = frozenset(['payload_error', 'supply_sag'])
    measured = recording(model, [effect_of(model, 'payload_error', dm=-15.0),
                                 effect_of(model, 'supply_sag', Rs=0.8)])
    found = selection(model, measured)
    good = found.sets.fits[names]
    stuck, = found.fitter.fit([[effect.with_values(**dict.fromkeys(effect.values, 1e-3))
                                for effect in good.effects]], found.fitting.metric, 0)
    assert stuck.log_evidence < good.log_evidence - 20.0
    monkeypatch.setitem(found.sets.fits, names, stuck)
    monkeypatch.setattr(found, 'settings', dataclasses.replace(found.settings, refits=6))
    found._fit_from_all_starts(2)
    assert found.sets.fits[names].log_evidence > good.log_evidence - 1.0


@pytest.mark.parametrize('change, tried', [(0.0, []), (0.2, [2])])
def test_all_starts_are_tried_where_nothing_suffices(model, monkeypatch, change, tried):
    sizes = []
    monkeypatch.setattr(Selection, '_fit_from_all_starts', lambda _, size: sizes.append(size))
    measured = recording(model, [effect_of(model, 'payload_error', dm=15.0)])
    shape = np.sin(7.0 * np.arange(measured.rows) ** 1.5)
    angle = measured.column('angle') + change * shape
    selection(model, Measurement.from_columns({**measured.columns, 'angle': angle}))
    assert sizes == tried


def test_what_suffices_alone_grows_alone(payload, monkeypatch):
    """Of sets of several effects; of single effects all the most probable ones do."""
    small, pair = frozenset(['payload_error']), frozenset(['payload_error', 'frame_tilt'])
    monkeypatch.setattr(payload, '_promising', lambda names: True)
    monkeypatch.setattr(payload.covariance, 'size', 0.0)
    assert payload._worth_growing(1) == payload.sets.best_of(1)
    assert payload._worth_growing(2) == []
    for ranks in ('valid', 'ranked'):
        monkeypatch.setattr(payload.sets, ranks, lambda: [pair, small])
    monkeypatch.setitem(payload.sets.fits, pair, payload.sets.fits[small])
    assert payload._worth_growing(2) == [pair]
    monkeypatch.setattr(payload, '_promising', lambda names: False)
    assert payload._worth_growing(2) == []
    monkeypatch.setattr(payload.sets, 'noise_free_rmse', lambda names: 2.0 * payload.sets.rmse_95)
    assert payload._worth_growing(2) == payload.sets.best_of(2)


def test_sets_grow_on_where_what_cannot_be_the_answer_is_more_probable(payload, monkeypatch):
    """It stands for something that a larger set may name."""
    assert payload._worth_growing(1) == []
    order = payload.sets.ranked()
    other = next(names for names in order if len(names) == 1 and names != {'payload_error'})
    monkeypatch.setattr(payload.sets, 'ranked', lambda: [other, *order])
    monkeypatch.setattr(payload.sets, 'valid', lambda: [frozenset(['payload_error'])])
    assert payload._worth_growing(1) == payload.sets.best_of(1) != []


PLANTED = frozenset(['payload_error', 'supply_sag'])


def without_the_planted_pair():
    """Return a selection that has not found what is there, and the log evidence of that."""
    model = bicep_model(metrics={'length': {'verification': {'rmse': 0.0001}}})
    found = selection(model, recording(model, [
        effect_of(model, 'payload_error', dm=-15.0), effect_of(model, 'supply_sag', Rs=0.8)]),
        [*TRIED, 'airflow'])
    return found, found.sets.fits.pop(PLANTED).log_evidence


@pytest.mark.parametrize('fails', ['linearised', 'as started'])
def test_one_effect_of_the_answer_is_exchanged_for_a_better_one(monkeypatch, fails):
    """A fan is a sag to an arm at rest; in its place the sag is found, by either score."""
    found, before = without_the_planted_pair()
    assert found.sets.valid()[0] == {'airflow', 'payload_error'}
    if fails == 'linearised':
        monkeypatch.setattr(Linearised, 'singles', lambda linearised: {})
    else:
        monkeypatch.setattr('hysteresis_ros.diagnosis.selection.singles_as_started',
                            lambda fitter, fit, names: {})
    found._exchange()
    assert found.sets.fits[PLANTED].log_evidence == pytest.approx(before, abs=1.0)


def test_of_what_changes_much_the_start_that_is_nearest_is_tried(model):
    """Where the wire hardly transforms any more, no derivative says what a larger value does."""
    hidden = [effect_of(model, 'pwm_dead_zone', Vd=1.2), effect_of(model, 'supply_sag', Rs=0.9)]
    found = selection(model, recording(model, hidden), ['pwm_dead_zone', *TRIED])
    kept, = found.fitter.fit([hidden[:1]], found.fitting.metric, 0)
    scored = singles_as_started(found.fitter, kept, ['supply_sag', 'payload_error'])
    error, (start,) = scored['supply_sag',]
    assert start.Rs == 1.0
    assert -error == pytest.approx(found.fitter.error(found.fitter.simulate([[*kept.effects,
                                                                            start]])[0]))
    assert error > scored['payload_error',][0]


def test_a_further_effect_that_only_led_out_of_a_local_minimum_is_no_answer(model):
    """What is left without it is fitted from where it ended, once."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
    single = frozenset(['payload_error'])
    offset = catalogue()['encoder_offset'](model.surroundings)
    least = 1.01 * next(one.low for one in offset.parameters if one.name == 'offset')
    pair, = found.fitter.fit([[*found.sets.fits[single].effects,
                               offset.with_values(offset=least)]], found.fitting.metric, 0)
    stuck, = found.fitter.fit([[effect_of(model, 'payload_error', dm=1.0)]], found.fitting.metric,
                              0)
    found.sets.fits = {frozenset(): found.sets.base, frozenset(pair.names): pair, single: stuck}
    found.sets.keep_least(single, stuck.predicted)
    assert found.sets.valid()[0] == {'payload_error', 'encoder_offset'}
    found.fitting.refine_best()
    assert found.sets.valid()[0] == single
    assert found.sets.fits[single].effects[0].dm == pytest.approx(15.0, abs=1.0)
    # Nothing is left that a larger set would begin better.
    assert found.fitting._worth_fitting_without(frozenset(pair.names)) == []


def test_what_is_not_physical_is_exchanged_for_what_it_stands_for(monkeypatch):
    """A fan that would have to blow harder than any does is the sag."""
    found, before = without_the_planted_pair()
    monkeypatch.setattr(Fit, 'implausible',
                        lambda fit: ['airflow.beta'] if 'airflow' in fit.names else [])
    assert found._to_exchange() == ({'airflow', 'payload_error'}, ['airflow'])
    found._exchange()
    assert found.sets.fits[PLANTED].log_evidence == pytest.approx(before, abs=1.0)
    assert found.sets.valid()[0] == PLANTED


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


def test_p_values_are_those_of_the_whole_family(model):
    """The more effects could have been named by chance, the less is a gain worth."""
    measured = recording(model, noise=0.035)
    alone, among = (selection(model, measured, names).sets.p_values for names in (
        ('payload_error',), TRIED))
    assert set(among) == set(TRIED)
    assert min(among.values()) > 0.05
    assert among['payload_error'] >= alone['payload_error'] - 0.05


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


def test_a_planted_effect_has_the_smallest_p_value_that_the_draws_allow(payload):
    """No draw of chance gains as much."""
    assert payload.sets.p_values['payload_error'] == pytest.approx(
        1.0 / (1 + payload.settings.draws))


def test_the_same_seed_gives_the_same_p_values(model):
    """And another one others, or nothing would be drawn."""
    measured = recording(model, noise=0.035)
    first, again, other = (selection(model, measured, TRIED[:2], seed).sets.p_values
                           for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_a_recording_that_shows_none_of_the_effects_asked_for_is_judged(model):
    """What a lag does is gone in settled rows; that something happened may still be seen."""
    told = diagnose(model, [recording(model)], ['thermal_lag'])
    assert (told.missing, told.ranking, told.event) == ([], [], None)
    assert told.verdict == 'not_excited'
    assert told.not_excited == {'thermal_lag': 'every row is settled'}
    told = diagnose(model, [recording(model, change=0.15 * (np.arange(90) >= 52))], [])
    assert (told.verdict, told.missing) == ('unknown', []) and told.event is not None


def test_noise_is_no_evidence_for_any_effect(model):
    """Two degrees of white noise, and no set is an answer; the model itself suffices."""
    found = selection(model, recording(model, noise=0.035))
    assert found.sets.valid() == [frozenset()]
    assert found.sets.ranked()[0] == frozenset()
    assert found.sets.base.noise == pytest.approx(0.035, rel=0.2)


def test_something_that_happened_once_has_its_time(model):
    """A step of the angle at a moment: an unknown, told by when it happened."""
    rows = 90
    row = 52
    measured = recording(model, change=0.15 * (np.arange(rows) >= row))
    found = selection(model, measured, ('payload_error', 'supply_sag'))
    time, log_posterior = events.most_probable(found.problem, found)
    assert abs(time - found.problem.clock[row]) <= 60.0
    best = max((found.sets.log_posterior(names) for names in found.sets.valid()), default=-np.inf)
    assert log_posterior > best
    told = diagnose(model, [measured], ['payload_error', 'supply_sag'])
    assert (told.verdict, told.missing, told.event) == ('unknown', [], time)


@pytest.mark.parametrize('of_length', [False, True])
def test_an_event_has_the_evidence_of_a_column_of_unknown_size(model, of_length):
    """Of each moment, in the angle or in the length, equally probable: integrated over the size."""
    row = 40
    gain = sensitivity(problem_for(model, [recording(model)]), [])
    shape = gain / np.sqrt(np.mean(gain ** 2)) if of_length else np.ones(90)
    found = selection(model, recording(model, change=0.1 * shape * (np.arange(90) >= row)), ())
    problem, rows = found.problem, 90 - 2 * int(events.MARGIN * 90)
    residual = problem.measured - found.sets.base.predicted
    moment, total = events.most_probable(problem, found)
    assert moment == problem.clock[row]
    best, spread = -np.inf, np.sqrt(np.mean(residual ** 2))
    sizes = spread * np.linspace(-8.0, 8.0, 20001)
    for point in found.covariance.points:
        for one in (np.ones(90), gain / np.sqrt(np.mean(gain ** 2))):
            whitened = point.whiten(np.column_stack([residual, one * (np.arange(90) >= row)]))
            density = stats.norm(scale=spread).logpdf(sizes) + point.log_density(
                whitened[:, :1] - whitened[:, 1:] * sizes)
            best = max(best, special.logsumexp(density) + np.log(sizes[1] - sizes[0]))
    odds = np.log(found.settings.prior / (1.0 - found.settings.prior))
    assert total == pytest.approx(best / found.sets.temper + odds - np.log(2 * rows), abs=0.3)


def test_an_event_has_to_explain_more_than_the_base_models_own_error():
    """A step that the bench's error could have caused is none."""
    for rmse, happened in ((0.0001, True), (0.004, False)):
        model = bicep_model(metrics={'length': {'verification': {'rmse': rmse}}})
        found = selection(model, recording(model, change=0.03 * (np.arange(90) >= 40)), ())
        assert np.isfinite(events.most_probable(found.problem, found)[1]) == happened


def test_what_martensite_keeps_is_no_event(monkeypatch):
    """However much of a step a share of it would explain; of another course it hides nothing."""
    step = 0.03 * (np.arange(90) >= 40)
    model = bicep_model(metrics={'length': {'verification': {'rmse': 0.0001}}})
    found = selection(model, recording(model, change=step), ())
    for kept, happened in ((2.0 * step, False), (step[::-1] - step, True)):
        monkeypatch.setattr(found.covariance, 'discrepancy', dataclasses.replace(
            found.covariance.discrepancy, kept=kept))
        assert np.isfinite(events.most_probable(found.problem, found)[1]) == happened


def test_a_recording_without_an_event_has_none(model):
    """An effect that acts all the time is more probable than a step."""
    measured = recording(model, [effect_of(model, 'payload_error', dm=15.0)])
    told = diagnose(model, [measured], ['payload_error', 'supply_sag'])
    assert (told.verdict, told.event) == ('missing', None)


def test_what_cannot_be_told_apart_is_named_as_an_alternative(model):
    """A tilt and an offset of the encoder: whichever is named, the planted one is reported."""
    measured = recording(model, [effect_of(model, 'encoder_offset', offset=3.0)])
    told = diagnose(model, [measured], ['encoder_offset', 'frame_tilt', 'supply_sag'])
    assert told.verdict == 'missing'
    assert 'encoder_offset' in {*told.missing, *(n for some in told.alternatives for n in some)}
    sets = {tuple(row['effects']): row['probability'] for row in told.sets}
    assert sum(sets.values()) == pytest.approx(1.0)
    assert sets[tuple(sorted(told.missing))] == max(sets.values())


def test_of_starts_without_any_effect_a_fit_still_finds_the_stop(model):
    """A stop is looked for where the response ends, though stops out of reach change nothing."""
    clean = recording(model)
    stop = float(np.quantile(clean.column('angle'), 0.5))
    measured = recording(model, [effect_of(model, 'end_stop', stop=stop, side=1.0, stiffness=8.0)])
    told = diagnose(model, [measured], ['end_stop', 'payload_error'])
    assert told.missing == ['end_stop']
    assert told.effects[0].values['stop'] == pytest.approx(stop, abs=0.03)
