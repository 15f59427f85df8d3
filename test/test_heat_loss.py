# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A heat transfer that grows with the temperature: its lag, its inverse, and the laboratory's."""

import math

from hypothesis import given, strategies as st
import numpy as np
import pytest
from scipy import integrate

from hidden_cases import found_in
from hysteresis_ros.diagnosis.forms import other_forms
from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.effects import catalogue, Inputs, Surroundings
from hysteresis_ros.laboratory.heat import HeatBalance, ROOM
from hysteresis_ros.laboratory.still_air import FULL_EXCESS, StillAir
from hysteresis_ros.model.chain import Chain

WIRE = Surroundings(0.27, 3.0, 36.0, 0.02)
drives = st.floats(0.0, 36.0)


def wire(growth=0.8, time_constant=4.0, linear=0.0):
    """Return the effect on a wire whose full drive squared is 36."""
    return catalogue()['heat_loss'](
        WIRE, time_constant=time_constant, growth=growth, linear=linear)


def lost(q, growth, linear):
    """Return what a q loses, in units of the drive squared of a bench that lost in proportion."""
    same = 36.0 * (1.0 - linear)
    return q * (1.0 + growth * q / 72.0) / (1.0 + growth * same / 72.0)


def balance(values, dt, growth=0.8, time_constant=4.0, linear=0.0):
    """Integrate the heat balance from the cold state under inputs held for `dt` [s] each."""
    q, rows = 0.0, []
    gain = 1.0 + growth * (1.0 - linear) / 2.0
    for value in values:
        def slope(_, q, value=value):
            if linear:
                return gain * (value - lost(q[0], growth, linear)) / time_constant
            return (1.0 + growth * q[0] / 36.0) * (value - q[0]) / time_constant
        q = integrate.solve_ivp(slope, (0.0, dt), [q], rtol=1e-10, atol=1e-10).y[0, -1]
        rows.append(q)
    return np.array(rows)


@pytest.mark.parametrize('growth', [0.0, 0.3, 1.5])
@pytest.mark.parametrize('linear', [0.0, 0.5, 0.65, 1.0])
def test_a_trial_solves_the_heat_balance(growth, linear):
    values, made = np.array([25.0, 25.0, 1.0, 9.0, 0.0, 36.0]), wire(growth, linear=linear)
    inputs = Inputs(0.0, 0.0, np.full(6, 0.7), np.nan, np.ones(6), 0.0)
    rows = made.forward(values, inputs, WIRE)
    np.testing.assert_allclose(rows, balance(values, 0.7, growth, linear=linear), rtol=1e-7)
    made.start()
    np.testing.assert_array_equal(
        rows, [made.step(value, 0.7, 1.0, WIRE) for value in values.tolist()])


def test_rows_between_change_nothing():
    one, many = wire(), wire()
    for value in (30.0, 4.0):
        for _ in range(8):
            many.step(value, 0.5, 1.0, WIRE)
        assert one.step(value, 4.0, 1.0, WIRE) == pytest.approx(many.present, rel=1e-12)


def test_what_is_settled_does_not_show_it():
    made = wire()
    for value in (25.0, 0.0, 9.0):
        assert made.step(value, 1e4, 1.0, WIRE) == pytest.approx(value, abs=1e-9)
        assert made.step(value, math.inf, 1.0, WIRE) == value
        assert made.step(0.5 * value, 0.0, 1.0, WIRE) == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize('linear, same', [(0.5, 18.0), (0.65, 12.6), (1.0, 0.0)])
def test_where_the_bench_lost_heat_in_proportion_an_arm_at_rest_shows_it(linear, same):
    """Colder than the bench above the drive squared where both lose as much, warmer below."""
    made = wire(linear=linear)
    for value in (36.0, 0.7 * same, 25.0):
        kept = made.step(value, 1e4, 1.0, WIRE)
        assert lost(kept, 0.8, linear) == pytest.approx(value, rel=1e-12)
        assert (kept < value) == (value > same)
    assert made.step(same, 1e4, 1.0, WIRE) == pytest.approx(same)
    assert made.step(-2.0, 1e4, 1.0, WIRE) == pytest.approx(-2.0 * (1.0 + 0.4 * (1.0 - linear)))


def test_a_controller_at_rest_undoes_what_is_lost():
    """Of a lag alone it has nothing to undo there."""
    assert wire().at_rest() is None
    rest = wire(linear=0.65).at_rest()
    for target in (4.0, 16.0, 30.0):
        value = rest.inverse(target, Inputs(0.0, 0.0, 0.0, math.nan, 1.0, 0.0), WIRE)
        assert value == pytest.approx(lost(target, 0.8, 0.65))
        assert rest.step(value, 0.0, 1.0, WIRE) == pytest.approx(target)


def test_settled_rows_show_the_loss_and_no_lag():
    made = wire(time_constant=0.0).in_settled_rows()
    starts = starts_of(made, 'arm', np.zeros(1))
    assert {start.linear for start in starts} == {0.5, 0.65, 1.0}
    assert all(start.time_constant == 0.0 for start in starts)
    inputs = Inputs(0.0, 0.0, np.full(3, 30.0), np.nan, np.ones(3), 0.0)
    kept = starts[0].forward(np.array([9.0, 36.0, 0.0]), inputs, WIRE)
    assert [lost(q, starts[0].growth, starts[0].linear) for q in kept] == pytest.approx(
        [9.0, 36.0, 0.0])


def test_a_bench_is_compared_with_no_other():
    """How else a bench would lose heat is no form of what it shows."""
    assert all(list(forms['heat_loss']) != ['linear'] for forms in other_forms([wire()]))


def test_it_cools_faster_from_hot_than_into_cold():
    gone = []
    for hot, cold in ((36.0, 18.0), (18.0, 0.0)):
        made = wire(growth=1.0)
        made.step(hot, 1e4, 1.0, WIRE)
        gone.append((hot - made.step(cold, 0.2, 1.0, WIRE)) / (hot - cold))
    assert gone[0] > 1.25 * gone[1]


@given(st.lists(st.tuples(drives, st.floats(0.01, 30.0)), min_size=1, max_size=5), drives,
       st.floats(0.1, 20.0), st.floats(0.0, 2.0), st.sampled_from([0.0, 0.5, 0.65, 1.0]))
def test_the_inverse_reaches_the_target_within_dt(past, target, dt, growth, linear):
    made = wire(growth, linear=linear)
    for value, held in past:
        made.step(value, held, 1.0, WIRE)
    before = made.save()
    wanted = made.inverse(target, Inputs(0.0, 0.0, dt, math.nan, 1.0, 0.0), WIRE)
    assert made.save() == before
    assert made.step(wanted, dt, 1.0, WIRE) == pytest.approx(target, abs=1e-9)


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 8.0))
def test_a_drive_of_the_wrong_sign_keeps_it_finite_and_between(first, then, growth):
    made = wire(growth)
    made.step(first, 3.0, 1.0, WIRE)
    before = made.present
    after = made.step(then, 2.0, 1.0, WIRE)
    assert min(before, then) - 1e-9 <= after <= max(before, then) + 1e-9


def test_it_takes_the_place_of_the_plain_lag_and_stands_before_the_air():
    kinds = catalogue()
    chain = Chain([kinds['ambient_temperature'](WIRE, gain=0.5, reference=20.0), wire(),
                   kinds['airflow'](WIRE, beta=2.0), kinds['thermal_lag'](WIRE)], WIRE)
    assert [effect.id for effect in chain.thermal] == ['airflow', 'heat_loss',
                                                       'ambient_temperature']
    # A fan that takes twice as much brings it there twice as fast.
    inputs = Inputs(0.0, 0.0, 0.35, 20.0, 1.0, 0.0)
    assert chain.step(6.0, inputs) == pytest.approx(balance([18.0], 0.7)[0])


def test_only_a_wire_that_is_heated_loses_heat_by_its_drive():
    kind = catalogue()['heat_loss']
    assert [drive for drive in ('voltage', 'current', 'power', 'temperature', 'pressure')
            if kind.available(WIRE._replace(drive=drive))] == ['voltage', 'current', 'power']


def test_the_laboratorys_wire_cools_faster_from_hot_than_into_cold():
    gone = {}
    for air in (None, StillAir(0.4), StillAir()):
        heat = HeatBalance(time_constant=4.0, air=air)
        gone[air] = [(hot - heat.advance(ROOM + hot, ROOM + cold, 2.0) + ROOM) / (hot - cold)
                     for hot, cold in ((90.0, 45.0), (45.0, 0.0))]
    ratios = [hot / cold for hot, cold in gone.values()]
    assert ratios[0] == pytest.approx(1.0)
    assert ratios[2] > ratios[1] + 0.05 > ratios[0] + 0.1


@pytest.mark.parametrize('share', [0.3, 1.0])
def test_the_laboratorys_balance_is_that_of_the_bench(share):
    air = StillAir(share)
    assert air.loss(FULL_EXCESS) == pytest.approx(FULL_EXCESS)
    assert air.loss(air.excess(40.0)) == pytest.approx(40.0, abs=1e-6)
    heat = HeatBalance(time_constant=4.0, air=air)
    for start, end in ((ROOM, 90.0), (100.0, 40.0)):
        assert heat.advance(start, end, 200.0) == pytest.approx(end, abs=1e-6)
        many = start
        for _ in range(20):
            many = heat.advance(many, end, 0.25)
        assert heat.advance(start, end, 5.0) == pytest.approx(many, abs=1e-3)


@pytest.mark.slow
@pytest.mark.long
def test_it_is_found_among_lags_on_an_arm_of_the_laboratory():
    lags = ['heat_loss', 'thermal_lag', 'heating_cooling_asymmetry', 'latency', 'airflow']
    found = found_in({'heat_loss': 1.0}, 4, lags)
    assert found.missing == ['heat_loss'], found.sets[:4]
    # A wire of the laboratory alike in its loop, from a fifth of the full heat on.
    assert 0.3 < found.effects[0].growth < 1.5
    lagging = found_in({'thermal_lag': 1.0}, 4, lags)
    assert 'heat_loss' not in lagging.missing, lagging.sets[:4]
