# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Nonlinear least squares within bounds."""

import numpy as np
import pytest
from scipy import optimize

from hysteresis_ros.identification.gauss_newton import damped_step, minimise

TIME = np.linspace(0.0, 2.0, 40)
MEASURED = 1.5 * np.exp(-0.7 * TIME) + 0.3 + 0.05 * np.sin(9.0 * TIME)


def residual(vector):
    """Return the errors of a decay."""
    return vector[0] * np.exp(-vector[1] * TIME) + vector[2] - MEASURED


def jacobian(vector):
    """Return their derivatives."""
    decay = np.exp(-vector[1] * TIME)
    return np.column_stack([decay, -vector[0] * TIME * decay, np.ones(len(TIME))])


@pytest.mark.parametrize('lower, upper', [
    ([-9.0, -9.0, -9.0], [9.0, 9.0, 9.0]), ([0.0, 0.9, 0.0], [2.0, 3.0, 2.0]),
    ([0.0, 0.0, 0.5], [1.2, 3.0, 2.0])])
def test_minimum_within_bounds_is_that_of_scipy(lower, upper):
    lower, upper = np.array(lower), np.array(upper)
    start = np.clip([1.0, 1.0, 1.0], lower + 1e-9, upper - 1e-9)
    expected = optimize.least_squares(residual, start, jac=jacobian, bounds=(lower, upper),
                                      xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    found = minimise(residual, jacobian, start, lower, upper, 50, 1e-12)
    assert np.all(found >= lower) and np.all(found <= upper)
    assert found == pytest.approx(expected, abs=2e-3)
    assert np.sum(residual(found) ** 2) == pytest.approx(np.sum(residual(expected) ** 2), rel=1e-5)


def test_no_derivative_is_taken_that_no_step_uses():
    looked, derived = [], []

    def watched(function, calls):
        return lambda vector: (calls.append(vector), function(vector))[1]
    minimise(watched(residual, looked), watched(jacobian, derived), np.ones(3), np.full(3, -9.0),
             np.full(3, 9.0), 3, 0.0)
    assert (len(looked), len(derived)) == (3, 2)


def bend(vector):
    """Return a residual whose Newton step from 0.3 leads to -0.7, where it is larger."""
    return np.arctan(20.0 * vector)


def slope_of_bend(vector):
    """Return its derivative."""
    return np.diag(20.0 / (1.0 + (20.0 * vector) ** 2))


def search_bend(evaluations, tolerance=0.0):
    """Return where a search from 0.3 ends, and where it looked."""
    looked = []
    found = minimise(lambda x: (looked.append(float(x[0])), bend(x))[1], slope_of_bend,
                     np.array([0.3]), np.array([-9.0]), np.array([9.0]), evaluations, tolerance)
    return found, looked


def test_a_step_that_makes_it_worse_is_not_taken():
    found, looked = search_bend(2)
    assert looked[1] == pytest.approx(-0.7)
    assert found == 0.3


def test_steps_get_shorter_until_one_helps():
    found, looked = search_bend(20)
    assert np.all(np.diff(np.abs(np.array(looked[1:5]) - 0.3)) <= 0.0)
    assert found == pytest.approx(0.0, abs=1e-3)


def test_a_search_ends_with_a_step_that_gains_little_or_is_short():
    assert len(search_bend(99, tolerance=0.9)[1]) < len(search_bend(99)[1]) < 20
    # From 3 a step is cut to 1; of the square that takes off five ninths.
    looked = []
    minimise(lambda x: (looked.append(x), x)[1], lambda x: np.eye(1), np.array([3.0]),
             np.array([-9.0]), np.array([9.0]), 99, 0.6)
    assert len(looked) == 2


def test_residuals_that_are_not_finite_end_the_search_where_it_is():
    start, bound = np.array([0.5]), np.array([1.0])
    found = minimise(lambda x: x * np.nan, lambda x: np.eye(1), start, -bound, bound, 9, 0.0)
    assert found == start


def test_a_step_ends_at_a_bound_and_the_others_follow():
    curvature, gradient = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-0.9, -0.3])
    step = damped_step(curvature, gradient, 0.0, np.full(2, -9.0), np.array([0.2, 9.0]))
    assert step == pytest.approx([0.2, 0.05])
    assert damped_step(np.zeros((1, 1)), np.zeros(1), 1.0, -np.ones(1), np.ones(1)) == 0.0


def test_a_step_within_bounds_is_the_best_one():
    """Components at a bound are let go again where that helps."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        root, target = rng.standard_normal((4, 3)), 0.5 * rng.standard_normal(4)
        lowest, highest = -0.3 * rng.random(3), 0.3 * rng.random(3)
        expected = optimize.lsq_linear(root, target, (lowest, highest), tol=1e-14).x
        found = damped_step(root.T @ root, -root.T @ target, 0.0, lowest, highest)
        assert found == pytest.approx(expected, abs=1e-6)


def test_a_step_is_no_longer_than_the_range_of_a_parameter():
    step = damped_step(np.eye(2), np.array([-30.0, 40.0]), 0.0, np.full(2, -99.0), np.full(2, 99.0))
    assert step == pytest.approx([0.6, -0.8])


def test_damping_is_a_share_of_each_curvature():
    step = damped_step(np.diag([4.0, 1.0]), np.array([-0.4, -0.1]), 0.5, np.full(2, -9.0),
                       np.full(2, 9.0))
    assert step == pytest.approx([0.4 / 6.0, 0.1 / 1.5])
