# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An encoder's disc off its shaft's centre: equation, inverse, and the laboratory's disc."""

import math

import numpy as np
import pytest

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.effects import catalogue
from hysteresis_ros.laboratory.encoder_disc import EncoderDisc
from model_support import bicep_model, effect_of, runs

THETA = np.linspace(0.0, 2.0 * math.pi, 73)


def eccentric(e, phi):
    """Return the effect with values."""
    return catalogue()['encoder_eccentricity'](e=e, phi=phi)


@pytest.mark.parametrize('e, phi', [(3.0, 1.0), (10.0, -2.5), (40.0, 0.3)])
def test_the_error_is_one_wave_a_turn_and_the_inverse_takes_it_away(e, phi):
    effect = eccentric(e, phi)
    measured = effect.forward(THETA, None)
    np.testing.assert_allclose(measured - THETA, math.radians(e) * np.sin(THETA + phi), atol=1e-14)
    np.testing.assert_allclose([effect.inverse(one) for one in measured], THETA, atol=1e-12)


def test_the_laboratorys_disc_is_that_wave_to_first_order():
    """The head sees the disc from a fixed place; terms of second order are another matter."""
    for off in (1e-5, 1e-3):
        disc = EncoderDisc(radius=0.011, off_centre=off, direction=0.7)
        seen = np.array([disc.reading(theta) for theta in THETA])
        expected = eccentric(math.degrees(off / 0.011), 0.7).forward(THETA, None)
        assert np.max(np.abs(seen - expected)) < 0.6 * (off / 0.011) ** 2
    assert EncoderDisc().reading(1.3) == 1.3


def test_a_disc_gets_round_with_its_shaft():
    disc = EncoderDisc(off_centre=0.004, direction=-1.0)
    whole = [disc.reading(theta) for theta in (0.0, 2.0 * math.pi)]
    assert whole[1] - whole[0] == pytest.approx(2.0 * math.pi)
    assert np.all(np.diff([disc.reading(theta) for theta in THETA]) > 0.0)


@pytest.mark.parametrize('phi', [-2.0, 1.2])
def test_it_is_named_or_an_alternative_where_the_arm_sees_its_slope(phi):
    model = bicep_model()
    arm = model.with_effects([effect_of(model, 'encoder_eccentricity', e=6.0, phi=phi)])
    found = diagnose(model, [runs(arm, trials=4, rows=30, seed=4)],
                     ['encoder_eccentricity', 'encoder_offset', 'geometry_error', 'payload_error',
                      'backlash'])
    assert found.verdict == 'missing' and len(found.missing) == 1
    assert 'encoder_eccentricity' in {found.missing[0], *found.alternatives[0]}
    assert {found.missing[0], *found.alternatives[0]} <= {
        'encoder_eccentricity', 'geometry_error'}
