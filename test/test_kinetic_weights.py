# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What weights contribute where minor loops follow kinetics, and its derivative."""

import numpy as np
import pytest
from scipy import optimize, sparse

from hysteresis_ros.diagnosis.bench_design import operator_with, weight_sizes
from hysteresis_ros.identification.kinetic_weights import KineticWeights
from hysteresis_ros.kernels.shares import shares
from hysteresis_ros.operators import Kinetic

NODES = np.linspace(0.0, 1.0, 13)
TOP = 0.9


@pytest.fixture
def excited():
    """Return inputs of two trials, some beyond the top, where they end, and those wanted."""
    rng = np.random.default_rng(4)
    inputs = np.append(0.95 * rng.random(40), [0.5, 0.97, 0.2, 0.0, 0.93, 0.91, 0.4])
    return inputs, np.array([20, len(inputs)]), np.arange(len(inputs)) % 3 != 0


@pytest.fixture(params=[(1.0, 1.0), (0.6, 0.8)], ids=['all is oriented', 'a share'])
def oriented(excited, request):
    """Return the share of what forms that the load of each trial orients."""
    _, ends, _ = excited
    return np.repeat(request.param, np.diff(ends, prepend=0))


@pytest.fixture
def kinetic(excited, oriented):
    """Return what kinetics add there."""
    inputs, ends, wanted = excited
    return KineticWeights(NODES, inputs, ends, wanted, plain_shares(excited), TOP, oriented)


def plain_shares(excited):
    inputs, ends, wanted = excited
    size = len(weight_sizes(NODES))
    return shares(NODES, inputs, ends, wanted, np.ones(np.count_nonzero(wanted)),
                  np.arange(size + 1))


def some_weights(seed, zeros=0.6):
    rng = np.random.default_rng(seed)
    weights = rng.random(len(weight_sizes(NODES))) * (
        rng.random(len(weight_sizes(NODES))) > zeros)
    return np.append(weights * weight_sizes(NODES), 0.3)


@pytest.mark.parametrize('zeros', [0.0, 0.6, 0.95])
def test_response_is_that_of_the_operator(excited, oriented, kinetic, zeros):
    inputs, ends, wanted = excited
    z = some_weights(1, zeros)
    whole = Kinetic(operator_with(NODES, z[:-1] / weight_sizes(NODES), z[-1]), 1.0, TOP)
    expected = []
    for trial, share in zip(np.split(inputs, ends[:-1]), np.split(oriented, ends[:-1])):
        whole.reset()
        expected.append(whole.simulate_under(trial, share))
    found = plain_shares(excited) @ z + kinetic.added(z)
    # The operator has its branches in a table.
    assert found == pytest.approx(np.concatenate(expected)[wanted], abs=2e-3 * np.ptp(found))


@pytest.mark.parametrize('zeros', [0.0, 0.6])
def test_the_tangent_touches_the_response(kinetic, zeros):
    z = some_weights(2, zeros)
    rows, constant = kinetic.tangent(z)
    assert rows @ z + constant == pytest.approx(kinetic.added(z), abs=1e-12)
    assert not rows[:, -1].any()
    for seed in range(5):
        step = 1e-6 * z * np.random.default_rng(seed).standard_normal(len(z))
        change = (kinetic.added(z + step) - kinetic.added(z - step)) / 2.0
        assert rows @ step == pytest.approx(change, abs=1e-5 * np.max(np.abs(change)))


def test_without_weights_nothing_is_added(kinetic):
    none = np.zeros(len(weight_sizes(NODES)) + 1)
    assert not kinetic.added(none).any() and np.all(np.isfinite(kinetic.tangent(none).rows))


@pytest.fixture
def fitting(excited, kinetic):
    """Return residual, solution of a tangent, and the weights that both are to find."""
    true, plain = some_weights(5), plain_shares(excited)
    target = plain @ true + kinetic.added(true)
    penalty = sparse.identity(len(true), format='csr') * 1e-9
    root = np.sqrt(len(target) * 1e-9) * np.eye(len(true))

    def residual(z):
        return target - plain @ z - kinetic.added(z)

    def solved(tangent):
        rows = np.vstack([plain + tangent.rows, root])
        return optimize.nnls(rows, np.append(target - tangent.constant, np.zeros(len(true))),
                             maxiter=9999)[0], penalty
    return residual, solved, true


def test_weights_are_fitted_from_tangent_to_tangent(kinetic, fitting):
    residual, solved, _ = fitting
    start = some_weights(6, 0.0)
    costs, tangents = [], []

    def watched(tangent):
        tangents.append(tangent)
        return solved(tangent)
    found = kinetic.fitted(start, residual, watched, 1e-9)
    for one in (start, kinetic.fitted(start, residual, solved, np.inf), found):
        costs.append(np.sqrt(np.mean(residual(one) ** 2)))
    # A step that settles at once is the first; the others go on from there.
    assert costs[2] < 0.5 * costs[1] < 0.5 * costs[0] and len(tangents) > 2


def test_a_step_that_makes_it_worse_is_cut_short_or_left_out(kinetic, fitting):
    residual, _, true = fitting
    start = 1.2 * true

    heavy = sparse.identity(len(true), format='csr')

    def far(tangent):
        return start + 3.0 * (true - start), 0.0 * heavy
    once = kinetic.fitted(start, residual, far, np.inf)
    assert once == pytest.approx(start + 1.5 * (true - start))

    def wrong(tangent):
        return start - 4.0 * (true - start), 0.0 * heavy
    assert kinetic.fitted(start, residual, wrong, np.inf) == pytest.approx(start)

    def dear(tangent):
        return true, -10.0 * heavy
    # What the penalty takes away may count more than what the rows gain.
    assert kinetic.fitted(start, residual, dear, np.inf) == pytest.approx(start)
