# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every loaded muscle has, judged under the loads of a bench that lie between others.

A load that is left out is predicted from the others. The lightest and the heaviest one are
extrapolated to, which says nothing where the stroke soon stops growing with the load, and which no
arm asks for whose loads the bench encloses; of those two the rows fitted count instead, as they do
for the discrepancy of an arm (`bench_error.length_errors`).
"""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_problem import SAME_LOAD
from hysteresis_ros.diagnosis.determined import undetermined_names
from hysteresis_ros.diagnosis.forms import simplest_forms
from hysteresis_ros.diagnosis.significance import typical_error
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.bench_fit import BenchFitter
    from hysteresis_ros.effects import Effect


def best_between_loads(fitter: BenchFitter, effects: Sequence[Effect], practical: float
                       ) -> list[Effect]:
    """
    Return those of some effects that predict the loads between others best together.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, under three loads or more.
    effects : sequence of Effect
        Effects at their usual values, of which all sets are tried in their simplest forms.
    practical : float
        Share by which the error between loads has to be less than without any of them, and by
        which the error of the rows fitted must not be more.

    Returns
    -------
    list of Effect
        Fitted, with intervals, by which the rows determine the size of each; none where no set is
        better than none.
    """
    base = fitter.cross_validate(fitter.fit([]))
    largest = (1.0 - practical) * _error_between(fitter, base)
    largest_fitted = (1.0 + practical) * fitter.problem.typical_error(base.predicted)

    def judged(some: Sequence[Effect]) -> tuple[float, list[Effect]]:
        own = fitter.apart()
        with np.errstate(all='ignore'):
            fit = own.fit(some)
            if (not np.all(np.isfinite(fit.predicted)) or fit.implausible()
                    or own.problem.typical_error(fit.predicted) > largest_fitted):
                return np.inf, []
            found = own.with_intervals(fit)
            if undetermined_names(found, own.problem.kind):
                return np.inf, []
            return _error_between(own, own.cross_validate(fit)), found

    forms = simplest_forms(effects)
    simple = [effect.with_values(**forms.get(effect.id, {})) for effect in effects]
    sets = [some for count in range(1, len(simple) + 1)
            for some in itertools.combinations(simple, count)]
    error, found = min(map_in_forks(judged, sets, fitter.problem.jobs), key=lambda one: one[0])
    return found if error <= largest else []


def _error_between(fitter: BenchFitter, fit: Fit) -> float:
    """Return the typical error of loads left out, of which those at the ends count as fitted."""
    problem = fitter.problem
    loads = np.array([np.mean(problem.signals['load'][problem.fold == fold])
                      for fold in problem.folds])
    same = SAME_LOAD * np.ptp(loads)
    ends = (loads <= loads.min() + same) | (loads >= loads.max() - same)
    fitted, held_out = (problem.squares(one) for one in (fit.predicted, fit.held_out))
    return float(typical_error(np.where(ends, fitted, held_out), problem.small_error))
