# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits of effects to measured rows: their parameters, their starts, and what is held out."""

import dataclasses
from types import SimpleNamespace

from hypothesis import given, strategies as st
from model_support import bicep_model, effect_of, runs, STRENGTHS
import numpy as np
import pytest

from hysteresis_ros.diagnosis.candidates import begin, consider, finish
from hysteresis_ros.diagnosis.derivatives import Derivatives
from hysteresis_ros.diagnosis.fit import Fitter
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of, usual
from hysteresis_ros.effects import catalogue


@pytest.fixture(scope='module')
def problem():
    """Return rows of a model without any error."""
    model = bicep_model()
    return problem_for(model, [runs(model)])


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


def test_another_compliance_than_on_the_bench_takes_the_place_of_the_first():
    """It is fitted anew, from what the bench has found; both together would count it twice."""
    model = bicep_model(['series_compliance'])
    other = model.with_effects([effect_of(model, 'series_compliance', compliance=0.25)])
    recorded = runs(other)
    problem = problem_for(model, [recorded])
    fitter = Fitter(problem)
    base = fitter.cross_validate(model.effects, fitter.fit(model.effects, []))
    found = consider(fitter, base, 'series_compliance')
    assert found.effect.values['compliance'] == pytest.approx(0.25, rel=0.02)
    assert found.rmse < 0.05 * fitter.error(base.held_out)


def test_the_fit_finds_a_planted_payload(problem):
    """With its interval, and on the rows that were held out."""
    truth = effect_of(problem.model, 'payload_error', dm=15.0)
    data = runs(problem.model.with_effects([truth]))
    fitter = Fitter(problem_for(problem.model, [data]))
    effect = catalogue()['payload_error'](problem.model.surroundings)
    fit = fitter.cross_validate([], fitter.search([], [], effect))
    found, = fitter.with_intervals(fit)
    assert found.values['dm'] == pytest.approx(15.0, abs=0.05)
    low, high = found.intervals['dm']
    assert low <= found.values['dm'] <= high
    assert fitter.error(fit.held_out) < 1e-3
    assert fitter.error(fitter.problem.simulate([])) > 0.02
    assert fit.implausible() == []


def test_a_fold_is_predicted_by_a_step_no_longer_than_it_helps(problem):
    """A straight line leads astray where the response bends."""
    fitter = Fitter(problem)
    payload = effect_of(problem.model, 'payload_error', dm=15.0)
    fit = fitter.fit([], [payload], evaluations=1)
    # Far from the minimum, with derivatives that are four times too small: a step of 1 at most.
    fit = dataclasses.replace(fit, jacobian=0.25 * fit.jacobian)
    held_out = fitter.cross_validate([], fit).held_out
    for fold in problem.folds:
        train = problem.fold != fold
        step = fitter._stepped([], fit, ParameterVector(fit.effects, 'arm'), train)
        assert fitter.error(step, train) <= fitter.error(fit.predicted, train)
        assert np.array_equal(step[~train], held_out[~train])


def test_what_promises_nothing_is_not_fitted_to_the_end(problem, monkeypatch):
    """A few steps, and no simulation of its folds: a straight line says as much."""
    fitter = Fitter(problem)
    monkeypatch.setattr(problem, 'measured', problem.measured + 0.05 * np.cos(problem.measured))
    begun = begin(fitter, [], [effect_of(problem.model, 'payload_error', dm=15.0)])
    error = fitter.error(begun.predicted)
    assert fitter.promises(begun, 1.03 * error) and not fitter.promises(begun, 1.01 * error)
    simulated = []
    simulate = problem.simulate
    monkeypatch.setattr(problem, 'simulate',
                        lambda *args: simulated.append(1) or simulate(*args))
    nothing = dataclasses.replace(begun, converged=False)
    current = dataclasses.replace(begun, held_out=begun.predicted)
    found = finish(fitter, current, nothing)
    assert not simulated
    assert found.rmse == pytest.approx(error, rel=0.2)
    current.predicted = np.zeros(len(problem.measured))
    finish(fitter, current, nothing)
    assert simulated


@pytest.mark.parametrize('bend', [0.0, 0.02, 30.0])
def test_derivatives_follow_a_step_that_they_have_foretold(bend):
    """Broyden's update costs no simulation; a step that surprises asks for differences again."""
    matrix = np.array([[1.0, 2.0], [0.5, -1.0], [0.2, 0.1]])
    asked = []

    def response(vector):
        asked.append(1)
        return matrix @ vector + bend * vector[0] ** 2

    derivatives = Derivatives(response, np.full(2, 10.0))
    first, second = np.array([0.0, 1.0]), np.array([0.4, 1.3])
    begun = derivatives.at(first)
    assert not derivatives.rough and begun == pytest.approx(matrix, abs=0.03 * bend + 1e-9)
    del asked[:]
    found = derivatives.at(second)
    assert derivatives.rough == (bend < 1.0)
    # The response at both ends of the step, which a fit has anyhow, and two differences.
    assert len(asked) == (2 if bend < 1.0 else 5)
    if bend < 1.0:
        # Broyden: right along the step, unchanged across it.
        across = np.array([-0.3, 0.4])
        assert found @ (second - first) == pytest.approx(response(second) - response(first))
        assert found @ across == pytest.approx(begun @ across)
    assert derivatives.at(second) is found


def test_a_fit_that_goes_on_does_not_simulate_again_what_it_knows(problem, monkeypatch):
    """Where it was, and the derivatives there; what is cross-validated has exact ones."""
    fitter = Fitter(problem)
    effects = [effect_of(problem.model, 'payload_error', dm=15.0)]
    begun = fitter.fit([], effects, evaluations=1)
    asked = []
    simulate = problem.simulate
    monkeypatch.setattr(problem, 'simulate',
                        lambda *args: asked.append(1) or simulate(*args))
    on = fitter.fit([], begun.effects, evaluations=1, begun=begun)
    assert not asked and on.vector == pytest.approx(begun.vector)
    rough = dataclasses.replace(begun, jacobian=1.1 * begun.jacobian, rough=True)
    exact = fitter.cross_validate([], rough)
    assert exact.jacobian == pytest.approx(begun.jacobian) and not exact.rough


def test_usual_values_keep_what_is_chosen_and_not_fitted():
    """The start in the middle, so that nothing of a former fit is left but a choice."""
    model = bicep_model()
    payload, creep = usual([effect_of(model, 'payload_error', dm=44.0),
                            effect_of(model, 'creep', c=0.4, t0=9.0, kept=1.0)], 'arm')
    assert payload.values['dm'] in {start.values['dm'] for start in starts_of(payload, 'arm')}
    assert payload.values['dm'] != 44.0
    assert creep.values['kept'] == 1.0 and creep.values['t0'] == 3.0


@pytest.mark.parametrize('names, count', [(['payload_error', 'supply_sag'], 2),
                                          (['viscous_friction', 'supply_sag'], 1),
                                          (['supply_sag'], 1)])
def test_beside_others_a_fit_begins_from_usual_values_too(problem, monkeypatch, names, count):
    """But where a simulation takes long; by itself an effect has no other's values to hold it."""
    fitter = Fitter(problem)
    *known, new = [effect_of(problem.model, name) for name in names]
    begun = []
    fit = fitter.fit

    def counting(fixed, effects, *rest, **options):
        begun.append([effect.values for effect in effects])
        return fit(fixed, effects, *rest, **options)
    monkeypatch.setattr(fitter, 'fit', counting)
    begin(fitter, known, [new])
    assert len(begun) == count and begun[0] == [effect.values for effect in (*known, new)]
    if count > 1:
        assert begun[1] == [effect.values for effect in usual([*known, new], 'arm')]


def test_of_starts_without_any_effect_one_is_tried(problem, monkeypatch):
    """A stop is looked for where the response ends, though stops out of reach fit better."""
    monkeypatch.setattr(problem, 'measured', problem.measured + 0.01)
    fitter = Fitter(problem)
    followed = []
    monkeypatch.setattr(fitter, 'fit', lambda fixed, effects, **options: followed.append(
        effects[-1].values) or SimpleNamespace(predicted=problem.measured))
    starts = fitter.starts([], effect_of(problem.model, 'end_stop'))
    highest, lowest = np.max(problem.measured), np.min(problem.measured)
    assert [start.values['stop'] for start in starts[-2:]] == [highest, lowest]
    out_of_reach = [start for start in starts if start.side * (
        start.stop - (highest if start.side > 0 else lowest)) > 0.05]
    near = starts[-2].with_values(stop=highest - 0.015)
    fitter.begin([], [], [*out_of_reach, *out_of_reach, near])
    assert len(followed) == 2 and near.values in followed
