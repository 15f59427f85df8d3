# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects between the drive that was set and the drive squared that the muscle feels."""

import math

from hypothesis import given, strategies as st
import numpy as np
import pytest
from scipy import integrate

from hysteresis_ros.effects import catalogue, Inputs, Surroundings
from hysteresis_ros.model.chain import Chain

# A wire of 0.27 m that sees up to 6 V.
WIRE = Surroundings(0.27, 3.0, 36.0, 0.02)
ROOM = Inputs(10.0, 1200.0, 0.5, 31.0, 0.3, 4.0, 10.5)
STATELESS = {
    # Effect, values, input, output worked out by hand.
    'supply_sag': ({'Rs': 2.0}, 5.0, 5.0 * 8.0 / 10.0),
    'measured_supply': ({'nominal': 12.0}, 4.0, 4.0 * 10.5 / 12.0),
    'pwm_dead_zone': ({'Vd': 1.0}, 3.0, 2.0 * 6.0 / 5.0),
    'supply_limit': ({'cut': 1.0}, 4.5, 4.5),
    'resistance_change': ({'eta': 0.2}, 4.0, math.sqrt(16.0 / (1.0 + 0.2 * 0.3))),
    'ambient_temperature': ({'gain': 0.4, 'reference': 24.0}, 9.0, 9.0 + 0.4 * 7.0),
    'ambient_drift': ({'offset': 1.0, 'rate': 0.5, 'curvature': -0.25}, 9.0,
                      9.0 + 1.0 + 0.5 * 2.0 - 0.25 * 4.0),
    'airflow': ({'beta': 1.5}, 9.0, 6.0),
}

drives = st.floats(0.0, 6.0)
shares = st.floats(0.0, 1.0)


def effect(name, **values):
    return catalogue()[name](WIRE, **values)


@pytest.mark.parametrize('name', STATELESS)
def test_output_is_that_of_the_equation(name):
    values, given_input, expected = STATELESS[name]
    made = effect(name, **values)
    assert float(made.forward(given_input, ROOM, WIRE)) == pytest.approx(expected, rel=1e-12)
    rows = made.forward(np.array([given_input, given_input]), ROOM, WIRE)
    np.testing.assert_allclose(rows, expected, rtol=1e-12)


@given(drives, shares, st.sampled_from(sorted(set(STATELESS) - {'ambient_drift'})))
def test_inverse_undoes_the_forward_map(drive, phase, name):
    inputs = ROOM._replace(phase=phase)
    made = effect(name, **STATELESS[name][0])
    forward = float(made.forward(drive, inputs, WIRE))
    if name == 'pwm_dead_zone' and drive <= 1.0:
        assert (forward, made.inverse(forward, inputs, WIRE)) == (0.0, 0.0)
    elif name == 'supply_limit' and drive > 5.0:
        assert forward == made.inverse(forward, inputs, WIRE) == 5.0
    else:
        assert made.inverse(forward, inputs, WIRE) == pytest.approx(drive, abs=1e-11)


def test_the_resistance_may_be_that_of_the_bench_at_any_share():
    made = effect('resistance_change', eta=0.2, xi0=0.5)
    expected = math.sqrt(16.0 / (1.0 - 0.2 * 0.2))
    assert float(made.forward(4.0, ROOM, WIRE)) == pytest.approx(expected, rel=1e-12)
    assert made.inverse(expected, ROOM, WIRE) == pytest.approx(4.0, rel=1e-12)


def test_less_than_nothing_stays_out_of_reach_behind_a_dead_zone():
    """A warmer room than that of the bench may ask for it; zero would be a lie."""
    made = effect('pwm_dead_zone', Vd=1.0)
    assert made.inverse(-2.0, ROOM, WIRE) < 0.0 == made.inverse(0.0, ROOM, WIRE)


def test_what_is_beyond_a_limit_is_out_of_reach():
    made = effect('supply_limit', cut=1.0)
    rows = made.forward(np.array([-1.0, 0.0, 4.999, 5.0, 5.001, 7.0]), ROOM, WIRE)
    np.testing.assert_array_equal(rows, [-1.0, 0.0, 4.999, 5.0, 5.0, 5.0])
    assert made.inverse(5.001, ROOM, WIRE) > 6.0
    neutral = effect('supply_limit')
    assert float(neutral.forward(7.0, ROOM, WIRE)) == neutral.inverse(7.0, ROOM, WIRE) == 7.0


def test_a_limit_that_is_reached_gradually_leaves_small_voltages_whole():
    """And is never passed; what it gives can be undone, up to there."""
    made = effect('supply_limit', cut=1.0, soft=1.0 / 12.0)
    asked = np.array([-1.0, 0.0, 2.0, 4.0, 5.0, 6.0, 6e9])
    rows = made.forward(asked, ROOM, WIRE)
    np.testing.assert_allclose(rows[:4], asked[:4], rtol=6e-3)
    assert rows[4] == pytest.approx(5.0 * 2.0 ** (-1.0 / 12.0)) and np.all(rows < 5.0 + 1e-12)
    for wanted, setpoint in zip(rows[:6], asked):
        assert made.inverse(float(wanted), ROOM, WIRE) == pytest.approx(setpoint, rel=1e-9)
    for beyond in (math.nextafter(5.0, 0.0), 5.0, 5.001):
        assert 6.0 - 1e-9 <= made.inverse(beyond, ROOM, WIRE) < math.inf
    nearly = effect('supply_limit', cut=1.0, soft=0.001).forward(asked, ROOM, WIRE)
    np.testing.assert_array_equal(nearly, np.minimum(asked, 5.0))


@pytest.mark.parametrize('whole, arrives', [(0.0, 2.4), (1.0, 3.0), (2.0, 2.0)])
def test_beyond_a_dead_zone_the_voltage_is_stretched_or_whole_or_lower(whole, arrives):
    made = effect('pwm_dead_zone', Vd=1.0, whole=whole)
    rows = made.forward(np.array([-1.0, 0.0, 0.999, 3.0]), ROOM, WIRE)
    np.testing.assert_allclose(rows[1:], [0.0, 0.0, arrives], rtol=1e-12)
    assert made.inverse(arrives, ROOM, WIRE) == pytest.approx(3.0, rel=1e-12)


def test_between_nothing_and_a_whole_pulse_the_nearer_one_in_heat_is_set():
    made = effect('pwm_dead_zone', Vd=2.0, whole=1.0)
    assert float(made.forward(2.0, ROOM, WIRE)) == 2.0 > float(made.forward(1.99, ROOM, WIRE))
    assert [made.inverse(wanted, ROOM, WIRE) for wanted in (-1.0, 0.0, 1.41, 1.42, 2.0, 2.5)] == [
        -1.0, 0.0, 0.0, 2.0, 2.0, 2.5]


@pytest.mark.parametrize('whole, largest', [(0.0, 1.5), (1.0, 4.0), (2.0, 1.5)])
def test_pulses_that_arrive_whole_may_drop_out_further_up(whole, largest):
    odd = [effect('pwm_dead_zone', Vd=share * largest, whole=whole).implausible(0.15)
           for share in (0.01, 1.1, 1.2)]
    assert odd[1:] == [[], ['Vd']]
    assert odd[0] == ([] if whole == 1.0 else ['Vd'])


def test_a_loss_at_any_duty_is_rarer_than_what_looks_like_it():
    odds = [effect('pwm_dead_zone', Vd=0.3, whole=whole).prior_odds for whole in (0.0, 1.0, 2.0)]
    assert odds[:2] == [1.0, 1.0] and 0.0 < odds[2] < 1.0 == effect('supply_sag').prior_odds


def test_dead_zone_as_wide_as_the_range_stays_finite():
    made = effect('pwm_dead_zone', Vd=7.0)
    out = float(made.forward(8.0, ROOM, WIRE))
    assert math.isfinite(out)
    assert made.inverse(out, ROOM, WIRE) == pytest.approx(8.0)


def test_a_current_heats_the_phase_of_higher_resistance_more():
    amperes = WIRE._replace(drive='current')
    made = catalogue()['resistance_change'](amperes, eta=0.2)
    cold = float(made.forward(1.0, ROOM._replace(phase=1.0), amperes))
    hot = float(made.forward(1.0, ROOM._replace(phase=0.0), amperes))
    assert hot == 1.0
    assert cold ** 2 == pytest.approx(1.2)


def test_ambient_temperature_that_was_not_recorded_counts_for_nothing():
    made = effect('ambient_temperature', gain=0.4, reference=24.0)
    rows = made.forward(np.array([4.0, 4.0]), ROOM._replace(ambient=np.array([np.nan, 25.0])), WIRE)
    assert rows == pytest.approx([4.0, 4.4])
    assert made.inverse(4.0, ROOM._replace(ambient=math.nan), WIRE) == 4.0


def heat_balance(volts, dt, up, down):
    """Integrate Eq. 1 in the drive squared q, with rates of their own for heating and cooling."""
    start, rows = 0.0, []
    for value in volts:
        def slope(_, q, value=value):
            return (up if value ** 2 > q[0] else down) * (value ** 2 - q)
        start = integrate.solve_ivp(slope, (0.0, dt), [start], rtol=1e-10, atol=1e-10).y[0, -1]
        rows.append(start)
    return np.array(rows)


@pytest.mark.parametrize('name, values, up, down', [
    ('thermal_lag', {'time_constant': 4.0}, 0.25, 0.25),
    ('heating_cooling_asymmetry', {'time_constant': 4.0, 'ratio': 1.6}, 0.4, 0.25),
    ('valve_lag', {'filling': 2.5, 'venting': 4.0}, 0.4, 0.25),
    ('latent_heat', {'time_constant': 4.0, 'latent': 0.3}, 0.25, 0.25)])
def test_lags_solve_the_heat_balance_exactly(name, values, up, down):
    volts = np.array([5.0, 5.0, 1.0, 3.0, 0.0, 6.0])
    inputs = Inputs(0.0, 0.0, np.full(6, 0.7), np.nan, np.full(6, 0.4), 0.0)
    rows = effect(name, **values).forward(volts ** 2, inputs, WIRE)
    np.testing.assert_allclose(rows, heat_balance(volts, 0.7, up, down), rtol=1e-7)


def test_latent_heat_slows_heating_and_cooling_down():
    made = effect('latent_heat', time_constant=4.0, latent=0.5)
    plain = effect('thermal_lag', time_constant=4.0)
    # On heating, martensite goes and takes heat up; on cooling it comes back and gives it off.
    for first, then, phases in ((0.0, 25.0, (1.0, 0.8)), (25.0, 0.0, (0.2, 0.4))):
        for lag in (made, plain):
            lag.start()
            lag.step(first, 1e3, phases[0], WIRE)
        change = made.step(then, 1.0, phases[1], WIRE) - plain.step(then, 1.0, phases[1], WIRE)
        # It comes evenly over the second, of which a part is lost again.
        lost = 4.0 * (1.0 - math.exp(-0.25))
        assert change == pytest.approx(lost * 0.5 * 36.0 * (phases[1] - phases[0]))
        assert change * (then - first) < 0.0


@given(st.lists(st.tuples(drives, st.floats(0.01, 30.0)), min_size=1, max_size=6), drives,
       st.floats(0.1, 20.0), st.sampled_from(['thermal_lag', 'heating_cooling_asymmetry']))
def test_inverse_of_a_lag_reaches_the_target_within_dt(past, target, horizon, name):
    values = {'time_constant': 4.0} if name == 'thermal_lag' else {
        'time_constant': 4.0, 'ratio': 0.6}
    lag = effect(name, **values)
    for volts, dt in past:
        lag.step(volts ** 2, dt, 1.0, WIRE)
    before = lag.save()
    wanted = lag.inverse(target ** 2, ROOM._replace(dt=horizon), WIRE)
    assert lag.save() == before
    assert lag.step(wanted, horizon, 1.0, WIRE) == pytest.approx(target ** 2, abs=1e-9)


def test_inverse_of_a_lag_without_past_or_horizon_is_the_steady_state():
    lag = effect('thermal_lag', time_constant=4.0)
    assert lag.inverse(9.0, ROOM, WIRE) == 9.0
    lag.step(4.0, 1.0, 1.0, WIRE)
    for dt in (0.0, math.inf):
        assert lag.inverse(9.0, ROOM._replace(dt=dt), WIRE) == 9.0


def test_lag_does_not_move_in_no_time_and_arrives_in_infinite_time():
    lag = effect('thermal_lag', time_constant=4.0)
    assert lag.step(25.0, 0.0, 1.0, WIRE) == 0.0
    assert lag.step(25.0, math.inf, 1.0, WIRE) == 25.0


@pytest.mark.parametrize('drive, expected', [
    ('voltage', 0.0), ('current', 0.0), ('power', 0.0), ('pressure', 0.0), ('temperature', 80.0)])
def test_a_trial_starts_cold(drive, expected):
    lag = effect('thermal_lag', time_constant=4.0)
    assert lag.step(80.0, 0.0, 1.0, WIRE._replace(drive=drive)) == expected


def test_a_fan_changes_gain_and_time_constant_together():
    beta, tau = 2.0, 4.0
    chain = Chain([effect('thermal_lag', time_constant=tau), effect('airflow', beta=beta)], WIRE)
    volts = np.full(8, 5.0)
    inputs = Inputs(0.0, 0.0, np.full(8, 0.5), np.full(8, np.nan), np.ones(8), np.zeros(8))
    time = 0.5 * np.arange(1, 9)
    # dq/dt = beta d1 (V^2 / beta - q)
    np.testing.assert_allclose(
        chain.drive_squared(volts, inputs), 25.0 / beta * (1.0 - np.exp(-beta * time / tau)),
        rtol=1e-12)


def test_the_air_adds_undivided_by_the_fan_and_without_lag():
    chain = Chain([effect('ambient_temperature', gain=0.5, reference=20.0),
                   effect('airflow', beta=2.0), effect('thermal_lag', time_constant=4.0)], WIRE)
    inputs = Inputs(0.0, 0.0, np.array([1e3, 0.0]), np.array([24.0, 22.0]), np.ones(2), np.zeros(2))
    np.testing.assert_allclose(
        chain.drive_squared(np.array([4.0, 4.0]), inputs), [8.0 + 2.0, 8.0 + 1.0])


def test_effects_act_in_the_order_of_the_stages_whatever_the_order_of_the_list():
    made = [effect('airflow', beta=1.5), effect('pwm_dead_zone', Vd=1.0),
            effect('supply_sag', Rs=2.0)]
    for order in (made, made[::-1]):
        q = Chain(order, WIRE).step(5.0, ROOM)
        assert q == pytest.approx((5.0 * 0.8 - 1.0) ** 2 * (6.0 / 5.0) ** 2 / 1.5)


@given(drives, shares)
def test_the_whole_chain_is_undone_in_reverse(drive, phase):
    made = [effect(name, **values) for name, (values, _, _) in STATELESS.items()
            if name not in ('ambient_drift', 'pwm_dead_zone')]
    chain = Chain(made, WIRE._replace(drive='voltage'))
    inputs = ROOM._replace(phase=phase)
    assert chain.inverse(chain.step(drive, inputs), inputs) == pytest.approx(drive, abs=1e-7)


def test_only_voltage_and_current_are_squared():
    assert Chain([], WIRE._replace(drive='pressure')).to_drive_squared(3.0) == 3.0
    chain = Chain([], WIRE)
    assert (chain.to_drive_squared(-3.0), chain.to_drive(-9.0)) == (-9.0, -3.0)


def test_what_another_effect_contains_is_replaced_by_it():
    lag, both = effect('thermal_lag', time_constant=9.0), effect(
        'heating_cooling_asymmetry', time_constant=4.0)
    assert [e.id for e in Chain([lag, both], WIRE).thermal] == ['heating_cooling_asymmetry']
    latent = effect('latent_heat', time_constant=4.0)
    assert [e.id for e in Chain([latent, lag], WIRE).thermal] == ['latent_heat']


def test_each_chain_has_a_memory_of_its_own_that_can_be_saved():
    lag = effect('thermal_lag', time_constant=4.0)
    one, other = Chain([lag], WIRE), Chain([lag], WIRE)
    inputs = ROOM._replace(dt=1.0)
    one.step(6.0, inputs)
    saved = one.save()
    later = one.step(6.0, inputs)
    assert other.step(6.0, inputs) < later
    other.restore(saved)
    assert other.step(6.0, inputs) == later
    one.start()
    assert one.step(6.0, inputs) < later
    with pytest.raises(ValueError):
        Chain([], WIRE).restore(saved)
    with pytest.raises(KeyError):
        one.restore([{}])


@pytest.mark.parametrize('name, values', [
    ('thermal_lag', {'time_constant': 3.0}),
    ('heating_cooling_asymmetry', {'time_constant': 3.0, 'ratio': 1.7}),
    ('valve_lag', {'filling': 0.8, 'venting': 2.0}),
    ('latent_heat', {'time_constant': 2.0, 'latent': 0.4})])
def test_a_whole_trial_is_the_same_as_step_by_step(name, values):
    rng = np.random.default_rng(4)
    signal, dt, phases = (rng.uniform(low, high, 40) for low, high in (
        (0.0, 36.0), (0.1, 4.0), (0.0, 1.0)))
    made = effect(name, **values)
    rows = made.forward(signal, ROOM._replace(dt=dt, phase=phases), WIRE)
    made.start()
    single = [made.step(*row, WIRE) for row in zip(signal.tolist(), dt.tolist(), phases.tolist())]
    np.testing.assert_allclose(rows, single, rtol=1e-12)
    # Turning to martensite gives heat off.
    if name == 'latent_heat':
        warmer = made.forward(np.zeros(2), ROOM._replace(
            dt=np.full(2, 1.0), phase=np.array([0.2, 0.7])), WIRE)
        kept = 2.0 * (1.0 - math.exp(-0.5))
        assert warmer[1] == pytest.approx(kept * 0.4 * 0.5 * WIRE.full_drive_squared)


def test_latent_heat_does_not_depend_on_how_often_it_is_looked_at():
    made = effect('latent_heat', time_constant=2.0, latent=0.4)
    ends = []
    for rows in (64, 16, 4):
        dt = np.full(rows + 1, 3.2 / rows)
        dt[0] = 0.0
        ends.append(made.forward(np.full(rows + 1, 20.0), ROOM._replace(
            dt=dt, phase=np.linspace(1.0, 0.0, rows + 1)), WIRE)[-1])
    np.testing.assert_allclose(ends, ends[0], rtol=1e-12)
