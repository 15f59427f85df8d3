# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The Preisach operator's memory: its staircase, limited by merging, and the weight below it."""

from unittest import mock

import numpy as np
import pytest

from hysteresis_ros.kernels import preisach as kernel
from hysteresis_ros.operators import Preisach, preisach, signed_areas, staircase


def span(operator):
    """Return the full scale of the output."""
    low, high = operator.output_range
    return high - low


def test_memory_is_bounded_under_loops_that_shrink_for_ever():
    rng = np.random.default_rng(11)
    weights = rng.uniform(0.5, 1.0, 55)
    most = 1000
    exact = Preisach(np.linspace(0.0, 6.0, 11), weights)
    with mock.patch.object(preisach, 'MOST_CORNERS', most):
        limited = Preisach(np.linspace(0.0, 6.0, 11), weights)
    loops = 6000
    inputs = 3.0 + np.linspace(2.9, 0.01, loops) * (-1.0) ** np.arange(loops)
    expected = exact.simulate(inputs)
    assert len(exact.corners) > loops - 3
    for u, y in zip(inputs, expected):
        # The present output does not change when steps of the staircase are merged.
        assert limited.step(u) == pytest.approx(y, abs=1e-9 * span(exact))
        assert len(limited.corners) <= most - 2
    # Nor does any later one by more than a share that falls with the square of the limit.
    for u in np.linspace(0.0, 6.0, 301):
        assert abs(limited.peek(u) - exact.peek(u)) < 10.0 / most ** 2 * span(exact)
    staircase.check_corners(limited.corners, limited.input, 0.0, 6.0, 'test')


def test_search_in_a_deep_memory_finds_the_same_corner():
    rng = np.random.default_rng(12)
    weights = rng.uniform(0.0, 1.0, 55) * (rng.random(55) < 0.7)
    operator = Preisach(np.linspace(0.0, 6.0, 11), weights, 2.0)
    loops = 500
    inputs = 3.0 + np.linspace(2.9, 0.1, loops) * (-1.0) ** np.arange(loops)
    operator.simulate(inputs)
    rng = np.random.default_rng(13)
    for u in rng.uniform(0.0, 6.0, 200):
        state = operator.save()
        y = operator.peek(u)
        assert operator.invert(y).output == pytest.approx(y, abs=1e-12 * span(operator))
        row = signed_areas(operator.nodes, [*inputs, u])[-1]
        expected = row @ operator.weights + operator.bias
        assert y == pytest.approx(expected, abs=1e-11 * span(operator))
        assert operator.step(u) == y
        # Wiped out: all that the input has passed, and nothing else.
        nested = [c for c in state['corners'][::2] if c <= u] + [
            c for c in state['corners'][1::2] if c >= u]
        assert not set(nested) & set(operator.corners)
        operator.restore(state)


def everett(operator, alpha, beta):
    """Return the weight over a triangle of the plane."""
    return kernel.everett(operator.table, alpha, beta)


def staircase_of(operator):
    """Return the corners that a memory holds and the levels at them."""
    entries = operator.memory[kernel.CORNERS:][:2 * int(operator.memory[kernel.COUNT])]
    return entries[::2].tolist(), entries[1::2].tolist()


def test_merging_keeps_the_weight_below_the_staircase():
    operator = Preisach([0.0, 10.0], [0.5])
    operator.simulate([9.0, 1.0, 8.0, 2.0, 7.0, 3.0, 6.0, 4.0, 5.5, 4.5, 5.0])
    corners, sums = staircase_of(operator)
    for k in range(2, len(corners)):
        sign = -1.0 if k & 1 else 1.0
        assert sums[k] - sums[k - 1] == pytest.approx(
            sign * everett(operator, *sorted(corners[k - 1:k + 1])[::-1]), abs=1e-12)
    operator.memory[kernel.COUNT] = kernel.thin(operator.table, operator.memory, len(corners))
    merged, levels = staircase_of(operator)
    assert 4 < len(merged) < len(corners)
    for k in range(2, len(merged)):
        sign = -1.0 if k & 1 else 1.0
        step = sign * everett(operator, *sorted(merged[k - 1:k + 1])[::-1])
        assert levels[k] - levels[k - 1] == pytest.approx(step, abs=1e-12)
    assert merged[-2:] == corners[-2:] and levels[-1] == sums[-1]


def alpha(operator, *arguments):
    """Return the input at which the weight above a corner is reached."""
    return kernel.find_alpha(operator.table, *arguments)


def beta(operator, *arguments):
    """Return the same on the way down."""
    return kernel.find_beta(operator.table, *arguments)


def test_everett_function_and_its_solutions_end_with_the_plane():
    operator = Preisach([0.0, 1.0, 2.0], [0.5, 0.5, 0.5])
    assert everett(operator, 1.5, 0.25) == pytest.approx(0.5 * 1.25 ** 2)
    assert alpha(operator, 0.5 * 1.25 ** 2, 0.25, 0.0)[0] == pytest.approx(1.5)
    assert beta(operator, 0.5 * 1.25 ** 2, 1.5, 0.0)[0] == pytest.approx(0.25)
    for corner, end in ((1.5, 0.5 ** 2 / 2.0), (0.5, 1.5 ** 2 / 2.0)):
        assert alpha(operator, 9.0, corner, 0.0) == pytest.approx((2.0, end))
        assert alpha(operator, 1e-15, corner, 1e-14) == (corner, 0.0)
        assert beta(operator, 9.0, 2.0 - corner, 0.0) == pytest.approx((0.0, end))
        assert beta(operator, 1e-15, corner, 1e-14) == (corner, 0.0)


def test_rounding_does_not_send_a_solution_across_a_plateau():
    # Two triangles on the diagonal with nothing between them.
    three = Preisach([0.0, 1.0, 2.0, 3.0], [0.5, 0.0, 0.0, 0.0, 0.0, 0.5])
    for excess in (-1e-15, 0.0, 1e-15):
        # In the first cell from the corner, and in a later one.
        assert alpha(three, 0.5 + excess, 0.0, 1e-14)[0] == pytest.approx(1.0)
        assert beta(three, 0.5 + excess, 3.0, 1e-14)[0] == pytest.approx(2.0)
        assert alpha(three, 0.125 + excess, 0.5, 1e-14)[0] == pytest.approx(1.0)
        assert beta(three, 0.125 + excess, 2.5, 1e-14)[0] == pytest.approx(2.0)
    assert alpha(three, 0.5 + 1e-6, 0.0, 1e-14)[0] > 2.0
    assert beta(three, 0.5 + 1e-6, 3.0, 1e-14)[0] < 1.0
    four = Preisach(np.arange(5.0), np.array([0.0] * 4 + [0.5] + [0.0] * 4 + [0.5]))
    assert alpha(four, 0.5 + 1e-15, 0.0, 1e-14)[0] == pytest.approx(2.0)
    assert beta(four, 0.5 + 1e-15, 4.0, 1e-14)[0] == pytest.approx(3.0)
