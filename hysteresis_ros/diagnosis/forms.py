# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which form of its equation an effect of a bench has, by rows that were held out.

A parameter that tells forms of an equation apart can take up errors of another origin: fitted rows
always prefer it free. What counts is a load that the fit has not seen. Errors of few loads are
large and uncertain; where rows left out say clearly which of two forms it is, they decide, as long
as loads held out do not surely speak against it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
import dataclasses
import itertools
import math

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.diagnosis.significance import independent_rows, schwarz_log_odds
from hysteresis_ros.effects import Effect

# Values of parameters of form, by effect and name.
Forms = Mapping[str, Mapping[str, float]]


@dataclasses.dataclass(frozen=True)
class _Scored:
    """
    A fit of effects in some forms, and what is off.

    Attributes
    ----------
    fit : Fit
    parameters : int
        That the response depends on.
    error, left_out : float
        RMSE of the rows fitted, and of a row left out.
    rows : float
        Number of independent ones.
    held_out : ndarray, shape (n,)
        Response of rows whose load was held out.
    errors : ndarray, shape (2,)
        RMSE of these rows, to which the least load contributes most, as the others are extrapolated
        to it; and the typical one, by which sets are compared, to which all contribute alike.
    """

    fit: Fit
    parameters: int
    error: float
    left_out: float
    rows: float
    held_out: np.ndarray
    errors: np.ndarray

    @classmethod
    def of(cls, fitter: BenchFitter, fit: Fit) -> '_Scored':
        """Return a fit with its scores."""
        problem, held_out = fitter.problem, np.asarray(fitter.cross_validate(fit).held_out)
        rows = independent_rows(problem.measured - fit.predicted, problem.trial,
                                len(np.unique(problem.block)))
        return cls(fit, fitter.parameters_in_use(fit), fitter.error(fit.predicted),
                   problem.left_out_rmse([*fitter.fixed, *fit.effects]), rows, held_out,
                   np.array([fitter.error(held_out), problem.typical_error(held_out)]))

    def log_odds(self, other: '_Scored') -> float:
        """Return the log odds against another fit, by the RMSE of a row left out."""
        if not (np.isfinite(self.left_out) and np.isfinite(other.left_out)):
            return 0.0
        return schwarz_log_odds(other.left_out, self.left_out, other.rows,
                                self.parameters - other.parameters)


def with_best_forms(fitter: BenchFitter, effects: Sequence[Effect], fixed: Collection[str] = ()
                    ) -> list[Effect]:
    """
    Return effects with the simplest forms on which held-out rows do not improve.

    Parameters
    ----------
    fitter : BenchFitter
        Rows.
    effects : sequence of Effect
        As fitted, with intervals.
    fixed : collection of str
        Identifiers of effects that keep their values.

    Returns
    -------
    list of Effect
        In the same order: the effects given, or fitted anew with other forms.
    """
    free = [effect for effect in effects if effect.id not in fixed]
    simplest, others = simplest_forms(free), other_forms(free)
    if not simplest and not others:
        return list(effects)
    trial = BenchFitter(fitter.problem)
    trial.fixed = [*fitter.fixed, *(effect for effect in effects if effect.id in fixed)]
    practical, least = Settings().practical, math.log(1 + len(others))

    def fitted(forms: Forms) -> _Scored:
        in_form = [effect.with_values(**forms.get(effect.id, {})) for effect in free]
        fits = [trial.fit(in_form)]
        if forms:
            # Values that suit one form may be where a fit of another one gets stuck.
            begun = trial.begin(list(itertools.product(*(
                [start.with_values(**forms[effect.id]) for start in starts_of(
                    effect, trial.problem.kind, trial.problem.measured)]
                if effect.id in forms else [effect] for effect in in_form))))
            fits.append(trial.fit(begun.effects))
        return _Scored.of(trial, min(fits, key=lambda one: trial.error(one.predicted)))

    def undetermined(fit: Fit) -> set[str]:
        return {effect.id for effect in trial.with_intervals(fit)
                if not_determined(effect, trial.problem.kind)}

    def better(other: _Scored, than: _Scored) -> bool:
        odds = other.log_odds(than)
        if abs(odds) > least:
            return odds > 0.0 and trial.problem.predicts_as_well(
                other.held_out, than.held_out, practical)
        # As of sets: where rows held out tell two forms apart by less than what matters, the rows
        # fitted do.
        if np.all(other.errors < (1.0 - practical) * than.errors):
            return True
        return bool(other.errors[1] <= (1.0 + practical) * than.errors[1]
                    and other.error < (1.0 - practical) * than.error)

    present = fitted({})
    chosen = None
    if simplest:
        plain = fitted(simplest)
        if not plain.fit.implausible() and np.all(
                plain.errors <= (1.0 + practical) * present.errors):
            present, chosen = plain, plain.fit
    for forms in others:
        other = fitted({**simplest, **forms} if chosen is not None else forms)
        # What rows do not determine in another form, either, says nothing of this one.
        if (not other.fit.implausible() and better(other, present)
                and undetermined(other.fit) <= undetermined(present.fit)):
            present, chosen = other, other.fit
    if chosen is None:
        return list(effects)
    found = {effect.id: effect for effect in (*effects, *trial.with_intervals(chosen))}
    return [found[effect.id] for effect in effects]


def simplest_forms(effects: Sequence[Effect]) -> Forms:
    """Return the neutral values of parameters of form that are not neutral."""
    found = {effect.id: {parameter.name: parameter.neutral for parameter in effect.parameters
                         if parameter.form and effect.values[parameter.name] != parameter.neutral}
             for effect in effects}
    return {name: values for name, values in found.items() if values}


def other_forms(effects: Sequence[Effect]) -> list[Forms]:
    """Return the forms, one at a time, that effects do not have of those to choose from."""
    return [{effect.id: {parameter.name: choice}} for effect in effects
            for parameter in effect.parameters if parameter.form and 'bench' in parameter.kinds
            for choice in parameter.choices
            if choice not in (parameter.neutral, effect.values[parameter.name])]
