# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What shows in a residual: structure, noise that comes and goes, and in which signal."""

from model_support import bicep_model, runs
import numpy as np
import pytest

from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.residual import (
    heteroscedasticity_p_value, predictable, shares, unexplained_signal)


@pytest.fixture(scope='module')
def problem():
    """Return rows of a model without any error."""
    model = bicep_model()
    return problem_for(model, [runs(model)])


def test_a_flexible_regression_finds_smooth_dependence_and_leaves_noise():
    """The share on held-out rows is that of the planted part."""
    rng = np.random.default_rng(6)
    signals = {'drive': rng.uniform(0.0, 6.0, 400), 'load': rng.standard_normal(400)}
    fold, noise = np.arange(400) // 50 % 4, rng.standard_normal(400)
    planted = 3.0 * np.sin(signals['drive'])
    truth = np.var(planted) / np.var(planted + noise)
    assert predictable(signals, planted + noise, fold) == pytest.approx(truth, abs=0.12)
    assert predictable(signals, noise, fold) < 0.03
    assert predictable({}, noise, fold) == 0.0


def test_noise_that_comes_and_goes_is_told_from_noise():
    """P values of noise are even between 0 and 1; rows without neighbours say nothing."""
    rng = np.random.default_rng(4)
    trial = np.repeat([0, 1], 60)
    p_values = np.array([heteroscedasticity_p_value(rng.standard_normal(120), trial, rng, 99)
                         for _ in range(200)])
    assert np.mean(p_values) == pytest.approx(0.5, abs=0.07)
    assert np.mean(p_values <= 0.05) == pytest.approx(0.05, abs=0.05)
    gusts = rng.standard_normal(120) * (1.0 + 4.0 * (np.arange(120) // 10 % 2))
    assert heteroscedasticity_p_value(gusts, trial, rng, 399) == 1.0 / 400.0
    assert heteroscedasticity_p_value(gusts, np.arange(120), rng, 99) == 1.0


def test_a_residual_names_the_signal_in_which_it_shows(problem):
    """One that follows the drive says drive, and white noise says nothing."""
    drive = problem.signals['drive']
    residual = np.cos(0.5 * drive)
    assert unexplained_signal(problem, residual) == 'drive'
    assert shares(problem, residual)['all'] > 0.8
    noise = np.random.default_rng(7).standard_normal(len(drive))
    assert unexplained_signal(problem, noise) == ''
    assert max(shares(problem, noise).values()) < 0.1


def test_one_signal_alone_may_show_what_all_together_do_not():
    """Few rows and many signals: the regression on all of them learns little."""
    model = bicep_model()
    problem = problem_for(model, [runs(model, sizes=[20, 20, 20])])
    rng = np.random.default_rng(9)
    problem.signals.update({f'noise{n}': rng.standard_normal(60) for n in range(12)})
    residual = np.sin(problem.signals['drive']) + 0.2 * rng.standard_normal(60)
    assert unexplained_signal(problem, residual) == 'drive'
    found = shares(problem, residual)
    assert found['drive'] > 0.5 and found['drive'] > found['all']
