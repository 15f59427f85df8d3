# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects of the sensor: equations, memory, and the targets that undo them."""

import itertools
import math

from hypothesis import given, strategies as st
import numpy as np
import pytest

from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.effects import catalogue, Inputs
from hysteresis_ros.model.simulation import Simulator
from model_support import arm_run, bicep_model, effect_of, STRENGTHS, wandering_voltage

angles = st.lists(st.floats(0.5, 2.5), min_size=1, max_size=20)


def effect(name, **values):
    return catalogue()[name](**(values or STRENGTHS[name]))


def rows(dt):
    time = np.cumsum(dt)
    return Inputs(time, time, np.asarray(dt, dtype=float), *(np.full(len(time), np.nan),) * 3)


def test_encoder_offset_adds_degrees():
    made = effect('encoder_offset', offset=3.0)
    np.testing.assert_allclose(
        made.forward(np.array([1.0, 2.0]), None), np.array([1.0, 2.0]) + math.radians(3.0))
    assert made.step(1.0, 0.1) == pytest.approx(1.0 + math.radians(3.0))
    assert made.inverse(made.step(1.2, 0.1)) == pytest.approx(1.2, abs=1e-15)


def test_backlash_stands_still_until_the_play_is_used_up():
    degrees = np.array([10.0, 10.5, 12.0, 11.5, 10.0, 7.0, 8.9, 9.5])
    seen = effect('backlash', B=2.0).forward(np.radians(degrees), rows(np.ones(8)))
    np.testing.assert_allclose(np.degrees(seen), [10.0, 10.0, 11.0, 11.0, 11.0, 8.0, 8.0, 8.5])


@pytest.mark.parametrize('seat, zeroed, seen', [
    (0.0, 1.0, [10.0, 10.0, 11.0, 9.0]), (1.0, 1.0, [10.5, 10.5, 12.0, 10.0]),
    (-1.0, 1.0, [10.0, 9.0, 10.0, 8.0]), (0.5, 1.0, [10.0, 10.0, 11.5, 9.5]),
    (0.0, 0.0, [10.0, 10.0, 11.0, 9.0]), (1.0, 0.0, [9.5, 9.5, 11.0, 9.0]),
    (-1.0, 0.0, [11.0, 10.0, 11.0, 9.0]), (0.0, 2.0, [10.5, 10.0, 11.0, 9.0]),
    (1.0, 2.0, [9.5, 9.5, 11.0, 9.0]), (-1.0, 2.0, [11.5, 10.0, 11.0, 9.0])])
def test_an_encoder_may_lie_anywhere_in_its_play_at_rest(seat, zeroed, seen):
    """
    Whichever way the arm came to rest, the first of its turns shows or is swallowed whole.

    A recording that begins in the middle of a run says nothing of that.
    """
    made = effect('backlash', B=2.0, seat=seat, zeroed=zeroed)
    made.start()
    made.begin(math.radians(10.0))
    turns = np.radians([10.5, 9.0, 12.0, 8.0])
    found = made.forward(turns, rows(np.ones(4)))
    np.testing.assert_allclose(np.degrees(found), seen)
    made.start()
    made.begin(math.radians(10.0))
    np.testing.assert_allclose([made.step(turn, 1.0) for turn in turns], found)


def test_backlash_starts_from_every_seat_however_it_was_zeroed():
    starts = starts_of(effect('backlash'), 'arm')
    assert {(one.B, one.seat, one.zeroed) for one in starts} == set(itertools.product(
        (1.0, 4.0), (-1.0, 0.0, 1.0), (0.0, 1.0, 2.0)))


@given(angles, st.sampled_from([-1.0, 0.0, 1.0]))
def test_backlash_reaches_every_target_once_the_first_is_passed(targets, seat):
    sensor, controller = (effect('backlash', B=2.0, seat=seat) for _ in range(2))
    sensor.step(targets[0], 0.0)
    controller.inverse(targets[0])
    for target in targets[1:]:
        assert sensor.step(controller.inverse(target), 0.0) == pytest.approx(target, abs=1e-12)


def test_latency_gives_what_was_a_moment_ago():
    seen = effect('latency', delay=0.25).forward(
        np.array([1.0, 2.0, 4.0, 4.0]), rows([0.1, 0.2, 0.2, 0.2]))
    np.testing.assert_allclose(seen, [1.0, 1.0, 1.75, 3.5])


@pytest.mark.parametrize('held, seen', [(0.0, [3.0, 2.0, 1.75]), (1.0, [1.0, 1.0, 1.75])])
def test_latency_shows_the_rest_before_a_trial_first_or_holds_the_first_response(held, seen):
    """The latter as `numpy.interp` does before the first time that it was given."""
    late = effect('latency', delay=0.25, held=held)
    late.start()
    late.begin(3.0)
    response, dt = np.array([1.0, 2.0, 4.0]), [0.1, 0.2, 0.2]
    whole = late.forward(response, rows(dt))
    np.testing.assert_allclose(whole, seen)
    single = [late.step(value, each) for value, each in zip(response, dt)]
    np.testing.assert_allclose(single, whole)


@pytest.mark.parametrize('onset', [False, True])
def test_the_rest_before_a_trial_is_measured_as_what_follows_it(onset):
    """Angles that arrive late are off by the offset from the first one on."""
    model, history = bicep_model(), {'history': (np.arange(30) < 20).astype(float)}
    run = arm_run(wandering_voltage(30), 0.1, **(history if onset else {}))
    late = effect_of(model, 'latency', delay=0.35)
    off = effect_of(model, 'encoder_offset', offset=3.0)
    simulated = [Simulator(model, run, before=effects if onset else None).run(effects)
                 for effects in ([late], [late, off])]
    np.testing.assert_allclose(simulated[1], simulated[0] + math.radians(3.0), rtol=0, atol=1e-12)


@given(st.lists(st.tuples(st.floats(0.5, 2.5), st.floats(0.01, 1.0)), min_size=1, max_size=20),
       st.sampled_from(['encoder_offset', 'encoder_eccentricity', 'encoder_scale', 'backlash',
                        'latency']))
def test_row_by_row_is_the_same_as_the_whole_trial(samples, name):
    made = effect(name)
    response, dt = np.array(samples).T
    whole = made.forward(response, rows(dt))
    made.start()
    single = []
    for value, dt in samples:
        single.append(made.step(value, dt))
        made.restore(made.save())
    np.testing.assert_allclose(single, whole, atol=1e-12)


def test_start_forgets_the_past():
    for name in ('backlash', 'latency'):
        made = effect(name)
        fresh = made.save()
        made.step(1.0, 0.1)
        made.step(2.0, 0.1)
        assert made.save() != fresh
        made.start()
        assert made.save() == fresh
