# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An encoder with other counts per revolution: equation, inverse, the laboratory's, its name."""

import math

import numpy as np
import pytest

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.effects import catalogue
from hysteresis_ros.laboratory.encoder_disc import EncoderDisc
from model_support import bicep_model, effect_of, runs

THETA = np.linspace(0.0, 2.0 * math.pi, 73)


@pytest.mark.parametrize('k, theta_0', [(0.5, 0.0), (2000.0 / 2048.0, 90.0), (4.0, 180.0)])
def test_the_angle_is_scaled_and_the_inverse_takes_it_away(k, theta_0):
    effect = catalogue()['encoder_scale'](k=k, theta_0=theta_0)
    measured = effect.forward(THETA, None)
    assert np.diff(measured) == pytest.approx(k * np.diff(THETA))
    assert effect.step(math.radians(theta_0), 0.1) == pytest.approx(math.radians(theta_0))
    np.testing.assert_allclose([effect.inverse(one) for one in measured], THETA, atol=1e-12)


def test_the_laboratorys_counts_are_that_line():
    disc = EncoderDisc(pulses=1.2, counted_from=0.7)
    effect = catalogue()['encoder_scale'](k=1.2, theta_0=math.degrees(0.7))
    np.testing.assert_allclose([disc.reading(theta) for theta in THETA],
                               effect.forward(THETA, None), atol=1e-12)
    assert disc.reading(0.7) == pytest.approx(0.7)


def test_an_eccentric_disc_that_does_as_well_comes_first():
    model = bicep_model()
    disc = effect_of(model, 'encoder_eccentricity', e=5.0, phi=0.3)
    found = diagnose(model, [runs(model.with_effects([disc]), trials=4, rows=30, seed=4)],
                     ['encoder_scale', 'encoder_eccentricity', 'payload_error', 'backlash'])
    assert found.missing == ['encoder_eccentricity']
    assert 0.0 < effect_of(model, 'encoder_scale').prior_odds < disc.prior_odds == 1.0


def test_an_encoder_set_by_eye_to_the_upright_or_the_hanging_arm_is_plausible():
    for theta_0 in (-3.0, 0.0, 180.0, 183.0):
        assert catalogue()['encoder_scale'](k=1.2, theta_0=theta_0).implausible() == []
    assert catalogue()['encoder_scale'](k=1.2, theta_0=-60.0).implausible() == ['theta_0']


@pytest.mark.slow
@pytest.mark.parametrize('k, theta_0', [(0.8, 140.0), (1.25, 60.0), (2.0, 90.0)])
def test_it_is_named_with_its_size(k, theta_0):
    model = bicep_model()
    arm = model.with_effects([effect_of(model, 'encoder_scale', k=k, theta_0=theta_0)])
    found = diagnose(model, [runs(arm, trials=4, rows=30, seed=4)],
                     ['encoder_scale', 'encoder_offset', 'geometry_error', 'payload_error',
                      'backlash'])
    assert found.missing == ['encoder_scale']
    assert found.ranking[0]['parameters']['k']['value'] == pytest.approx(k, rel=0.02)
