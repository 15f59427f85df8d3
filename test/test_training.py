# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A wire in training, whose stroke grows with the cycles, is told by the equation of fatigue."""

import pytest

from hidden_cases import found_in


@pytest.mark.slow
def test_training_is_found_with_its_signs():
    tried = ['fatigue', 'ambient_drift', 'creep', 'payload_error']
    found = found_in({'fatigue': -1.0}, 4, tried)
    assert found.missing == ['fatigue'], found.sets[:4]
    trained, = found.effects
    assert trained.a < 0.0 and trained.b < 0.0 and trained.implausible() == []
