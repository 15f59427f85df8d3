# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reversible weights of the Preisach operator: relays on the line beta = alpha."""

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.operators import Preisach, operator_from_dict, signed_areas, signed_lengths


def make(seed, levels=6, sparse=0.6):
    generator = np.random.default_rng(seed)
    nodes = np.sort(generator.uniform(-2.0, 6.0, levels + 1))
    weights = generator.uniform(0.0, 1.0, levels * (levels + 1) // 2)
    weights *= generator.random(weights.shape) < sparse
    slopes = generator.uniform(0.0, 1.0, levels) * (generator.random(levels) < sparse)
    sign = -1.0 if seed % 2 else 1.0
    return Preisach(nodes, sign * weights, 0.7, sign * slopes), generator


@pytest.mark.parametrize('seed', range(6))
def test_output_is_that_of_the_cells_and_a_curve_without_memory(seed):
    operator, generator = make(seed)
    inputs = generator.uniform(operator.lower, operator.upper, 200)
    expected = (signed_areas(operator.nodes, inputs) @ operator.weights + operator.bias
                + signed_lengths(operator.nodes, inputs) @ operator.reversible)
    assert operator.simulate(inputs) == pytest.approx(expected, abs=1e-12)
    operator.reset()
    assert [operator.step(u) for u in inputs] == pytest.approx(expected, abs=1e-12)


def test_reversible_weights_are_the_limit_of_small_diagonal_cells():
    coarse = Preisach([0.0, 1.0, 3.0], [0.0] * 3, 0.2, [0.5, 0.25])
    nodes = np.linspace(0.0, 3.0, 3001)
    cells = np.zeros((3000, 3000))
    # The mass of a diagonal cell is weight * width^2 / 2, that of its interval slope * width.
    np.fill_diagonal(cells, np.where(nodes[:-1] < 1.0, 0.5, 0.25) * 2.0 / 0.001)
    inputs = np.array([0.3, 2.7, 1.4, 1.45, 0.2, 3.0, 0.0])
    expected = np.array([signed_areas(nodes[i:i + 2], [u])[0, 0] * cells[i, i]
                         for u in inputs for i in range(3000)]).reshape(7, 3000).sum(axis=1) + 0.2
    assert coarse.simulate(inputs) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize('seed', range(6))
def test_lengths_do_not_depend_on_the_order(seed):
    operator, generator = make(seed)
    inputs = generator.uniform(operator.lower, operator.upper, 50)
    order = generator.permutation(50)
    assert np.array_equal(signed_lengths(operator.nodes, inputs)[order],
                          signed_lengths(operator.nodes, inputs[order]))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 1000), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_forward_of_inverse_is_exact(seed, shares):
    operator, _ = make(seed)
    low, high = operator.output_range
    for share in shares:
        found = operator.invert(low + share * (high - low))
        assert not found.saturated
        assert found.output == pytest.approx(low + share * (high - low), abs=1e-11)
        assert operator.step(found.input) == pytest.approx(found.output, abs=1e-11)


def test_the_output_keeps_its_slope_where_the_input_turns():
    operator = Preisach([0.0, 1.0, 2.0], [0.3, 0.1, 0.3], 0.0, [0.4, 0.4])
    operator.step(1.5)
    assert (operator.output - operator.peek(1.5 - 1e-6)) / 1e-6 == pytest.approx(0.8, abs=1e-5)
    assert (operator.peek(1.5 + 1e-6) - operator.output) / 1e-6 >= 0.8 - 1e-9


def test_dictionary_keeps_the_reversible_weights_and_reads_files_without():
    operator, _ = make(3)
    again = operator_from_dict(operator.to_dict())
    assert np.array_equal(again.reversible, operator.reversible)
    content = operator.to_dict()
    del content['reversible']
    assert not np.any(operator_from_dict(content).reversible)


@pytest.mark.parametrize('reversible', [[1.0], [-1.0, 0.0], [np.nan, 0.0], 'ab'])
def test_bad_reversible_weights_are_refused(reversible):
    with pytest.raises(ParameterError):
        Preisach([0.0, 1.0, 2.0], [1.0, 1.0, 1.0], 0.0, reversible)
