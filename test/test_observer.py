# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The observer: row by row what the simulation of the whole recording gives."""

import math

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

from hysteresis_ros.errors import ModelFileError, ParameterError
from hysteresis_ros.model import Observer
from model_support import arm_run, bicep_model, effect_of, STRENGTHS, wandering_voltage

VOLTAGE = wandering_voltage(150, seed=4)
AMBIENT = 25.0 + 3.0 * np.sin(np.arange(150) / 30.0)
# These depend on the phase, which they change.
PHASE = ('resistance_change', 'latent_heat', 'creep')


def observed(model, run, ambient=AMBIENT):
    observer = model.observer()
    observer.reset(0.0)
    return np.array([observer.step(*row) for row in zip(run.time, VOLTAGE, ambient)])


@pytest.mark.parametrize('dt', [0.2, 30.0])
@pytest.mark.parametrize('names', [(), *((name,) for name in STRENGTHS if name not in PHASE), (
    'supply_sag', 'thermal_lag', 'airflow', 'ambient_temperature', 'r_phase', 'fatigue',
    'stress_dependent_strain', 'coulomb_friction', 'viscous_friction', 'payload_error', 'latency',
    'backlash', 'encoder_offset')])
def test_observer_is_the_simulation_row_by_row(names, dt):
    model = bicep_model(names)
    run = arm_run(VOLTAGE, dt, ambient_temperature=AMBIENT)
    np.testing.assert_allclose(observed(model, run), model.predict(run), rtol=0.0, atol=1e-12)


@settings(max_examples=30)
@given(st.lists(st.sampled_from(sorted(STRENGTHS)), max_size=2, unique=True),
       st.lists(st.sampled_from(PHASE), min_size=1, max_size=2, unique=True), st.booleans(),
       st.sampled_from([0.02, 0.1, 1.0, 7.0, 30.0]), st.integers(0, 99), st.booleans())
def test_the_phase_of_each_sample_is_its_own(others, names, last, dt, seed, jumps):
    """Whatever the effects, their order, the rate and the drive, noise on it included."""
    names = [*others, *names] if last else [*names, *others]
    model = bicep_model(dict.fromkeys(names))
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(0.0, 6.0, 8), 5) if jumps else wandering_voltage(40, seed)
    volts = np.clip(volts + rng.normal(0.0, 0.02, 40), 0.0, 6.0)
    run = arm_run(volts, dt, ambient_temperature=AMBIENT[:40])
    observer = model.observer()
    observer.reset(0.0)
    seen = [observer.step(*row) for row in zip(run.time, volts, AMBIENT)]
    np.testing.assert_allclose(seen, model.predict(run), rtol=0.0, atol=math.radians(0.01))


@pytest.mark.parametrize('dt', [0.1, 1.0])
def test_strong_latent_heat_does_not_make_the_observer_swing(dt):
    model = bicep_model()
    model = model.with_effects([effect_of(model, 'latent_heat', time_constant=3.0, latent=1.0)])
    observer = model.observer()
    observer.reset(0.0)
    angles = [observer.step(dt * n, 4.5) for n in range(1, 101)]
    # A constant voltage heats the wire, and the arm rises all the time.
    assert np.all(np.diff(angles) <= 1e-9)
    run = arm_run(np.full(100, 4.5), dt)
    np.testing.assert_allclose(angles, model.predict(run), rtol=0.0, atol=math.radians(0.01))


@pytest.mark.parametrize('volts', [3.0, 4.5])
def test_phase_comes_into_agreement_while_the_voltage_is_held(volts):
    """It is that of the simulation: what is only stretched has not transformed."""
    model = bicep_model()
    model = model.with_effects([effect_of(model, 'resistance_change', eta=0.4),
                                effect_of(model, 'series_compliance', compliance=0.3)])
    observer = model.observer()
    for n in range(40):
        angle = observer.step(30.0 * n, volts)
    assert angle == pytest.approx(model.predict(arm_run(np.full(40, volts)))[-1], abs=1e-3)


def test_an_unknown_ambient_temperature_counts_for_nothing():
    run = arm_run(VOLTAGE, 0.2)
    model, plain = bicep_model(['ambient_temperature']), bicep_model()
    np.testing.assert_array_equal(observed(model, run, np.full(150, np.nan)), plain.predict(run))


def test_reset_forgets_the_history_but_not_the_wear():
    model = bicep_model(['thermal_lag', 'backlash'])
    observer, fresh = model.observer(), model.observer()
    for n, volts in enumerate(VOLTAGE):
        observer.step(0.1 * n, volts)
    observer.reset()
    assert [observer.step(0.5 * n, 4.0) for n in range(5)] == [
        fresh.step(0.5 * n, 4.0) for n in range(5)]

    observer, fresh = (bicep_model(['fatigue']).observer() for _ in range(2))
    for n, volts in enumerate(VOLTAGE):
        observer.step(30.0 * n, volts)
    observer.reset()
    # L -= b l0 ln(1 + N): a worn muscle is shorter.
    assert observer.step(0.0, 4.0) < fresh.step(0.0, 4.0)


def test_two_observers_of_a_model_do_not_share_what_they_remember():
    model = bicep_model(['thermal_lag'])
    one, other = Observer(model), Observer(model)
    for observer in (one, other):
        observer.reset(0.0)
    first = one.step(0.5, 5.0)
    one.step(10.0, 5.0)
    assert other.step(0.5, 5.0) == first


def test_observer_never_gives_anything_but_a_number():
    observer = bicep_model(['thermal_lag', 'viscous_friction', 'latency']).observer()
    expected = bicep_model(['thermal_lag', 'viscous_friction', 'latency']).observer()
    samples = [(0.0, 3.0), (0.5, math.nan), (math.nan, 3.0), (0.2, 3.0), (1.0, math.inf),
               (1.5, -1e300), (2.0, 1e300), (2.5, 3.0)]
    seen = [observer.step(*sample, math.nan) for sample in samples]
    assert np.all(np.isfinite(seen))
    good = [expected.step(*sample) for sample in (
        (0.0, 3.0), (0.5, 3.0), (0.5, 3.0), (0.5, 3.0), (1.0, 3.0))]
    assert seen[:5] == good


@pytest.mark.parametrize('changes, error, message', [
    ({'geometry': None}, ParameterError, 'no arm geometry'),
    ({'length_stage': None}, ModelFileError, 'no length stage'),
    ({'sign': 1}, ParameterError, 'extends when driven'),
    ({'response': 'strain'}, ParameterError, 'needs a length table with forces'),
    ({'load_name': 'stress'}, ParameterError, 'needs a length table with forces')])
def test_a_model_that_has_no_arm_is_refused_in_one_line(changes, error, message):
    with pytest.raises(error, match=message) as caught:
        bicep_model(**changes).observer()
    assert '\n' not in str(caught.value)
