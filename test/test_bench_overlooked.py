# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a set of effects of a bench lacks, by rows and loads that are left out."""

from model_support import effect_of
import numpy as np
import pytest
from test_bench_expansion import made_with, PRACTICAL, usual_model
from test_bench_kinetics import fitter_of

from hysteresis_ros.diagnosis import bench_overlooked, extend
from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_overlooked import with_overlooked


@pytest.fixture(scope='module')
def usual():
    """Return a model of a wire with what every loaded muscle has."""
    return usual_model()


def added(usual, own=(), known=None, excluded=(), seed=0):
    known = usual.effects if known is None else known
    found = with_overlooked(
        fitter_of(usual, made_with(usual, own, seed)), known, excluded, PRACTICAL)
    return {effect.id: effect for effect in found
            if effect.id not in {one.id for one in known}}


def slopes(usual, g=0.2):
    return [effect_of(usual, 'transformation_slopes', g=g)]


def test_what_is_missing_is_found_in_its_size(usual):
    found = added(usual, slopes(usual))
    assert list(found) == ['transformation_slopes']
    assert found['transformation_slopes'].g == pytest.approx(0.2, rel=0.1)
    assert 'g' in found['transformation_slopes'].intervals


@pytest.mark.parametrize('name', ['stress_dependence', 'stress_dependent_strain'])
def test_what_was_left_out_is_found_again(usual, name):
    known = [effect for effect in usual.effects if effect.id != name]
    assert name in added(usual, known=known)


def test_nothing_is_added_where_nothing_is_missing(usual):
    assert all(not added(usual, seed=seed) for seed in range(4))


def test_two_are_found_one_after_the_other(usual):
    known = [effect for effect in usual.effects if effect.id != 'stress_dependent_strain']
    assert set(added(usual, slopes(usual), known)) == {
        'stress_dependent_strain', 'transformation_slopes'}


def test_kinetics_stay_with_what_is_found(usual):
    kinetics = effect_of(usual, 'kinetics', share=0.8)
    kinetics.intervals['share'] = 0.7, 0.9
    found = with_overlooked(
        fitter_of(usual, made_with(usual, [kinetics, *slopes(usual)])), [*usual.effects, kinetics],
        (), PRACTICAL)
    assert 'transformation_slopes' in {effect.id for effect in found}
    assert [effect.intervals for effect in found if effect.id == 'kinetics'] == [
        {'share': (0.7, 0.9)}]


def test_a_fit_beside_kinetics_leaves_them_as_they_are(usual):
    kinetics = effect_of(usual, 'kinetics', share=0.3)
    fitter = fitter_of(usual, made_with(usual))
    fit, found = fitter.fit_but_kinetics([kinetics, *usual.effects])
    assert found[0] is kinetics and fit.names == tuple(sorted(one.id for one in usual.effects))
    assert [one.id for one in found[1:]] == [one.id for one in usual.effects]
    assert all(one.intervals for one in found[1:])
    assert fitter.fixed == []


def test_it_is_not_added_where_anything_speaks_against_it(usual, monkeypatch):
    own = slopes(usual)
    assert 'transformation_slopes' not in added(usual, own, excluded=['transformation_slopes'])
    # It would have to lower the error of loads held out by all of it.
    fitter = fitter_of(usual, made_with(usual, own))
    known = usual.effects
    assert with_overlooked(fitter, known, (), 1.0) == known
    with monkeypatch.context() as patch:
        patch.setattr(bench_overlooked, 'undetermined_names', lambda *args: {'all'})
        assert not added(usual, own)
    monkeypatch.setattr(Fit, 'implausible', lambda self: ['transformation_slopes.g'])
    assert not added(usual, own)


def test_what_rows_do_not_determine_stays_as_loads_left_out_have_it(usual, monkeypatch):
    monkeypatch.setattr(bench_overlooked, 'undetermined_names', lambda effects, kind: {
        effect.id for effect in effects if effect.id == 'stress_dependent_strain'})
    found = with_overlooked(
        fitter_of(usual, made_with(usual, slopes(usual))), usual.effects, (), PRACTICAL)
    kept, = (effect for effect in usual.effects if effect.id == 'stress_dependent_strain')
    assert {effect.id for effect in found} > {effect.id for effect in usual.effects}
    assert any(effect is kept for effect in found)


@pytest.mark.parametrize('known_before', [
    pytest.param(True, marks=pytest.mark.long), False])
def test_a_form_that_rows_do_not_determine_takes_no_place_of_one_that_they_do(
        usual, known_before, monkeypatch):
    growth = effect_of(usual, 'stress_dependent_strain', r=0.5, F0=0.6)
    growth.intervals['r'] = (0.4, 0.6) if known_before else (0.0, 1.0)
    kinetics = effect_of(usual, 'kinetics', share=0.8)
    kinetics.intervals['share'] = 0.7, 0.9
    other = growth.with_values(n=4.0)
    other.intervals['r'] = 0.0, 1.0
    fixed = []
    monkeypatch.setattr(extend, 'with_best_forms', lambda fitter, effects, names: (
        fixed.append(set(names)) or [other, kinetics]))
    extend.extended_model(
        usual.with_effects([]), ['stress_dependent_strain', 'kinetics'], [made_with(usual)],
        [growth, kinetics])
    assert fixed == [{'kinetics'}, *[{'kinetics', 'stress_dependent_strain'}] * known_before]


def test_each_effect_tried_has_to_be_worth_more(usual, monkeypatch):
    """By chance the best of many is better than none."""
    tried = []
    monkeypatch.setattr(bench_overlooked, 'schwarz_log_odds',
                        lambda before, after, rows, more: tried.append(more) or 1.0)
    assert not added(usual, slopes(usual))
    assert len(tried) > np.e
    # Each by the parameters that it has: one of slopes, three of an R-phase.
    assert min(tried) == 1 and max(tried) >= 2
