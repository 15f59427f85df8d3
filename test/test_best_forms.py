# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which form of its equation an effect of a bench gets, by what each leaves of the rows."""

import types

from model_support import bicep_model, effect_of
import pytest

from hysteresis_ros.diagnosis import forms

FAR = 9.0, 9.0


@pytest.mark.parametrize('present, errors, vague, chosen', [
    # Loads held out do not tell the two apart: rows fitted do, or else the simplest form is taken.
    (2.0, {1.0: (1.4, 1.0), 2.0: (0.4, 1.0)}, (), 2.0),
    (2.0, {1.0: (0.41, 1.0), 2.0: (0.4, 1.0)}, (), 1.0),
    (2.0, {1.0: (0.41, 1.2), 2.0: (0.4, 1.0)}, (), 2.0),
    # Rows fitted and held out count together, where the latter may be chance.
    (1.0, {1.0: (0.8, 1.0), 2.0: (0.4, 1.2)}, (), 2.0),
    (1.0, {1.0: (0.8, 1.0), 2.0: (0.7, 1.2)}, (), 1.0),
    (1.0, {1.0: (0.8, 1.0), 2.0: (0.4, 1.6)}, (), 1.0),
    # A form that leaves nothing undetermined comes first, whatever another one gains.
    (1.0, {1.0: (1.4, 1.0), 1.5: (0.4, 0.8), 4.0: (0.6, 0.9)}, (1.0, 1.5), 4.0),
    # Where there is none, one that leaves no more than there was.
    (1.0, {1.0: (1.4, 1.0), 1.5: (0.4, 0.8)}, (1.0, 1.5), 1.5),
    (1.0, {1.0: (1.4, 1.0), 1.5: (0.4, 0.8)}, (1.5,), 1.0)])
def test_the_form_is_that_which_fitted_and_held_out_rows_ask_for(
        monkeypatch, present, errors, vague, chosen):
    """Errors of rows fitted and held out, by the form n."""
    class Fitter:
        """Each form has its errors, whatever the values."""

        def __init__(self, problem):
            self.problem = problem

        def holding(self, effects):
            return self

        def fit(self, effects):
            fitted, held_out = errors.get(effects[0].n, FAR)
            return types.SimpleNamespace(effects=effects, predicted=fitted, held_out=held_out,
                                         implausible=list)

        def cross_validate(self, fit):
            return fit

        def error(self, error):
            return error

        def with_intervals(self, fit):
            return fit.effects

    monkeypatch.setattr(forms, 'undetermined_names', lambda effects, kind: {
        effect.id for effect in effects if effect.n in vague})
    # Loads held out are few: up to half as large an error again is chance.
    problem = types.SimpleNamespace(kind='bench', typical_error=float, predicts_as_well=(
        lambda one, other, practical: one <= 1.5 * other))
    growth = effect_of(bicep_model(), 'stress_dependent_strain', r=0.6, n=present)
    found, = forms.with_best_forms(Fitter(problem), [growth])
    assert found.n == chosen


def test_a_form_between_two_begins_where_its_parameter_is_fitted():
    """A share that has come out as none is not fitted again by itself."""
    def shift(follows):
        return effect_of(bicep_model(), 'stress_dependence', C=0.8, follows=follows)
    assert forms.other_forms([shift(0.0)]) == [{'stress_dependence': {'follows': 0.5}}]
    assert forms.other_forms([shift(0.7)]) == []
