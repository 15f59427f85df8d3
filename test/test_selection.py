# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which sets of effects are tried: on recordings of an arm that the model itself has made."""

import dataclasses
import math

from model_support import bicep_model, effect_of, runs
import numpy as np
import pytest
from selection_support import heavier, recording, selection, TRIED

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.discrepancy import discrepancy_along
from hysteresis_ros.diagnosis.linearised import Linearised, linearised_starts, singles_as_started
from hysteresis_ros.diagnosis.selection import Selection
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.measurements import Measurement


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


@pytest.fixture(scope='module')
def payload(model):
    """Return what is found in an arm that carries more."""
    return heavier(model)


def test_the_planted_effect_is_the_most_probable_answer(payload):
    """With its value, and its residual is no larger than the base model's own error could be."""
    best = payload.sets.valid()[0]
    assert best == {'payload_error'}
    fit = payload.sets.fits[best]
    assert fit.effects[0].values['dm'] == pytest.approx(15.0, abs=2.0)
    assert payload.sets.sufficient(best) and not payload.sets.sufficient(frozenset())
    assert payload.sets.log_posterior(best) > payload.sets.log_posterior(frozenset()) + 5.0


def test_only_the_best_single_effects_are_fitted_to_the_end(payload):
    """With what they are easily taken for; the others are begun, and known all the same."""
    tried = (*TRIED, 'backlash', 'end_stop')
    quick = selection(payload.problem.model, payload.problem.measurements[0], tried, refits=1,
                      beam=1)
    ended = {names for names, fit in quick.sets.fits.items()
             if len(names) == 1 and fit.covariance is not None}
    known = {frozenset([name]) for name in tried}
    assert known <= set(quick.sets.fits)
    assert {frozenset(['payload_error']), frozenset(['supply_sag'])} <= ended < known
    assert quick.sets.valid()[0] == payload.sets.valid()[0]


def test_what_an_effect_changes_is_as_uncertain_as_its_equation(payload):
    """By the share `form` with two standard deviations, besides the base model's own error."""
    fit = payload.sets.fits[frozenset(['payload_error'])]
    own = discrepancy_along(payload.problem, fit.effects, fit.predicted, payload.settings, TRIED)
    change = fit.predicted - payload.sets.base.predicted
    found = np.diag(payload.fitter.discrepancy(fit).matrix())
    assert found == pytest.approx(
        np.diag(own.matrix()) + (0.5 * payload.settings.form * change) ** 2)
    assert np.max(np.abs(change)) > 0.02


def test_courses_along_a_fit_are_those_at_the_shares_that_its_residual_shows(model):
    """Half of the kept strain moves a play by another way than half of what all of it does."""
    grown = model.with_effects([effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)])
    measured = recording(grown, [*grown.effects, effect_of(model, 'backlash', B=6.0),
                                 effect_of(model, 'formation_memory', kept=0.35)])
    found = selection(grown, measured, ('backlash',))
    fit = found.sets.fits[frozenset(['backlash'])]
    effects, residual = [*grown.effects, *fit.effects], found.problem.measured - fit.predicted
    along, whole = (discrepancy_along(found.problem, effects, fit.predicted, found.settings,
                                      found.names, residual=known).courses
                    for known in (residual, None))
    np.testing.assert_array_equal(found.fitter.discrepancy(fit).courses, along)
    assert np.abs(along - whole).max() > 1e-3


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


def test_two_effects_behind_one_are_found_as_a_pair(model, monkeypatch):
    """
    A heavier payload may leave no more than the bench's error, but not with that shape.

    Kinetics could have it.
    """
    monkeypatch.setattr(Kinetics, 'available', lambda surroundings: False)
    found = diagnose(model, [two_effects(model)], TRIED)
    assert (found.verdict, set(found.missing)) == ('missing', {'payload_error', 'supply_sag'})


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


@pytest.mark.slow
@pytest.mark.parametrize('change, tried', [(0.0, []), (0.2, [2])])
def test_all_starts_are_tried_where_nothing_suffices(model, monkeypatch, change, tried):
    sizes = []
    monkeypatch.setattr(Selection, '_fit_from_all_starts', lambda _, size: sizes.append(size))
    measured = recording(model, [effect_of(model, 'payload_error', dm=15.0)])
    shape = np.sin(0.25 * np.arange(measured.rows))
    angle = measured.column('angle') + change * shape
    selection(model, Measurement.from_columns({**measured.columns, 'angle': angle}))
    assert sizes == tried


def test_what_suffices_alone_grows_alone(payload, monkeypatch):
    """Where one more effect is promising."""
    small, pair = frozenset(['payload_error']), frozenset(['payload_error', 'frame_tilt'])
    monkeypatch.setattr(payload, '_promising', lambda names: True)
    monkeypatch.setattr(payload.covariance, 'size', 0.0)
    assert payload._worth_growing(1) == [small]
    assert payload._worth_growing(2) == []
    for ranks in ('valid', 'ranked'):
        monkeypatch.setattr(payload.sets, ranks, lambda: [pair, small])
    monkeypatch.setitem(payload.sets.fits, pair, payload.sets.fits[small])
    assert payload._worth_growing(2) == [pair]
    monkeypatch.setattr(payload, '_promising', lambda names: False)
    assert payload._worth_growing(2) == []
    monkeypatch.setattr(payload.sets, 'noise_free_rmse',
                        lambda names: 2.0 * payload.sets.largest_rmse)
    assert payload._worth_growing(2) == payload.sets.best_of(2)


@pytest.mark.parametrize('left, grown', [(1.01, True), (0.99, False)])
def test_all_single_effects_grow_where_one_more_has_room(payload, monkeypatch, left, grown):
    """Besides what the base model is off by in half of all cases, whatever seems promising."""
    monkeypatch.setattr(payload, '_promising', lambda names: False)
    room = left * math.hypot(payload.covariance.size, payload.sets.rmse_50)
    assert room < payload.sets.largest_rmse
    monkeypatch.setattr(payload.sets, 'own_error', lambda names: room)
    monkeypatch.setattr(payload.sets, 'noise_free_rmse', lambda names: room)
    monkeypatch.setattr(payload.sets, 'valid', lambda: [frozenset(['payload_error'])])
    assert payload._worth_growing(1) == (payload.sets.best_of(1) if grown else [])


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


@pytest.mark.slow
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


def test_what_is_easily_taken_for_an_effect_of_the_answer_is_fitted_in_its_place(monkeypatch):
    """However many others score better: a fan and a sag are named together."""
    found, before = without_the_planted_pair()
    monkeypatch.setattr(Selection, '_best_with', lambda *arguments: [])
    fitted = []
    fit = found.fitting.fit
    monkeypatch.setattr(found.fitting, 'fit', lambda sets: fitted.extend(sets) or fit(sets))
    found._exchange()
    assert found.sets.fits[PLANTED].log_evidence == pytest.approx(before, abs=1.0)
    names = [tuple(effect.id for effect in effects) for effects in fitted]
    assert ('payload_error', 'supply_sag') in names and ('airflow', 'payload_error') not in names


def test_what_could_as_well_be_the_answer_is_fitted_to_the_end(model):
    """A fan that was only begun is as good as the sag that it is taken for."""
    found = selection(model, recording(model, [effect_of(model, 'supply_sag', Rs=0.4)]),
                      [*TRIED, 'airflow', 'backlash'])
    sag, fan, play = (frozenset([name]) for name in ('supply_sag', 'airflow', 'backlash'))
    best = found.sets.fits[fan].log_evidence
    for names in (fan, play):
        found.sets.fits[names] = dataclasses.replace(
            found.sets.fits[names], covariance=None, log_evidence=best - 5.0)
    found._exchange()
    assert sag in found.sets.valid()
    assert found.sets.fits[fan].log_evidence == pytest.approx(best, abs=0.5)
    assert found.sets.fits[play].covariance is None
    # Nor need it have been begun.
    del found.sets.fits[fan]
    found._exchange()
    assert found.sets.fits[fan].log_evidence == pytest.approx(best, abs=0.5)


LAGS = ('thermal_lag', 'heating_cooling_asymmetry', 'latent_heat', 'heat_loss')


@pytest.fixture(scope='module')
def late(model):
    """Return what a recording of an arm that lags behind shows of effects with a lag in them."""
    measured = runs(model.with_effects([effect_of(model, 'thermal_lag', time_constant=4.0)]),
                    rows=60, dt=1.0)
    return selection(model, measured, LAGS)


@pytest.mark.slow
def test_an_equation_begins_also_where_the_one_that_it_contains_has_ended(late):
    """With all forms that it has, once each."""
    lag, = late.sets.fits[frozenset(['thermal_lag'])].effects
    starts = late._containing(lag)
    assert {own.id for own in starts} == set(LAGS[1:])
    assert {own.time_constant for own in starts} == {lag.time_constant}
    assert {own.linear for own in starts if own.id == 'heat_loss'} == {0.0, 0.5, 0.65, 1.0}
    keys = [(own.id, *own.values.values()) for own in starts]
    assert len(keys) == len(set(keys)) < sum(
        start.id in LAGS[1:] for start in late.alone.starts)
    asymmetry, = late.sets.fits[frozenset(['heating_cooling_asymmetry'])].effects
    assert late._containing(asymmetry) == []


def test_a_fit_that_went_astray_is_found_again_from_the_equation_that_it_contains(
        late, monkeypatch):
    """Far from there, and behind by far, it would not be named beside the lag."""
    loss, lag = frozenset(['heat_loss']), frozenset(['thermal_lag'])
    best = late.sets.fits[loss]
    astray = dataclasses.replace(best, log_evidence=best.log_evidence - 1e3)
    monkeypatch.setitem(late.sets.fits, loss, astray)
    late._end_confused_with(lag)
    assert late.sets.fits[loss].log_evidence > astray.log_evidence + 900.0


def test_an_equation_that_contains_more_is_fitted_in_the_place_of_two_effects(
        model, monkeypatch):
    """Of a lag and of what stands for what else the equation says."""
    hidden = effect_of(model, 'heat_loss', time_constant=4.0, growth=0.5, linear=1.0)
    measured = runs(model.with_effects([hidden]), rows=60, dt=1.0)
    found = selection(model, measured, ('thermal_lag', 'heat_loss', 'supply_sag'))
    loss = frozenset(['heat_loss'])
    best = found.sets.fits[loss]
    found.fitting.fit([[effect for name in ('thermal_lag', 'supply_sag')
                        for effect in found.sets.fits[frozenset([name])].effects]])
    pair = frozenset(['thermal_lag', 'supply_sag'])
    astray, = found.fitter.fit([[hidden.with_values(time_constant=25.0)]],
                               found.fitting.metric, 0)
    found.sets.fits[loss] = found.fitter.along(astray)
    found._exchanged.clear()
    monkeypatch.setattr(found, '_to_exchange', lambda: (pair, []))
    found._exchange()
    assert found.sets.fits[loss].log_evidence == pytest.approx(best.log_evidence, abs=1.0)
    assert found.sets.fits[loss].effects[0].linear == 1.0


def test_either_of_two_effects_may_say_that_it_is_confused_with_the_other(model):
    """A payload says so of the sag, which says so of the fan alone."""
    names = ('payload_error', 'supply_sag', 'airflow', 'encoder_offset')
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]), names)
    scored = found.alone.singles()

    def confused(name):
        effect, = found.sets.fits[frozenset([name])].effects
        return {effects[0].id for effects in found._confused_with([], scored, effect)}
    assert 'supply_sag' in confused('payload_error')
    assert {'payload_error', 'airflow'} <= confused('supply_sag')
    assert 'encoder_offset' not in confused('supply_sag')


@pytest.mark.parametrize('further, ended', [(-1.0, True), (-10.0, False)])
def test_what_is_confused_with_an_alternative_is_fitted_to_the_end(model, monkeypatch, further,
                                                                   ended):
    """As long as that could as well be the answer."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]),
                      [*TRIED, 'airflow'])
    answer, sag, fan = (frozenset([name]) for name in ('payload_error', 'supply_sag', 'airflow'))
    begun = dataclasses.replace(found.sets.fits[fan], covariance=None, log_evidence=-1e6)
    found.sets.fits[fan] = begun
    monkeypatch.setattr(found.sets, 'valid', lambda: [answer, sag])
    monkeypatch.setattr(found.sets, 'log_posterior', {answer: 0.0, sag: further}.get)
    found._end_confused_with(answer)
    assert (found.sets.fits[fan] is not begun) == ended


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


@pytest.mark.slow
def test_what_is_not_physical_is_exchanged_for_what_it_stands_for(monkeypatch):
    """A fan that would have to blow harder than any does is the sag."""
    found, before = without_the_planted_pair()
    monkeypatch.setattr(Fit, 'implausible',
                        lambda fit: ['airflow.beta'] if 'airflow' in fit.names else [])
    assert found._to_exchange() == ({'airflow', 'payload_error'}, ['airflow'])
    found._exchange()
    assert found.sets.fits[PLANTED].log_evidence == pytest.approx(before, abs=1.0)
    assert found.sets.valid()[0] == PLANTED


def test_p_values_are_those_of_the_whole_family(model):
    """The more effects could have been named by chance, the less is a gain worth."""
    measured = recording(model, noise=0.035)
    alone, among = (selection(model, measured, names).sets.p_values for names in (
        ('payload_error',), TRIED))
    assert set(among) == set(TRIED)
    assert min(among.values()) > 0.05
    assert among['payload_error'] >= alone['payload_error'] - 0.05


def test_a_planted_effect_has_the_smallest_p_value_that_the_draws_allow(payload):
    """No draw of chance gains as much."""
    assert payload.sets.p_values['payload_error'] == pytest.approx(
        1.0 / (1 + payload.settings.draws))


def test_a_single_effect_that_is_fitted_better_is_tested_anew(model):
    """Where its first fit was stuck, its p value is that of what it came to be."""
    found = selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
    single = frozenset(['payload_error'])
    assert all(found._tested[names] is fit.predicted
               for names, fit in found.sets.fits.items() if len(names) == 1)
    best, least = found.sets.fits[single], 1.0 / (1.0 + found.settings.draws)
    found.alone.starts = [one for one in found.alone.starts if one.id != 'payload_error']
    stuck, = found.fitter.fit([[best.effects[0].with_values(dm=0.01)]], found.fitting.metric, 0)
    found.sets.fits[single] = dataclasses.replace(stuck, jacobian=0.0 * stuck.jacobian)
    found._test_singles()
    assert found.sets.p_values['payload_error'] > 0.05
    values = dict(found.sets.p_values)
    found._test_singles()
    assert found.sets.p_values == values
    found.sets.fits[single] = best
    found._test_singles()
    assert found.sets.p_values['payload_error'] == pytest.approx(least)


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
