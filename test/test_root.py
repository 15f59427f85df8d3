# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Roots that are followed from one sample to the next."""

import math

from hypothesis import given, strategies as st
import pytest

from hysteresis_ros.bicep.root import bracket, illinois


def bent(root):
    """Return a falling function that is steep on one side of its root and flat on the other."""
    return lambda u: -(5.0 * (u - root) if u > root else math.expm1(u - root))


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(1e-3, 10.0))
def test_the_root_is_found_from_either_side(root, start, gain):
    residual = bent(root)
    here = residual(start)
    if abs(here) < 1e-12:
        return
    near, at_near, far, at_far = bracket(residual, start, here, math.copysign(gain, here))
    assert at_near * at_far <= 0.0
    found = illinois(residual, near, at_near, far, at_far, 1e-10)
    assert found == pytest.approx(root, abs=1e-6)


def test_without_a_root_inside_the_nearer_end_is_the_answer():
    points = bracket(lambda u: 5.0 - u, 0.0, 5.0, 1.0, low=-3.0, high=3.0)
    assert points[2] == 3.0 and points[3] == 2.0
    points = bracket(lambda u: -5.0 - u, 0.0, -5.0, -1.0, low=-3.0, high=3.0)
    assert points[2] == -3.0
