# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A wire in training, whose stroke grows with the cycles, is told by the equation of fatigue."""

import math

import pytest

from hidden_cases import found_in
from hysteresis_ros.laboratory.arm import Arm


@pytest.mark.long
def test_training_is_found_with_its_signs():
    tried = ['fatigue', 'ambient_drift', 'creep', 'payload_error']
    found = found_in({'fatigue': -1.0}, 4, tried)
    assert found.missing == ['fatigue'], found.sets[:4]
    trained, = found.effects
    assert trained.a < 0.0 and trained.b < 0.0 and trained.implausible() == []


@pytest.mark.slow
@pytest.mark.long
def test_defects_that_delay_the_transformation_are_wear_and_no_cooler_room(monkeypatch):
    """They settle with the cycles; the catalogue's equation goes on with their logarithm."""
    room = Arm._room
    monkeypatch.setattr(Arm, '_room', lambda arm: room(arm) - 8.0 * (
        1.0 - math.exp(-arm.muscle.cycles / 4.0)))
    found = found_in({}, 4, ['fatigue', 'ambient_drift', 'creep', 'payload_error'])
    assert found.missing == ['fatigue'], found.sets[:4]
    worn, = found.effects
    assert worn.c > 0.2 and worn.implausible() == []
