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

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.determined import not_determined
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
        fit = trial.cross_validate(trial.fit(
            [effect.with_values(**forms.get(effect.id, {})) for effect in free]))
        # To the error of all rows the least load contributes most, as the others are extrapolated
        # to it; to the typical one, by which sets are compared, all contribute alike.
        return np.array([trial.error(fit.held_out), significance.typical_error(
            trial.problem.squares(fit.held_out), trial.problem.small_error)]), fit

    present = error, _ = fitted({})
    chosen = None
    if simplest:
        plain = fitted(simplest)
        if not plain[1].implausible() and np.all(plain[0] <= (1.0 + practical) * error):
            present, chosen = plain, plain[1]
    for forms in others:
        other = fitted({**simplest, **forms} if chosen is not None else forms)
        if (not other[1].implausible() and np.all(other[0] < (1.0 - practical) * present[0])
                and not any(not_determined(effect, trial.problem.kind)
                            for effect in trial.with_intervals(other[1]))):
            present, chosen = other, other[1]
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
            for parameter in effect.parameters if parameter.form
            for choice in parameter.choices
            if choice not in (parameter.neutral, effect.values[parameter.name])]
