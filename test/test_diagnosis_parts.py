# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The statistics and the bookkeeping that a diagnosis is made of, each against its definition."""

import dataclasses

from hypothesis import given, strategies as st
from model_support import bicep_model, effect_of, STRENGTHS, wandering_voltage
import numpy as np
import pytest

from hysteresis_ros.diagnosis import structure
from hysteresis_ros.diagnosis.derivatives import Derivatives
from hysteresis_ros.diagnosis.fit import Fitter
from hysteresis_ros.diagnosis.candidates import begin, consider, finish, possible
from hysteresis_ros.diagnosis.leftover import event_of, examine, flexible, lasting_step
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.problem import sensor_resolution
from hysteresis_ros.diagnosis.significance import (
    block_sums, cosines, family_p_values, flipped, gain_interval, held_out_errors,
    paired_p_values, residualise)
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement

ROWS = 60


def runs(model, trials=3, rows=ROWS, seed=0, step=30.0, sizes=None):
    """Return an arm run of some settled trials that the model itself has made."""
    sizes = sizes or [rows] * trials
    voltage = np.concatenate([
        wandering_voltage(400, seed + trial)[::400 // size][:size]
        for trial, size in enumerate(sizes)])
    trial = np.repeat(np.arange(float(len(sizes))), sizes)
    time = step * np.concatenate([1.0 + np.arange(size) for size in sizes])
    columns = {'time': time, 'trial': trial, 'voltage': voltage, 'angle': np.ones(len(voltage))}
    angle = model.predict(Measurement.from_columns(columns))
    return Measurement.from_columns({**columns, 'angle': angle})


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


def test_held_out_errors_are_those_of_numpy_fold_by_fold():
    """Each fold is predicted by least squares on the others."""
    rng = np.random.default_rng(1)
    columns, fold = rng.standard_normal((40, 3)), np.arange(40) // 10
    targets = columns @ rng.standard_normal((3, 5)) + rng.standard_normal((40, 5))
    expected = np.zeros(5)
    for number in range(4):
        test = fold == number
        weights = np.linalg.lstsq(columns[~test], targets[~test], rcond=None)[0]
        expected += np.sum((targets[test] - columns[test] @ weights) ** 2, axis=0)
    assert held_out_errors(columns, targets.T, fold) == pytest.approx(expected / 40, rel=1e-6)
    nothing = held_out_errors(np.zeros((40, 0)), targets.T, fold)
    assert nothing == pytest.approx(np.mean(targets ** 2, axis=0))


def test_family_p_values_count_the_best_of_all_candidates():
    """A gain has to beat the best of the family in a draw, not its own chance."""
    chance = np.array([[1.0, 2.0, 3.0, 0.0], [4.0, 0.0, 0.0, 0.5]])
    values = family_p_values(np.array([2.5, 5.0, 0.1]), chance)
    assert values == pytest.approx([3 / 5, 1 / 5, 1.0])


def test_flipped_residuals_keep_size_and_blocks():
    """Only the signs change, and those of a block together."""
    residual, block = np.arange(1.0, 13.0), np.arange(12) // 3
    draws = flipped(residual, block, np.random.default_rng(0), 50)
    assert draws.shape == (50, 12)
    signs = draws / residual
    assert set(np.unique(signs)) == {-1.0, 1.0}
    assert np.all(signs.reshape(50, 4, 3) == signs.reshape(50, 4, 3)[:, :, :1])


def test_paired_p_values_tell_a_steady_gain_from_one_lucky_block():
    """The same sum in every block counts, in a single one it does not."""
    rng = np.random.default_rng(2)
    steady = 1.0 + 0.3 * rng.standard_normal(24)
    lucky = np.r_[24.0, np.zeros(23)]
    values = paired_p_values(np.stack([steady, lucky, -steady]), rng)
    assert values[0] < 0.02 and values[1] > 0.2 and values[2] > 0.9


def test_the_interval_of_a_gain_holds_its_value():
    """Half of every residual gone is a gain of exactly one half."""
    rng = np.random.default_rng(3)
    before, block = rng.standard_normal(240), np.arange(240) // 10
    assert gain_interval(before, 0.5 * before, block, rng) == pytest.approx((0.5, 0.5))
    low, high = gain_interval(before, rng.standard_normal(240), block, rng)
    assert low < 0.0 < high
    assert block_sums(np.ones(240), block).tolist() == [10.0] * 24


def test_cosines_and_what_is_left_beside_columns():
    """Opposite directions are the same signature; projections are orthogonal."""
    vectors = np.array([[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    expected = [[1, 1, 0.5 ** 0.5, 0], [1, 1, 0.5 ** 0.5, 0], [0.5 ** 0.5, 0.5 ** 0.5, 1, 0],
                [0, 0, 0, 0]]
    assert cosines(vectors) == pytest.approx(np.array(expected))
    columns = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, 0.0]])
    left = residualise(columns, vectors)
    assert np.abs(left @ columns).max() < 1e-12
    assert left[2] == pytest.approx([0.0, 0.0, 0.0])
    assert left[0] == pytest.approx([0.5, -0.5, 0.0])
    assert residualise(np.zeros((3, 0)), vectors) is vectors


@given(st.integers(30, 170), st.sampled_from([-1.0, 1.0]))
def test_a_planted_step_is_found_at_its_row(row, sign):
    """Something that slips once leaves a step."""
    noise = 0.1 * np.random.default_rng(row).standard_normal(200)
    found, share = lasting_step(noise + sign * (np.arange(200) >= row))
    assert abs(found - row) <= 1
    assert share > 0.8


def test_noise_has_no_step_and_few_rows_none_at_all():
    """The best split of white noise explains next to nothing."""
    assert lasting_step(np.random.default_rng(5).standard_normal(400))[1] < 0.05
    assert lasting_step(np.array([0.0, 0.0, 1.0, 1.0])) == (0, 0.0)


def test_a_drift_is_no_event():
    """It, too, is higher at its end than at its start, but not at once."""
    rng = np.random.default_rng(8)
    drift = np.linspace(-1.0, 1.0, 300) + 0.1 * rng.standard_normal(300)
    assert lasting_step(drift)[1] == 0.0
    shape = 1.0 + np.cos(0.3 * np.arange(300))
    assert lasting_step(shape * np.linspace(0.0, 1.0, 300), shape)[1] == 0.0


def test_a_step_of_the_length_shows_in_proportion_to_the_sensitivity(problem):
    """A crimp that slips moves the arm more where the arm answers more."""
    rows = len(problem.measured)
    sensitivity = 60.0 + 50.0 * np.sin(0.7 * np.arange(rows))
    residual = 1e-3 * sensitivity * (np.arange(rows) >= 100)
    time, share = event_of(problem, residual, sensitivity)
    assert time == problem.clock[100] and share == pytest.approx(1.0)
    assert event_of(problem, residual)[1] < 0.8
    assert event_of(problem, np.zeros(rows)) == (None, 0.0)


def test_effects_that_the_bench_has_shown_may_differ_on_the_arm():
    """Those of the wire are tried again, those of the arm are not."""
    model = bicep_model(['series_compliance', 'payload_error', 'heating_cooling_asymmetry'])
    names, _ = possible(problem_for(model, [runs(model, step=0.1)]), [])
    assert 'series_compliance' in names
    assert 'payload_error' not in names
    # A lag is a part of the asymmetry, so it cannot be missing beside it.
    effect = effect_of(model, 'heating_cooling_asymmetry')
    names, _ = possible(problem_for(bicep_model(), [runs(model, step=0.1)]), [effect])
    assert not {'thermal_lag', 'heating_cooling_asymmetry'} & set(names)


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


def test_a_flexible_regression_finds_smooth_dependence_and_leaves_noise():
    """The share on held-out rows is that of the planted part."""
    rng = np.random.default_rng(6)
    signals = {'drive': rng.uniform(0.0, 6.0, 400), 'load': rng.standard_normal(400)}
    fold, noise = np.arange(400) // 50 % 4, rng.standard_normal(400)
    planted = 3.0 * np.sin(signals['drive'])
    truth = np.var(planted) / np.var(planted + noise)
    assert flexible(signals, planted + noise, fold) == pytest.approx(truth, abs=0.12)
    assert flexible(signals, noise, fold) < 0.03
    assert flexible({}, noise, fold) == 0.0


def test_what_is_left_names_the_signal_in_which_it_shows(problem):
    """A residual that follows the drive says drive, and white noise says nothing."""
    drive = problem.signals['drive']
    left = examine(problem, np.cos(0.5 * drive))
    assert left.explained > 0.8 and left.signal == 'drive'
    noise = examine(problem, np.random.default_rng(7).standard_normal(len(drive)))
    assert noise.explained < 0.1 and noise.signal == ''


def test_an_event_has_the_time_since_the_recording_began():
    """Trials follow each other, and the clock runs on."""
    model = bicep_model()
    problem = problem_for(model, [runs(model)])
    row = 2 * ROWS - 20
    left = examine(problem, (np.arange(3 * ROWS) >= row).astype(float))
    assert left.event_share > 0.99
    assert left.event == problem.clock[row]
    assert np.all(np.diff(problem.clock) > 0.0)


def test_one_signal_alone_may_show_what_all_together_do_not():
    """Few rows and many signals: the regression on all of them learns little."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[20, 20, 20])])
    rng = np.random.default_rng(9)
    problem.signals.update({f'noise{n}': rng.standard_normal(60) for n in range(12)})
    drive = problem.signals['drive']
    left = examine(problem, np.sin(drive) + 0.2 * rng.standard_normal(60))
    assert left.signal == 'drive' and left.explained > 0.5


def test_decoys_have_the_size_that_the_bench_found_and_the_noise(problem):
    """In the angle they are the error of the length times the arm's sensitivity."""
    model = problem.model
    assert structure.length_error(model) == 0.0004
    rng = np.random.default_rng(8)
    predicted = problem.simulate([])
    draws = structure.decoys(problem, [], predicted, rng, 800)
    assert draws.shape == (800, len(predicted))
    gain = structure.sensitivity(problem, [])
    expected = np.sqrt(np.mean((0.0004 * gain) ** 2) + problem.noise ** 2)
    assert np.sqrt(np.mean(draws ** 2)) == pytest.approx(expected, rel=0.08)
    assert abs(np.mean(draws)) < 0.1 * expected


def test_the_sensitivity_is_the_slope_of_the_arm(problem):
    """A longer muscle raises the angle by the inverse of dL/dtheta, less what the load gives."""
    gain = structure.sensitivity(problem, [])
    theta = problem.measured
    step = 1e-5
    length = problem.model.geometry.length
    slope = (length(theta + step) - length(theta - step)) / (2.0 * step)
    assert np.all(gain * slope > 0.0)
    assert np.median(gain * slope) == pytest.approx(1.0, abs=0.3)


def test_a_model_without_verification_falls_back_on_what_it_has():
    """The error of the fitted trials counts where no others are, and none is zero."""
    model = bicep_model(metrics={'length': {'identification': {'rmse': 0.001}}})
    assert structure.length_error(model) == 0.001
    assert structure.length_error(bicep_model(metrics={})) == 0.0


def test_whole_trials_are_held_out_together():
    """Memory leaks across random splits, so a trial is never divided."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, 3), runs(model, 3, seed=9)])
    assert np.unique(problem.trial).tolist() == list(range(6))
    for trial in range(6):
        assert len(np.unique(problem.fold[problem.trial == trial])) == 1
    for block in np.unique(problem.block):
        assert len(np.unique(problem.trial[problem.block == block])) == 1
    assert problem.folds.tolist() == [0, 1, 2, 3]


def test_one_trial_is_held_out_in_blocks_of_time():
    """Every fold is some stretches of the recording, and all rows are in one."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, 1, rows=80)])
    assert problem.folds.tolist() == [0, 1, 2, 3]
    assert np.count_nonzero(np.diff(problem.fold)) == 7


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


def test_the_noise_of_a_sensor_comes_from_its_steps():
    """Counts of an encoder are uniform in their step."""
    angle = 0.001 * np.round(np.random.default_rng(0).uniform(1.0, 2.0, 500) / 0.001)
    data = Measurement.from_columns({
        'time': 30.0 * np.arange(500.0), 'trial': np.zeros(500), 'voltage': angle,
        'angle': angle})
    assert sensor_resolution(data) == pytest.approx(0.001 / 12 ** 0.5, rel=1e-6)


def test_recordings_that_do_not_go_together_are_refused():
    """One line says which kinds there are, or what to give instead."""
    model = bicep_model()
    bench = Measurement.from_columns({
        'trial': np.zeros(5), 'step': np.arange(5.0), 'voltage': np.arange(5.0),
        'force': np.ones(5), 'length': np.linspace(0.0, -0.01, 5)})
    force = Measurement.from_columns({
        'trial': np.zeros(5), 'step': np.arange(5.0), 'voltage': np.arange(5.0),
        'force': np.ones(5)})
    for given_, words in (([], 'no measurement'), ([force], 'length table'),
                          ([bench, runs(model, 1)], 'several kinds')):
        with pytest.raises(MeasurementError, match=words):
            problem_for(model, given_)
