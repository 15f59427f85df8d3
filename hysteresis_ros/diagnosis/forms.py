# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which form of its equation an effect of a bench has, by rows that were held out.

A parameter that tells forms of an equation apart can take up errors of another origin: fitted rows
always prefer it free. What counts is a load that the fit has not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
import functools

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.determined import undetermined_names
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
    own = fitter.holding([effect for effect in effects if effect.id in fixed])
    first = best = _fitted(own, free, {})
    kept: Forms = {}
    if simplest:
        plain = _fitted(own, free, simplest)
        if plain.plausible and plain.no_worse(best) and not best.better(plain):
            best, kept = plain, simplest
    tried = [_fitted(own, free, {**kept, **forms}) for forms in others]
    start = best
    # One that leaves nothing undetermined, or else no more than there was.
    for most in (set(), start.undetermined):
        for other in tried:
            if other.plausible and other.better(best) and other.undetermined <= most:
                best = other
        if best is not start:
            break
    if best is first:
        return list(effects)
    found = {effect.id: effect for effect in (*effects, *best.effects)}
    return [found[effect.id] for effect in effects]


class _FormFit:
    """
    One fit of effects in some forms, and how it compares.

    Parameters
    ----------
    fitter : BenchFitter
        That it was fitted by.
    fit : Fit
        With held-out rows.
    """

    def __init__(self, fitter: BenchFitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self._fitted = fitter.error(fit.predicted)
        # To the error of all rows the least load contributes most, as the others are extrapolated
        # to it; to the typical one, by which sets are compared, all contribute alike.
        self._held_out = np.array([fitter.error(fit.held_out),
                                   fitter.problem.typical_error(fit.held_out)])
        self._practical = Settings().practical

    @property
    def plausible(self) -> bool:
        """Whether all parameters lie in their physical ranges."""
        return not self._fit.implausible()

    @functools.cached_property
    def effects(self) -> list[Effect]:
        """Those that were free, with intervals."""
        return self._fitter.with_intervals(self._fit)

    @property
    def undetermined(self) -> set[str]:
        """Effects whose sizes the rows do not determine."""
        return undetermined_names(self.effects, self._fitter.problem.kind)

    def no_worse(self, than: _FormFit) -> bool:
        """Whether held-out rows are predicted as well, by less than what matters."""
        return bool(np.all(self._held_out <= (1.0 + self._practical) * than._held_out))

    def better(self, than: _FormFit) -> bool:
        """
        Whether rows tell this form from another one.

        As of sets: those held out and those fitted together, where the former are not sure to be
        predicted worse.
        """
        problem = self._fitter.problem
        both = self._held_out[1] * self._fitted / (than._held_out[1] * than._fitted)
        return bool(both < (1.0 - self._practical) ** 2 and problem.predicts_as_well(
            self._fit.held_out, than._fit.held_out, self._practical))


def _fitted(fitter: BenchFitter, effects: Sequence[Effect], forms: Forms) -> _FormFit:
    """Return the better of a fit from the present values and one from the usual ones."""
    starts = [effects]
    if forms:
        # Values that suit one form may be where a fit of another one gets stuck.
        starts.append([usual([effect], 'bench')[0] if effect.id in forms or effect.implausible()
                       else effect for effect in effects])
    fits = [fitter.fit([effect.with_values(**forms.get(effect.id, {})) for effect in start])
            for start in starts]
    best = min(fits, key=lambda one: fitter.error(one.predicted))
    return _FormFit(fitter, fitter.cross_validate(best))


def simplest_forms(effects: Sequence[Effect]) -> Forms:
    """Return the neutral values of parameters of form that are not neutral."""
    found = {effect.id: {parameter.name: parameter.neutral for parameter in effect.parameters
                         if parameter.form and effect.values[parameter.name] != parameter.neutral}
             for effect in effects}
    return {name: values for name, values in found.items() if values}


def other_forms(effects: Sequence[Effect]) -> list[Forms]:
    """
    Return the forms, one at a time, that effects do not have of those to choose from.

    Of a parameter between two forms, which is fitted where it is not neutral: its starts.
    """
    return [{effect.id: {parameter.name: choice}} for effect in effects
            for parameter in effect.parameters if parameter.form and 'bench' in parameter.kinds
            and (parameter.choices or effect.values[parameter.name] == parameter.neutral)
            for choice in parameter.choices or parameter.starts
            if choice not in (parameter.neutral, effect.values[parameter.name])]
