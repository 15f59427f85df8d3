# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every loaded muscle has, judged under the loads of a bench that lie between others.

A load that is left out is predicted from the others. The lightest and the heaviest one are
extrapolated to, which a growth of the stroke that ends soon makes hopeless, and which no arm asks
for whose loads the bench encloses; of those two the rows fitted count instead, as they do for the
discrepancy of an arm (`discrepancy.length_errors`).
"""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_problem import SAME_LOAD
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.forms import simplest_forms
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.bench_fit import BenchFitter
    from hysteresis_ros.effects import Effect


def best_between_loads(fitter: BenchFitter, effects: Sequence[Effect], small: float,
                       practical: float) -> list[Effect]:
    """
    Return those of some effects that predict the loads between others best together.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, under three loads or more.
    effects : sequence of Effect
        Effects at their usual values, of which all sets are tried in their simplest forms.
    small : float
        Error that does not matter, in the unit of the response.
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
    largest = (1.0 - practical) * _typical_error(fitter, base, small, _ends(fitter))
    largest_fitted = (1.0 + practical) * _typical_error(fitter, base, small)

    def judged(some: Sequence[Effect]) -> tuple[float, list[Effect]]:
        own = fitter.apart()
        with np.errstate(all='ignore'):
            fit = own.fit(some)
            if (not np.all(np.isfinite(fit.predicted)) or fit.implausible()
                    or _typical_error(own, fit, small) > largest_fitted):
                return np.inf, []
            found = own.with_intervals(fit)
            if any(not_determined(one, own.problem.kind) for one in found):
                return np.inf, []
            return _typical_error(own, own.cross_validate(fit), small, _ends(own)), found

    forms = simplest_forms(effects)
    simple = [effect.with_values(**forms.get(effect.id, {})) for effect in effects]
    sets = [some for count in range(1, len(simple) + 1)
            for some in itertools.combinations(simple, count)]
    error, found = min(map_in_forks(judged, sets, fitter.problem.jobs), key=lambda one: one[0])
    return found if error <= largest else []


def _ends(fitter: BenchFitter) -> np.ndarray:
    """Return which folds have the lightest or the heaviest load, shape (folds,)."""
    problem = fitter.problem
    loads = np.array([np.mean(problem.signals['load'][problem.fold == fold])
                      for fold in problem.folds])
    same = SAME_LOAD * np.ptp(loads)
    ends: np.ndarray = (loads <= loads.min() + same) | (loads >= loads.max() - same)
    return ends


def _typical_error(fitter: BenchFitter, fit: Fit, small: float,
                   fitted: np.ndarray | None = None) -> float:
    """
    Return the geometric mean over the folds of the RMSE, `small` added to each.

    Of rows held out in all folds but those that count as `fitted` (folds,), by default all.
    """
    problem = fitter.problem
    fitted = np.ones(len(problem.folds), dtype=bool) if fitted is None else fitted
    squares = [np.mean((problem.measured - (fit.predicted if one else fit.held_out))[
        problem.fold == fold] ** 2) + small ** 2 for fold, one in zip(problem.folds, fitted)]
    return float(np.exp(0.5 * np.mean(np.log(np.maximum(squares, 1e-300)))))
