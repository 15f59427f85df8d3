# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits of effects to measured rows: their parameters, their starts, and what is held out."""

import dataclasses
import math

from hypothesis import given, strategies as st
from model_support import bicep_model, effect_of, runs, STRENGTHS
import numpy as np
import pytest

from hysteresis_ros.diagnosis.arm_fit import _Walk, FACTOR, Fit, Fitter
from hysteresis_ros.diagnosis.covariance import Covariance
from hysteresis_ros.diagnosis.discrepancy import Discrepancy
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.linearised import Linearised, linearised_starts
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of, usual
from hysteresis_ros.effects import catalogue
from hysteresis_ros.measurements import Measurement

# Root mean square of the discrepancy that the fits below expect [rad], and noise of the sensor.
SIZE, NOISE = 0.01, 1e-3


def fitter_of(model, measured, jobs=1):
    """Return a fitter on a recording, under a smooth discrepancy and noise."""
    problem = problem_for(model, [measured], jobs=jobs)
    drive = problem.signals['drive'] / 6.0
    discrepancy = Discrepancy(np.full((len(drive), 1), SIZE), drive[:, None] / 0.45,
                              np.zeros((len(drive), 0)), np.zeros((len(drive), 0)),
                              np.zeros((len(drive), 0)))
    covariance = Covariance(discrepancy, problem.clock, problem.trial, NOISE, np.inf, 0.3)
    covariance.add(covariance.start(0.1, 0.3))
    return Fitter(problem, covariance, lambda fit: discrepancy)


def noisy(model, effects=(), seed=3, **how):
    """Return an arm run of the model with effects, with white noise on its angle."""
    clean = runs(model.with_effects([*model.effects, *effects]), rows=40, **how)
    noise = NOISE * np.random.default_rng(seed).standard_normal(clean.rows)
    return Measurement.from_columns({**clean.columns, 'angle': clean.column('angle') + noise})


def neutral(fitter, name):
    """Return an effect at the value in the middle of its starts."""
    return usual([catalogue()[name](fitter.problem.model.surroundings)], 'arm')[0]


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


@pytest.fixture(scope='module')
def loaded(model):
    """Return a fitter on a run of the arm with 15 g too much."""
    return fitter_of(model, noisy(model, [effect_of(model, 'payload_error', dm=15.0)]))


@pytest.mark.parametrize('name', sorted(STRENGTHS))
def test_a_vector_gives_back_the_values_it_was_made_of(name):
    """Logarithms and units of the plausible range cancel."""
    effect = effect_of(bicep_model(), name)
    for kind in effect.kinds:
        parameters = ParameterVector([effect], kind)
        again, = parameters.with_vector(parameters.vector())
        fitted = [parameter.name for _, parameter in parameters.entries
                  if parameter.name in STRENGTHS[name]]
        for each in fitted:
            assert again.values[each] == pytest.approx(effect.values[each], rel=1e-9)
        assert np.all(parameters.lower < parameters.upper)


@given(st.sampled_from(sorted(STRENGTHS)), st.lists(
    st.floats(-1e3, 1e3), min_size=4, max_size=4))
def test_no_vector_leads_out_of_the_bounds(name, numbers):
    """Whatever the optimiser tries, the effect gets values that it accepts."""
    parameters = ParameterVector([effect_of(bicep_model(), name)], 'arm')
    effect, = parameters.with_vector(np.array(numbers[:len(parameters)]))
    for _, parameter in parameters.entries:
        low, high = parameter.bounds
        slack = 1e-9 * (high - low)
        assert low - slack <= effect.values[parameter.name] <= high + slack


@pytest.mark.parametrize('name, values', [
    ('payload_error', {'dm': 3.0}), ('payload_error', {'dm': -3.0}), ('airflow', {'beta': 0.97}),
    ('airflow', {'beta': 1.03}), ('supply_sag', {'Rs': 0.08})])
def test_what_changes_little_is_near_a_start(model, name, values):
    """Linearised where it changes the angle by ten times as much it scores behind all others."""
    fitter = fitter_of(model, noisy(model))
    base = fitter.problem.simulate([])
    true = effect_of(model, name, **values)
    change = fitter.problem.simulate([true]) - base
    starts = linearised_starts(
        fitter, Fit([], np.zeros(0), base, np.zeros((len(base), 0))), [name])
    parameters = ParameterVector([true], 'arm')
    mean, spread = parameters.prior()
    off = [np.std(start.change + start.columns @ ((parameters.vector() - mean) / spread) - change)
           for start in starts if all(start.effect.values[other.name] == true.values[other.name]
                                      for other in true.parameters if other.choices)]
    assert min(off) < 0.5 * np.std(change)


def test_vectors_of_two_effects_stay_apart():
    """Each component moves its own effect and no other."""
    model = bicep_model()
    effects = [effect_of(model, 'payload_error'), effect_of(model, 'encoder_offset')]
    parameters = ParameterVector(effects, 'arm')
    vector = parameters.vector()
    vector[1] *= 0.5
    first, second = parameters.with_vector(vector)
    assert first.values == pytest.approx(effects[0].values)
    assert second.values['offset'] == pytest.approx(0.5 * effects[1].values['offset'])


def test_intervals_are_given_in_the_unit_of_the_parameter():
    """A logarithmic component has an interval by a factor."""
    parameters = ParameterVector([effect_of(bicep_model(), 'thermal_lag')], 'arm')
    vector = parameters.vector()
    effect, = parameters.with_intervals(vector, np.full(len(vector), np.log(1.5)))
    low, high = effect.intervals['time_constant']
    assert (low, high) == pytest.approx((3.0 / 1.5, 3.0 * 1.5))


@pytest.mark.parametrize('name', sorted(catalogue()))
def test_fits_start_from_different_plausible_values(name):
    """At most as many as asked for, ends included, none twice."""
    effect = catalogue()[name](bicep_model().surroundings)
    for kind in effect.kinds:
        starts = starts_of(effect, kind, most=5)
        assert 1 <= len(starts) <= 5
        values = [tuple(sorted(start.values.items())) for start in starts]
        assert len(set(values)) == len(values)
        assert not any(start.implausible() for start in starts)


@pytest.mark.parametrize('name', sorted(STRENGTHS))
def test_the_plausible_range_is_the_middle_of_the_prior(name):
    """One and a half standard deviations to each side; signed ones are as often negative."""
    effect = effect_of(bicep_model(), name)
    parameters = ParameterVector([effect], 'arm')
    mean, spread = parameters.prior()
    assert np.all(spread > 0.0)
    for index, (_, parameter) in enumerate(parameters.entries):
        ends = []
        for side in (-1.5, 1.5):
            vector = parameters.vector()
            vector[index] = mean[index] + side * spread[index]
            ends.append(parameters.with_vector(vector)[0].values[parameter.name])
        low = -parameter.high if parameter.both_signs else parameter.low
        expected = np.clip([low, parameter.high], *parameter.bounds)
        assert ends == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_the_fit_finds_a_planted_payload(loaded):
    """With its interval, and on the rows that were held out."""
    fit, = loaded.fit([[neutral(loaded, 'payload_error')]], loaded.covariance.points[0])
    found, = loaded.with_intervals(fit)
    assert found.values['dm'] == pytest.approx(15.0, abs=1.0)
    low, high = found.intervals['dm']
    assert low < 15.0 < high and high - low < 6.0
    assert fit.implausible() == []
    checked, = loaded.cross_validate([fit])
    assert loaded.error(checked.held_out) < 2.0 * NOISE
    assert loaded.error(loaded.simulate([[]])[0]) > 0.02


def test_a_fit_is_the_maximum_of_the_posterior(loaded):
    """A little to either side the whitened residuals and the prior cost more."""
    point = loaded.covariance.points[0]
    fit, = loaded.fit([[neutral(loaded, name) for name in ('payload_error', 'supply_sag')]], point)
    parameters = ParameterVector(fit.effects, 'arm')
    mean, spread = parameters.prior()

    def cost(vector):
        predicted, = loaded.simulate([parameters.with_vector(vector)])
        whitened = point.whiten(loaded.problem.measured - predicted)
        return whitened @ whitened + np.sum(((vector - mean) / spread) ** 2)

    best = cost(fit.vector)
    deviation = np.sqrt(np.diag(fit.spread))
    for index in range(len(fit.vector)):
        for side in (-1.0, 1.0):
            moved = fit.vector.copy()
            moved[index] += side * deviation[index]
            assert cost(np.clip(moved, parameters.lower, parameters.upper)) > best


def test_a_first_look_carries_derivatives_on_by_secants(loaded, monkeypatch):
    """It gets nearly as far in three steps, for fewer simulations."""
    point = loaded.covariance.points[0]
    start = [neutral(loaded, name) for name in ('payload_error', 'geometry_error')]
    simulated = []

    def count(sets):
        simulated[-1] += len(sets)
        return Fitter.simulate(loaded, sets)

    monkeypatch.setattr(loaded, 'simulate', count)
    fits = []
    for how in ({'steps': 0}, {'steps': 3}, {'steps': 3, 'exact': False}):
        simulated.append(0)
        fits += loaded.fit([start], point, **how)
    begun, exact, rough = fits
    assert simulated[2] < 0.75 * simulated[1]
    assert rough.log_evidence - begun.log_evidence > 0.9 * (
        exact.log_evidence - begun.log_evidence) > 0.0


def test_a_fit_is_polished_under_the_covariance_that_it_is_judged_by(loaded, monkeypatch):
    """That of its own way, whose rows may count quite differently."""
    problem = loaded.problem
    drive = problem.signals['drive'] / 6.0
    parts = np.where(drive > 0.5, 10.0, 0.1)[:, None] * SIZE
    other = dataclasses.replace(loaded.covariance.discrepancy, parts=parts)
    monkeypatch.setattr(loaded, 'discrepancy', lambda fit: other)
    start = [[neutral(loaded, 'supply_sag')]]
    fit, = loaded.fit(start, loaded.covariance.points[0])
    along = loaded.along(fit)
    polished = loaded.polished(along)
    direct = loaded.along(loaded.fit(start, loaded.point(along))[0])
    assert polished.log_evidence > along.log_evidence + 1.0
    assert polished.log_evidence == pytest.approx(direct.log_evidence, abs=0.5)
    assert polished.covariance is along.covariance


def test_several_sets_in_one_batch_are_fitted_as_each_by_itself(loaded):
    """None knows of the others."""
    sets = [[neutral(loaded, name) for name in names] for names in (
        ('payload_error',), ('encoder_offset', 'supply_sag'), ('frame_tilt',))]
    point = loaded.covariance.points[0]
    together = loaded.fit(sets, point)
    assert [fit.names for fit in together] == [
        ('payload_error',), ('encoder_offset', 'supply_sag'), ('frame_tilt',)]
    for fit, effects in zip(together, sets):
        alone, = loaded.fit([effects], point)
        assert fit.vector == pytest.approx(alone.vector, abs=1e-9)
        assert fit.log_evidence == pytest.approx(alone.log_evidence, abs=1e-6)
        assert fit.predicted == pytest.approx(alone.predicted, abs=1e-9)


def test_a_set_that_was_simulated_before_is_not_simulated_again(model, monkeypatch):
    """But where the phase is sought, which begins with that of the run before."""
    fitter = fitter_of(model, noisy(model))
    simulator, = fitter.problem.simulators
    run_many, simulated = simulator.run_many, []

    def count(sets, jobs):
        simulated.extend(effect.id for effects in sets for effect in effects)
        return run_many(sets, jobs)

    monkeypatch.setattr(simulator, 'run_many', count)
    sets = [[effect_of(model, 'payload_error', dm=15.0)], [effect_of(model, 'resistance_change')]]
    first = fitter.simulate(sets)
    again = fitter.simulate([[effect_of(model, 'payload_error', dm=20.0)], *sets])
    assert simulated == ['payload_error', 'resistance_change'] * 2
    np.testing.assert_array_equal(again[1], first[0])
    assert np.ptp(again[:, -1]) > 0.0 and not np.array_equal(again[0], again[1])


def test_no_effects_are_a_fit_too(loaded):
    """The base model, with an evidence that the planted effect exceeds by far."""
    point = loaded.covariance.points[0]
    base, = loaded.fit([[]], point)
    planted, = loaded.fit([[neutral(loaded, 'payload_error')]], point)
    assert base.vector.shape == (0,) and base.names == ()
    assert np.array_equal(base.predicted, loaded.simulate([[]])[0])
    assert planted.log_evidence > base.log_evidence + 20.0


def test_a_start_without_any_effect_has_no_better_evidence_than_the_base(loaded):
    """A stop out of reach changes nothing, and its prior has to be paid for."""
    highest = float(np.max(loaded.problem.measured))
    stop = neutral(loaded, 'end_stop').with_values(stop=min(highest + 0.8, 3.1), side=1.0)
    point = loaded.covariance.points[0]
    base, = loaded.fit([[]], point)
    fit, = loaded.fit([[stop]], point, steps=0)
    assert fit.predicted == pytest.approx(base.predicted, abs=1e-9)
    assert np.all(np.isfinite(fit.spread)) and np.isfinite(fit.log_evidence)
    assert fit.log_evidence <= base.log_evidence + 1e-6


def test_a_set_whose_simulation_fails_is_left_out(loaded, monkeypatch):
    """The others of the batch are fitted as if it were not there."""
    simulate = loaded.problem.simulate_many

    def failing(sets):
        responses = simulate(sets)
        for response, effects in zip(responses, sets):
            if any(effect.id == 'frame_tilt' for effect in effects):
                response[:] = np.nan
        return responses
    monkeypatch.setattr(loaded.problem, 'simulate_many', failing)
    fits = loaded.fit([[neutral(loaded, 'frame_tilt')], [neutral(loaded, 'payload_error')]],
                      loaded.covariance.points[0])
    assert [fit.names for fit in fits] == [('payload_error',)]


@pytest.mark.parametrize('noise', [1e-3, 1e-2])
def test_intervals_hold_the_truth_about_as_often_as_they_say(model, noise):
    """Of 40 draws of noise and discrepancy at least 33, and they are no wider than needed."""
    truth = effect_of(model, 'payload_error', dm=15.0)
    fitter = fitter_of(model, noisy(model, [truth]))
    clean = fitter.simulate([[truth]])[0]
    values = fitter.covariance.start(0.1)
    values[3] = np.log(noise)
    point = fitter.covariance.point(values)
    fitter.covariance.points[:] = [point]
    rng, held, away, widths = np.random.default_rng(6), 0, [], []
    for _ in range(40):
        fitter.problem.measured = clean + point.factor @ rng.standard_normal(len(clean))
        fit, = fitter.fit([[truth]], point)
        found, = fitter.with_intervals(fit)
        low, high = found.intervals['dm']
        held += low <= 15.0 <= high
        away.append(found.values['dm'] - 15.0)
        widths.append(high - low)
    assert held >= 33, held
    assert np.median(widths) < 2.0 * 1.96 * 1.8 * np.std(away)


def test_the_evidence_under_the_covariance_of_the_residuals_is_the_larger_one(loaded):
    """Noise and drift are estimated from the residual of a fit, which no evidence makes smaller."""
    fit, = loaded.fit([[neutral(loaded, 'supply_sag')]], loaded.covariance.points[0])
    points = list(loaded.covariance.points)
    try:
        values = loaded.covariance_values(fit)
        loaded.covariance.add(values)
        refined = loaded.refined(fit, values)
    finally:
        loaded.covariance.points[:] = points
    assert refined.log_evidence > fit.log_evidence


def test_a_fit_knows_how_long_its_recording_takes(loaded):
    """What adds up over that is implausible where the sum is."""
    fit, = loaded.fit([[neutral(loaded, 'ambient_drift')]], loaded.covariance.points[0])
    run = loaded.problem.measurements[0]
    # Its trials follow each other.
    duration = sum(float(run.column('time')[rows][-1]) for _, rows in run.split())
    assert fit.duration == pytest.approx(duration) and fit.implausible() == []
    rate = 1.2 * 8.0 / duration * 600.0
    drift = fit.effects[0].with_values(offset=0.0, rate=rate, curvature=0.0)
    assert 'ambient_drift.total' in dataclasses.replace(fit, effects=[drift]).implausible()
    slower = drift.with_values(rate=rate / 1.2)
    assert 'ambient_drift.total' not in dataclasses.replace(fit, effects=[slower]).implausible()


def test_a_fold_is_predicted_by_a_step_no_longer_than_it_helps(loaded):
    """A straight line leads astray where the response bends."""
    fit, = loaded.fit([[neutral(loaded, 'payload_error')]], loaded.covariance.points[0], steps=0)
    # Far from the minimum, with derivatives that are four times too small.
    wrong = Fit(fit.effects, fit.vector, fit.predicted, 0.25 * fit.jacobian)
    checked, = loaded.cross_validate([wrong])
    problem = loaded.problem
    assert loaded.error(checked.held_out) < loaded.error(fit.predicted)
    for fold in problem.folds:
        rows = problem.fold == fold
        assert np.mean((problem.measured - checked.held_out)[rows] ** 2) <= 1.01 * np.mean(
            (problem.measured - fit.predicted)[rows] ** 2)


def test_what_changes_nothing_in_other_rows_stays_where_they_are_to_predict(loaded):
    """Of the time of an event they say nothing; all else takes a step."""
    effects = [neutral(loaded, name) for name in ('payload_error', 'encoder_offset')]
    fit, = loaded.fit([effects], loaded.covariance.points[0], steps=0)
    trained = loaded.problem.fold != loaded.problem.folds[0]
    jacobian = fit.jacobian.copy()
    jacobian[trained, 1] = 0.0
    walk = _Walk(fit.effects, loaded.problem.kind)
    walk.vector, walk.mean = fit.vector, fit.vector + 1.0
    step = loaded._step(dataclasses.replace(fit, jacobian=jacobian), walk, trained)
    assert step[1] == 0.0 and abs(step[0]) > 1e-3


def test_the_rows_of_a_fold_do_not_help_to_predict_themselves(model, loaded):
    """Another angle in one trial changes what is foretold of the others only."""
    fit, = loaded.fit([[neutral(loaded, 'payload_error')]], loaded.covariance.points[0])
    problem = loaded.problem
    measured, rows = problem.measured, problem.fold == problem.folds[0]
    before, = loaded.cross_validate([fit])
    try:
        problem.measured = measured + 0.02 * rows
        after, = loaded.cross_validate([fit])
    finally:
        problem.measured = measured
    assert np.array_equal(before.held_out[rows], after.held_out[rows])
    assert not np.array_equal(before.held_out[~rows], after.held_out[~rows])


def test_another_compliance_than_on_the_bench_takes_the_place_of_the_first():
    """It is fitted anew, from what the bench has found; both together would count it twice."""
    model = bicep_model(['series_compliance'])
    other = effect_of(model, 'series_compliance', compliance=0.25)
    clean = runs(model.with_effects([other]), rows=40)
    fitter = fitter_of(model, clean)
    fit, = fitter.fit([list(model.effects)], fitter.covariance.points[0])
    assert fit.effects[0].values['compliance'] == pytest.approx(0.25, rel=0.1)
    assert fitter.error(fit.predicted) < 0.1 * fitter.error(fitter.simulate([[]])[0])


def test_what_the_bench_says_of_an_effect_is_one_of_its_starts():
    """An arm's wires may be those of the bench."""
    model = bicep_model(['series_compliance'])
    fitter, own = fitter_of(model, noisy(model)), model.effects[0]
    base = Fit([], np.zeros(0), fitter.simulate([[]])[0], np.zeros((len(
        fitter.problem.measured), 0)))
    found = linearised_starts(fitter, base, ['series_compliance', 'payload_error'])
    assert [start.effect.values for start in found if start.id == own.id].count(own.values) == 1


def test_a_form_that_least_squares_finds_neutral_is_no_longer_free(monkeypatch):
    """Its interval goes, and those of the others are as wide as both fits ask for."""
    model = bicep_model()
    sticking = effect_of(model, 'coulomb_friction', rest=0.3)
    fitter = fitter_of(model, noisy(model, [sticking]))
    point = fitter.covariance.points[0]
    fit, = fitter.fit([[sticking]], point)
    sliding, = fitter.fit([[fit.effects[0].with_values(rest=0.0)]], point)
    sliding = dataclasses.replace(sliding, vector=sliding.vector + 0.2)
    monkeypatch.setattr(fitter, 'fit', lambda *arguments: [sliding])
    found = fitter.least_squares(fit)
    assert (fit.spread.shape, found.spread.shape) == ((2, 2), (1, 1))
    away = abs(sliding.vector[0] - fit.vector[0]) / (FACTOR * math.sqrt(fit.spread[0, 0]))
    assert found.spread[0, 0] == pytest.approx((1.0 + away) ** 2 * fit.spread[0, 0])


def test_in_settled_rows_only_creep_that_goes_on_frees_its_time():
    """That of the bench neither."""
    model = bicep_model(['creep'])
    fitter = fitter_of(model, noisy(model))
    base = Fit([], np.zeros(0), fitter.simulate([[]])[0], np.zeros((len(
        fitter.problem.measured), 0)))
    found = linearised_starts(fitter, base, ['creep'])
    assert [start.effect.values for start in found].count(model.effects[0].values) >= 1
    assert all(start.columns.shape[1] == (2 if start.effect.kept else 1) for start in found)
    assert any(start.effect.kept for start in found)


@pytest.mark.parametrize('name', ['end_stop', 'overload', 'encoder_eccentricity', 'r_phase'])
def test_of_many_starts_the_best_is_linearised_with_other_effects(name):
    """With the derivatives that they had alone that has the best evidence which does with its."""
    model = bicep_model()
    payload = effect_of(model, 'payload_error', dm=15.0)
    fitter = fitter_of(model, noisy(model, [payload, effect_of(model, name)]))
    point, (base, other) = fitter.covariance.points[0], (
        fitter.fit([effects], fitter.covariance.points[0])[0] for effects in ([], [payload]))
    alone = linearised_starts(fitter, base, [name, 'supply_sag'])
    every = linearised_starts(fitter, other, [name, 'supply_sag'])
    few = linearised_starts(fitter, other, [name, 'supply_sag'], alone, point)
    residual = fitter.problem.measured - other.predicted
    whole, part = (Linearised([point], residual, starts).singles()[name,]
                   for starts in (every, few))
    assert whole[1][0].values == part[1][0].values
    assert whole[0] == pytest.approx(part[0], rel=1e-9)
    usual_ones = [start.values for start in starts_of(effect_of(model, name), 'arm')]
    assert len(usual_ones) > 3
    # None is of use that changes nothing, however it is moved.
    assert all(np.any(start.change) or np.any(start.columns) for start in alone)
    assert sum(start.effect.values in usual_ones for start in few) == 1
    # What the response suggests is looked at in any case.
    suggested = [start.effect.values for start in every
                 if start.id == name and start.effect.values not in usual_ones]
    assert all(values in [start.effect.values for start in few] for values in suggested)
    assert sum(start.id == 'supply_sag' for start in few) == 1


def test_what_the_response_suggests_is_a_start_in_addition():
    """Where an arm stays is where a stop may be."""
    stop = catalogue()['end_stop'](bicep_model().surroundings)
    measured = np.append(np.linspace(1.0, 1.9, 30), np.full(20, 1.9))
    guesses = stop.guesses(measured)
    assert guesses
    without, found = starts_of(stop, 'arm'), starts_of(stop, 'arm', measured)
    assert [start.values for start in found[:len(without)]] == [one.values for one in without]
    for guess, start in zip(guesses, found[len(without):], strict=True):
        assert guess.items() <= start.values.items()


def test_usual_values_keep_what_is_chosen_and_not_fitted():
    """The start in the middle, so that nothing of a former fit is left but a choice."""
    model = bicep_model()
    payload, creep = usual([effect_of(model, 'payload_error', dm=44.0),
                            effect_of(model, 'creep', c=0.4, t0=9.0, kept=1.0)], 'arm')
    assert payload.values['dm'] in {start.values['dm'] for start in starts_of(payload, 'arm')}
    assert payload.values['dm'] != 44.0
    assert creep.values['kept'] == 1.0 and creep.values['t0'] == 3.0


def test_a_form_that_ends_as_the_simplest_is_free_no_longer(monkeypatch):
    """Friction that is no larger at rest: what is left of it is one parameter."""
    model = bicep_model()
    friction, other = (effect_of(model, 'coulomb_friction', tau_c=0.02, rest=rest)
                       for rest in (0.0, 0.5))
    parameters = ParameterVector([other], 'arm')
    assert list(parameters.free_still([other])) == [True, True]
    assert list(parameters.free_still([friction])) == [True, False]

    def end_at_the_bound(walk, vector, predicted, cost):
        walk.vector, walk.active = np.array([vector[0], 0.0]), False
    monkeypatch.setattr(_Walk, 'step_to', end_at_the_bound)
    fitter = fitter_of(model, noisy(model, [effect_of(model, 'coulomb_friction', tau_c=0.04)]))
    fit, = fitter.fit([[other]], fitter.covariance.points[0])
    assert fit.effects[0].rest == 0.0
    assert fit.vector.shape == (1,) and fit.jacobian.shape[1] == 1
