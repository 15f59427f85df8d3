# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The mean of Preisach operators with inputs of their own is one Preisach operator."""

import numpy as np
import pytest

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.operators import Preisach
from hysteresis_ros.operators.series import mean_in_series


def make(seed, levels=6):
    """Return an operator with cells and reversible weights, and a generator."""
    rng = np.random.default_rng(seed)
    nodes = np.sort(rng.uniform(-2.0, 6.0, levels + 1))
    weights = rng.uniform(0.0, 1.0, levels * (levels + 1) // 2)
    sign = -1.0 if seed % 2 else 1.0
    return Preisach(nodes, sign * weights, 0.7, sign * rng.uniform(0.0, 1.0, levels)), rng


def series(seed, count=3):
    """Return an operator, nodes of a common input, inputs of each at these, parts, a generator."""
    operator, rng = make(seed)
    nodes = np.linspace(-10.0, 10.0, 24)
    steps = np.cumsum(rng.uniform(0.0, 1.0, (count, len(nodes))), axis=1)
    shares = (steps - steps[:, :1]) / (steps[:, -1:] - steps[:, :1])
    inputs = operator.lower - 0.5 + (operator.upper - operator.lower + 1.0) * shares
    parts = rng.uniform(0.2, 1.0, count)
    return operator, nodes, inputs, parts / parts.sum(), rng


@pytest.mark.parametrize('seed', range(6))
def test_at_the_nodes_it_is_the_mean_of_all(seed):
    operator, nodes, inputs, parts, rng = series(seed)
    made = mean_in_series(operator, nodes, inputs, parts)
    places = rng.integers(0, len(nodes), 200)
    expected = 0.0
    for own, part in zip(inputs, parts):
        operator.reset()
        expected = expected + part * operator.simulate(own[places])
    np.testing.assert_allclose(made.simulate(nodes[places]), expected, rtol=0.0, atol=1e-11)
    assert made.output_range == pytest.approx(operator.output_range, abs=1e-11)


@pytest.mark.parametrize('seed', range(4))
def test_an_operator_alone_with_its_own_input_is_itself(seed):
    operator, rng = make(seed)
    made = mean_in_series(operator, operator.nodes, operator.nodes[None, :], np.ones(1))
    np.testing.assert_allclose(made.weights, operator.weights, rtol=1e-12)
    np.testing.assert_allclose(made.reversible, operator.reversible, rtol=1e-12)
    inputs = rng.uniform(operator.lower, operator.upper, 100)
    np.testing.assert_allclose(made.simulate(inputs), operator.simulate(inputs), atol=1e-12)


@pytest.mark.parametrize('end', [0, -1])
def test_inputs_that_would_lose_relays_are_refused(end):
    operator, nodes, inputs, parts, _ = series(0)
    inputs[1, end] = 0.5 * (operator.lower + operator.upper)
    with pytest.raises(ParameterError, match='do not cover the range'):
        mean_in_series(operator, nodes, inputs, parts)
