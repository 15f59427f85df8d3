# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which form of its equation an effect of a bench has, by rows and loads that are left out."""

import dataclasses

from model_support import effect_of
import numpy as np
import pytest
from test_bench_expansion import made_with, usual_model
from test_bench_kinetics import fitter_of

from hysteresis_ros.diagnosis import forms
from hysteresis_ros.diagnosis.forms import with_best_forms


@pytest.fixture(scope='module')
def usual():
    """Return a model of a wire with what every loaded muscle has."""
    return usual_model()


def as_growing(usual, **values):
    """Return the effects of a model whose strain grows in another way."""
    return [effect_of(usual, 'stress_dependent_strain', **{'r': 0.5, 'F0': 0.7, **values})
            if effect.id == 'stress_dependent_strain' else effect for effect in usual.effects]


def found_order(fitter, effects, fixed=()):
    growth, = (effect for effect in with_best_forms(fitter, effects, fixed)
               if effect.id == 'stress_dependent_strain')
    return growth.n


@pytest.fixture(scope='module')
def abrupt(usual):
    """Return rows of a wire whose strain grows from a critical load on."""
    return fitter_of(usual, made_with(usual.with_effects(as_growing(usual, n=4.0))))


def test_the_form_is_that_of_the_wire(usual, abrupt):
    """Whatever the form that the effect was found in."""
    for n in (1.0, 2.0, 4.0):
        assert found_order(abrupt, as_growing(usual, n=n)) == 4.0
    plain = fitter_of(usual, made_with(usual))
    assert found_order(plain, as_growing(usual, n=4.0)) == 1.0


def test_what_is_fixed_keeps_its_form(usual, abrupt):
    assert found_order(abrupt, as_growing(usual), ['stress_dependent_strain']) == 1.0


def test_rows_left_out_decide_where_they_are_clear(usual, abrupt, monkeypatch):
    """As long as loads held out do not surely speak against it."""
    of = forms._Scored.of.__func__

    def order_of(fit):
        return fit.effects[[one.id for one in fit.effects].index('stress_dependent_strain')].n

    def scored(share):
        # All forms are alike but for n = 2, which is off by a share on rows left out.
        def score(cls, fitter, fit):
            found = of(cls, fitter, fit)
            left_out = 1e-4 * (share if order_of(fit) == 2.0 else 1.0)
            return dataclasses.replace(
                found, left_out=left_out, errors=np.full(2, 1e-4), error=1e-4, rows=100.0,
                parameters=3)
        return classmethod(score)
    monkeypatch.setattr(forms._Scored, 'of', scored(0.9))
    monkeypatch.setattr(abrupt.problem, 'predicts_as_well', lambda *args: True)
    assert found_order(abrupt, as_growing(usual)) == 2.0
    monkeypatch.setattr(abrupt.problem, 'predicts_as_well', lambda *args: False)
    assert found_order(abrupt, as_growing(usual)) == 1.0
    # The logarithm of three forms is 1.1, and 100 rows times that of 0.99 one.
    monkeypatch.setattr(abrupt.problem, 'predicts_as_well', lambda *args: True)
    monkeypatch.setattr(forms._Scored, 'of', scored(0.99))
    assert found_order(abrupt, as_growing(usual)) == 1.0


def test_a_form_that_fits_not_at_all_has_no_odds(abrupt, usual):
    fit = abrupt.fit(as_growing(usual))
    own = forms._Scored.of(abrupt, fit)
    worse = dataclasses.replace(own, left_out=2.0 * own.left_out)
    assert own.log_odds(worse) == pytest.approx(own.rows * np.log(2.0))
    assert worse.log_odds(own) == pytest.approx(-own.rows * np.log(2.0))
    more = dataclasses.replace(own, parameters=own.parameters + 1)
    assert own.log_odds(more) == pytest.approx(0.5 * np.log(own.rows))
    assert own.log_odds(dataclasses.replace(own, left_out=np.nan)) == 0.0
