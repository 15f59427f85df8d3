# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Roots that are followed from one sample to the next."""

import math

from hypothesis import given, strategies as st
import numpy as np
import pytest

from hysteresis_ros.kernels import root


def bent(at):
    """Return a falling function that is steep on one side of its root and flat on the other."""
    return lambda u: -(5.0 * (u - at) if u > at else math.expm1(u - at))


def search(function, start, step, low=-math.inf, high=math.inf, tolerance=1e-10):
    """Return the root that is found, and how often the function was evaluated."""
    memory = np.empty(root.SIZE + 3)
    count, value = 1, function(start)
    point = root.begin(memory, 3, start, value, step, low, high, tolerance)
    while root.searching(memory, 3):
        last, value = point, function(point)
        point = root.proceed(memory, 3, value)
        count += 1
    assert point == last
    return point, count


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(1e-3, 10.0))
def test_the_root_is_found_from_either_side(at, start, gain):
    here = bent(at)(start)
    if abs(here) < 1e-12:
        return
    found, count = search(bent(at), start, math.copysign(gain, here))
    assert found == pytest.approx(at, abs=1e-6)
    assert count < root.MOST_ITERATIONS


def test_without_a_root_inside_the_nearer_end_is_the_answer():
    assert search(lambda u: 5.0 - u, 0.0, 1.0, -3.0, 3.0)[0] == 3.0
    assert search(lambda u: -5.0 - u, 0.0, -1.0, -3.0, 3.0)[0] == -3.0


def test_a_search_goes_on_between_two_points():
    memory = np.empty(root.SIZE)
    point = root.between(memory, 0, -1.0, 2.0, 3.0, -2.0, 1e-12)
    while root.searching(memory, 0):
        point = root.proceed(memory, 0, 1.0 - point)
    assert point == pytest.approx(1.0, abs=1e-12)
