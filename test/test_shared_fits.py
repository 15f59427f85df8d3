# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits and simulations that processes or threads share: the same as those of one process."""

import threading

from model_support import bicep_model, effect_of
import numpy as np
import pytest
from test_diagnosis_fit import fitter_of, neutral, noisy

from hysteresis_ros.diagnosis import arm_fit, arm_problem
from hysteresis_ros.diagnosis.kind import problem_for


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


def test_fits_are_the_same_whatever_the_jobs(model, forkable):
    """Forks know what was known before all of them, and of phases they begin with no others."""
    measured = noisy(model, [effect_of(model, 'payload_error', dm=15.0)])
    vectors = []
    for jobs in (1, 2):
        fitter = fitter_of(model, measured, jobs)
        vectors.append([fit.vector for fit in fitter.fit(
            [[neutral(fitter, name)] for name in (
                'payload_error', 'resistance_change', 'supply_sag', 'latent_heat') * 2],
            fitter.covariance.points[0])])
    for one, two in zip(*vectors):
        assert np.array_equal(one, two)


@pytest.mark.parametrize('jobs', [1, 2])
def test_a_fit_leaves_its_phase_and_nothing_else_behind(model, jobs, forkable):
    """Similar sets begin with it, whoever has found it."""
    fitter = fitter_of(model, noisy(model), jobs)
    problem = fitter.problem
    start = [neutral(fitter, 'resistance_change')]
    simulator, = problem.simulators
    assert np.all(simulator.known_phases.nearest(start) == 1.0)
    fit, = fitter.fit([start], fitter.covariance.points[0])
    phase, = problem.phases(fit.effects)
    assert 0.1 < np.mean(phase) < 0.9
    assert np.array_equal(phase, simulator.known_phases.nearest(start))
    other = [effect_of(model, 'latent_heat')]
    before = simulator.known_phases.nearest(other)
    with problem.no_phases_kept():
        problem.simulate(other)
        assert not np.array_equal(simulator.known_phases.nearest(other), before)
    assert np.array_equal(simulator.known_phases.nearest(other), before)


@pytest.mark.parametrize('jobs', [1, 2])
def test_a_fit_that_was_judged_along_its_way_keeps_its_covariance(model, jobs, forkable):
    """Which is not sent from process to process, but for its discrepancy."""
    measured = noisy(model, [effect_of(model, 'payload_error', dm=15.0)])
    fitter = fitter_of(model, measured, jobs)
    starts = [[neutral(fitter, name)] for name in ('payload_error', 'supply_sag')]
    point = fitter.covariance.points[0]

    def fitted(effects):
        return [fitter.along(fit) for fit in fitter.fit_one(effects, point)]

    for (fit,), start in zip(fitter.shared(fitted, starts), starts):
        alone, = fitted(start)
        assert fit.log_evidence == alone.log_evidence and fit.judged == alone.judged
        assert np.array_equal(fit.covariance.discrepancy.matrix(),
                              alone.covariance.discrepancy.matrix())
        assert np.array_equal(fitter.point(fit).factor, fitter.point(alone).factor)


def test_many_simulations_are_shared_and_come_in_order(model, monkeypatch, forkable):
    """Each begins with the phases known before all of them."""
    measured = noisy(model)
    sets = [[effect_of(model, 'payload_error', dm=3.0 * number)] for number in range(6)]
    sets[2:4] = [[effect_of(model, 'resistance_change', eta=eta)] for eta in (-0.1, 0.2)]
    alone = problem_for(model, [measured]).simulate_many(sets)
    monkeypatch.setattr(arm_problem, 'WORTH_FORKS', 0)
    shared = problem_for(model, [measured], jobs=2)
    assert np.array_equal(shared.simulate_many(sets), alone)
    phases = [shared.phases(effects)[0] for effects in sets]
    assert phases[0] is None and not np.array_equal(phases[2], phases[3])
    simulator, = problem_for(model, [measured]).simulators
    assert np.array_equal(phases[2], simulator.run_apart(sets[2])[1])


def test_beside_other_threads_long_simulations_are_shared_between_threads(model, monkeypatch):
    """As in a notebook; and the answer is that of one thread."""
    measured = noisy(model)
    found, taken = [], []
    for jobs in (1, 2):
        fitter = fitter_of(model, measured, jobs)
        monkeypatch.setattr(arm_fit, 'forks', lambda jobs: 1)
        monkeypatch.setattr(arm_fit, 'WORTH_THREADS', 1)
        fit_one = fitter.fit_one

        def watched(*args, fit_one=fit_one):
            taken.append((args[0][0].id, threading.current_thread() is threading.main_thread()))
            return fit_one(*args)

        monkeypatch.setattr(fitter, 'fit_one', watched)
        found.append([fit.vector for fit in fitter.fit(
            [[neutral(fitter, name)] for name in (
                'payload_error', 'resistance_change', 'supply_sag', 'latent_heat')],
            fitter.covariance.points[0])])
    for one, two in zip(*found):
        assert np.array_equal(one, two)
    assert set(taken[4:]) == {('payload_error', False), ('supply_sag', False),
                              ('resistance_change', True), ('latent_heat', True)}
