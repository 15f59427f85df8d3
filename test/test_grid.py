# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes lie where the response goes its way."""

import numpy as np
import pytest

from hysteresis_ros.identification.grid import nodes_along


def test_an_even_response_has_an_even_grid_just_beyond_the_inputs():
    inputs = np.concatenate((np.linspace(-2.0, 6.0, 30), np.linspace(6.0, -2.0, 17)))
    nodes = nodes_along(-2.0, 6.0, inputs, 3.0 * inputs, np.zeros(47, dtype=int), 8)
    assert nodes == pytest.approx(np.linspace(-2.0, 6.0, 9), abs=1e-4)
    assert nodes[0] < -2.0 and nodes[-1] > 6.0


def test_half_of_the_nodes_follow_the_response():
    """All of the way is done between 4 and 5; two trials do not change it."""
    half = np.linspace(0.0, 10.0, 101)
    inputs = np.tile(np.concatenate((half, half[::-1])), 2)
    trial = np.repeat([0, 1], 202)
    response = np.clip(inputs - 4.0, 0.0, 1.0) * np.where(trial == 0, 1.0, 2.0) + 7.0 * trial
    response = response + 0.002 * np.random.default_rng(0).standard_normal(404)
    nodes = nodes_along(0.0, 10.0, inputs, response, trial, 20)
    assert np.all(np.diff(nodes) > 0.0)
    assert 10 <= np.count_nonzero((nodes > 3.999) & (nodes < 5.001)) <= 12
    assert np.ptp(np.diff(nodes_along(
        0.0, 10.0, inputs, response, trial, 20, following=0.0))) < 1e-9
    # Elsewhere they are half as dense as on an even grid.
    assert np.diff(nodes)[nodes[1:] < 3.9] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize('response', [np.zeros(5), np.array([0.0, 0.0, 0.0, 0.0, 1.0])])
def test_what_stands_still_or_jumps_at_an_end_has_a_grid(response):
    inputs = np.linspace(0.0, 4.0, 5)
    nodes = nodes_along(0.0, 4.0, inputs, response, np.zeros(5, dtype=int), 6)
    assert len(nodes) == 7 and np.all(np.diff(nodes) > 0.0)
