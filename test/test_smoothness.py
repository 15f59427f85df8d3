# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The penalty on a rough Preisach weight function, as a root and as its square."""

import numpy as np
import pytest

from hysteresis_ros.identification.smoothness import smoothness, smoothness_square
from hysteresis_ros.operators import cell_areas, cells


def test_penalty_is_on_densities_of_neighbours_along_the_diagonal():
    nodes = np.array([0.0, 1.0, 2.0, 4.0])
    root = smoothness(nodes, reversible=True)
    areas = cell_areas(nodes)
    beta, alpha = cells(3)
    # A weight that depends on alpha - beta alone costs the ridge only.
    band = np.append(1.0 + alpha - beta, np.zeros(3)) * np.append(areas, np.zeros(3)) / 16.0
    assert np.sum((root @ band)[:3] ** 2) == pytest.approx(0.0, abs=1e-20)
    assert np.sum((root @ band) ** 2) == pytest.approx(
        0.1 * np.sum((1.0 + alpha - beta) ** 2 * areas / 16.0))
    # The same density on a grid twice as fine costs about the same.
    costs = []
    for levels in (10, 20):
        grid = np.linspace(-3.0, 2.0, levels + 1)
        middle = (grid[1:] + grid[:-1]) / 2.0
        i, j = cells(levels)
        weights = np.sin(0.5 * (middle[i] + middle[j])) * cell_areas(grid) / 25.0
        costs.append(np.sum((smoothness(grid) @ weights) ** 2))
    assert costs[0] == pytest.approx(costs[1], rel=0.1)


@pytest.mark.parametrize('levels', [1, 2, 7])
def test_the_square_is_that_of_the_root_and_leaves_the_bias_free(levels):
    nodes = np.sort(np.random.default_rng(levels).uniform(-3.0, 5.0, levels + 1))
    root = smoothness(nodes, reversible=True)
    square = smoothness_square(nodes).toarray()
    assert square[:-1, :-1] == pytest.approx(root.T @ root, rel=1e-12)
    assert not square[-1].any() and not square[:, -1].any()
