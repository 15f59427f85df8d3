# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The muscle's thermal expansion, on a bench: named where rows prove it, and about how large."""

import dataclasses

from model_support import effect_of, with_noise
import numpy as np
import pytest
from test_bench_kinetics import fitter_of, LOADS, USUAL

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis import bench_effects, bench_expansion
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.bench_expansion import with_expansion
from hysteresis_ros.diagnosis.bench_fit import Response
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import bench_tables, experiment_tables
from hysteresis_ros.laboratory.hidden_physics import EXPANSION
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.sequences import damped_oscillation
from hysteresis_ros.measurements import Measurement

TRIALS = {'length_trials': range(4), 'force_trials': [0]}
NOISE, PRACTICAL = 2e-5, 0.05


def usual_model():
    """Return a model of a wire that does not expand, with what every loaded muscle has."""
    force, length = (Measurement.from_columns(bench_tables({}, 11)[name])
                     for name in ('force.csv', 'length.csv'))
    plain = identify(length, force, **TRIALS).model
    return add_effects(plain, length, force, USUAL, **TRIALS)[0]


@pytest.fixture(scope='module')
def usual():
    """Return that model."""
    return usual_model()


def made_with(model, own=(), seed=0):
    """Return lengths of that wire with effects of its own, on the bench of the paper."""
    drive = damped_oscillation()
    columns = {'trial': np.repeat(np.arange(float(len(LOADS))), len(drive)),
               'voltage': np.tile(drive, len(LOADS)), 'force': np.repeat(LOADS, len(drive))}
    clean = Measurement.from_columns({**columns, 'length': np.zeros(len(drive) * len(LOADS))})
    lengths = model.with_effects([*model.effects, *own]).predict(clean)
    return with_noise(Measurement.from_columns({**columns, 'length': lengths}),
                      NOISE * np.random.default_rng(seed).standard_normal(len(lengths)))


def made(model, alpha, seed=0):
    """Return lengths of that wire where it expands."""
    return made_with(
        model, [effect_of(model, 'thermal_expansion', alpha=alpha)] if alpha else [], seed)


def shown(usual, alpha, seed=0, **changes):
    fitter = fitter_of(usual, made(usual, alpha, seed), **changes)
    found = with_expansion(fitter, usual.effects, PRACTICAL)
    return next((effect for effect in found if effect.id == 'thermal_expansion'), None)


@pytest.mark.parametrize('alpha', [0.1, 0.2])
def test_it_is_found_where_it_is_and_no_larger(usual, alpha):
    """Relays without a loop could undo any amount that is too large."""
    found = shown(usual, alpha)
    low, high = found.intervals['alpha']
    assert low < alpha < high < 2.5 * alpha
    assert found.alpha == pytest.approx(alpha, rel=0.5)


def test_it_is_not_found_where_it_is_not(usual):
    assert all(shown(usual, 0.0, seed) is None for seed in range(6))


def test_it_is_not_found_where_anything_speaks_against_it(usual, monkeypatch):
    own = effect_of(usual, 'thermal_expansion', alpha=0.05)
    assert shown(usual, 0.2, effects=[own]) is None
    assert shown(dataclasses.replace(usual, sign=1), 0.2) is None
    for name, answer in (('not_determined', lambda *_: 'vague'), ('_proves', lambda *_: False)):
        with monkeypatch.context() as patched:
            patched.setattr(bench_expansion, name, answer)
            assert shown(usual, 0.2) is None
    # Loads held out may not be predicted worse.
    fitter = fitter_of(usual, made(usual, 0.2))
    assert with_expansion(fitter, usual.effects, -0.5) == list(usual.effects)


def test_what_rows_bound_on_one_side_only_is_held_by_what_is_known_beforehand(usual):
    """By as much as one block of rows tells; others are left where the rows have them."""
    fitter = fitter_of(usual, made(usual, 0.0))
    expansion = effect_of(usual, 'thermal_expansion', alpha=0.3)
    response = Response(fitter.problem, [], [*usual.effects, expansion])
    start = response.parameters.vector()
    mean, pull = response._known_beforehand(start)
    assert pull.shape == (1, len(start)) and np.count_nonzero(pull) == 1
    place = [one.name for _, one in response.parameters.entries].index('alpha')
    _, spread = response.parameters.prior()
    error = (response.predicted(start) - fitter.problem.measured) / np.std(fitter.problem.measured)
    blocks = len(np.unique(fitter.problem.block))
    assert pull[0, place] == pytest.approx(np.sqrt(error @ error / blocks) / spread[place])
    assert np.exp(mean[place]) == pytest.approx(np.sqrt(0.016 * 0.325))
    none = Response(fitter.problem, [], usual.effects)._known_beforehand(start[:-1])[1]
    assert none.shape == (0, len(start) - 1)
    # Where the rows say nothing it comes to its mean.
    free = fitter.fit([*usual.effects, expansion]).effects[-1]
    assert 0.03 < free.alpha < 0.2


def test_one_that_was_left_out_is_not_sought_again(usual, monkeypatch):
    """Nor are others that are asked for once more, with or without it."""
    asked = []
    monkeypatch.setattr(bench_effects, 'with_expansion',
                        lambda fitter, known, practical: asked.append(known) or list(known))
    monkeypatch.setattr(bench_effects, '_with_universal', lambda model, found, *_: list(found))
    monkeypatch.setattr(bench_effects, 'shown_kinetics', lambda *_: None)
    problem = fitter_of(usual, made(usual, 0.0)).problem
    for excluded in (['thermal_expansion'], ['creep']):
        bench_effects._extended_without(excluded, usual, [], problem)
    assert asked == [[]]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('muscle', ['grains', 'lagoudas'])
def test_lengths_that_verify_are_predicted_better_with_it(muscle):
    """22 millionths per kelvin are a thirtieth of the stroke."""
    hidden = experiment_tables('bench', {'thermal_expansion': 1.0}, 51, muscle)
    force, length = (Measurement.from_columns(hidden[name]) for name in (
        'force.csv', 'length.csv'))
    plain = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **TRIALS).model
    model, added = add_effects(plain, length, force, **TRIALS)
    expansion = next(effect for effect in added if effect.id == 'thermal_expansion')
    # 6 V heat the wire by 97 K; its specimen has up to a seventh more or less.
    low, high = expansion.intervals['alpha']
    assert 0.87 * low < 100.0 * EXPANSION * 97.0 < 1.15 * high
    without = add_effects(plain, length, force, [
        effect.id for effect in added if effect is not expansion], **TRIALS)[0]
    before, after = (one.metrics['length']['verification']['model']['mean_percent']
                     for one in (without, model))
    assert after < 0.85 * before


@pytest.mark.slow
@pytest.mark.long
def test_a_wire_that_contracts_with_its_temperature_is_said_to():
    """Tanaka's equations: 0.55 MPa/K, 13 GPa when cold and 30 GPa when hot, 97 K at 6 V."""
    tables = bench_tables({}, 8401, 'tanaka')
    force, length = (Measurement.from_columns(tables[name]) for name in (
        'force.csv', 'length.csv'))
    added = add_effects(identify(length, force, **TRIALS).model, length, force, **TRIALS)[1]
    expansion = next(effect for effect in added if effect.id == 'thermal_expansion')
    assert expansion.sign == -1.0
    assert 97.0 * 0.55e-3 / 30.0 < 0.01 * expansion.alpha < 97.0 * 0.55e-3 / 13.0
