# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Minor loops that kinetics leave open: the operator, the effect, and what a diagnosis says."""

import dataclasses
import json

from hypothesis import given, settings, strategies as st
from model_support import arm_run, bicep_model, effect_of, runs, with_noise
import numpy as np
import pytest

from hysteresis_ros.diagnosis import discrepancy
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.operators import (
    cells, Kinetic, operator_from_dict, PrandtlIshlinskii, Preisach)
from hysteresis_ros.report.words import verdict_in_words

TRIED = ['payload_error', 'encoder_offset', 'end_stop']
NOISE = 3e-4
RISES, FALLS = 2.0, 1.5     # where forming begins, and reverting


def tanaka(share=1.0, sign=1.0, rate=1.5):
    """
    Return an operator whose major loop is that of Tanaka's kinetics, to a hundredth.

    Relays go up at alpha and down at beta; all that a branch does is in their marginals, so that
    they may be independent of each other: w(alpha, beta) = r(alpha) d(beta).
    """
    nodes = np.linspace(-3.0, 7.0, 201)
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    up = np.where(middle > RISES, rate * np.exp(-rate * (middle - RISES)), 0.0)
    down = np.where(middle < FALLS, rate * np.exp(rate * (middle - FALLS)), 0.0)
    beta, alpha = cells(len(middle))
    return Kinetic(Preisach(nodes, sign * up[alpha] * down[beta] / 2.0, 0.3), share)


def along(operator, *corners, steps=1):
    """Return what has transformed on the way through corners, with so many steps to each."""
    operator.reset()
    inputs = np.concatenate([[corners[0]], *(np.linspace(here, there, steps + 1)[1:]
                                             for here, there in zip(corners, corners[1:]))])
    cold, hot = operator.peek(operator.lower), operator.peek(operator.upper)
    return (operator.simulate(inputs) - cold) / (hot - cold)


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('steps', [1, 3, 50])
def test_what_transforms_is_in_proportion_to_what_has_still_to(steps, sign):
    """dy = 1.5 (1 - y) du above 2 while the input rises, dy = 1.5 y du below 1.5 while it falls."""
    corners = (-3.0, 2.6, 1.1, 2.4, 0.8, 3.0)
    expected, y = [], 0.0
    for here, there in zip(corners, corners[1:]):
        if there > here:
            y = 1.0 - (1.0 - y) * np.exp(-1.5 * max(there - max(here, RISES), 0.0))
        else:
            y *= np.exp(-1.5 * max(min(here, FALLS) - there, 0.0))
        expected.append(y)
    found = along(tanaka(sign=sign), *corners, steps=steps)[steps::steps]
    assert found == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize('share', [0.0, 0.3, 1.0])
def test_the_major_loop_is_that_of_the_preisach_operator(share):
    operator = tanaka(share)
    both_ways = (-3.0, 7.0, -3.0)
    assert along(operator, *both_ways, steps=500) == pytest.approx(
        along(operator.preisach, *both_ways, steps=500), abs=5e-3)


def test_minor_loops_shift_until_they_fit_in_and_those_of_a_preisach_operator_close():
    loops = (-3.0, 4.0, *(8 * (1.0, 2.4)))
    shifts = np.abs(np.diff(along(tanaka(), *loops)[2::2]))
    assert shifts[0] > 0.05 and np.all(shifts[1:] < shifts[:-1])
    assert shifts[-1] < 0.01 * shifts[0]
    assert along(tanaka(0.0), *loops)[4:] == pytest.approx(
        np.tile(along(tanaka(0.0), *loops)[2:4], 7), abs=1e-12)
    half = along(tanaka(0.5), *loops)
    assert half == pytest.approx(0.5 * (along(tanaka(), *loops) + along(tanaka(0.0), *loops)))


@pytest.mark.parametrize('way, turn', [((-3.0, 2.4), 1.7), ((-3.0, 5.0, 1.1), 1.8)])
def test_nothing_transforms_anew_where_nothing_went_the_other_way(way, turn):
    """A swing between the two branches is as if it had not been, both ways."""
    direct, swung = tanaka(), tanaka()
    here = along(direct, *way)[-1]
    assert 0.1 < here < 0.9
    assert along(swung, *way, turn, way[-1])[-2:] == pytest.approx([here, here], abs=1e-3)
    further = 2.0 * way[-1] - turn
    assert along(swung, *way, turn, further)[-1] == pytest.approx(
        along(direct, *way, further)[-1], abs=2e-3)


def test_a_turn_counts_anew_by_what_has_gone_back():
    """After a hundredth in part, after a tenth altogether, and the more the further."""
    deep = FALLS - np.linspace(0.0, 0.1, 11)
    again = np.array([along(tanaka(), -3.0, 2.4, turn, 2.4)[-1] for turn in deep])
    anew = 1.0 - (1.0 - along(tanaka(), -3.0, 2.4, deep[-1])[-1]) * np.exp(-1.5 * (2.4 - RISES))
    assert np.all(np.diff(again[:4]) > 0.0)
    assert again[-1] == pytest.approx(anew, abs=0.02) and again[-1] > again[0] + 0.1


@settings(max_examples=40, deadline=None)
@given(share=st.floats(0.0, 1.0), top=st.floats(2.0, 4.0), sign=st.sampled_from([1.0, -1.0]),
       seed=st.integers(0, 1000))
def test_the_inverse_gives_what_is_asked_and_the_nearest_input(share, top, sign, seed):
    rng = np.random.default_rng(seed)
    operator = Kinetic(Preisach(np.linspace(-3.0, 4.0, 9), sign * rng.random(36), 0.3), share, top)
    span = np.ptp(operator.output_range)
    for wanted in rng.uniform(*operator.output_range, 20):
        before, output = operator.input, operator.output
        found = operator.invert(wanted)
        assert not found.saturated and operator.output == output
        assert operator.peek(found.input) == found.output == pytest.approx(wanted, abs=1e-9 * span)
        halfway = 0.5 * (before + found.input)
        between = operator.peek(halfway)
        assert min(output, wanted) - 1e-9 * span <= between <= max(output, wanted) + 1e-9 * span
        operator.step(found.input)
    for wanted, end in zip((-1.0, 1.0), operator.output_range):
        found = operator.invert(end + wanted * span)
        assert found.saturated and found.output == pytest.approx(end)
    assert operator.invert(np.nan).saturated


@settings(max_examples=20, deadline=None)
@given(top=st.floats(2.0, 4.0), seed=st.integers(0, 1000))
def test_minor_loops_stay_inside_of_the_major_one(top, seed):
    """Whatever its weights."""
    rng = np.random.default_rng(seed)
    operator = Kinetic(Preisach(np.linspace(-3.0, 4.0, 9), rng.random(36), 0.3), 1.0, top)
    inputs = rng.uniform(-3.0, top, 60)
    rising, falling = (
        np.array([operator.preisach.simulate(np.array([-3.0, *way, u]))[-1] for u in inputs])
        for way in ([], [top]))
    found = operator.simulate(inputs)
    close = 2e-3 * np.ptp(operator.output_range)
    assert np.all(found >= rising - close) and np.all(found <= falling + close)


def test_a_scaled_branch_ends_at_the_major_loop():
    """A tenth goes up and down at -2 at once; what goes down at 3 would take it along, scaled."""
    nodes = np.array([-3.0, -2.0, -1.9, 2.9, 3.0, 4.0])
    beta, alpha = cells(5)
    weights = np.where((beta == 1) & (alpha == 1), 20.0, 0.0)
    weights[(beta == 3) & (alpha == 4)] = 9.0
    operator = Kinetic(Preisach(nodes, weights), 1.0)
    scaled, own = (along(one, -3.0, 2.95, 0.0)[-1] for one in (operator, operator.preisach))
    assert own > 0.05 and scaled == pytest.approx(own, abs=5e-3)


def test_an_input_that_is_none_is_flagged_and_changes_nothing():
    operator = tanaka(0.6)
    output = operator.step(2.5)
    assert operator.step(np.nan) == output and operator.saturated and operator.input == 2.5
    assert operator.step(9.0) == operator.peek(7.0) and operator.saturated
    assert not Kinetic(operator.preisach, 0.6, 4.0).saturated


def test_memory_and_parameters_survive_as_text():
    operator = tanaka(0.6)
    operator.simulate(np.array([-3.0, 3.0, 0.5, 2.4, 1.0]))
    other = operator_from_dict(json.loads(json.dumps(operator.to_dict())))
    other.restore(json.loads(json.dumps(operator.save())))
    way = np.array([2.6, 0.9, 3.0, -1.0, 2.2])
    assert other.direction == operator.direction == -1.0
    assert other.simulate(way).tolist() == operator.simulate(way).tolist()
    snapshot = operator.snapshot()
    ahead = operator.simulate(way)
    operator.rewind(snapshot)
    assert operator.simulate(way) == pytest.approx(ahead)


@pytest.mark.parametrize('change, said', [
    ({'transformed': 1.5}, 'transformed is 1.5'), ({'transformed': 'x'}, 'transformed'),
    ({'input': 99.0}, 'outside'), ({'input': 1.5}, 'in its part preisach'),
    ({'preisach': {'kind': 'play'}}, 'kind'), ({'direction': None}, 'direction')])
def test_a_damaged_memory_is_refused_and_the_own_one_stays(change, said):
    operator = tanaka(0.6)
    operator.simulate(np.array([-3.0, 3.0, 1.0]))
    saved = operator.save()
    with pytest.raises(ParameterError, match=said):
        operator.restore({**saved, **change})
    assert operator.save() == saved


@pytest.mark.parametrize('share, top, said', [
    (1.2, None, 'share is 1.2'), (-0.1, None, 'share'), (0.5, 9.0, 'top is 9.0'),
    (0.5, -3.0, 'top'), (np.nan, None, 'share')])
def test_parameters_that_make_no_sense_are_refused(share, top, said):
    with pytest.raises(ParameterError, match=said):
        Kinetic(tanaka().preisach, share, top)


@pytest.fixture(scope='module')
def model():
    """Return a model that is right on its bench, by 0.1 mm."""
    return dataclasses.replace(bicep_model(), metrics={'length': {'verification': {'rmse': 1e-4}}})


def to_and_fro():
    """Return an arm's run that goes to and fro in the middle of its way."""
    both_ways = np.concatenate([np.linspace(0.0, 6.0, 30), np.linspace(6.0, 0.0, 30)])
    return arm_run(np.concatenate([both_ways, np.linspace(0.0, 4.0, 20), np.tile([3.0, 4.0], 8)]))


def test_on_an_arm_the_way_out_stays_and_small_loops_shift(model):
    run = to_and_fro()
    change = (model.with_effects([effect_of(model, 'kinetics', share=1.0)]).predict(run)
              - model.predict(run))
    assert np.abs(change[:30]).max() < 0.15 * np.abs(change[-16:]).max()
    own = model.with_effects([effect_of(model, 'kinetics', share=1.0)]).predict(run)[-16::2]
    assert np.all(np.abs(np.diff(own))[1:] < np.abs(np.diff(own))[:-1] + 1e-12)
    assert np.ptp(model.predict(run)[-16::2]) < 0.05 * np.ptp(own)


def test_a_model_with_other_operators_says_what_it_lacks():
    play = bicep_model(length_stage=PrandtlIshlinskii([0.0, 2.0], [5e-4, 5e-4], 0.0, -13.0, 9.0))
    kind = catalogue()['kinetics']
    assert not kind.available(play.surroundings) and kind.available(bicep_model().surroundings)
    with pytest.raises(ParameterError, match=r'kinetics\) needs a Preisach length stage.*play'):
        play.with_effects([kind(play.surroundings, share=0.5)]).predict(to_and_fro())


def test_the_controller_goes_where_the_model_with_kinetics_goes(model):
    made = model.with_effects([effect_of(model, 'kinetics', share=0.8)])
    wanted = np.radians([95.0, 110.0, 100.0, 112.0, 98.0, 113.0, 97.0, 105.0])
    controller = made.controller(arm=True)
    volts = [controller.setpoint(*controller.reference(angle)).voltage for angle in wanted]
    reached = made.predict(arm_run(np.array(volts)))
    assert reached == pytest.approx(wanted, abs=np.radians(0.02))
    plain = model.controller(arm=True)
    volts = [plain.setpoint(*plain.reference(angle)).voltage for angle in wanted]
    assert np.abs(made.predict(arm_run(np.array(volts))) - wanted).max() > np.radians(0.5)


def recorded(model, share, *effects):
    """Return a recording of an arm of whose wire a share follows its kinetics."""
    own = [effect_of(model, 'kinetics', share=share)] if share else []
    clean = runs(model.with_effects([*own, *effects]), rows=40)
    return with_noise(clean, NOISE * np.random.default_rng(4).standard_normal(clean.rows))


@pytest.mark.slow
def test_minor_loops_that_stay_open_are_no_fault_of_the_arm_but_said(model, monkeypatch):
    measured = recorded(model, 0.8)
    found = diagnose(model, [measured], TRIED)
    assert (found.verdict, found.missing) == ('adequate', [])
    kinetics = found.to_dict()['kinetics']
    assert kinetics['effect'] == 'kinetics' and kinetics['share'] == pytest.approx(0.8, abs=0.1)
    assert kinetics['rmse_before'] > 0.01 > 5.0 * NOISE > kinetics['rmse_after']
    assert 'extend --add kinetics' in found.experiment or 'kinetics' in found.experiment
    assert f'{100.0 * kinetics["share"]:.0f} % of what transforms' in verdict_in_words(found)
    monkeypatch.setattr(discrepancy.Kinetics, 'available', lambda surroundings: False)
    found = diagnose(model, [measured], TRIED)
    assert found.verdict != 'adequate' and found.kinetics is None


def test_they_hide_nothing_that_is_missing(model):
    payload = effect_of(model, 'payload_error', dm=40.0)
    found = diagnose(model, [recorded(model, 0.8, payload)], TRIED)
    assert found.missing == ['payload_error']
    assert found.effects[0].values['dm'] == pytest.approx(40.0, abs=6.0)
    assert found.kinetics['share'] == pytest.approx(0.8, abs=0.15)


@pytest.mark.parametrize('share', [0.0, 0.07])
def test_nothing_is_said_of_loops_that_close_or_nearly_do(model, share):
    found = diagnose(model, [recorded(model, share)], TRIED)
    assert found.verdict == 'adequate' and found.kinetics is None


def test_who_names_it_is_told_by_the_sets(model):
    found = diagnose(model, [recorded(model, 0.8)], [*TRIED, 'kinetics'])
    assert found.missing == ['kinetics'] and found.kinetics is None
    assert found.effects[0].values['share'] == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize('factor, counts', [(0.5, 0.5), (2.0, 1.0), (0.0, 1.0)])
def test_a_place_is_no_more_uncertain_than_the_bench_has_shown(model, factor, counts):
    """Of a part that follows its kinetics, where the bench has shown anything."""
    own = effect_of(model, 'kinetics', share=0.5)
    on_bench = 0.5 * discrepancy._kinetics_on_bench(model, own)
    assert 1e-4 < on_bench < 2e-3
    made = dataclasses.replace(
        model, effects=[own], metrics={'length': {'verification': {'rmse': factor * on_bench}}})
    problem = problem_for(made, [to_and_fro()])
    plain, whole = problem.simulate_many([[], [own.with_values(share=1.0)]])
    assert discrepancy.kinetics_spread(problem, [own]) == pytest.approx(
        counts * 0.5 * (whole - plain))


def test_what_kinetics_change_on_a_bench_is_that_of_an_oscillation_that_shrinks(model):
    """From rest over the whole range to its middle, as of the paper's Fig. 7(a)."""
    own = effect_of(model, 'kinetics', share=0.5)
    turns = [0.0, 63 / 11, 6 / 11, 57 / 11, 12 / 11, 51 / 11, 18 / 11, 45 / 11, 24 / 11, 39 / 11,
             30 / 11, 3.0]
    volts = np.interp(np.arange(0.0, 11.0, 0.2), np.arange(12), turns)
    bench = Measurement.from_columns({
        'step': np.arange(55), 'trial': np.zeros(55), 'voltage': volts, 'length': np.zeros(55),
        'force': np.full(55, model.surroundings.load)})
    change = model.with_effects([own.with_values(share=1.0)]).predict(bench) - model.predict(bench)
    assert discrepancy._kinetics_on_bench(model, own) == pytest.approx(
        np.sqrt(np.mean(change ** 2)), rel=0.15)


def test_a_bench_has_the_loads_of_its_tables(model):
    """Under each it goes through loops that become smaller."""
    own = effect_of(model, 'kinetics', share=0.5)
    growing = model.with_effects([effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)])
    light, heavy = (discrepancy._kinetics_on_bench(dataclasses.replace(growing, metrics={
        'length': {'identification': {'loads': [load]}}}), own) for load in (0.3, 6.0))
    assert 0.0 < light < 0.8 * heavy
    both = discrepancy._kinetics_on_bench(dataclasses.replace(growing, metrics={
        'length': {'identification': {'loads': [0.3, 6.0]}}}), own)
    assert both ** 2 == pytest.approx(0.5 * (light ** 2 + heavy ** 2))
