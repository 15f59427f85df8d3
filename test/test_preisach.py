# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The Preisach operator: numbers worked out by hand, edges, refusals."""

import json
import math

import numpy as np
import pytest

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.operators import (
    Preisach, cell_areas, cells, operator_from_dict, signed_areas)


def uniform(levels=1, lower=0.0, upper=1.0, weight=1.0, bias=0.0):
    """Return an operator with the same weight everywhere."""
    nodes = np.linspace(lower, upper, levels + 1)
    return Preisach(nodes, np.full(levels * (levels + 1) // 2, weight), bias)


def random_operator(seed, levels=10, sign=1.0):
    """Return an operator over 0 to 6 with about a third of its weights zero."""
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.0, 1.0, levels * (levels + 1) // 2)
    weights *= rng.random(len(weights)) < 0.7
    return Preisach(np.linspace(0.0, 6.0, levels + 1), sign * weights, 2.0)


def span(operator):
    """Return the full scale of the output."""
    low, high = operator.output_range
    return high - low


# Sec. IV-B, Eqs. 3 to 6

@pytest.mark.parametrize('levels', [1, 2, 7])
def test_uniform_weight_has_parabolic_branches(levels):
    operator = uniform(levels, bias=0.25)
    # All relays down: minus the area 1/2 of the plane.
    assert operator.output == pytest.approx(-0.25, abs=1e-15)
    # Rising from the cold state turns the triangle u^2 / 2 from down to up.
    assert operator.step(0.6) == pytest.approx(-0.25 + 0.36, abs=1e-14)
    # Falling by d turns d^2 / 2 back.
    assert operator.step(0.2) == pytest.approx(-0.25 + 0.36 - 0.16, abs=1e-14)
    assert operator.step(0.5) == pytest.approx(-0.25 + 0.36 - 0.16 + 0.09, abs=1e-14)
    # Beyond 0.6 the inner loop is forgotten: the first branch goes on.
    assert operator.step(0.9) == pytest.approx(-0.25 + 0.81, abs=1e-14)
    assert operator.step(1.0) == pytest.approx(0.75, abs=1e-14)


def test_signed_areas_by_hand_on_an_uneven_grid():
    # Cells in the order of Eq. 8: (1,1) [0,1]^2 triangle, (1,2) beta 0-1 alpha 1-3, (2,1)
    # [1,3]^2 triangle; areas 1/2, 2, 2.
    nodes = [0.0, 1.0, 3.0]
    assert cell_areas(np.array(nodes)).tolist() == [0.5, 2.0, 2.0]
    rows = signed_areas(nodes, [0.0, 2.0, 0.5, 1.5, 3.0, -1.0])
    up = [
        [0.0, 0.0, 0.0],
        # alpha <= 2: all of (1,1), alpha 1-2 of (1,2), the triangle of side 1 in (2,1).
        [0.5, 1.0, 0.5],
        # beta > 1/2 is turned down again.
        [0.375, 0.5, 0.0],
        # alpha <= 1.5, beta >= 0.5 is turned up: half the triangle, 0.5 x 0.5, triangle of 0.5.
        [0.5, 0.75, 0.125],
        [0.5, 2.0, 2.0],
        [0.0, 0.0, 0.0]]
    expected = 2.0 * np.array(up) - [0.5, 2.0, 2.0]
    np.testing.assert_allclose(rows, expected, atol=1e-14)
    weights = [0.3, 0.7, 1.1]
    operator = Preisach(nodes, weights, 0.5)
    steps = [operator.step(u) for u in [0.0, 2.0, 0.5, 1.5, 3.0, -1.0]]
    np.testing.assert_allclose(steps, expected @ weights + 0.5, atol=1e-14)


@pytest.mark.parametrize('levels', [1, 2, 5, 20])
def test_cells_are_in_the_order_of_equation_8(levels):
    beta, alpha = cells(levels)
    for i in range(1, levels + 1):
        for j in range(1, levels + 2 - i):
            k = (i - 1) * (2 * levels - i + 2) // 2 + j - 1
            assert (beta[k], alpha[k]) == (i - 1, i + j - 2)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_areas_times_weights_are_the_output(sign):
    operator = random_operator(1, sign=sign)
    rng = np.random.default_rng(2)
    inputs = rng.uniform(-0.5, 6.5, 148)
    inputs[::7] = rng.choice(operator.nodes, 22)
    rows = operator.areas(inputs)
    assert rows.shape == (148, 55)
    outputs = [operator.step(u) for u in inputs]
    np.testing.assert_allclose(
        rows @ operator.weights + operator.bias, outputs, atol=1e-12 * span(operator))


def relay_grid(operator, inputs, refinement):
    """Return the outputs of a grid of relays, one in the middle of each small square."""
    fine = np.concatenate([
        low + (high - low) * (np.arange(refinement) + 0.5) / refinement
        for low, high in zip(operator.nodes[:-1], operator.nodes[1:])])
    width = np.repeat(np.diff(operator.nodes) / refinement, refinement)
    levels = len(operator.nodes) - 1
    weight = np.zeros((levels, levels))
    weight[cells(levels)] = operator.weights
    weight = np.kron(weight, np.ones((refinement, refinement)))
    weight *= np.multiply.outer(width, width)
    weight[np.diag_indices(len(fine))] /= 2.0
    weight = np.triu(weight)
    beta, alpha = fine[:, None], fine[None, :]
    relays = np.full_like(weight, -1.0)
    outputs = []
    for u in inputs:
        relays[np.broadcast_to(alpha < u, relays.shape)] = 1.0
        relays[np.broadcast_to(beta > u, relays.shape)] = -1.0
        outputs.append(np.sum(weight * relays) + operator.bias)
    return np.array(outputs)


@pytest.mark.parametrize('seed', range(3))
def test_relay_grid_converges_to_the_exact_areas(seed):
    rng = np.random.default_rng(seed)
    nodes = np.cumsum(rng.uniform(0.5, 1.5, 6))
    operator = Preisach(nodes, rng.uniform(0.0, 1.0, 15), -1.0)
    inputs = rng.uniform(nodes[0], nodes[-1], 60)
    exact = operator.simulate(inputs)
    errors = {n: np.abs(relay_grid(operator, inputs, n) - exact) for n in (2, 8, 32)}
    for n, error in errors.items():
        # The staircase cuts at most two small squares a row.
        row = 4.0 * np.max(operator.weights) * np.max(np.diff(nodes)) * np.ptp(nodes) / n
        assert np.max(error) < row
    assert np.mean(errors[8]) < 0.5 * np.mean(errors[2])
    assert np.mean(errors[32]) < 0.5 * np.mean(errors[8])


# Saturation, bad numbers

def test_input_beyond_the_grid_saturates_and_says_so():
    operator = uniform(4)
    assert operator.step(1.5) == operator.output_range[1]
    assert operator.saturated and operator.input == 1.0
    assert operator.step(1.0) == operator.output_range[1]
    assert not operator.saturated
    assert operator.step(-0.1) == operator.output_range[0]
    assert operator.saturated and operator.input == 0.0
    operator.step(0.5)
    assert not operator.saturated
    assert operator.peek(2.0) == operator.output_range[1]
    assert operator.peek(-2.0) == operator.output_range[0]
    assert not operator.saturated and operator.input == 0.5


def test_nan_and_infinities_do_not_get_in():
    operator = uniform(4)
    before = operator.step(0.5)
    assert operator.step(math.nan) == before
    assert operator.saturated and operator.input == 0.5
    assert operator.peek(math.nan) == before
    assert operator.step(math.inf) == operator.output_range[1]
    assert operator.step(-math.inf) == operator.output_range[0]
    np.testing.assert_array_equal(
        operator.simulate([0.5, math.nan, math.inf]), [before, before, 0.5])
    for y in (math.nan, math.inf, -math.inf):
        operator.reset()
        operator.step(0.5)
        assert operator.invert(y) == (0.5, before, True)
        assert operator.invert(y, dead_band=0.1) == (0.5, before, True)


@pytest.mark.parametrize('nodes, weights, bias, message', [
    ([0.0], [], 0.0, 'at least 2'),
    ([0.0, 1.0, 1.0], [1.0] * 3, 0.0, 'entry 2'),
    ([0.0, 2.0, 1.0], [1.0] * 3, 0.0, 'not above'),
    ([0.0, 1.0, 1.0 + 1e-14], [1.0] * 3, 0.0, 'not above'),
    ([0.0, math.nan], [1.0], 0.0, 'entry 1 is not finite'),
    ([0.0, 1e200], [1.0], 0.0, 'another unit'),
    ([[0.0, 1.0]], [1.0], 0.0, '2 dimensions'),
    (['a', 'b'], [1.0], 0.0, 'not a list of numbers'),
    ([0.0, 1.0], [1.0, 2.0], 0.0, '2 given, 1 levels have 1 cells'),
    ([0.0, 1.0, 2.0], [1.0, -1.0, 0.0], 0.0, 'both signs'),
    ([0.0, 1.0], [math.inf], 0.0, 'entry 0 is not finite'),
    ([0.0, 1e60], [1e60], 0.0, 'another unit'),
    ([0.0, 1.0], [1.0], math.nan, 'bias is nan'),
    ([0.0, 1.0], [1.0], 'x', 'not a number'),
    ([0.0, 1.0], [1.0], True, 'not a number'),
])
def test_parameters_that_make_no_sense_are_refused(nodes, weights, bias, message):
    with pytest.raises(ParameterError, match=message) as caught:
        Preisach(nodes, weights, bias)
    assert '\n' not in str(caught.value)


def test_areas_of_inputs_that_are_no_numbers_are_refused():
    with pytest.raises(ParameterError, match='input 1 is not finite'):
        signed_areas([0.0, 1.0], [0.5, math.nan])
    with pytest.raises(ParameterError, match='2 dimensions'):
        signed_areas([0.0, 1.0], [[0.5]])


@pytest.mark.parametrize('weight', [5e-324, 1e-310, 1e-200, 1e90])
def test_extreme_weights_stay_finite(weight):
    operator = uniform(3, weight=weight)
    low, high = operator.output_range
    for u in (0.3, 0.9, 0.4, 0.41, 0.2):
        assert low <= operator.step(u) <= high
        for y in np.linspace(low, high, 7):
            found = operator.invert(y)
            assert 0.0 <= found.input <= 1.0
            assert low - 1e-12 * high <= found.output <= high + 1e-12 * high


# The inverse (Eq. 12)

@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_inverse_gives_the_reference(sign):
    operator = random_operator(3, sign=sign)
    full = span(operator)
    rng = np.random.default_rng(4)
    for y in rng.uniform(*operator.output_range, 400):
        found = operator.invert(y)
        assert not found.saturated
        assert abs(found.output - y) < 1e-12 * full
        assert abs(operator.peek(found.input) - y) < 1e-12 * full
        assert operator.step(found.input) == pytest.approx(found.output, abs=1e-13 * full)


def test_inverse_of_the_uniform_weight_is_a_root():
    operator = uniform(5)
    operator.step(0.8)
    assert operator.invert(operator.output - 0.09).input == pytest.approx(0.5, abs=1e-12)
    operator.step(0.5)
    assert operator.invert(operator.output + 0.04).input == pytest.approx(0.7, abs=1e-12)
    # Beyond the corner at 0.8 the branch from the cold state counts.
    assert operator.invert(-0.5 + 0.81).input == pytest.approx(0.9, abs=1e-12)
    assert operator.input == 0.5 and operator.corners == [0.8]


def test_inverse_takes_the_nearest_input_on_a_plateau():
    # Weight only for alpha in [2, 3] and beta in [0, 1]: nothing happens between 1 and 2.
    operator = Preisach([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 0.0)
    operator.step(3.0)
    top, bottom = operator.output, -operator.output
    assert (bottom, top) == operator.output_range
    # Falling, the output stays until the input is 1, and is spent at 0.
    assert operator.invert(top) == (3.0, top, False)
    assert operator.invert(bottom).input == pytest.approx(0.0, abs=1e-12)
    operator.step(1.5)
    assert operator.invert(top).input == 1.5
    operator.step(0.0)
    assert operator.invert(bottom) == (0.0, bottom, False)
    operator.step(1.2)
    assert operator.invert(bottom).input == 1.2
    # Rounding of a reference on the plateau must not send the input across it.
    operator.step(2.5)
    y = operator.output
    operator.step(1.7)
    for k in (-1.0, 0.0, 1.0):
        assert operator.invert(y + k * 1e-15).input == 1.7


def test_reference_out_of_reach_gives_the_nearest_input_flagged():
    operator = random_operator(5)
    low, high = operator.output_range
    operator.step(3.0)
    for y, end in ((high + 1e-6, high), (1e300, high), (low - 1e-6, low), (-1e300, low)):
        found = operator.invert(y)
        assert found.saturated
        assert found.output == pytest.approx(end, abs=1e-12)
        assert operator.peek(found.input) == pytest.approx(end, abs=1e-12)
    # A hair outside is rounding, not a request.
    assert not operator.invert(high + 1e-14 * (high - low)).saturated
    assert not operator.invert(low - 1e-14 * (high - low)).saturated


def test_operator_without_weight_keeps_its_input():
    operator = uniform(3, weight=0.0, bias=1.0)
    operator.step(0.4)
    assert operator.invert(1.0) == (0.4, 1.0, False)
    assert operator.invert(2.0) == (0.4, 1.0, True)


def test_dead_band_holds_the_input_against_small_reversals_only():
    operator = uniform(6)
    operator.step(0.8)
    y = operator.output
    band = 1e-3
    assert operator.invert(y - 0.9 * band, dead_band=band) == (0.8, y, False)
    beyond = operator.invert(y - 1.1 * band, dead_band=band)
    assert beyond.output == pytest.approx(y - 1.1 * band, abs=1e-14)
    assert beyond.input < 0.8
    # The input goes on as it did: nothing is amplified, nothing is held.
    onward = operator.invert(y + 0.1 * band, dead_band=band)
    assert onward.output == pytest.approx(y + 0.1 * band, abs=1e-14)
    # At the cold end every movement starts with slope zero.
    operator.reset()
    assert operator.invert(operator.output + 0.5 * band, dead_band=band).input == 0.0
    # What is out of reach stays flagged.
    operator.step(2.0)
    assert operator.invert(operator.output + 0.5 * band, dead_band=band) == (
        1.0, operator.output, True)


# Batches

def test_simulate_equals_the_steps():
    operator, other = random_operator(7), random_operator(7)
    time = np.linspace(0.0, 40.0, 3000)
    inputs = 3.0 + 3.3 * np.cos(time) * np.exp(-time / 60.0)
    inputs[1000:1400] += np.random.default_rng(0).normal(0.0, 0.3, 400)
    inputs[100:120] = inputs[100]
    expected = [operator.step(u) for u in inputs]
    np.testing.assert_array_equal(
        np.concatenate([other.simulate(inputs[:777]), other.simulate(inputs[777:])]), expected)
    assert other.save() == operator.save()


def test_simulate_takes_an_empty_sequence_and_refuses_a_table():
    operator = uniform(2)
    assert operator.simulate([]).shape == (0,)
    with pytest.raises(ParameterError, match='plain sequence'):
        operator.simulate([[0.1]])


# Memory

def test_memory_comes_back_through_json():
    operator = random_operator(8)
    rng = np.random.default_rng(9)
    operator.simulate(rng.uniform(0.0, 6.0, 50))
    state = json.loads(json.dumps(operator.save()))
    twin = operator_from_dict(json.loads(json.dumps(operator.to_dict())))
    twin.restore(state)
    for u in rng.uniform(-0.2, 6.2, 50):
        assert twin.output == operator.output and twin.saturated == operator.saturated
        assert twin.peek(u) == operator.peek(u)
        twin.step(u)
        operator.step(u)
    operator.step(7.0)
    twin.restore(operator.save())
    assert twin.saturated and twin.output == operator.output_range[1]


@pytest.mark.parametrize('change, message', [
    ({'kind': 'play'}, 'kind is'),
    ({'input': math.nan}, 'finite'),
    ({'input': 7.0}, 'outside of the range'),
    ({'input': 1.0}, 'not between'),
    ({'corners': [5.0, 1.0, 0.5]}, 'damaged'),
    ({'corners': [5.0, 'x']}, 'not a list'),
    ({'corners': [4.0, 2.0] * 40000}, 'at most'),
    ({'saturated': 'no'}, 'not true or false'),
])
def test_damaged_memory_is_refused_and_the_old_one_kept(change, message):
    operator = random_operator(10)
    operator.simulate([5.0, 2.0, 4.0, 3.0])
    before = operator.save()
    with pytest.raises(ParameterError, match=message):
        operator.restore({**before, **change})
    assert operator.save() == before
    del before['corners']
    with pytest.raises(ParameterError, match='"corners" is missing'):
        operator.restore(before)


def test_saved_memory_does_not_change_with_the_operator():
    operator = uniform(3)
    operator.simulate([0.9, 0.2, 0.6, 0.4])
    state = operator.save()
    assert state['corners'] == [0.9, 0.2, 0.6]
    operator.step(1.0)
    assert state['corners'] == [0.9, 0.2, 0.6]


# Files

def test_parameters_survive_a_file_to_the_last_bit():
    operator = random_operator(14, sign=-1.0)
    twin = operator_from_dict(json.loads(json.dumps(operator.to_dict())))
    assert isinstance(twin, Preisach)
    assert twin.to_dict() == operator.to_dict()
    assert twin.step(3.3) == operator.step(3.3)
    with pytest.raises(ValueError):
        twin.nodes[0] = 1.0
    with pytest.raises(ValueError):
        twin.weights[0] = 1.0


@pytest.mark.parametrize('parameters, message', [
    ({'kind': 'pressach'},
     "unknown kind 'pressach': use one of bouc-wen, kinetic, linear, play, pre"),
    ({}, 'unknown kind None'),
    ('preisach', 'unknown kind None'),
    ({'kind': ['preisach']}, 'unknown kind'),
    ({'kind': 'preisach', 'nodes': [0.0, 1.0], 'bias': 0.0}, '"weights" is missing'),
])
def test_files_that_hold_no_operator_are_refused(parameters, message):
    with pytest.raises(ParameterError, match=message):
        operator_from_dict(parameters)
