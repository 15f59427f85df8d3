# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which rows are judged together, what they can show, and what a sensor adds."""

import warnings

from model_support import bicep_model, ROWS, runs
import numpy as np
import pytest

from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement


@pytest.fixture(scope='module')
def problem():
    """Return rows of a model without any error."""
    model = bicep_model()
    return problem_for(model, [runs(model)])


def test_effects_that_the_bench_has_shown_may_differ_on_the_arm():
    """Those of the wire are tried again, those of the arm are not."""
    model = bicep_model(['series_compliance', 'payload_error'])
    names, unobservable = observable(problem_for(model, [runs(model, dt=0.1)]))
    assert 'series_compliance' in names and 'encoder_offset' in names
    assert 'payload_error' not in {*names, *unobservable}


def test_what_needs_transients_is_unobservable_in_settled_rows(problem):
    """With the reason; and what was not asked for is not mentioned."""
    names, unobservable = observable(problem)
    assert unobservable['thermal_lag'] == 'every row is settled'
    # A wire that loses heat otherwise than on the bench does so at rest, too.
    assert 'heat_loss' in names
    assert 'was not recorded' in unobservable['ambient_temperature']
    assert not set(names) & set(unobservable)
    few = problem_for(problem.model, problem.measurements, ['thermal_lag', 'payload_error'])
    assert observable(few) == (['payload_error'], {'thermal_lag': 'every row is settled'})
    # What creeps shows at the ends of holds.
    assert 'creep' in names
    moving = problem_for(problem.model, [runs(problem.model, dt=0.1)])
    assert 'thermal_lag' in observable(moving)[0]


def test_what_only_a_bench_shows_is_said_to_show_there(problem, monkeypatch):
    """But for what the model has from there, and what this muscle cannot have."""
    _, unobservable = observable(problem)
    assert unobservable['phase_modulus'].startswith('only a bench shows it')
    asked = problem_for(problem.model, problem.measurements, ['phase_modulus'])
    assert observable(asked) == ([], {'phase_modulus': unobservable['phase_modulus']})
    known = problem_for(bicep_model(['phase_modulus']), problem.measurements)
    assert 'phase_modulus' not in observable(known)[1]
    assert not {'payload_error', 'series_compliance'} & set(unobservable)
    monkeypatch.setattr(catalogue()['phase_modulus'], 'available', lambda surroundings: False)
    assert 'phase_modulus' not in observable(problem)[1]


def test_the_clock_runs_on_over_trials_and_recordings():
    """An event has one time, whatever the files are divided into."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, 2), runs(model, 1, seed=4)])
    assert np.all(np.diff(problem.clock) > 0.0)
    assert problem.clock[-1] == pytest.approx(3 * ROWS * 30.0)


def test_weight_columns_of_a_trial_do_not_depend_on_the_others():
    """Each begins with the memory wiped."""
    model = bicep_model()
    measured = runs(model, 3)
    together = problem_for(model, [measured])
    columns = together.weight_columns([])
    for trial in range(3):
        own = problem_for(model, [measured.select([trial])]).weight_columns([])
        assert np.ptp(own) > 0.0
        np.testing.assert_allclose(columns[together.trial == trial], own, rtol=1e-6, atol=1e-12)


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


def test_the_noise_of_a_sensor_comes_from_its_steps():
    """Counts of an encoder are uniform in their step."""
    angle = 0.001 * np.round(np.random.default_rng(0).uniform(1.0, 2.0, 500) / 0.001)
    data = Measurement.from_columns({
        'time': 30.0 * np.arange(500.0), 'trial': np.zeros(500), 'voltage': angle,
        'angle': angle})
    assert problem_for(bicep_model(), [data]).noise == pytest.approx(0.001 / 12 ** 0.5, rel=1e-6)


def test_a_long_recording_is_judged_on_some_rows_of_each_trial():
    """In equal steps, so that what is slow is seen."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[400, 400])])
    assert (problem.stride, len(problem.measured)) == (2, 400)
    assert np.bincount(problem.trial).tolist() == [200, 200]


def test_short_trials_have_no_empty_blocks():
    """Three rows make a block at least."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[10, 40])])
    sizes = np.bincount(problem.block)
    assert sizes.min() >= 3
    assert len(np.unique(problem.block[problem.trial == 0])) == 3
    assert len(np.unique(problem.block[problem.trial == 1])) == 12


def test_of_several_recordings_the_noisiest_counts():
    """Of two sensors nobody knows which rows are right."""
    model, rng = bicep_model(), np.random.default_rng(0)
    coarse, fine = (Measurement.from_columns({
        'time': 30.0 * np.arange(300.0), 'trial': np.zeros(300), 'voltage': np.ones(300),
        'angle': 1.5 + step * np.round(rng.standard_normal(300) * 0.003 / step)})
        for step in (0.001, 0.0001))
    for order in ((coarse, fine), (fine, coarse)):
        problem = problem_for(model, list(order))
        assert problem.noise == pytest.approx(0.001 / 12 ** 0.5, rel=1e-6)
    loud = Measurement.from_columns({**fine.columns, 'angle': 1.5 + 0.1 * rng.standard_normal(300)})
    for order in ((loud, fine), (fine, loud)):
        assert problem_for(model, list(order)).largest_noise > 0.1


@pytest.mark.parametrize('change, seen', [(0.3, False), (3.0, True)])
def test_a_temperature_that_hardly_changes_shows_nothing(change, seen):
    """Half a degree is the thermometer's noise."""
    model = bicep_model()
    clean = runs(model)
    ambient = 22.0 + change * np.linspace(0.0, 1.0, clean.rows)
    problem = problem_for(model, [Measurement.from_columns(
        {**clean.columns, 'ambient_temperature': ambient})])
    assert ('ambient_temperature' in observable(problem)[0]) == seen


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


def test_rows_written_twice_have_the_rate_of_their_time():
    """Loggers do so; the rate would be no number there, and no signal."""
    rows = np.repeat(np.arange(8), 2)
    table = Measurement.from_columns({
        'time': 0.1 * rows, 'voltage': np.sin(rows), 'angle': 2.0 - 0.1 * np.sin(rows)})
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        rate = problem_for(bicep_model(), [table]).signals['rate']
    once = np.gradient(np.sin(np.arange(8)), 0.1 * np.arange(8))
    assert rate == pytest.approx(np.repeat(once, 2))
