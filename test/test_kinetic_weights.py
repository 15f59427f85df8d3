# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What weights contribute where minor loops follow kinetics, and its derivative."""

import numpy as np
import pytest

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


@pytest.fixture
def kinetic(excited):
    """Return what kinetics add there."""
    inputs, ends, wanted = excited
    return KineticWeights(NODES, inputs, ends, wanted, plain_shares(excited), TOP)


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
def test_response_is_that_of_the_operator(excited, kinetic, zeros):
    inputs, ends, wanted = excited
    z = some_weights(1, zeros)
    whole = Kinetic(operator_with(NODES, z[:-1] / weight_sizes(NODES), z[-1]), 1.0, TOP)
    expected = []
    for trial in np.split(inputs, ends[:-1]):
        whole.reset()
        expected.append(whole.simulate(trial))
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
