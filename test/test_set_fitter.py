# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Sets of effects are fitted to the maximum of their own covariance."""

import dataclasses

from model_support import bicep_model, effect_of, runs
import pytest
from selection_support import recording, selection, TRIED

from hysteresis_ros.effects import catalogue


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


def test_a_fit_that_is_better_from_the_least_squares_on_is_kept(model, monkeypatch):
    """Under a covariance the way to the maximum may be too rough."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
    found.fitting._refined.clear()
    monkeypatch.setattr(found.fitter, 'polished', lambda fit: dataclasses.replace(
        fit, log_evidence=1e6))
    found.fitting.refine(1)
    assert found.sets.fits[frozenset(['payload_error'])].log_evidence == 1e6


def test_what_leaves_the_least_error_is_fitted_to_the_end_whatever_its_evidence(
        model, monkeypatch):
    """An effect that bends the response is, after a few steps, behind what changes nothing."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
    fitting, measured = found.fitting, found.problem.measured
    begun = [dataclasses.replace(
        found.sets.fits[frozenset([name])], log_evidence=evidence, predicted=measured + error)
        for name, evidence, error in zip(TRIED, (3.0, 2.0, 1.0, 0.0), (0.4, 0.3, 0.2, 0.1))]
    ended = []
    monkeypatch.setattr(fitting.fitter, 'fit', lambda *args, **options: begun)
    monkeypatch.setattr(fitting, 'fit', lambda sets: ended.extend(
        effects[0].id for effects in sets))
    rest = fitting.begin([[]], 1)
    assert ended == [TRIED[0], TRIED[3]]
    assert [fit.names[0] for fit in rest] == list(TRIED[1:3])
    ended.clear()
    # Nothing twice.
    assert fitting.begin([[]], 4) == []
    assert ended == list(TRIED)


@pytest.mark.slow
@pytest.mark.parametrize('hidden, judged', [
    ({'payload_error': {'dm': -15.0}, 'supply_sag': {'Rs': 0.8}}, None),
    ({'end_stop': {}, 'payload_error': {'dm': 25.0}}, 'payload_error')],
    ids=['all', 'least-squares'])
def test_sets_are_fitted_in_the_units_that_they_are_judged_by(hidden, judged):
    """
    Fitted once more from their values they gain nothing, where the way there is rough, too.

    But for sets that are out of the question, by 20 nats and more, also with what they gain.
    """
    model = bicep_model(metrics={'length': {'verification': {'rmse': 1e-4}}})
    effects = [effect_of(model, name, **values) for name, values in hidden.items()]
    found = selection(model, recording(model, effects),
                      [*TRIED, 'airflow', 'pwm_dead_zone', 'end_stop'])
    sets = found.sets
    probable = max(map(sets.log_posterior, sets.fits)) - 20.0
    for names, fit in sets.fits.items():
        if judged is None or names == {judged}:
            gain = found.fitter.polished(fit).log_evidence - fit.log_evidence
            assert gain < 1.0 or sets.log_posterior(names) + gain / sets.temper < probable, names


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


def test_a_set_that_was_fitted_better_since_is_a_start_without_its_effects_again(model):
    """What it held when it was stuck itself says nothing of where it has come to."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
    single, offset = frozenset(['payload_error']), effect_of(model, 'encoder_offset', offset=0.3)
    names = single | {'encoder_offset'}

    def with_payload(dm):
        payload = effect_of(model, 'payload_error', dm=dm)
        one, = found.fitter.fit([[payload]], found.fitting.metric, 0)
        both, = found.fitter.fit([[payload, offset]], found.fitting.metric, 0)
        return one, both
    stuck, (_, early), (_, late) = with_payload(1.0)[0], with_payload(2.0), with_payload(15.0)
    found.sets.fits = {frozenset(): found.sets.base, single: stuck, names: early}
    found.sets.keep_least(single, stuck.predicted)

    def begun():
        return [one.dm for start in found.fitting._worth_fitting_without(names)
                for one in start if one.id == 'payload_error']
    assert (begun(), begun()) == ([2.0], [])
    found.sets.fits[names] = late
    assert (begun(), begun()) == ([15.0], [])


@pytest.fixture(scope='module')
def lagging(model):
    """Return what a recording of an arm that lags behind, and is 15 g heavier, shows."""
    effects = [effect_of(model, 'thermal_lag', time_constant=4.0),
               effect_of(model, 'payload_error', dm=15.0)]
    return selection(model, runs(model.with_effects(effects), rows=60, dt=1.0),
                     ['thermal_lag', 'heating_cooling_asymmetry', 'payload_error'])


@pytest.mark.parametrize('answer', [True, False])
def test_a_simpler_equation_begins_where_the_one_that_contains_it_has_ended(
        model, lagging, monkeypatch, answer):
    """Of the most probable set also where that is no answer, as fewer effects suffice."""
    found = lagging
    payload = effect_of(model, 'payload_error', dm=15.0)
    both = [effect_of(model, 'heating_cooling_asymmetry', time_constant=4.0, ratio=1.01),
            payload]
    best, = found.fitter.fit([both], found.fitting.metric, 0)
    stuck, = found.fitter.fit([[effect_of(model, 'thermal_lag', time_constant=1.0), payload]],
                              found.fitting.metric, 0)
    best, simple = found.fitter.along(best), frozenset(stuck.names)
    monkeypatch.setattr(found.sets, 'fits', {
        frozenset(): found.sets.base, simple: found.fitter.along(stuck),
        frozenset(best.names): best})
    found.sets.keep_least(simple, stuck.predicted)
    assert found.sets.ranked()[0] == frozenset(best.names)
    monkeypatch.setattr(found.sets, 'valid', lambda: [frozenset(best.names)] if answer else [])
    found.fitting.refine_best()
    lag = next(one for one in found.sets.fits[simple].effects if one.id == 'thermal_lag')
    assert lag.time_constant == pytest.approx(4.0, rel=0.02)


def test_a_simpler_equation_that_nobody_asked_for_is_not_fitted(model, lagging, monkeypatch):
    both = [effect_of(model, 'heating_cooling_asymmetry'), effect_of(model, 'payload_error')]

    def names():
        return [[one.id for one in effects] for effects in lagging.fitting._with_less(both)]
    alone = [['payload_error'], ['heating_cooling_asymmetry']]
    assert names() == [alone[0], ['payload_error', 'thermal_lag'], alone[1]]
    monkeypatch.setattr(lagging.problem, 'catalogue', ('heating_cooling_asymmetry',))
    assert names() == alone
