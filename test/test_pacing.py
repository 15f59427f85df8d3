# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Overdriving a muscle that lags: it arrives in time, and a wrong time constant does no harm."""

import math

import numpy as np
import pytest

from hysteresis_ros.errors import ParameterError
from model_support import bicep_model, effect_of

TARGETS = np.radians(np.random.default_rng(3).uniform(82.0, 106.0, 20)).tolist()


@pytest.mark.parametrize('names', [('thermal_lag',), ('heating_cooling_asymmetry',),
                                   ('thermal_lag', 'airflow', 'ambient_temperature')])
@pytest.mark.parametrize('horizon', [1.0, 2.3, 6.0])
def test_overdriven_muscle_arrives_at_the_horizon_unless_limited(names, horizon):
    model = bicep_model(names)
    controller = model.controller(horizon=horizon, lag_margin=0.0)
    observer = model.observer()
    observer.reset(0.0)
    time, arrivals = 0.0, 0
    for target in TARGETS:
        voltage = controller.setpoint(*controller.reference(target), time, ambient=28.0).voltage
        arrived = time + math.ceil(horizon / 0.5) * 0.5
        limited = False
        for _ in range(60):
            limited |= time < arrived and voltage in (0.0, 6.0)
            time += 0.5
            angle = observer.step(time, voltage, 28.0)
            voltage = controller.hold(time)
            if time >= arrived and not limited:
                arrivals += time == arrived
                assert angle == pytest.approx(target, abs=1e-6)
        assert angle == pytest.approx(target, abs=1e-6)
    assert arrivals >= 1


def test_a_muscle_is_overdriven_early_in_the_horizon_once_the_pace_of_the_calls_is_known():
    model = bicep_model(['thermal_lag'])
    controller = model.controller(
        horizon=5.0, lag_margin=0.0, voltage_limits=(0.0, 12.0))
    reference = controller.reference(1.6)
    first = controller.setpoint(*reference, 10.0).voltage
    steady = model.controller(arm=True).setpoint(*reference).voltage
    # V^2 = q + (q - q0) e / (1 - e) with e the share that remains after the horizon.
    assert first ** 2 == pytest.approx(steady ** 2 / (1.0 - math.exp(-5.0 / 3.0)))
    # After half a second the next second is to bring it there.
    q = first ** 2 * (1.0 - math.exp(-0.5 / 3.0))
    share = math.exp(-1.0 / 3.0)
    early = math.sqrt(steady ** 2 + (steady ** 2 - q) * share / (1.0 - share))
    assert [controller.hold(10.5), controller.hold(11.0)] == pytest.approx([early] * 2)
    assert [controller.hold(11.5), controller.hold(12.0)] == pytest.approx([steady] * 2)


def lagging(tau, ratio, hold=30.0, name='thermal_lag', more=None, **options):
    """Return errors [deg] (targets, samples each 0.5 s) of an arm with `ratio` times the tau."""
    plain, more = bicep_model(), more or {}
    model, arm = (plain.with_effects([effect_of(plain, name, time_constant=value, **more)])
                  for value in (tau, ratio * tau))
    controller, observer = model.controller(**options), arm.observer()
    observer.reset(0.0)
    time, errors = 0.0, []
    for target in TARGETS[:4]:
        voltage = controller.setpoint(*controller.reference(target), time).voltage
        for _ in range(int(2 * hold)):
            time += 0.5
            errors.append(math.degrees(observer.step(time, voltage) - target))
            voltage = controller.hold(time)
    return np.array(errors).reshape(4, -1)


def rmse(errors):
    return float(np.sqrt(np.mean(errors ** 2)))


def settled_after(errors):
    """Return the mean time [s] until less than 5 % of each step is left."""
    steps = np.abs(np.diff(np.degrees(TARGETS[:4])))
    return np.mean([np.max(np.nonzero(np.abs(row) > 0.05 * step)[0], initial=-1)
                    for row, step in zip(errors[1:], steps)]) * 0.5


@pytest.mark.parametrize('tau', [1.0, 3.0, 10.0])
def test_overdriving_by_a_wrong_time_constant_is_never_worse_than_none(tau):
    for ratio in (0.7, 0.85, 1.0, 1.3):
        plain = lagging(tau, ratio)
        errors = lagging(tau, ratio, horizon=5.0)
        assert rmse(errors[:, :10]) < rmse(plain[:, :10])
        assert rmse(errors[:, -10:]) <= rmse(plain[:, -10:]) + 1e-3


@pytest.mark.parametrize('tau', [1.0, 3.0, 10.0])
def test_overdriving_by_the_right_time_constant_is_twice_as_fast(tau):
    """Of what a muscle lacks that is as far from the fastest as the margin says, less is left."""
    plain = lagging(tau, 1.0, 5.0 * tau)
    assert settled_after(lagging(tau, 1.0, 5.0 * tau, horizon=2.0, lag_margin=0.05)) < (
        0.5 * settled_after(plain))
    assert settled_after(lagging(tau, 1.0, 5.0 * tau, horizon=2.0)) < 0.85 * settled_after(plain)


def test_an_interval_of_the_time_constant_counts_where_it_is_wider_than_the_margin():
    model = bicep_model(['thermal_lag'])
    drives = []
    for interval in (None, (2.5, 3.5), (1.0, 9.0)):
        if interval:
            model.effects[0].intervals = {'time_constant': interval}
        controller = model.controller(horizon=5.0)
        drives.append(controller.setpoint(*controller.reference(1.6), 0.0).voltage)
    assert drives[0] == drives[1] > drives[2]


@pytest.mark.parametrize('latent', [0.5, 1.0])
def test_latent_heat_is_brought_in_sooner_and_never_too_much(latent):
    for ratio, margin, part in ((0.75, 0.3, 0.75), (1.0, 0.0, 0.4)):
        plain, errors = (lagging(8.0, ratio, 25.0, 'latent_heat', {'latent': latent}, **options)
                         for options in ({}, {'horizon': 5.0, 'lag_margin': margin}))
        assert rmse(errors[:, -1]) < part * rmse(plain[:, -1])


@pytest.mark.parametrize('margin', [-0.1, 1.0, math.nan])
def test_a_margin_that_makes_no_sense_is_refused(margin):
    with pytest.raises(ParameterError, match='lag_margin is'):
        bicep_model().controller(lag_margin=margin)


def test_overdriving_latent_heat_never_goes_too_far():
    model = bicep_model(['latent_heat'])
    plain = model.controller(arm=True)
    controller, observer = model.controller(horizon=2.0), model.observer()
    observer.reset(0.0)
    for n, target in enumerate(TARGETS[:8]):
        reference = controller.reference(target)
        voltage = controller.setpoint(*reference, 30.0 * n).voltage
        steady = plain.setpoint(*reference).voltage
        for k in range(1, 301):
            angle = observer.step(30.0 * n + 0.1 * k, voltage)
            if k % 5 == 0:
                voltage = controller.hold(30.0 * n + 0.1 * k)
        assert voltage == pytest.approx(steady, abs=1e-6)
        assert angle == pytest.approx(target, abs=3e-3)


def test_irregular_calls_do_not_make_an_overdriven_muscle_swing():
    model = bicep_model(['thermal_lag'])
    controller = model.controller(horizon=1.0, lag_margin=0.0)
    observer = model.observer()
    observer.reset(0.0)
    target, time = 1.5, 0.0
    voltage = controller.setpoint(*controller.reference(target), time).voltage
    angles = []
    for n in range(60):
        time += 0.1 if n % 2 else 0.4
        angles.append(observer.step(time, voltage))
        voltage = controller.hold(time)
    assert min(angles) > target - 1e-3
    assert angles[-1] == pytest.approx(target, abs=1e-3)
    assert 0.0 < voltage < 6.0
