# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixed points of functions."""

import numpy as np
import pytest

from hysteresis_ros.identification.fixed_point import fixed_point


def counted(function):
    """Return a function that counts its calls, and the list of their arguments."""
    calls = []

    def call(x):
        calls.append(x)
        return function(x)
    return call, calls


def test_values_that_come_near_slowly_are_reached_at_once():
    """Of what goes on along a line the end is known after two steps."""
    end, way = np.array([1.0, -2.0, 0.5]), np.array([3.0, 1.0, -2.0])
    call, calls = counted(lambda x: end + 0.95 * (x - end))
    found = fixed_point(call, end + way, 1e-9, 20)
    assert found == pytest.approx(end, abs=1e-8) and len(calls) == 3


def test_it_ends_where_values_agree_or_after_so_many():
    call, calls = counted(lambda x: 0.1 * x)
    start = np.array([1.0, -1.0])
    assert fixed_point(call, start, 1.0, 9) == pytest.approx(0.1 * start) and len(calls) == 1
    call, calls = counted(lambda x: np.array([x[1], 1.0 + np.sin(3.0 * x[0])]))
    fixed_point(call, start, 0.0, 5)
    assert len(calls) == 5
    call, calls = counted(lambda x: x)
    assert fixed_point(call, start, 0.0, 5).tolist() == start.tolist() and len(calls) == 1


def test_a_function_that_moves_all_values_alike_does_not_stop_it():
    """No step changes from the one before, which would divide by zero."""
    assert fixed_point(lambda x: x + [1.0, 2.0], np.zeros(2), 0.1, 4) == pytest.approx([4.0, 8.0])
