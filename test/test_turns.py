# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How often a signal turns."""

from hysteresis_ros.measurements.turns import turns
import numpy as np
import pytest


@pytest.mark.parametrize('values, expected', [
    ([], 0), ([1.0], 0), ([0.0, 1.0, 2.0], 0), ([2.0, 1.0, 0.0], 0), ([0.0, 1.0, 2.0, 1.0, 0.0], 1),
    ([0.0, 2.0, 0.0, 3.0], 2), ([5.0, 1.0, 4.0, 2.0], 2)])
def test_it_counts_turns(values, expected):
    assert turns(np.array(values), 0.1) == expected


def test_noise_does_not_turn_it():
    """Each swing is below the least one, however far it goes in the end."""
    clean = np.concatenate((np.linspace(0.0, 3.0, 40), np.linspace(3.0, 1.0, 40),
                            np.linspace(1.0, 2.0, 40)))
    noisy = clean + 0.04 * np.random.default_rng(0).uniform(-1.0, 1.0, len(clean))
    assert turns(noisy, 0.1) == turns(clean, 0.1) == 2
    assert turns(noisy, 0.0) > 20


def test_a_swing_that_grows_bit_by_bit_is_one():
    falling = 1.0 - 0.01 * np.arange(40.0)
    assert turns(np.concatenate(([0.0], falling, [1.0])), 0.1) == 2
