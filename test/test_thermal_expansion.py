# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle expands with its temperature: the law, its inverse, and where it makes sense."""

from hysteresis_ros.effects import catalogue, Inputs
from hysteresis_ros.laboratory.arm import Arm
from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.hidden_physics import EFFECTS, EXPANSION, SPREAD, apply_effects
from hysteresis_ros.laboratory.parallel_wires import ParallelWires
from hysteresis_ros.model import Simulator
from hysteresis_ros.model.chain import Chain
from model_support import arm_run, bicep_model, effect_of, misses_of_targets, wandering_voltage
import numpy as np
import pytest

KIND = catalogue()['thermal_expansion']
RESTING = Inputs(*(np.zeros(3) for _ in Inputs._fields))


def expansion(model, alpha=0.2):
    return effect_of(model, 'thermal_expansion', alpha=alpha)


def test_a_heated_wire_expands_with_the_square_of_its_drive():
    around = bicep_model().surroundings
    drive = np.array([0.0, 3.0, np.sqrt(around.full_drive_squared)])
    offset, factor = Chain([KIND(around, alpha=0.2)], around).drift(drive, drive ** 2, RESTING)
    share = drive ** 2 / around.full_drive_squared
    np.testing.assert_allclose(offset, 0.002 * around.length * share)
    np.testing.assert_array_equal(factor, 1.0)


def test_one_that_contracts_does_so_as_much():
    around = bicep_model().surroundings
    drive = np.array([0.0, 3.0, 5.0])
    longer, shorter = (Chain([KIND(around, alpha=0.2, sign=sign)], around).drift(
        drive, drive ** 2, RESTING)[0] for sign in (1.0, -1.0))
    np.testing.assert_array_equal(shorter, -longer)
    # What earlier versions saved has no sign.
    assert KIND(around, alpha=0.2).sign == 1.0 and longer[-1] > 0.0


def test_one_whose_temperature_is_the_drive_has_a_coefficient_per_kelvin():
    around = bicep_model().surroundings._replace(
        drive='temperature', full_drive_squared=300.0, length=1.0)
    warm = np.array([-20.0, 20.0, 120.0])
    effect = KIND(around, alpha=11.0)
    assert effect.parameters[0].unit == '1e-6/K'
    offset, _ = Chain([effect], around).drift(warm, warm, RESTING)
    np.testing.assert_allclose(np.diff(offset), 11e-6 * np.diff(warm))


@pytest.mark.parametrize('names', [(), ('coulomb_friction',), ('unequal_muscles',)])
def test_none_changes_nothing_and_some_does(names):
    model = bicep_model(names)
    run = arm_run(wandering_voltage(40, seed=3), 0.1)
    without = Simulator(model, run).run(model.effects)
    np.testing.assert_array_equal(
        Simulator(model, run).run([*model.effects, expansion(model, 0.0)]), without)
    change = Simulator(model, run).run([*model.effects, expansion(model)]) - without
    # A longer muscle lets the arm down.
    assert change.max() > 3e-3 and change.min() > -1e-6


@pytest.mark.parametrize('others', [
    (), ('stress_dependent_strain', 'series_compliance', 'transformation_slopes'),
    ('unequal_muscles', 'coulomb_friction')])
def test_the_inverse_brings_the_arm_to_its_targets(others):
    model = bicep_model(others)
    model = model.with_effects([*model.effects, expansion(model)])
    assert np.max(misses_of_targets(model)) < 0.01


def test_it_makes_no_sense_for_a_muscle_that_nothing_heats_or_that_heat_lengthens():
    there = bicep_model().surroundings
    assert KIND.available(there)
    assert not KIND.available(there._replace(drive='pressure'))
    assert not KIND.available(there._replace(sign=1))


def test_ranges_are_those_of_metals():
    """From 5e-6 to 22e-6 per kelvin, over 40 to 130 K where the temperature is not known."""
    heated, warmed = KIND.describe(None)[0], KIND.describe(
        bicep_model().surroundings._replace(drive='temperature'))[0]
    assert all(warmed.plausible(value) for value in (5.0, 22.0))
    assert not warmed.plausible(1.0) and not warmed.plausible(40.0)
    assert all(heated.plausible(value) for value in (0.02, 0.3))
    assert not heated.plausible(0.005) and not heated.plausible(0.5)


def test_an_arm_whose_conditions_change_has_other_wires_from_then_on():
    arm = Arm(Conditions())
    arm.change_at(0.0, lambda: setattr(arm.conditions, 'expansion', 1e-5))
    arm.advance(0.1, 0.0)
    assert [wire.expansion for wire in arm.muscle.wires] == [1e-5]


def test_a_wire_of_the_laboratory_expands_on_bench_and_arm():
    """Hot austenite, 10 K hotter, is longer by the coefficient; bench and arm have it alike."""
    assert EFFECTS['thermal_expansion'].bench
    for bench in (False, True):
        conditions = apply_effects(Conditions(), {'thermal_expansion': 1.0}, 5, bench=bench)
        assert abs(conditions.expansion / EXPANSION - 1.0) <= SPREAD
        wires = (ParallelWires(one).wires[0] for one in (conditions, Conditions()))
        own, none = (wire.elongation(150.0, 4.0) - wire.elongation(140.0, 4.0) for wire in wires)
        assert own - none == pytest.approx(
            10.0 * conditions.expansion * conditions.material.resting_length, rel=1e-6)
