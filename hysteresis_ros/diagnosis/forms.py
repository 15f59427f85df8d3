# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which form of its equation an effect of a bench has, by rows that were held out.

A parameter that tells forms of an equation apart can take up errors of another origin: fitted rows
always prefer it free. What counts is a load that the fit has not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import Effect

# Values of parameters of form, by effect and name.
Forms = Mapping[str, Mapping[str, float]]


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
    practical = Settings().practical

    def fitted(forms: Forms) -> tuple[np.ndarray, Fit]:
        # Values that suit one form may be where a fit of another one gets stuck.
        anew = [usual([effect], 'bench')[0] if effect.id in forms or effect.implausible()
                else effect for effect in free]
        fits = [trial.fit([effect.with_values(**forms.get(effect.id, {})) for effect in start])
                for start in ([free, anew] if forms else [free])]
        fit = trial.cross_validate(min(fits, key=lambda one: trial.error(one.predicted)))
        # To the error of all rows the least load contributes most, as the others are extrapolated
        # to it; to the typical one, by which sets are compared, all contribute alike.
        return np.array([trial.error(fit.held_out),
                         trial.problem.typical_error(fit.held_out)]), fit

    def better(other: tuple[np.ndarray, Fit], than: tuple[np.ndarray, Fit]) -> bool:
        # As of sets: where rows held out tell two forms apart by less than what matters, the rows
        # fitted do.
        if np.all(other[0] < (1.0 - practical) * than[0]):
            return True
        own, its = (trial.error(fit.predicted) for _, fit in (other, than))
        return bool(other[0][1] <= (1.0 + practical) * than[0][1]
                    and own < (1.0 - practical) * its)

    def vague(fit: Fit) -> set[str]:
        return {effect.id for effect in trial.with_intervals(fit)
                if not_determined(effect, trial.problem.kind)}

    present = error, _ = fitted({})
    kept: Forms = {}
    chosen = None
    if simplest:
        plain = fitted(simplest)
        if (not plain[1].implausible() and np.all(plain[0] <= (1.0 + practical) * error)
                and not better(present, plain)):
            present, chosen, kept = plain, plain[1], simplest
    tried = [fitted({**kept, **forms}) for forms in others]
    # One that leaves nothing undetermined, or else no more than there was.
    for most in (set(), vague(present[1])):
        for other in tried:
            if (not other[1].implausible() and better(other, present)
                    and vague(other[1]) <= most):
                present = other
        if any(present is other for other in tried):
            chosen = present[1]
            break
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
