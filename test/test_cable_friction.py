# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Friction in proportion to the load: on the model's arm, in its inverse, and in the laboratory."""

import math

import numpy as np
import pytest
from scipy import optimize

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.laboratory.arm import Arm
from hysteresis_ros.laboratory.cable import Cable
from hysteresis_ros.laboratory.conditions import Air, Conditions
from hysteresis_ros.laboratory.heat import HeatBalance
from hysteresis_ros.laboratory.linkage import Linkage
from hysteresis_ros.laboratory.plant import BRISK
from hysteresis_ros.model import Simulator
from model_support import (
    arm_run, bicep_model, effect_of, GEOMETRY, misses_of_targets, runs, wandering_voltage)

MODEL = bicep_model()
MU_PHI = 0.12


def balance(*names, **values):
    """Return the model's arm with a rubbing cable, and other effects by name."""
    model = MODEL.with_effects([effect_of(MODEL, 'cable_friction', mu_phi=MU_PHI),
                                *(effect_of(MODEL, name, **values) for name in names)])
    return model.balance(model.chain())


def load_at(theta, drag=0.0):
    """Return the load that the arm asks of each muscle with a straight cable."""
    return (GEOMETRY.load_moment(theta) - drag) / (3.0 * GEOMETRY.moment_arm(theta))


@pytest.mark.parametrize('names, drag', [((), 0.0), (('coulomb_friction',), 0.03)])
def test_the_muscle_bears_the_load_times_the_capstan_factor(names, drag):
    """Less while the arm sinks, more while it rises, and what is between while it sticks."""
    made = balance(*names, **({'tau_c': drag} if names else {}))
    made.settle(0.5)
    risen = made.step(6.0, 30.0)
    pulled = load_at(risen, -drag) * math.exp(MU_PHI)
    assert made.operators[0].input + 6.0 == pytest.approx(pulled, abs=1e-5)
    borne = load_at(risen, drag) * math.exp(-MU_PHI)
    for x in (6.0 - 0.5 * (pulled - borne), 6.0 - 0.99 * (pulled - borne), 5.9):
        assert made.step(x, 30.0) == risen
    x = 6.0 - 1.3 * (pulled - borne)
    sunk = made.step(x, 30.0)
    assert sunk > risen
    assert made.operators[0].input + x == pytest.approx(
        load_at(sunk, drag) * math.exp(-MU_PHI), abs=1e-5)


def test_the_angle_is_that_of_brute_force():
    """H2 of the load at the muscle has to be as long as the arm lets it."""
    made = balance()
    made.settle(0.5)
    stage = MODEL.require_length_stage()
    stage.step(made.operators[0].input)
    for x in (3.0, 5.0, 8.0, 11.0):
        def gap(theta):
            return stage.peek(load_at(theta) * math.exp(MU_PHI) - x) - GEOMETRY.length(theta)
        theta = made.step(x, 30.0)
        assert theta == pytest.approx(optimize.brentq(gap, *GEOMETRY.angle_range), abs=5e-7)
        stage.step(load_at(theta) * math.exp(MU_PHI) - x)


@pytest.mark.parametrize('others', [(), ('stress_dependent_strain', 'series_compliance'),
                                    ('unequal_muscles',), ('transformation_slopes',)])
def test_the_inverse_brings_the_arm_to_its_targets(others):
    model = bicep_model(('cable_friction', *others))
    assert np.max(misses_of_targets(model, 85.0)) < 0.01


@pytest.mark.parametrize('names', [('inertia',), ('viscous_friction',),
                                   ('inertia', 'coulomb_friction')])
def test_a_moving_arm_goes_where_a_slow_one_comes_to_rest(names):
    """Friction is the same with and without dynamics once these have died away."""
    slow, moving = balance(*(name for name in names if name == 'coulomb_friction')), balance(*names)
    plain = MODEL.balance(MODEL.chain())
    for made in (slow, moving, plain):
        made.settle(0.5)
    lower = []
    for ends in ((0.5, 9.0), (9.0, 5.0)):
        for x in np.concatenate((np.linspace(*ends, 200), np.full(100, ends[1]))):
            expected, angle = slow.step(float(x), 0.1), moving.step(float(x), 0.1)
        assert angle == pytest.approx(expected, abs=3e-3)
        lower.append(expected - plain.step(ends[1], 30.0))
    assert lower[0] > 0.005


def test_friction_takes_energy_from_a_swinging_arm():
    """Its swings die away, and faster than those of the wire's own hysteresis."""
    spans = []
    for mu_phi in (0.001, 0.1):
        model = MODEL.with_effects([effect_of(MODEL, 'inertia', I=0.01),
                                    effect_of(MODEL, 'cable_friction', mu_phi=mu_phi)])
        made = model.balance(model.chain())
        made.settle(3.0)
        angles = [made.step(9.0, 0.02) for _ in range(60)]
        assert np.all(np.isfinite(angles))
        spans.append(np.ptp(angles[30:]))
    assert spans[1] < 0.5 * spans[0]


def test_a_cable_loses_tension_as_the_capstan_equation_says():
    cable = Cable(friction=0.2, wrap=math.radians(180.0))
    assert cable.behind(5.0) == pytest.approx(5.0 * math.exp(-0.2 * math.pi), rel=1e-6)
    assert cable.behind(cable.before(5.0)) == pytest.approx(5.0)
    assert Cable().behind(5.0) == 5.0 and not Cable().rubs


def test_the_laboratorys_wires_bear_the_moment_times_that_factor():
    """Within it the arm stands still, at its ends the arm moves."""
    cable, linkage = Cable(friction=0.1, wrap=1.5), Linkage()
    arm = Arm(Conditions(air=Air(turbulence=0.0), heat=HeatBalance(time_constant=BRISK),
                         cable=cable))
    ratios, stuck = [], 0
    for voltage in (3.9, 4.2, 4.5, 4.45, 4.2, 4.0, 3.6, 3.2):
        before = arm.angle
        arm.settle(30.0, voltage)
        pull = 3.0 * arm.tensions[0] * linkage.moment_arm(arm.angle)
        ratios.append(pull / linkage.moment(arm.angle))
        stuck += arm.angle == before
    assert np.max(ratios) == pytest.approx(math.exp(0.15), rel=1e-3)
    assert np.min(ratios) == pytest.approx(math.exp(-0.15), rel=1e-3)
    assert stuck >= 1


def test_a_heavy_arm_comes_to_rest_where_its_cables_hold_it():
    linkage = Linkage()
    arm, straight = (Arm(Conditions(
        air=Air(turbulence=0.0), heat=HeatBalance(time_constant=BRISK), inertia=0.012,
        cable=cable)) for cable in (Cable(friction=0.1, wrap=1.5), Cable()))
    for voltage in np.concatenate((np.linspace(0.0, 4.4, 150), np.full(50, 4.4))):
        before = arm.angle
        arm.advance(0.1, float(voltage))
        straight.advance(0.1, float(voltage))
    assert arm.angle == pytest.approx(before, abs=1e-5)
    ratio = 3.0 * arm.tensions[0] * linkage.moment_arm(arm.angle) / linkage.moment(arm.angle)
    assert 1.02 < ratio < math.exp(0.15) + 1e-3
    assert arm.angle > straight.angle + 0.02


def test_neutral_cables_change_nothing():
    run = arm_run(wandering_voltage(60, seed=3), 0.1)
    model = bicep_model(('coulomb_friction', 'inertia'))
    np.testing.assert_array_equal(
        Simulator(model, run).run(model.effects),
        Simulator(model, run).run([*model.effects, effect_of(model, 'cable_friction', mu_phi=0.0)]))


@pytest.mark.parametrize('name, other', [('cable_friction', 'coulomb_friction'),
                                         ('coulomb_friction', 'cable_friction')])
def test_one_friction_is_named_and_the_other_at_most_together_with_it(name, other):
    values = {'cable_friction': {'mu_phi': 0.15}, 'coulomb_friction': {'tau_c': 0.05}}[name]
    arm = MODEL.with_effects([effect_of(MODEL, name, **values)])
    found = diagnose(MODEL, [runs(arm, trials=4, rows=30, seed=4)],
                     [name, other, 'backlash', 'encoder_offset', 'payload_error'])
    assert found.verdict == 'missing' and len(found.missing) == 1
    assert name in {found.missing[0], *found.alternatives[0]}
    assert {found.missing[0], *found.alternatives[0]} <= {name, other}
