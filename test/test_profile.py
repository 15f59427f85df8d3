# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Sizes that derivatives say nothing of, and the profile of the squares does."""

import numpy as np
import pytest
from scipy import stats

from hysteresis_ros.diagnosis import bench_fit
from hysteresis_ros.diagnosis.determined import not_determined, spans
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.profile import profile_interval
from hysteresis_ros.effects import catalogue
from model_support import effect_of
from test_bench_expansion import made_with, usual_model
from test_bench_kinetics import fitter_of


class Valley:
    """Squares that are least along x0 x1 = 1, as of two parameters that are one number."""

    def __init__(self, low=-1.0, high=8.0):
        self.low, self.high = low, high
        self.lower, self.upper = np.array([-2.0, 0.2]), np.array([9.0, 5.0])
        self.parameters = self

    def plausible(self, index):
        """Return the range in which the first may be."""
        return self.low, self.high

    def squares(self, vector):
        """Return them; the second is bounded."""
        return 1.0 + (vector[0] * vector[1] - 1.0) ** 2

    def minimise(self, start, evaluations, tolerance, held):
        """Return the best second parameter for a first that is held."""
        _, first = held
        return np.array([first, np.clip(1.0 / first if first else 0.0, 0.2, 5.0)])


def test_a_valley_is_followed_to_both_ends():
    low, high = profile_interval(Valley(), np.array([1.0, 1.0]), 0, 1.25)
    # With the other one between 0.2 and 5, products of 0.5 and 1.5 end at 0.1 and 7.5.
    assert low == pytest.approx(0.1, abs=0.15) and high == pytest.approx(7.5, abs=0.5)
    assert profile_interval(Valley(0.5, 4.0), np.array([1.0, 1.0]), 0, 1.25) == (-2.0, 9.0)


@pytest.fixture(scope='module')
def growing():
    """Return a wire whose strain grows below the second load, and its bench."""
    usual = usual_model()
    shift, = (effect for effect in usual.effects if effect.id == 'stress_dependence')
    wire = usual.with_effects([
        shift.with_values(follows=0.0),
        effect_of(usual, 'stress_dependent_strain', r=0.5, F0=0.2, n=1.5)])
    return wire, fitter_of(wire.with_effects([]), made_with(wire))


@pytest.mark.slow
def test_its_level_is_that_of_an_f_test_with_a_row_for_each_block(growing, monkeypatch):
    wire, fitter = growing
    fit, allowed = fitter.fit(wire.effects), []
    monkeypatch.setattr(bench_fit, 'profile_interval', lambda response, vector, index, most: (
        allowed.append(most) or (-1.0, 1.0)))
    fitter.with_intervals(fit)
    freedom = len(np.unique(fitter.problem.block)) - len(fit.vector)
    assert allowed == [pytest.approx(1.0 + stats.f.ppf(0.95, 1, freedom) / freedom)]


@pytest.mark.slow
def test_a_growth_of_which_one_load_tells_is_sure(growing):
    wire, fitter = growing
    fit = fitter.fit(wire.effects)
    growth, = (effect for effect in fitter.with_intervals(fit)
               if effect.id == 'stress_dependent_strain')
    low, high = growth.intervals['r']
    assert 0.05 < low < 0.5 < high and not_determined(growth, 'bench') is None


@pytest.mark.slow
@pytest.mark.long
def test_what_acts_with_a_growth_of_which_one_load_tells_has_its_size(growing):
    """Without the growth a softer martensite had twice the size, and nothing was elastic."""
    wire, _ = growing
    wire = wire.with_effects([*wire.effects, effect_of(wire, 'phase_modulus', m=0.06),
                              effect_of(wire, 'series_compliance', compliance=0.15)])
    found = diagnose(wire.with_effects([]), [made_with(wire)])
    assert set(found.missing) == {effect.id for effect in wire.effects}
    values = {effect.id: effect for effect in found.effects}
    assert values['phase_modulus'].m == pytest.approx(0.06, rel=0.1)
    assert values['series_compliance'].compliance == pytest.approx(0.15, rel=0.1)


@pytest.mark.slow
def test_what_is_not_there_is_not_determined(growing):
    wire, fitter = growing
    fit = fitter.fit([*wire.effects, effect_of(wire, 'series_compliance', compliance=0.01)])
    stretch, = (effect for effect in fitter.with_intervals(fit)
                if effect.id == 'series_compliance')
    assert not_determined(stretch, 'bench')


@pytest.mark.parametrize('low, high, all_of_it', [
    (0.02, 1.0, True), (-9.0, 9.0, True), (0.2, 1.0, False), (0.02, 0.8, False),
    (np.nan, np.nan, False)])
def test_an_interval_spans_a_range_or_not(low, high, all_of_it):
    size = catalogue()['stress_dependent_strain'].parameters[0]
    assert (size.low, size.high) == (0.02, 1.0)
    assert spans(size, low, high) == all_of_it
