# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The Prandtl-Ishlinskii operator and its exact inverse."""

import json
import math

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.operators import Preisach, PrandtlIshlinskii, operator_from_dict


def example(sign=1.0):
    """Return plays of radius 0, 0.5 and 1 over -1 to 5, with saturation behind them."""
    return PrandtlIshlinskii(
        [0.0, 0.5, 1.0], sign * np.array([0.5, 1.0, 2.0]), 0.3, -1.0, 5.0,
        thresholds=[-1.0, 4.0] if sign > 0.0 else [-4.0, 1.0], bends=[0.5, -0.9])


def test_one_play_by_hand():
    operator = PrandtlIshlinskii([1.0], [2.0], 0.5, 0.0, 6.0)
    # Cold, the play has come down with the input: it is one radius above.
    assert operator.output == 0.5 + 2.0 * 1.0
    # It stays until the clearance is taken up, then follows one radius below.
    assert operator.step(2.0) == 0.5 + 2.0 * 1.0
    assert operator.step(5.0) == 0.5 + 2.0 * 4.0
    assert operator.step(3.5) == 0.5 + 2.0 * 4.0
    assert operator.step(2.0) == 0.5 + 2.0 * 3.0
    assert operator.output_range == (2.5, 10.5)


def test_dead_zones_bend_the_output():
    straight = PrandtlIshlinskii([0.0], [1.0], 0.0, 0.0, 6.0)
    bent = PrandtlIshlinskii([0.0], [1.0], 0.0, 0.0, 6.0, [2.0, 4.0], [1.0, -1.5])
    for u, y in ((1.0, 1.0), (2.0, 2.0), (3.0, 4.0), (4.0, 6.0), (5.0, 6.5), (6.0, 7.0)):
        assert straight.peek(u) == u
        assert bent.peek(u) == pytest.approx(y)
        assert bent.invert(y).input == pytest.approx(u)


def test_play_is_a_preisach_operator_with_its_weight_on_a_line():
    # Relays with alpha - beta = 2 r make a play. A narrow band of fine cells around that line
    # comes as near as its width.
    radius, levels = 1.0, 60
    nodes = np.linspace(0.0, 6.0, levels + 1)
    beta, alpha = np.triu_indices(levels)
    band = (alpha - beta == 2.0 * radius / 0.1).astype(float)
    relays = Preisach(nodes, band / 0.1 ** 2 * 0.05, 0.0)
    plays = PrandtlIshlinskii([radius], [1.0], 0.0, 0.0, 6.0)
    shift = plays.output - relays.output
    inputs = [5.0, 2.5, 4.0, 0.3, 3.3, 6.0, 1.0]
    for u in inputs:
        assert plays.step(u) == pytest.approx(relays.step(u) + shift, abs=0.11)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_inverse_is_exact(sign):
    operator = example(sign)
    low, high = operator.output_range
    rng = np.random.default_rng(0)
    for y in rng.uniform(low, high, 300):
        found = operator.invert(y)
        assert not found.saturated
        assert operator.peek(found.input) == found.output
        assert abs(found.output - y) < 1e-12 * (high - low)
        operator.step(found.input)


def test_inverse_takes_the_nearest_input_on_a_plateau():
    operator = PrandtlIshlinskii([0.5, 1.0], [0.0, 2.0], 0.0, 0.0, 6.0)
    operator.step(5.0)
    y = operator.output
    assert operator.invert(y) == (5.0, y, False)
    operator.step(4.0)
    assert operator.invert(y) == (4.0, y, False)
    # Down by 0.1 only moves once the clearance of 2 is taken up.
    assert operator.invert(y - 0.2).input == pytest.approx(2.9)


def test_inverse_beyond_the_range_is_flagged():
    operator = example()
    low, high = operator.output_range
    operator.step(2.0)
    assert operator.invert(high + 1.0) == (5.0, pytest.approx(high), True)
    assert operator.invert(low - 1.0) == (-1.0, pytest.approx(low), True)
    y = operator.output
    for bad in (math.nan, math.inf, -math.inf):
        assert operator.invert(bad) == (2.0, y, True)
    assert operator.step(math.nan) == y and operator.saturated
    assert operator.peek(math.nan) == y
    assert operator.step(math.inf) == pytest.approx(high)
    assert operator.step(-9.0) == pytest.approx(low)
    assert operator.saturated and operator.input == -1.0


def test_dead_band_counts_from_the_last_movement():
    operator = example()
    operator.step(3.0)
    y = operator.output
    assert operator.direction == 1.0
    assert operator.invert(y - 0.01, dead_band=0.02) == (3.0, y, False)
    assert operator.invert(y + 0.01, dead_band=0.02).input > 3.0
    operator.step(2.0)
    assert operator.direction == -1.0
    assert operator.invert(operator.output + 0.01, dead_band=0.02).input == 2.0


def test_simulate_equals_the_steps():
    one, other = example(), example()
    inputs = 2.0 + 3.5 * np.sin(np.linspace(0.0, 30.0, 2000))
    inputs[500:600] = np.random.default_rng(1).uniform(-1.0, 5.0, 100)
    expected = [one.step(u) for u in inputs]
    np.testing.assert_array_equal(other.simulate(inputs), expected)
    assert other.save() == one.save()
    np.testing.assert_array_equal(other.simulate([math.nan, 1.0]), [one.output, one.step(1.0)])


@settings(deadline=None, max_examples=50, derandomize=True)
@given(st.lists(st.floats(-1.2, 5.2), max_size=20), st.floats(-1.0, 5.0), st.floats(-1.0, 5.0))
def test_wiping_out_monotone_and_saved(inputs, a, b):
    operator = example()
    for u in inputs:
        operator.step(u)
    low, high = sorted((a, b))
    assert operator.peek(low) <= operator.peek(high) + 1e-12
    twin = operator_from_dict(json.loads(json.dumps(operator.to_dict())))
    twin.restore(json.loads(json.dumps(operator.save())))
    assert twin.output == operator.output and twin.direction == operator.direction
    # A loop inside a larger one is forgotten.
    for each in (operator, twin):
        for u in (high, low, high):
            each.step(u)
    for u in (low, (low + high) / 2.0, low, high):
        twin.step(u)
    assert twin.output == pytest.approx(operator.output, abs=1e-12)
    assert twin.peek(a) == pytest.approx(operator.peek(a), abs=1e-12)


@pytest.mark.parametrize('change, message', [
    ({'radii': [0.5, 0.5]}, 'strictly increasing'),
    ({'radii': [-0.5, 0.5]}, '>= 0'),
    ({'radii': [], 'weights': []}, 'radii'),
    ({'weights': [1.0]}, '1 weights for 2 radii'),
    ({'weights': [1.0, -1.0]}, 'both signs'),
    ({'thresholds': [1.0], 'bends': []}, 'one bend each'),
    ({'thresholds': [2.0, 1.0], 'bends': [0.1, 0.1]}, 'strictly increasing'),
    ({'thresholds': [1.0], 'bends': [-1.0]}, 'stay positive'),
    ({'lower': 6.0}, 'not below'),
    ({'bias': math.nan}, 'finite'),
    ({'weights': [1e100, 1e100]}, 'another unit'),
])
def test_parameters_that_make_no_sense_are_refused(change, message):
    good = {'kind': 'play', 'radii': [0.1, 0.5], 'weights': [1.0, 2.0], 'bias': 0.0,
            'lower': 0.0, 'upper': 6.0, 'thresholds': [], 'bends': []}
    operator_from_dict(good)
    with pytest.raises(ParameterError, match=message):
        operator_from_dict({**good, **change})


@pytest.mark.parametrize('change, message', [
    ({'plays': [0.0, 0.0]}, 'could have left'),
    ({'plays': [9.0, 9.0, 9.0]}, 'could have left'),
    ({'plays': [1.0, 0.7, 1.9]}, 'could have left'),
    ({'kind': 'preisach'}, 'kind is'),
    ({'direction': None}, 'not a number'),
])
def test_damaged_memory_is_refused(change, message):
    operator = example()
    operator.step(1.0)
    before = operator.save()
    with pytest.raises(ParameterError, match=message):
        operator.restore({**before, **change})
    assert operator.save() == before
