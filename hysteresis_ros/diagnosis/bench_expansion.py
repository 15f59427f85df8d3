# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether the rows of a bench show that the muscle expands with its temperature.

Every wire expands, by 1 to 3 % of its stroke. That is too little for a search among all effects, in
which an error of 1 % of the range counts as none, and is sought once the others are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.diagnosis.significance import schwarz_log_odds
from hysteresis_ros.effects import Effect
from hysteresis_ros.effects.thermal_expansion import ThermalExpansion

# Of the fit with all effects; see `BenchFitter.fit`.
EVALUATIONS, TOLERANCE = 30, 1e-4

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.bench_fit import BenchFitter
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem


def with_expansion(fitter: BenchFitter, known: Sequence[Effect], practical: float) -> list[Effect]:
    """
    Return the effects known and, where rows prove it, `ThermalExpansion`.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    known : sequence of Effect
        Effects with values.
    practical : float
        Share by which loads held out may be predicted worse with one parameter more.

    Returns
    -------
    list of Effect
        With intervals where the expansion is among them: its size is determined, Schwarz's
        criterion prefers it on the rows fitted, and loads held out do not speak against it.
    """
    problem = fitter.problem
    surroundings = problem.model.surroundings
    if (ThermalExpansion.id in {effect.id for effect in (*fitter.fixed, *known)}
            or not ThermalExpansion.available(surroundings)):
        return list(known)
    with np.errstate(all='ignore'):
        before = fitter.fit(known)
        alone = fitter.apart().holding(before.effects)
        expansion = min((alone.fit([start]) for start in starts_of(
            ThermalExpansion(surroundings), 'bench')), key=lambda fit: fitter.error(fit.predicted))
        effects = [*before.effects, *expansion.effects]
        # With one parameter more, others that rows hardly determine may end far from where they
        # were: then all of them stay as they are.
        for after in (fitter.fit(effects, evaluations=EVALUATIONS, tolerance=TOLERANCE),
                      fitter.fit(effects, evaluations=1)):
            if not np.all(np.isfinite(after.predicted)) or after.implausible():
                continue
            found = fitter.with_intervals(after)
            if not (not_determined(found[-1], problem.kind)
                    or not _proves(problem, before, after)
                    or _harms(fitter, before, after, practical)):
                return found
    return list(known)


def _proves(problem: BenchProblem, before: Fit, after: Fit) -> bool:
    """Whether the rows fitted prefer one parameter more, with as many of them as blocks."""
    without, with_it = (problem.typical_error(fit.predicted, problem.noise)
                        for fit in (before, after))
    return schwarz_log_odds(without, with_it, len(np.unique(problem.block)), 1) > 0.0


def _harms(fitter: BenchFitter, before: Fit, after: Fit, practical: float) -> bool:
    """Whether loads held out are predicted worse by more than one parameter does by chance."""
    without, with_it = (fitter.problem.typical_error(fitter.cross_validate(fit).held_out)
                        for fit in (before, after))
    return with_it > (1.0 + practical) * without
