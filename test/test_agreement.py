# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The martensite share of a whole trial, brought into agreement with what it causes."""

import math

import numpy as np
import pytest

from hysteresis_ros.effects import Inputs
from hysteresis_ros.model import agreement, Simulator
from hysteresis_ros.model.agreement import KnownPhases
from hysteresis_ros.model.simulation import FIT_AGREEMENT
from model_support import arm_run, bicep_model, effect_of, wandering_voltage

MODEL = bicep_model()


def effects(*names, **values):
    return [effect_of(MODEL, name, **values) for name in names]


def test_of_runs_with_the_same_effects_the_nearest_values_count():
    known = KnownPhases(np.ones(3))
    for latent in (0.1, 0.2, 0.5):
        known.keep(effects('latent_heat', latent=latent), np.full(3, latent))
    for latent, nearest in ((0.05, 0.1), (0.22, 0.2), (0.19, 0.2), (1.0, 0.5)):
        found = known.nearest(effects('latent_heat', latent=latent))
        np.testing.assert_array_equal(found, np.full(3, nearest))


def test_effects_that_never_acted_together_begin_where_most_of_them_did():
    known = KnownPhases(np.ones(2))
    np.testing.assert_array_equal(known.nearest(effects('creep')), np.ones(2))
    known.keep(effects('latent_heat'), np.full(2, 0.3))
    known.keep(effects('creep'), np.full(2, 0.6))
    known.keep(effects('payload_error', 'resistance_change'), np.full(2, 0.9))
    for names, expected in ((('latent_heat', 'slack'), 0.3), (('creep', 'slack'), 0.6),
                            (('payload_error', 'resistance_change', 'slack'), 0.9)):
        np.testing.assert_array_equal(known.nearest(effects(*names)), np.full(2, expected))


def test_of_equal_runs_the_last_one_counts_and_the_first_are_forgotten(monkeypatch):
    monkeypatch.setattr(agreement, 'MOST_KEPT', 3)
    known = KnownPhases(np.ones(1))
    sizes = (0.1, 0.2, 0.4, 0.4)
    for number, size in enumerate(sizes):
        known.keep(effects('latent_heat', latent=size), np.array([0.1 * number]))
    assert known.nearest(effects('latent_heat', latent=0.4)) == pytest.approx(0.3)
    # The first one was 0.1.
    assert known.nearest(effects('latent_heat', latent=0.1)) == pytest.approx(0.1)


@pytest.mark.parametrize('time_constant', [0.3, 3.0])
@pytest.mark.parametrize('latent', [0.2, 1.0])
def test_without_hysteresis_one_run_shows_where_the_phase_agrees(latent, time_constant):
    """A muscle whose phase is a function of the drive squared alone has the same branches again."""
    effect, = effects('latent_heat', latent=latent, time_constant=time_constant)
    scales, rows, dt = MODEL.surroundings, 400, 0.05
    drive_squared = scales.full_drive_squared * np.repeat([0.9, 0.3, 1.0, 0.0], rows // 4)
    still = np.zeros(rows)

    def felt(phase):
        return effect.forward(drive_squared, Inputs(still, still, np.full(rows, dt), still, phase,
                                                    still), scales)

    def caused(q):
        return np.clip(1.1 - 1.3 * q / scales.full_drive_squared, 0.0, 1.0)

    given = np.ones(rows)
    found = effect.agreeing_phase(given, caused(felt(given)), felt(given), np.full(rows, dt),
                                  scales)
    assert np.sqrt(np.mean((caused(felt(found)) - found) ** 2)) < FIT_AGREEMENT
    # What the muscle would have without the heat is far from that.
    assert np.max(np.abs(caused(felt(given)) - found)) > 0.05


@pytest.mark.parametrize('latent, time_constant', [(0.2, 1.0), (0.6, 3.0), (1.0, 1.0)])
def test_a_fit_is_near_the_arm_that_is_followed_row_by_row(latent, time_constant):
    run = arm_run(wandering_voltage(600, seed=4), 0.1)
    own = effects('latent_heat', latent=latent, time_constant=time_constant)
    fitted, exact = (Simulator(MODEL, run).run(own, exact=exact) for exact in (False, True))
    assert np.sqrt(np.mean((fitted - exact) ** 2)) < math.radians(0.5)


def test_a_copy_of_known_phases_knows_nothing_of_what_comes_later():
    model = bicep_model()
    one, other = effect_of(model, 'resistance_change'), effect_of(model, 'latent_heat')
    known = KnownPhases(np.ones(3))
    known.keep([one], np.array([0.1, 0.2, 0.3]))
    before = known.copy()
    known.keep([one, other], np.array([0.4, 0.5, 0.6]))
    np.testing.assert_array_equal(known.nearest([one, other]), [0.4, 0.5, 0.6])
    np.testing.assert_array_equal(before.nearest([one, other]), [0.1, 0.2, 0.3])
    before.keep([other], np.array([0.7, 0.8, 0.9]))
    np.testing.assert_array_equal(before.nearest([other]), [0.7, 0.8, 0.9])
    np.testing.assert_array_equal(known.nearest([one]), [0.1, 0.2, 0.3])
