# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Ranges of parameters follow from muscle and arm, not from those of the paper."""

import dataclasses

from model_support import bicep_model, effect_of, preisach, runs
import numpy as np
import pytest
from selection_support import recording, selection

from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.effects import catalogue
from hysteresis_ros.effects.base import PAPER, Surroundings
from hysteresis_ros.laboratory.linkage import GEOMETRY

# How much longer everything is, how much stronger each muscle, and how much higher the voltage:
# three wires of 0.5 mm at 24 V, and some of 0.06 mm at 3 V.
BIG, SMALL = (2.5, 6.0, 4.0), (0.3, 0.1, 0.5)
# Time does not scale with the arm, and a moment of inertia needs it; wires have no valve.
UNLIKE = {'inertia', 'valve_lag'}


def rig(longer=1.0, stronger=1.0, higher=1.0):
    """Return the bicep's model at another scale, whose angles are the same."""
    model = bicep_model()
    lengths = {name: longer * getattr(model.geometry, name) for name in (
        'clamp_distance', 'clamp_height', 'anchor_height', 'forearm_length', 'resting_length')}
    masses = {name: stronger * getattr(model.geometry, name)
              for name in ('payload_mass', 'forearm_mass')}
    return bicep_model(
        force_stage=preisach(0.0, 6.0 * higher, 6, 0.5 * stronger, 14.5 * stronger, 0.5 * higher),
        length_stage=preisach(-13.0 * stronger, 9.0 * stronger, 10, -0.0205 * longer,
                              0.0005 * longer, 4.0 * stronger),
        geometry=dataclasses.replace(model.geometry, **lengths, **masses),
        ranges={'voltage': (0.0, 6.0 * higher), 'length': (-0.0205 * longer, 0.0),
                'force': (0.5 * stronger, 14.5 * stronger)},
        mean_load=3.0 * stronger,
        metrics={'length': {'verification': {'rmse': 0.0004 * longer}}})


def test_the_paper_s_own_muscle_and_arm_have_the_ranges_that_are_written_down():
    model = bicep_model(mean_load=PAPER.load)
    for name in ('moved_mass', 'largest_moment', 'moment_of_inertia', 'clamp_distance'):
        assert getattr(model.geometry, name) == pytest.approx(
            dict(moved_mass=PAPER.mass, largest_moment=PAPER.moment, clamp_distance=PAPER.lever,
                 moment_of_inertia=PAPER.inertia)[name])
    assert model.geometry.clamp_distance == GEOMETRY['clamp_distance']
    for name, effect in catalogue().items():
        for written, own in zip(effect.describe(None), effect.describe(model.surroundings)):
            assert (own.low, own.high, *own.starts) == pytest.approx(
                (written.low, written.high, *written.starts)), name
            assert own.unit == written.unit


@pytest.mark.slow
@pytest.mark.parametrize('scale', [BIG, SMALL])
@pytest.mark.parametrize('name', sorted(set(catalogue()) - UNLIKE))
def test_at_another_scale_an_effect_of_usual_size_does_the_same_to_the_angle(name, scale):
    """Whatever is longer, stronger and driven by more volts by the same factors."""
    kind, angles = catalogue()[name], []
    for own in ((1.0, 1.0, 1.0), scale):
        model = rig(*own)
        problem = problem_for(model, [runs(model, rows=30)])
        effect = kind(model.surroundings)
        angles += [problem.simulate([effect.with_values(**{
            parameter.name: (parameter.choices[-1] if parameter.choices else
                             parameter.starts[-1])
            for parameter in effect.parameters})])]
    assert angles[1] == pytest.approx(angles[0], abs=2e-3)


@pytest.mark.parametrize('scale, dm', [(BIG, 100.0), (SMALL, 1.7)])
def test_a_wrong_payload_is_found_at_another_scale(scale, dm):
    """It is as large a share of what the arm carries as 17 g are of the paper's 100 g."""
    model = rig(*scale)
    measured = recording(model, [effect_of(model, 'payload_error', dm=dm)])
    found = selection(model, measured).sets
    best = found.valid()[0]
    assert best == {'payload_error'}
    assert found.fits[best].effects[0].dm == pytest.approx(dm, rel=0.1)


@pytest.mark.parametrize('drive, square, plain', [
    ('voltage', 'V^2/K', 'V'), ('current', 'A^2/K', 'A'), ('power', 'W/K', 'W')])
def test_a_range_has_the_unit_of_the_drive(drive, square, plain):
    own = Surroundings(0.27, 3.0, 0.09, 0.02, drive=drive)
    gain = catalogue()['ambient_temperature'].describe(own)[0]
    assert gain.unit == square and gain.high == pytest.approx(2.0 * 0.09 / 36.0)
    dead = catalogue()['pwm_dead_zone'].describe(own)[0]
    assert dead.unit == plain and dead.high == pytest.approx(1.5 * 0.3 / 6.0)


def test_a_range_stays_as_it_is_where_nothing_is_known_to_scale_it_by():
    """Without an arm, for one."""
    bench = Surroundings(0.27, 3.0, 36.0, 0.02)
    assert catalogue()['payload_error'].describe(bench) == catalogue()[
        'payload_error'].describe(None)


def test_a_drift_starts_at_rates_that_suit_the_recording():
    """In an hour and a half a room cannot change by 1 V^2 every ten minutes."""
    drift = catalogue()['ambient_drift'](PAPER)
    for hours in (0.3, 1.5):
        clock = np.linspace(0.0, 3600.0 * hours, 50)
        for values in drift.moments(np.zeros(50), np.zeros(50), clock):
            total = drift.with_values(**values).total(clock)
            waves = 'sine' in values
            # A wave swings to both sides; 50 rows just miss its ends.
            assert np.ptp(total) == pytest.approx(1.6 if waves else 4.0, rel=0.01)
