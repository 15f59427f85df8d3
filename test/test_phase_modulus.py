# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Martensite is softer than austenite: the law, its inverse, and its name on a bench."""

import dataclasses

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.effects import catalogue
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.bench import Bench
from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.tanaka import TanakaMaterial
from hysteresis_ros.model import Simulator
from hysteresis_ros.model.chain import Chain
from model_support import (
    arm_run, bicep_model, effect_of, misses_of_targets, wandering_voltage)
import numpy as np
import pytest
from test_transformation_slopes import bench_tables, LOADS

LENGTH, MODULI = 0.27, (30e9, 13e9)


def modulus(model, m=0.1):
    return effect_of(model, 'phase_modulus', m=m)


def test_it_is_the_strain_of_two_phases_with_moduli_of_their_own():
    """1 / E = xi / E_M + (1 - xi) / E_A, for any load and any martensite share."""
    model = bicep_model()
    around = model.surroundings
    austenite, martensite, section, stroke = 60e9, 25e9, 3.2e-8, 0.012
    softer = (1.0 / martensite - 1.0 / austenite) * LENGTH / section
    chain = Chain([modulus(model, softer * around.load / stroke)], around)
    for load in (0.0, 1.0, around.load, 7.0):
        for share in (0.0, 0.3, 1.0):
            # The stroke under the mean load contains what is elastic there.
            transformed = share * (stroke - softer * around.load)
            elastic = load * LENGTH / section * (
                share / martensite + (1.0 - share) / austenite)
            found = (chain.scale(load) * share * stroke
                     + load * LENGTH / section / austenite)
            assert found == pytest.approx(transformed + elastic, abs=1e-9)


def test_growth_by_orientation_and_by_softening_add_up():
    model = bicep_model()
    around = model.surroundings
    growth = effect_of(model, 'stress_dependent_strain', r=0.5, F0=1.2)
    loads = np.linspace(0.0, 9.0, 10)
    both = Chain([growth, modulus(model, 0.1)], around).scale(loads)
    np.testing.assert_allclose(
        both, 0.9 * Chain([growth], around).scale(loads) + 0.1 * loads / around.load)
    assert Chain([growth, modulus(model)], around).scale(around.load) == pytest.approx(1.0)


@pytest.mark.parametrize('others', [
    (), ('stress_dependent_strain', 'series_compliance'),
    ('unequal_muscles', 'coulomb_friction')])
def test_the_inverse_brings_the_arm_to_its_targets(others):
    model = bicep_model(others)
    model = model.with_effects([*model.effects, modulus(model, 0.2)])
    assert np.max(misses_of_targets(model)) < 0.01


@pytest.mark.parametrize('names', [(), ('coulomb_friction',), ('unequal_muscles',)])
def test_equal_moduli_change_nothing_and_others_do(names):
    model = bicep_model(names)
    run = arm_run(wandering_voltage(40, seed=3), 0.1)
    without = Simulator(model, run).run(model.effects)
    np.testing.assert_array_equal(
        Simulator(model, run).run([*model.effects, modulus(model, 0.0)]), without)
    assert np.abs(Simulator(model, run).run([*model.effects, modulus(model)])
                  - without).max() > 1e-3


def test_it_makes_no_sense_without_a_load_or_for_a_muscle_that_nothing_heats():
    kind = catalogue()['phase_modulus']
    there = bicep_model().surroundings
    assert kind.available(there)
    assert not kind.available(there._replace(load=0.0))
    assert not kind.available(there._replace(drive='pressure'))


def bench_of(moduli, seed):
    """Identify a wire after Tanaka, whose strain does not depend on the load."""
    material = dataclasses.replace(
        TanakaMaterial.specimen(np.random.default_rng(seed)),
        austenite_modulus=moduli[0], martensite_modulus=moduli[1])
    force, length = bench_tables(material, seed)
    trials = {'length_trials': range(4), 'force_trials': [0]}
    model = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **trials).model
    return material, add_effects(model, length, force, **trials)


def stroke_of(material):
    """Return the stroke of a wire [m] under the mean load of the bench."""
    bench = Bench(Conditions(material=material), seed=0)
    loads = np.mean(LOADS)
    response = bench.length_trial(np.concatenate([np.linspace(0.0, 7.0, 60)]), loads)
    return float(np.ptp(response))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('seed', [3, 4])
def test_it_is_named_where_the_moduli_differ_and_no_growth_of_the_strain(seed):
    material, (model, added) = bench_of(MODULI, seed)
    found = {effect.id: effect for effect in added}
    assert 'stress_dependent_strain' not in found and 'r_phase' not in found
    section = 0.25 * np.pi * material.diameter ** 2
    softer = (1.0 / MODULI[1] - 1.0 / MODULI[0]) * LENGTH / section
    true = softer * np.mean(LOADS) / stroke_of(material)
    assert found['phase_modulus'].m == pytest.approx(true, rel=0.3)
    low, high = found['phase_modulus'].intervals['m']
    assert 0.02 < low < high < 0.25


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('seed', [3, 4])
def test_it_is_not_named_where_the_moduli_are_equal(seed):
    _, (model, added) = bench_of((30e9, 30e9), seed)
    names = {effect.id for effect in added}
    assert not names & {'phase_modulus', 'stress_dependent_strain', 'r_phase'}
    assert {'stress_dependence', 'transformation_slopes'} <= names
