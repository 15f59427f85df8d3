# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Covariance of residuals: its parts are estimated, and whitening makes rows independent."""

import dataclasses

import numpy as np
import pytest
from scipy import optimize, stats

from hysteresis_ros.diagnosis.covariance import Covariance, LARGEST_SCALE, TAILS
from hysteresis_ros.diagnosis.discrepancy import Discrepancy

ROWS, TRIALS = 120, 3


def smooth(rows, size):
    """Return a smooth discrepancy of a size."""
    return Discrepancy(np.full((rows, 1), size), np.linspace(0.0, 2.0, rows)[:, None],
                       np.zeros((rows, 0)), np.zeros((rows, 0)), np.zeros((rows, 0)))


def make(size=0.01, resolution=1e-4, trials=TRIALS, dt=30.0, largest_noise=np.inf):
    """Return covariances on some trials of settled rows."""
    trial = np.repeat(np.arange(trials), ROWS // trials)
    return Covariance(smooth(ROWS, size), dt * np.arange(1.0, ROWS + 1.0), trial, resolution,
                      largest_noise, 0.3)


def test_a_discrepancy_is_the_sum_of_its_parts_correlated_between_near_rows():
    """By hand for three rows, of which two are at one place."""
    parts = np.array([[3.0, 0.0], [4.0, 1.0], [0.0, 2.0]])
    places = np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 4.0]])
    found = Discrepancy(parts, places, np.zeros((3, 0)), np.zeros((3, 0)), np.zeros((3, 0)))
    far = 1.0 / np.sqrt(26.0)
    np.testing.assert_allclose(found.matrix(), [
        [9.0, 12.0, 0.0], [12.0, 17.0, 2.0 * far], [0.0, 2.0 * far, 4.0]], atol=1e-12)
    assert found.size == pytest.approx(np.sqrt(30.0 / 3.0))


def test_equations_that_are_off_are_further_parts_and_none_of_the_models_own():
    parts, places = np.array([[3.0], [4.0], [0.0]]), np.zeros((3, 2))
    equation = np.array([[0.0], [1.0], [2.0]])
    both, own = (Discrepancy(columns, places, np.zeros((3, 0)), np.zeros((3, 0)), np.zeros((3, 0)))
                 for columns in (np.hstack([parts, equation]), parts))
    found = Discrepancy(parts, places, np.zeros((3, 0)), np.zeros((3, 0)), equation)
    np.testing.assert_allclose(found.matrix(), both.matrix())
    np.testing.assert_allclose(found.of_model_alone().matrix(), own.matrix())
    assert found.size == own.size < both.size


def test_common_errors_act_in_all_rows_together():
    """However far apart the rows are."""
    parts, places = np.array([[1.0], [2.0]]), np.array([[0.0], [1e9]])
    common = np.array([[3.0, 0.0], [-1.0, 2.0]])
    found = Discrepancy(parts, places, common, np.zeros((2, 0)), np.zeros((2, 0)))
    np.testing.assert_allclose(found.matrix(), [[10.0, -3.0], [-3.0, 9.0]], atol=1e-6)
    assert found.size == pytest.approx(np.sqrt(19.0 / 2.0))


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
    matrix = smooth(ROWS, 0.01).matrix()
    found = covariance._cost(values, residual, matrix)[1]
    expected = optimize.approx_fprime(
        values, lambda v: covariance._cost(v, residual, matrix)[0], 1e-6)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-3)


def test_the_curvature_is_that_of_the_mean_density():
    """Of residuals drawn from the covariance itself, so that it makes no step too long."""
    covariance, rng = make(), np.random.default_rng(2)
    values = np.array([0.2, np.log(0.015), np.log(100.0), np.log(0.008)])
    matrix, factor = smooth(ROWS, 0.01).matrix(), covariance.point(values).factor
    residuals = (factor @ rng.standard_normal((ROWS, 400))).T
    found = np.mean([covariance._cost(values, one, matrix)[2] for one in residuals], axis=0)

    def gradient(values):
        return np.mean([covariance._cost(values, one, matrix)[1] for one in residuals], axis=0)

    expected = [(gradient(values + step) - gradient(values - step)) / 2e-4
                for step in 1e-4 * np.eye(4)]
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(size, size), expected / np.outer(size, size),
                               atol=0.15)


def test_the_density_of_a_point_is_that_of_scipy():
    """With the prior of its values taken off."""
    covariance = make()
    point = covariance.point(covariance.start(0.4, 0.3))
    residual = np.random.default_rng(2).standard_normal(ROWS) * 0.01
    matrix = point.factor @ point.factor.T
    whitened = point.whiten(residual)
    density = point.constant - covariance._prior(point.values)[0] - 0.5 * whitened @ whitened
    assert density == pytest.approx(stats.multivariate_normal(cov=matrix).logpdf(residual))


def test_the_density_of_residuals_has_the_tails_of_student():
    """So that a row that jumps costs a few units, and not half its square."""
    covariance = make()
    point = covariance.point(covariance.start(0.4, 0.3))
    whitened = np.random.default_rng(5).standard_normal((ROWS, 2))
    whitened[7, 1] += 20.0
    calm, jump = point.log_density(whitened)
    # The density of Student's t over its standard units, in place of the Gaussian's.
    change = stats.t(TAILS).logpdf(whitened) + 0.5 * np.log(2.0 * np.pi)
    np.testing.assert_allclose((calm, jump), point.constant + np.sum(change, axis=0))
    assert 5.0 < calm - jump < 20.0
    assert point.log_density(whitened[:, 0]) == pytest.approx(calm)


@pytest.mark.parametrize('noise', [0.003, 0.035])
def test_white_noise_is_estimated_from_the_residuals(noise):
    """The encoder's step says little of it: 2 degrees are no structure."""
    covariance, rng = make(), np.random.default_rng(3)
    found = np.exp(covariance.fit(noise * rng.standard_normal(ROWS)))
    assert found[3] == pytest.approx(noise, rel=0.2)
    assert found[1] < noise


@pytest.mark.slow
@pytest.mark.parametrize('drift', [0.0, 0.02])
def test_noise_is_at_most_what_is_said_in_nine_of_ten_or_more(drift):
    """
    Where all is noise, a drift that lasts for two rows may take up some of it: 90 instead of 95 %.

    Half say less than 1.25 times the noise that there is.
    """
    covariance, rng = make(), np.random.default_rng(8)
    most = []
    for _ in range(200):
        residual = (0.03 * rng.standard_normal(ROWS)
                    + autoregressive(rng, ROWS, 0.95, drift))
        most.append(covariance.noise_at_most(covariance.fit(residual), residual))
    assert 170 <= np.sum(np.array(most) > 0.03) <= 198
    assert np.median(most) < 1.25 * 0.03


def test_what_all_rows_show_to_be_no_noise_is_not_taken_for_it():
    """Rows of a ringing arm, thinned, look like white noise."""
    residual = 0.03 * np.random.default_rng(3).standard_normal(ROWS)
    covariance = make(largest_noise=0.001)
    found = np.exp(covariance.fit(residual))
    assert found[3] <= 0.001 * (1.0 + 1e-9)
    assert found[1] > 0.015
    assert covariance.noise_at_most(np.log(found), residual) <= 0.001 * (1.0 + 1e-9)


@pytest.mark.parametrize('rho', [0.9, 0.98])
def test_drift_is_estimated_with_its_time(rho):
    """Autocorrelated residuals say less than their number."""
    covariance = make(trials=1)
    rng = np.random.default_rng(4)
    times = [covariance.fit(autoregressive(rng, ROWS, rho, 0.05))[2] for _ in range(8)]
    expected = np.log(-30.0 / np.log(rho))
    assert np.median(times) == pytest.approx(expected, abs=0.7)


@pytest.mark.slow
@pytest.mark.parametrize('noise, rho', [(0.003, 0.0), (0.03, 0.0), (0.03, 0.9), (0.1, 0.98)])
def test_no_other_values_are_much_more_probable(noise, rho):
    """Of those that a general optimiser comes to, from the default starts and from one far away."""
    covariance, rng = make(), np.random.default_rng(11)
    for _ in range(5):
        residual = autoregressive(rng, ROWS, rho, noise)
        found = covariance.fit(residual)
        matrix = covariance.discrepancy.matrix()
        share = np.std(residual) / 0.01
        for start in (covariance.start(0.1, share), covariance.start(share, 0.1),
                      covariance.start(10.0, 10.0)):
            other = optimize.minimize(
                lambda values: covariance._cost(values, residual, matrix)[:2], start, jac=True,
                method='L-BFGS-B', bounds=list(zip(covariance._low, covariance._high)))
            assert covariance._cost(found, residual, matrix)[0] < other.fun + 0.05
            # Values from an earlier fit may lie where the way to the best ones is long.
            again = covariance.fit(residual, start)
            assert covariance._cost(again, residual, matrix)[0] < other.fun + 0.05


def test_covariances_of_another_discrepancy_share_no_more_than_drift_and_noise():
    """They are laid out once for all sets of effects."""
    shared, values = make(), make().start(1.0, 0.5)
    other = smooth(ROWS, 0.03)
    before = shared.point(values)
    found, alone = shared.of(other).point(values), make().of(other).point(values)
    assert np.array_equal(found.factor, alone.factor) and found.constant == alone.constant
    assert np.array_equal(shared.point(values).factor, before.factor)
    assert not np.allclose(found.factor, before.factor)


def test_whitened_rows_are_independent():
    """Of draws from the covariance itself."""
    covariance = make()
    point = covariance.point(covariance.start(1.0, 0.5))
    draws = point.factor @ np.random.default_rng(5).standard_normal((ROWS, 4000))
    whitened = point.whiten(draws)
    np.testing.assert_allclose(whitened @ whitened.T / 4000, np.eye(ROWS), atol=0.12)


def test_the_largest_error_is_beyond_the_expected_one_and_grows_with_it():
    """One draw in twenty of the discrepancy exceeds it."""
    small, large = (make(size).largest_error(np.random.default_rng(6), 2000)
                    for size in (0.01, 0.02))
    assert 0.012 < small < 0.03
    assert large == pytest.approx(2.0 * small, rel=0.1)


def test_the_largest_error_is_the_quantile_of_draws_of_any_scale():
    """A discrepancy that is one number for all rows is normal times log-normal, by sampling."""
    everywhere = Discrepancy(np.full((ROWS, 1), 0.01), np.zeros((ROWS, 1)), np.zeros((ROWS, 0)),
                             np.zeros((ROWS, 0)), np.zeros((ROWS, 0)))
    covariance = Covariance(everywhere, 30.0 * np.arange(1.0, ROWS + 1.0), np.zeros(ROWS, int),
                            0.03, np.inf, 0.8)
    rng = np.random.default_rng(8)
    size = 0.01 * np.exp(0.8 * rng.standard_normal(200000)) * np.abs(rng.standard_normal(200000))
    expected = np.hypot(np.quantile(size, 0.95), 0.03)
    assert covariance.largest_error(rng, 20000) == pytest.approx(expected, rel=0.05)


def uneven(rows=ROWS, small=0.01, large=0.1):
    """Return covariances of a discrepancy that is small in the first half of the rows."""
    size = np.where(np.arange(rows) < rows // 2, small, large)
    found = dataclasses.replace(smooth(rows, 1.0), parts=size[:, None])
    return Covariance(found, 30.0 * np.arange(1.0, rows + 1.0), np.zeros(rows, int), 1e-4, np.inf,
                      0.3), size


def relative(covariance, residual, noise=0.0):
    """Return a residual's size, or those of several (n, k), over the largest error's."""
    sizes = covariance.equivalent_rmse(
        np.atleast_2d(residual.T), noise, np.random.default_rng(1), 2000, 0.95)
    largest = covariance.largest_error(np.random.default_rng(1), 2000, courses=False)
    return np.squeeze(sizes / largest)


def test_the_size_of_a_residual_is_one_where_a_draw_in_twenty_is_larger():
    """Whatever white noise is in the rows, and where the discrepancy is the same in all rows."""
    covariance, rng = make(), np.random.default_rng(11)
    root = np.linalg.cholesky(covariance.discrepancy.matrix() + 1e-12 * np.eye(ROWS))
    draws = root @ rng.standard_normal((ROWS, 300)) * np.exp(0.3 * rng.standard_normal(300))
    for noise in (0.0, 0.01, 0.1):
        rows = draws + noise * rng.standard_normal(draws.shape)
        assert 0.02 < np.mean(relative(covariance, rows, noise) > 1.0) < 0.09
    assert relative(covariance, np.full(ROWS, 0.02)) == pytest.approx(
        0.02 / covariance.largest_error(np.random.default_rng(1), 2000), rel=0.05)


def test_noise_alone_has_no_size():
    noise = 0.05 * np.random.default_rng(12).standard_normal(ROWS)
    assert relative(make(), noise, 0.05) < 1.0 < relative(make(), noise)


def test_a_residual_is_larger_where_the_model_is_surer_of_the_response():
    """The same residual in rows that may be off by little, or by much."""
    covariance, size = uneven()
    first = 0.1 * (size < 0.05)
    assert relative(covariance, first) > 1.15 * relative(covariance, first[::-1])


def test_that_the_model_is_surer_than_on_average_says_little():
    """Its size is known better than its place: rows with almost none count as with the mean."""
    sure, surer = (relative(uneven(small=small)[0], np.full(ROWS, 0.1)) for small in (1e-2, 1e-5))
    assert surer == pytest.approx(sure, rel=0.05)


def test_a_few_rows_do_not_decide_of_what_size_a_residual_is():
    """A tenth of the rows is off by ten times what the others are: 10 sizes by its square."""
    residual = np.full(ROWS, 0.01)
    residual[::10] = 0.1
    equal = np.full(ROWS, np.sqrt(np.mean(residual ** 2)))
    assert relative(make(), residual) < 0.7 * relative(make(), equal)


def test_a_row_that_is_off_by_more_than_heavy_tails_decides():
    """A reading that is wrong; of 120 rows one is off by nine standard deviations by chance."""
    for sigmas in (5.0, 30.0):
        residual = np.zeros(ROWS)
        residual[30] = 0.01 * sigmas
        assert (relative(make(), residual) > 1.0) == (sigmas > 9.0)


def test_what_has_one_course_has_no_size():
    course = np.linspace(-1.0, 1.0, ROWS) ** 3
    covariance = make()
    covariance.discrepancy = dataclasses.replace(
        covariance.discrepancy, courses=course[:, None])
    assert relative(covariance, 0.4 * course) == 0.0
    assert relative(covariance, -0.4 * course) > 1.0


def test_the_scale_of_the_discrepancy_has_a_bound():
    """What is larger than twice the spread of what the bench has seen is something else."""
    covariance = make()
    draw = np.linalg.cholesky(smooth(ROWS, 0.01).matrix() + 1e-12 * np.eye(ROWS)) @ (
        np.random.default_rng(9).standard_normal(ROWS))
    assert covariance.fit(9.0 * draw)[0] == pytest.approx(LARGEST_SCALE)


def test_a_model_without_a_known_error_has_the_noise_of_its_sensor():
    """No division by a size of zero."""
    covariance = make(size=0.0, resolution=1e-3)
    values = covariance.fit(1e-3 * np.random.default_rng(7).standard_normal(ROWS))
    assert np.all(np.isfinite(values))
    assert np.exp(values[3]) == pytest.approx(1e-3, rel=0.3)
