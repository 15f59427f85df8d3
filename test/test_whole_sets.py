# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""All that a loaded muscle has, fitted together from many starts: effects stand for others."""

import numpy as np
import pytest

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_search import BenchSearch
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.diagnosis.whole_sets import starts_together, subsets
from hysteresis_ros.effects import catalogue
from model_support import effect_of
from test_bench_expansion import made_with, usual_model
from test_bench_kinetics import fitter_of

NAMES = ('phase_modulus', 'series_compliance', 'stress_dependence', 'stress_dependent_strain',
         'transformation_slopes')


@pytest.fixture(scope='module')
def wire():
    """Return a wire whose loops widen, and whose strain grows at little load only."""
    usual = usual_model()
    shift, = (effect for effect in usual.effects if effect.id == 'stress_dependence')
    return usual.with_effects([
        shift.with_values(follows=0.0),
        effect_of(usual, 'stress_dependent_strain', r=0.79, F0=0.47, n=4.0),
        effect_of(usual, 'transformation_slopes', g=0.25),
        effect_of(usual, 'phase_modulus', m=0.06),
        effect_of(usual, 'series_compliance', compliance=0.24)])


def silent(items, total):
    return items


def search_of(wire, names=NAMES):
    fitter = fitter_of(wire.with_effects([]), made_with(wire))
    return BenchSearch(fitter.problem, fitter, names, Settings(), 1, silent)


def test_starts_are_all_of_each_form(wire):
    forms = starts_together(wire.surroundings, NAMES)
    assert [{(effects['stress_dependent_strain'].n, effects['stress_dependence'].follows > 0.0)
             for effects in ({effect.id: effect for effect in start} for start in starts)}
            for starts in forms] == [
                {(n, follows)} for n in (1.0, 1.5, 2.0, 4.0) for follows in (False, True)]
    for starts in forms:
        assert all({effect.id for effect in start} == set(NAMES) for start in starts)
        values = {(effects['stress_dependence'].C, effects['stress_dependent_strain'].F0,
                   effects['transformation_slopes'].g) for effects in (
                       {effect.id: effect for effect in start} for start in starts)}
        assert len(values) == len(starts)
        assert {np.sign(g) for _, _, g in values} == {-1.0, 0.0, 1.0}
        shifts = sorted({C for C, _, _ in values})
        C, = (one for one in catalogue()['stress_dependence'](wire.surroundings).parameters
              if one.name == 'C')
        assert shifts[0] == pytest.approx(C.low) and shifts[-1] == pytest.approx(C.high)
        assert np.all(np.diff(np.log(shifts)) < 0.35)


def test_only_what_the_tables_can_show_is_tried(wire):
    around = wire.surroundings
    assert starts_together(around, [name for name in NAMES if name != 'stress_dependence']) == []
    assert starts_together(around, ['series_compliance']) == []
    start = starts_together(around, NAMES[2:4])[0][0]
    assert {effect.id for effect in start} == set(NAMES[2:4])


def test_parts_keep_shift_and_growth(wire):
    found = subsets(wire.effects)
    assert len(found) == len({frozenset(effect.id for effect in some) for some in found}) == 8
    assert all({'stress_dependence', 'stress_dependent_strain'} <= {effect.id for effect in some}
               for some in found)


def test_the_whole_is_fitted_to_the_noise(wire):
    fits = search_of(wire)._together()
    whole = min((fit for fit in fits if set(fit.names) == set(NAMES)),
                key=lambda fit: search_of(wire).fitter.error(fit.predicted))
    search = search_of(wire)
    assert search.fitter.error(whole.predicted) < 4e-5
    # Of either kind of shift, which these rows do not tell apart.
    assert len(fits) == 16
    slopes, = (effect for effect in whole.effects if effect.id == 'transformation_slopes')
    assert slopes.g == pytest.approx(0.25, abs=0.02)


def test_of_each_kind_of_shift_the_form_that_predicts_loads_left_out_is_taken_apart(
        wire, monkeypatch):
    """Rows fitted would prefer others."""
    search = search_of(wire)
    measured, taken = search.fitter.problem.measured, []

    def begun(n, follows, held_out, fitted):
        effects = [effect.with_values(follows=follows) if effect.id == 'stress_dependence'
                   else effect.with_values(n=n) if effect.id == 'stress_dependent_strain'
                   else effect for effect in wire.effects]
        return Fit(effects, np.zeros(0), measured + fitted, held_out=measured + held_out)
    fits = [begun(1.0, 0.0, 3e-4, 2e-4), begun(2.0, 0.0, 5e-4, 1e-4),
            begun(1.5, 1.0, 4e-4, 1e-4), begun(4.0, 0.7, 2e-4, 3e-4)]

    def in_parallel(task, fitter, items):
        if task.__name__ == '_begun_at_best':
            return fits
        if task.__name__ == '_fitted':
            taken.extend(items)
        return list(items)
    monkeypatch.setattr(search, '_in_parallel', in_parallel)
    assert search._together() == taken and len(taken) == 16
    assert {tuple(value for effect in effects for name, value in effect.values.items()
                  if name in ('follows', 'n')) for effects in taken} == {(0.0, 1.0), (0.7, 4.0)}


def test_nothing_is_tried_together_without_a_load(wire):
    assert search_of(wire, ['fatigue', 'creep'])._together() == []


@pytest.mark.slow
@pytest.mark.long
def test_effects_that_stand_for_each_other_are_all_named(wire):
    """Grown by one at a time, sets end with three of them and 369 um where loads are left out."""
    found = diagnose(wire.with_effects([]), [made_with(wire)])
    assert set(found.missing) == set(NAMES)
    values = {effect.id: effect for effect in found.effects}
    assert values['transformation_slopes'].g == pytest.approx(0.25, abs=0.02)
    assert values['series_compliance'].compliance == pytest.approx(0.24, rel=0.1)
    assert values['stress_dependent_strain'].n == 4.0


def test_what_only_rows_left_out_tell_is_held_to_what_is_usual(wire):
    """Of a growth that the least load alone shows, the others leave all open: 5.4 mm, unless."""
    changed = {'stress_dependence': {'C': 0.375}, 'transformation_slopes': {'g': -0.3}}
    wire = wire.with_effects([effect.with_values(**changed.get(effect.id, {}))
                              for effect in wire.effects])
    fitter = fitter_of(wire.with_effects([]), made_with(wire))
    fit = fitter.cross_validate(fitter.fit(wire.effects))
    squares = fitter.problem.squares(fit.held_out)
    assert np.sqrt(squares[0]) < 3.5e-3
    assert np.all(np.sqrt(squares[1:]) < 5e-4)
