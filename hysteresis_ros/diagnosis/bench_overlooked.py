# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects that the rows of a bench show once the others are known.

A set of effects is chosen by what it predicts of loads that are held out. These errors are few and
large, so that they do not tell a small effect from chance. A row left out has others under its own
load around it: generalised cross-validation (Golub, Heath and Wahba, Technometrics 21 (1979) 215)
tells it from what the weights of H2 take up. It does not tell a small effect from a small error of
the form of another one, either; loads held out do, and have to be predicted better, too.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.determined import undetermined_names
from hysteresis_ros.diagnosis.observable import observable, present
from hysteresis_ros.diagnosis.significance import independent_rows, schwarz_log_odds
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.effects.kinetics import Kinetics

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit


def with_overlooked(fitter: BenchFitter, known: Sequence[Effect], excluded: Collection[str],
                    practical: float) -> list[Effect]:
    """
    Return the effects known and those that rows and loads left out show besides.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    known : sequence of Effect
        Effects with values.
    excluded : collection of str
        Effects that are not to be sought.
    practical : float
        Share by which one effect more has to lower the error of loads held out.

    Returns
    -------
    list of Effect
        As they are where there is no other, else with intervals.
    """
    found = list(known)
    with np.errstate(all='ignore'):
        while more := _OneMore(fitter, found, excluded).shown(practical):
            found = more
    return found


class _OneMore:
    """
    What rows left out say of each other effect of the catalogue, all known ones fitted with it.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    known : sequence of Effect
        Effects with values.
    excluded : collection of str
        Effects that are not to be tried.
    """

    def __init__(self, fitter: BenchFitter, known: Sequence[Effect], excluded: Collection[str]
                 ) -> None:
        problem = fitter.problem
        apart = fitter.apart()
        _, fitted = apart.fit_but_kinetics(known)
        # What loads held out have determined is not refitted to rows that do not determine it.
        kept = undetermined_names(fitted, problem.kind).union(
            effect.id for effect in known if isinstance(effect, Kinetics))
        self._fixed = [effect for effect in known if effect.id in kept]
        self._fitter = apart.holding(self._fixed)
        self._base = self._fitter.fit([effect for effect in fitted if effect.id not in kept])
        self._rows = independent_rows(
            problem.measured - self._base.predicted, problem.trial,
            len(np.unique(problem.block)))
        taken = {effect.id for effect in (*fitter.fixed, *known)}
        self._names = [name for name in observable(problem)[0]
                       if name not in {*taken, *excluded, Kinetics.id}]

    def shown(self, practical: float) -> list[Effect] | None:
        """Return all effects with the one that rows left out show most clearly, if there is one."""
        # Each of them might have been the one (Chen and Chen, Biometrika 95 (2008) 759).
        least = math.log(max(len(self._names), 1))
        tried = [(self._log_odds(fit), fit) for fit in map(self._with, self._names)]
        for odds, fit in sorted(tried, key=lambda one: -one[0]):
            if odds > least and not fit.implausible():
                effects = self._fitter.with_intervals(fit)
                if (not undetermined_names(effects, self._fitter.problem.kind)
                        and self._confirmed(fit, practical)):
                    return [*self._fixed, *effects]
        return None

    def _with(self, name: str) -> Fit:
        """Fit one effect more together with those that are known."""
        problem = self._fitter.problem
        effect = present(problem.model, catalogue()[name], problem.settled)
        return self._fitter.search(
            self._base.effects, effect if problem.loads_return else effect.within_trials())

    def _log_odds(self, fit: Fit) -> float:
        """Return the log odds of one effect more against none, by the RMSE of a row left out."""
        before, after = (self._fitter.problem.left_out_rmse(
            [*self._fitter.fixed, *one.effects]) for one in (self._base, fit))
        # What does not fit at all predicts nothing.
        if not np.isfinite(after):
            return -math.inf
        more = (self._fitter.parameters_in_use(fit)
                - self._fitter.parameters_in_use(self._base))
        return schwarz_log_odds(before, after, self._rows, max(more, 1))

    def _confirmed(self, fit: Fit, practical: float) -> bool:
        """Whether loads held out are predicted better by what matters."""
        after, before = (self._fitter.problem.typical_error(
            np.asarray(self._fitter.cross_validate(one).held_out)) for one in (fit, self._base))
        return after < (1.0 - practical) * before
