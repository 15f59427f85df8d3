# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What every Preisach operator does, whatever its grid, its weights and its history."""

import json
import math

from hypothesis import given, settings, strategies as st
import numpy as np

from hysteresis_ros.operators import (
    Preisach, cells, operator_from_dict, signed_lengths)

slow = settings(deadline=None, max_examples=80, derandomize=True)
shares = st.floats(0.0, 1.0)


@st.composite
def operators(draw):
    """Return an operator with an uneven grid, plateaus, either sign, and often a line."""
    levels = draw(st.integers(1, 7))
    gaps = draw(st.lists(st.floats(0.05, 2.0), min_size=levels, max_size=levels))
    count = levels * (levels + 1) // 2
    weights = draw(st.lists(
        st.one_of(st.just(0.0), st.floats(1e-3, 1.0)), min_size=count, max_size=count))
    sign = draw(st.sampled_from([1.0, -1.0]))
    bottom = draw(st.floats(-5.0, 5.0))
    nodes = bottom + np.concatenate(([0.0], np.cumsum(gaps)))
    line = draw(st.one_of(
        st.just([0.0] * levels),
        st.lists(st.sampled_from([0.0, 0.05, 0.7]), min_size=levels, max_size=levels)))
    return Preisach(
        nodes, sign * np.array(weights), draw(st.floats(-3.0, 3.0)), sign * np.array(line))


@st.composite
def histories(draw, operator, most=25):
    """Return inputs inside the range, often on nodes or on earlier inputs."""
    inputs = []
    for share in draw(st.lists(shares, max_size=most)):
        kind = draw(st.integers(0, 3))
        if kind == 0:
            inputs.append(float(operator.nodes[round(share * (len(operator.nodes) - 1))]))
        elif kind == 1 and inputs:
            inputs.append(inputs[int(share * (len(inputs) - 1))])
        else:
            inputs.append(place(operator, share))
    return inputs


def place(operator, share):
    """Return an input of the range."""
    u = operator.lower + share * (operator.upper - operator.lower)
    return min(max(u, operator.lower), operator.upper)


def full(operator):
    """Return the full scale of the output, above what its constant is rounded to."""
    low, high = operator.output_range
    return max(high - low, 0.01 * max(abs(low), abs(high)), 1e-9)


def follow(operator, inputs):
    """Return the outputs of steps."""
    return [operator.step(u) for u in inputs]


def copy(operator):
    """Return an operator with the same parameters and memory."""
    twin = operator_from_dict(operator.to_dict())
    twin.restore(operator.save())
    return twin


@slow
@given(st.data())
def test_a_larger_excursion_wipes_out_what_lies_inside(data):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    low, high = sorted(place(operator, data.draw(shares)) for _ in range(2))
    # Down to low and up to high: any loop in between leaves no trace.
    follow(operator, [operator.lower, high, low])
    direct = copy(operator)
    for share in data.draw(st.lists(shares, max_size=10)):
        operator.step(min(low + share * (high - low), high))
    operator.step(low)
    assert operator.corners == direct.corners
    assert abs(operator.output - direct.output) < 1e-12 * full(operator)
    operator.step(high)
    direct.reset()
    direct.step(high)
    assert operator.save() == direct.save()


@slow
@given(st.data())
def test_minor_loops_between_the_same_inputs_are_congruent(data):
    operator = data.draw(operators())
    low, high = sorted(place(operator, data.draw(shares)) for _ in range(2))
    inside = [min(low + share * (high - low), high)
              for share in data.draw(st.lists(shares, max_size=6))]
    loops = []
    for _ in range(2):
        operator.reset()
        follow(operator, data.draw(histories(operator)))
        # Once round, so that both start on the closed loop.
        follow(operator, [low, high, low])
        loops.append(np.array(follow(operator, [*inside, high, *inside[::-1], low])))
    shape = [loop - loop[-1] for loop in loops]
    np.testing.assert_allclose(shape[0], shape[1], rtol=0.0, atol=1e-12 * full(operator))


@slow
@given(st.data())
def test_output_is_monotone_in_the_next_input(data):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    inputs = sorted(data.draw(histories(operator)) + [operator.input])
    sign = math.copysign(1.0, operator.peek(operator.upper) - operator.peek(operator.lower))
    outputs = sign * np.array([operator.peek(u) for u in inputs])
    assert np.all(np.diff(outputs) >= -1e-13 * full(operator))
    low, high = operator.output_range
    slack = 1e-13 * full(operator)
    assert np.all(sign * outputs >= low - slack) and np.all(sign * outputs <= high + slack)


@slow
@given(st.data(), st.sampled_from([2, 10, 1000]))
def test_sampling_of_a_ramp_makes_no_difference(data, steps):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    twin = copy(operator)
    end = place(operator, data.draw(shares))
    ramp = np.linspace(operator.input, end, steps)
    ramp[-1] = end
    follow(twin, ramp)
    operator.step(end)
    assert abs(operator.output - twin.output) < 1e-12 * full(operator)
    assert operator.corners == twin.corners


def test_ten_thousand_steps_of_a_ramp_make_no_difference():
    rng = np.random.default_rng(0)
    operator = Preisach(np.linspace(0.0, 6.0, 21), rng.uniform(0.0, 1.0, 210))
    follow(operator, [5.0, 1.0])
    twin = copy(operator)
    follow(twin, np.linspace(1.0, 4.0, 10000)[1:])
    assert abs(operator.step(4.0) - twin.output) < 1e-12 * full(operator)
    assert operator.save()['corners'] == twin.save()['corners']


@slow
@given(st.data())
def test_between_grid_levels_the_cells_are_relays(data):
    operator = data.draw(operators())
    levels = len(operator.nodes) - 1
    beta, alpha = cells(levels)
    width = np.diff(operator.nodes)
    mass = operator.weights * width[beta] * width[alpha] * np.where(beta == alpha, 0.5, 1.0)
    mass[beta == alpha] += operator.reversible * width
    relays = np.full(len(mass), -1.0)
    for level in data.draw(st.lists(st.integers(0, levels), max_size=30)):
        relays[alpha < level] = 1.0
        relays[beta >= level] = -1.0
        expected = mass @ relays + operator.bias
        y = operator.step(float(operator.nodes[level]))
        assert abs(y - expected) < 1e-12 * full(operator)


@slow
@given(st.data())
def test_forward_of_the_inverse_is_the_reference(data):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    low, high = operator.output_range
    for share in data.draw(st.lists(shares, min_size=1, max_size=15)):
        y = min(max(low + share * (high - low), low), high)
        before = operator.save()
        found = operator.invert(y)
        assert operator.save() == before
        assert operator.lower <= found.input <= operator.upper
        assert not found.saturated
        assert abs(found.output - y) <= 1e-9 * full(operator)
        assert abs(operator.peek(found.input) - y) <= 1e-9 * full(operator)
        # No input nearer to the present one does it as well.
        nearer = operator.input + 0.999 * (found.input - operator.input)
        if abs(found.input - operator.input) > 1e-3:
            missing = abs(operator.peek(nearer) - y)
            assert missing > abs(operator.peek(found.input) - y) - 1e-15 * full(operator)
        operator.step(found.input)


@slow
@given(st.data())
def test_inverse_of_an_output_leads_back(data):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    u = place(operator, data.draw(shares))
    y = operator.peek(u)
    found = operator.invert(y)
    assert abs(operator.peek(found.input) - y) <= 1e-12 * full(operator)
    slack = 1e-9 * (operator.upper - operator.lower)
    # On a plateau the nearer end counts.
    assert abs(found.input - operator.input) <= abs(u - operator.input) + slack


@slow
@given(st.data(), st.floats(0.0, 0.1))
def test_the_dead_band_of_the_inverse_keeps_its_promise(data, dead_band):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    low, high = operator.output_range
    y = low + data.draw(shares) * (high - low)
    found = operator.invert(y, dead_band=dead_band)
    slack = 1e-12 * full(operator)
    assert found.output == operator.peek(found.input) or abs(
        found.output - operator.peek(found.input)) < slack
    change = abs(y - operator.output)
    if found.input == operator.input:
        assert change <= max(dead_band, slack)
    exact = operator.invert(y)
    assert abs(found.input - operator.input) <= abs(exact.input - operator.input) + 1e-12


@slow
@given(st.data(), st.lists(st.floats(), max_size=30))
def test_no_float_breaks_it(data, values):
    operator = data.draw(operators())
    for value in values:
        y = operator.step(value)
        found = operator.invert(value)
        twice = operator.invert(value, dead_band=0.01)
        numbers = [y, operator.peek(-value), operator.input, *found[:2], *twice[:2]]
        assert all(map(math.isfinite, numbers))
        assert operator.lower <= operator.input <= operator.upper
        assert operator.lower <= found.input <= operator.upper
    json.dumps(operator.save(), allow_nan=False)
    assert np.all(np.isfinite(operator.simulate(values)))


@slow
@given(st.data())
def test_batch_equals_steps(data):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    twin = copy(operator)
    ends = data.draw(histories(operator))
    inputs = np.concatenate([np.linspace(a, b, 9) for a, b in zip(ends[:-1], ends[1:])] or [[]])
    inputs = inputs + data.draw(st.sampled_from([0.0, 0.3]))
    expected = follow(operator, inputs)
    np.testing.assert_array_equal(twin.simulate(inputs), expected)
    assert twin.save() == operator.save()
    sums = (operator.areas(inputs) @ operator.weights + operator.bias
            + signed_lengths(operator.nodes, inputs) @ operator.reversible)
    operator.reset()
    np.testing.assert_allclose(
        sums, follow(operator, inputs), rtol=0.0, atol=1e-12 * full(operator))


@slow
@given(st.data())
def test_saved_memory_has_the_same_future(data):
    operator = data.draw(operators())
    follow(operator, data.draw(histories(operator)))
    twin = operator_from_dict(operator.to_dict())
    twin.restore(json.loads(json.dumps(operator.save())))
    future = data.draw(histories(operator))
    assert twin.output == operator.output
    assert twin.direction == operator.direction
    assert follow(twin, future) == follow(operator, future)
    assert twin.save() == operator.save()


@slow
@given(st.data())
def test_memory_is_nested_and_no_longer_than_the_history(data):
    operator = data.draw(operators())
    history = data.draw(histories(operator))
    follow(operator, history)
    corners = operator.corners
    assert len(corners) <= len(history)
    assert all(a > b for a, b in zip(corners[::2], corners[2::2]))
    assert all(a < b for a, b in zip(corners[1::2], corners[3::2]))
    assert set(corners) <= set(history)
