# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Covariance of residuals: its parts are estimated, and whitening makes rows independent."""

import numpy as np
import pytest
from scipy import optimize, stats

from hysteresis_ros.diagnosis.covariance import Covariance

ROWS, TRIALS = 120, 3


def smooth(rows, size):
    """Return a smooth covariance (rows, rows) of a size."""
    place = np.linspace(0.0, 1.0, rows)
    return size ** 2 * np.exp(-0.5 * ((place[:, None] - place[None, :]) / 0.45) ** 2)


def make(size=0.01, resolution=1e-4, trials=TRIALS, dt=30.0):
    """Return covariances on some trials of settled rows."""
    trial = np.repeat(np.arange(trials), ROWS // trials)
    return Covariance(smooth(ROWS, size), dt * np.arange(1.0, ROWS + 1.0), trial, resolution, 0.3)


def autoregressive(rng, rows, rho, size):
    """Return rows of AR(1) noise of a size."""
    noise = rng.standard_normal(rows)
    for row in range(1, rows):
        noise[row] = rho * noise[row - 1] + np.sqrt(1.0 - rho ** 2) * noise[row]
    return size * noise


def test_the_gradient_of_the_marginal_likelihood_is_that_of_differences():
    """Or the estimate ends anywhere."""
    covariance, rng = make(), np.random.default_rng(1)
    residual = autoregressive(rng, ROWS, 0.8, 0.02)
    values = np.array([0.2, np.log(0.015), np.log(100.0), np.log(0.003)])
    found = covariance._cost(values, residual)[1]
    expected = optimize.approx_fprime(values, lambda v: covariance._cost(v, residual)[0], 1e-6)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-3)


def test_the_density_of_a_point_is_that_of_scipy():
    """With the prior of its values taken off."""
    covariance = make()
    point = covariance.point(covariance.start(0.4, 0.3))
    residual = np.random.default_rng(2).standard_normal(ROWS) * 0.01
    matrix = point.factor @ point.factor.T
    whitened = point.whiten(residual)
    density = point.constant - covariance._prior(point.values)[0] - 0.5 * whitened @ whitened
    assert density == pytest.approx(stats.multivariate_normal(cov=matrix).logpdf(residual))


@pytest.mark.parametrize('noise', [0.003, 0.035])
def test_white_noise_is_estimated_from_the_residuals(noise):
    """The encoder's step says little of it: 2 degrees are no structure."""
    covariance, rng = make(), np.random.default_rng(3)
    found = np.exp(covariance.fit(noise * rng.standard_normal(ROWS)))
    assert found[3] == pytest.approx(noise, rel=0.2)
    assert found[1] < noise


@pytest.mark.parametrize('rho', [0.9, 0.98])
def test_drift_is_estimated_with_its_time(rho):
    """Autocorrelated residuals say less than their number."""
    covariance = make(trials=1)
    rng = np.random.default_rng(4)
    times = [covariance.fit(autoregressive(rng, ROWS, rho, 0.05))[2] for _ in range(8)]
    expected = np.log(-30.0 / np.log(rho))
    assert np.median(times) == pytest.approx(expected, abs=0.7)


def test_whitened_rows_are_independent():
    """Of draws from the covariance itself."""
    covariance = make()
    point = covariance.point(covariance.start(1.0, 0.5))
    draws = point.factor @ np.random.default_rng(5).standard_normal((ROWS, 4000))
    whitened = point.whiten(draws)
    np.testing.assert_allclose(whitened @ whitened.T / 4000, np.eye(ROWS), atol=0.12)


def test_the_largest_error_is_beyond_the_expected_one_and_grows_with_it():
    """One draw in twenty of the discrepancy exceeds it."""
    rng = np.random.default_rng(6)
    small, large = (make(size).largest_error(rng, 2000) for size in (0.01, 0.02))
    assert 0.012 < small < 0.03
    assert large == pytest.approx(2.0 * small, rel=0.1)


def test_a_model_without_a_known_error_has_the_noise_of_its_sensor():
    """No division by a size of zero."""
    covariance = make(size=0.0, resolution=1e-3)
    values = covariance.fit(1e-3 * np.random.default_rng(7).standard_normal(ROWS))
    assert np.all(np.isfinite(values))
    assert np.exp(values[3]) == pytest.approx(1e-3, rel=0.3)
