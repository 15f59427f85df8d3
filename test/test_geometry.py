# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of the bicep against an independent construction with plane vectors."""

import dataclasses
import math
import re

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.errors import ParameterError, RangeError

GEOMETRY = BicepGeometry(
    clamp_distance=0.015, clamp_height=0.004, anchor_height=0.265, forearm_length=0.30,
    resting_length=0.26, payload_mass=0.100, forearm_mass=0.040)

angles = st.floats(0.35, 3.0)


def points(theta):
    """Pivot A, clamp C and anchor D in the plane, with y upwards."""
    along = np.array([math.sin(theta), math.cos(theta)])
    # The clamp stands on the side of the forearm that faces the anchor.
    across = np.array([-math.cos(theta), math.sin(theta)])
    clamp = GEOMETRY.clamp_distance * along + GEOMETRY.clamp_height * across
    return clamp, np.array([0.0, GEOMETRY.anchor_height])


@given(angles)
def test_length_is_the_distance_between_clamp_and_anchor(theta):
    clamp, anchor = points(theta)
    expected = np.linalg.norm(anchor - clamp) - GEOMETRY.resting_length
    assert GEOMETRY.length(theta) == pytest.approx(expected, abs=1e-12)


@given(angles)
def test_force_balances_the_moment_of_payload_and_forearm(theta):
    clamp, anchor = points(theta)
    direction = (anchor - clamp) / np.linalg.norm(anchor - clamp)
    total = GEOMETRY.muscle_count * float(GEOMETRY.force(theta)) * direction
    muscle_moment = clamp[0] * total[1] - clamp[1] * total[0]
    weight_moment = -9.81 * GEOMETRY.forearm_length * math.sin(theta) * (0.100 + 0.040 / 2)
    assert muscle_moment + weight_moment == pytest.approx(0.0, abs=1e-12)


@given(angles)
def test_moment_arm_is_y_sin_delta_and_the_slope_of_the_length(theta):
    z = float(GEOMETRY.muscle_length(theta))
    c, y = GEOMETRY.clamp_radius, GEOMETRY.anchor_height
    delta = math.acos((c * c - z * z - y * y) / (-2.0 * z * y))
    assert GEOMETRY.moment_arm(theta) == pytest.approx(y * math.sin(delta), abs=1e-8)
    step = 1e-6
    slope = (GEOMETRY.length(theta + step) - GEOMETRY.length(theta - step)) / (2 * step)
    assert GEOMETRY.moment_arm(theta) == pytest.approx(slope, abs=1e-8)


@given(angles)
def test_angle_inverts_length(theta):
    assert GEOMETRY.angle(GEOMETRY.length(theta)) == pytest.approx(theta, abs=1e-7)


def test_a_muscle_that_gets_longer_lets_the_arm_down():
    theta = np.linspace(*GEOMETRY.angle_range, 50)
    assert np.all(np.diff(GEOMETRY.length(theta)) > 0.0)
    assert np.isnan(GEOMETRY.angle(1.0))


def test_reference_refuses_what_the_linkage_cannot_take():
    low, high = GEOMETRY.angle_range
    length, force = GEOMETRY.reference(1.0)
    assert (length, force) == (GEOMETRY.length(1.0), GEOMETRY.force(1.0))
    for bad in (low - 1e-3, high + 1e-3, math.nan, math.inf):
        with pytest.raises(RangeError, match='target angle'):
            GEOMETRY.reference(bad)


def test_bad_geometry_is_named():
    for name, value in [('clamp_distance', 0.0), ('payload_mass', -1.0), ('gravity', math.nan),
                        ('muscle_count', 2.5), ('anchor_height', 'high')]:
        with pytest.raises(ParameterError, match=name):
            dataclasses.replace(GEOMETRY, **{name: value})


def test_files_round_trip_and_say_what_is_wrong(tmp_path):
    import yaml
    path = tmp_path / 'geometry.yaml'
    path.write_text(yaml.safe_dump(GEOMETRY.to_mapping()))
    assert BicepGeometry.from_yaml(path) == GEOMETRY
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': GEOMETRY.to_mapping()}}))
    assert BicepGeometry.from_yaml(path) == GEOMETRY
    path.write_text('clamp_distance: 0.01\n')
    with pytest.raises(ParameterError, match='geometry.yaml.*anchor_height'):
        BicepGeometry.from_yaml(path)
    path.write_text('[1, 2]')
    with pytest.raises(ParameterError, match='mapping'):
        BicepGeometry.from_yaml(path)
    path.write_text('a: [')
    with pytest.raises(ParameterError, match='not a YAML file'):
        BicepGeometry.from_yaml(path)


@pytest.mark.parametrize('name, factor, unit', [
    ('clamp_distance', 1e3, 'mm'), ('clamp_height', 1e3, 'mm'), ('anchor_height', 1e3, 'mm'),
    ('forearm_length', 1e3, 'mm'), ('resting_length', 1e3, 'mm'), ('payload_mass', 1e3, 'g'),
    ('forearm_mass', 1e3, 'g'), ('gravity', 1e3, 'mm/s^2')])
def test_values_in_another_unit_are_refused_and_converted_as_the_line_says(name, factor, unit):
    """Too large by a factor of 1000, with the unit that explains it; too small as well."""
    mapping = GEOMETRY.to_mapping()
    with pytest.raises(ParameterError, match=re.escape(f'is it in {unit}?')) as refused:
        BicepGeometry.from_written({**mapping, name: factor * mapping[name]}, 'arm.yaml')
    written = re.search(f'Write "{name}: (.*)"', str(refused.value))[1]
    arm = BicepGeometry.from_written({**mapping, name: written})
    assert getattr(arm, name) == pytest.approx(mapping[name])
    with pytest.raises(ParameterError, match=f'{name} is .* which is impossible'):
        BicepGeometry.from_written({**mapping, name: mapping[name] / 1000.0})


def test_all_values_in_another_unit_are_named_at_once_and_a_written_unit_confirms():
    mapping = {**GEOMETRY.to_mapping(), 'clamp_distance': 17, 'payload_mass': 100}
    with pytest.raises(ParameterError, match='clamp_distance is 17 m, .*; payload_mass is 100 kg'):
        BicepGeometry.from_written(mapping)
    heavy = BicepGeometry.from_written({**GEOMETRY.to_mapping(), 'payload_mass': '20 kg'})
    assert heavy.payload_mass == 20.0
    with pytest.raises(ParameterError, match="payload_mass: 'stone' is none of kg, g"):
        BicepGeometry.from_written({**mapping, 'payload_mass': '2 stone'})
