# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects of the arm at rest, against an arm that is really built otherwise."""

import dataclasses
import math

import numpy as np
import pytest

from hysteresis_ros.effects import catalogue, MechanismEffect, Statics
from model_support import GEOMETRY, STRENGTHS

THETA = np.linspace(0.6, 2.6, 9)
REST = Statics.of(GEOMETRY, THETA)


def applied(name, **values):
    return catalogue()[name](**values).forward(REST, GEOMETRY)


def test_arm_without_effects_is_that_of_the_geometry():
    np.testing.assert_array_equal(REST.length, GEOMETRY.length(THETA))
    np.testing.assert_allclose(REST.moment / (3.0 * REST.moment_arm), GEOMETRY.force(THETA))
    plain = MechanismEffect()
    assert plain.forward(REST, GEOMETRY) is REST
    assert plain.resistance() == (0.0, 0.0, 0.0)


def test_payload_error_is_another_payload():
    heavier = dataclasses.replace(GEOMETRY, payload_mass=0.115)
    statics = applied('payload_error', dm=15.0)
    np.testing.assert_allclose(statics.moment, heavier.load_moment(THETA))
    np.testing.assert_array_equal(statics.length, REST.length)


def test_frame_tilt_turns_gravity_for_every_weight():
    tilted = applied('frame_tilt', phi=6.0)
    lean = math.radians(6.0)
    np.testing.assert_allclose(tilted.moment, GEOMETRY.load_moment(THETA + lean))
    both = catalogue()['clamp_mass'](moment=1.0, phi=0.5).forward(
        catalogue()['payload_error'](dm=50.0).forward(tilted, GEOMETRY), GEOMETRY)
    expected = 9.81 * ((0.150 + 0.020) * 0.30 * np.sin(THETA + lean)
                       + 1e-3 * np.sin(THETA + lean + 0.5))
    np.testing.assert_allclose(both.moment, expected)
    # The linkage stands in the frame, so it leans along.
    np.testing.assert_array_equal(both.length, REST.length)


def test_frame_tilt_acts_before_the_weights_in_a_chain():
    names = list(catalogue())
    assert names.index('frame_tilt') < min(
        names.index('payload_error'), names.index('clamp_mass'))


def test_clamp_mass_has_a_direction_of_its_own():
    moment = applied('clamp_mass', moment=0.8, phi=0.7).moment - REST.moment
    np.testing.assert_allclose(moment, 0.8e-3 * 9.81 * np.sin(THETA + 0.7))


def test_geometry_error_is_another_linkage():
    built = dataclasses.replace(GEOMETRY, clamp_distance=0.018, clamp_height=0.0055,
                                anchor_height=0.2658)
    statics = applied('geometry_error', dx=1.0, da=-0.5, dz=0.3)
    np.testing.assert_allclose(statics.length, built.length(THETA))
    np.testing.assert_allclose(statics.moment_arm, built.moment_arm(THETA))
    np.testing.assert_array_equal(statics.moment, REST.moment)


def test_shorter_muscle_and_higher_anchor_are_nearly_one():
    shorter = dataclasses.replace(GEOMETRY, resting_length=0.27 - 0.001)
    np.testing.assert_allclose(
        applied('geometry_error', dz=1.0).length, shorter.length(THETA), atol=3e-6)


def test_wild_geometry_stays_a_geometry():
    statics = applied('geometry_error', dx=-1e3, da=-1e3, dz=-1e3)
    assert np.all(np.isfinite(statics.length)) and np.all(np.isfinite(statics.moment_arm))


@pytest.mark.parametrize('side, beyond', [(1.0, THETA > 1.5), (-1.0, THETA < 1.5)])
def test_end_stop_pushes_the_arm_back(side, beyond):
    moment = applied('end_stop', stop=1.5, side=side, stiffness=2.0).moment - REST.moment
    np.testing.assert_allclose(moment, np.where(beyond, -2.0 * (THETA - 1.5), 0.0))
    # Above an upper stop the muscle is relieved, below a lower one it is loaded.
    assert np.all(moment[beyond] * side < 0.0)


@pytest.mark.parametrize('name, expected', [
    ('coulomb_friction', (0.02, 0.0, 0.0)), ('viscous_friction', (0.0, 0.5, 0.0)),
    ('inertia', (0.0, 0.0, 0.01))])
def test_what_resists_motion_does_nothing_at_rest(name, expected):
    effect = catalogue()[name](**STRENGTHS[name])
    assert effect.resistance() == expected
    assert effect.forward(REST, GEOMETRY) is REST


def test_fits_of_an_inertia_begin_in_every_period_of_the_ringing():
    """No further apart than a quarter of a period, which goes with the root of the inertia."""
    inertia = catalogue()['inertia'].parameters[0]
    starts = np.array(inertia.starts)
    assert np.all(np.diff(np.log(starts)) < 2.0 * np.log(1.27))
    assert starts[0] <= 5.0 * inertia.low and starts[-1] >= 0.6 * inertia.high
