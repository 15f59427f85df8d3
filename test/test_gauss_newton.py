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


def test_a_step_that_makes_it_worse_is_not_taken():
    # Newton's step from here leads far to the other side.
    found = minimise(lambda x: np.arctan(x), lambda x: np.diag(1.0 / (1.0 + x ** 2)),
                     np.array([3.0]), np.array([-99.0]), np.array([99.0]), 2, 0.0)
    assert abs(np.arctan(found[0])) <= np.arctan(3.0)


def test_residuals_that_are_not_finite_end_the_search_where_it_is():
    start, bound = np.array([0.5]), np.array([1.0])
    found = minimise(lambda x: x * np.nan, lambda x: np.eye(1), start, -bound, bound, 9, 0.0)
    assert found == start


def test_a_step_ends_at_a_bound_and_the_others_follow():
    curvature, gradient = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-0.9, -0.3])
    step = damped_step(curvature, gradient, 0.0, np.full(2, -9.0), np.array([0.2, 9.0]))
    assert step == pytest.approx([0.2, 0.05])
    assert damped_step(np.zeros((1, 1)), np.zeros(1), 1.0, -np.ones(1), np.ones(1)) == 0.0
