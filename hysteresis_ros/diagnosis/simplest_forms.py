# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The simplest form of an effect's equation on which held-out rows of a bench do not improve.

A parameter that tells forms of an equation apart can take up errors of another origin: fitted rows
always prefer it free. What counts is a load that the fit has not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import Effect


def simplest_forms(fitter: BenchFitter, effects: Sequence[Effect], fixed: Collection[str] = ()
                   ) -> list[Effect]:
    """
    Return effects with parameters of form neutral where held-out rows do not speak against it.

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
        In the same order: the effects given, or fitted anew with their simplest forms.
    """
    forms = {effect.id: {parameter.name: parameter.neutral for parameter in effect.parameters
                         if parameter.form
                         and effect.values[parameter.name] != parameter.neutral}
             for effect in effects}
    if not any(forms.values()):
        return list(effects)
    other = BenchFitter(fitter.problem)
    other.fixed = [*fitter.fixed, *(effect for effect in effects if effect.id in fixed)]
    free = [effect for effect in effects if effect.id not in fixed]
    plain = [effect.with_values(**forms[effect.id]) for effect in free]
    fits = [other.cross_validate(other.fit(start)) for start in (free, plain)]
    bent, straight = (other.error(fit.held_out) for fit in fits)
    if fits[1].implausible() or straight > (1.0 + Settings().practical) * bent:
        return list(effects)
    found = {effect.id: effect for effect in (*effects, *other.with_intervals(fits[1]))}
    return [found[effect.id] for effect in effects]
