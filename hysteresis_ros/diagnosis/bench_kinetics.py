# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether the rows of a bench show minor loops that do not close (`effects.kinetics`).

The weights of H2 follow the minor loops that they are fitted to one by one, whatever these are. A
wire whose minor loops are scaled from the major one needs fewer of them for the same rows, and one
whose loops close is fitted far worse. What a row left out would be off by tells both: generalised
cross-validation (Golub, Heath and Wahba, Technometrics 21 (1979) 215). Kinetics are sought once the
other effects are known, because each wire has kinetics and no other effect stands for them.
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses

import numpy as np
from scipy import special

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.significance import (
    independent_rows, schwarz_log_odds, SIGNIFICANCE)
from hysteresis_ros.effects import Effect
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.measurements.turns import turns

# Shares that are tried first, and those that are tried too where one of them is better than none.
COARSE, FINE = (0.25, 0.5, 0.75, 1.0), (0.125, 0.375, 0.625, 0.875)


@dataclasses.dataclass
class BenchKinetics:
    """
    What the rows of a bench show with kinetics.

    Attributes
    ----------
    effects : list of Effect
        Those found before and, last, `Kinetics`, with intervals.
    before, after : float
        RMSE of a row left out without and with kinetics, in the unit of the response.
    """

    effects: list[Effect]
    before: float
    after: float


def shown_kinetics(fitter: BenchFitter, found: Sequence[Effect]) -> BenchKinetics | None:
    """
    Return the effects found on a bench with the kinetics of the wire.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    found : sequence of Effect
        Effects with values.

    Returns
    -------
    BenchKinetics or None
        None where there are no minor loops, a row left out is predicted no better than by chance
        (Schwarz's criterion), or the share is not determined.
    """
    problem = fitter.problem
    surroundings = problem.model.surroundings
    known = {effect.id for effect in (*fitter.fixed, *found)}
    if (Kinetics.id in known or not Kinetics.available(surroundings)
            or not _has_minor_loops(problem)):
        return None
    shown = _shown(fitter, found)
    finest = problem.finest([*fitter.fixed, *found])
    if shown is None and finest.levels > problem.levels:
        # Coarse weights follow fewer minor loops one by one, fine ones less of a steep branch.
        shown = _shown(fitter.on(finest), found)
    return shown


def _shown(fitter: BenchFitter, found: Sequence[Effect]) -> BenchKinetics | None:
    """Return what `shown_kinetics` does, with the weights of one problem."""
    problem = fitter.problem
    with np.errstate(all='ignore'):
        profile = _Profile(fitter, found)
        profile.evaluate(COARSE[:1])
        # The error bends but once.
        if profile.unlikely(COARSE[0]):
            return None
        profile.evaluate(COARSE[1:])
        if profile.best == 0.0:
            return None
        profile.evaluate(FINE)
        if not profile.proves():
            return None
        kinetics = Kinetics(problem.model.surroundings, share=profile.best)
        kinetics.intervals['share'] = profile.interval()
        own = profile.fitter_with(profile.best)
        fit = profile.fits[profile.best]
        effects = own.with_intervals(fit)
        # What loads held out have determined is not refitted to rows that do not determine it.
        vague = [one for one, fitted in zip(found, effects) if not_determined(fitted, problem.kind)]
        if vague:
            own.fixed = [*own.fixed, *vague]
            fit = own.fit([one for one in fit.effects
                           if one.id not in {effect.id for effect in vague}])
            effects = own.with_intervals(fit)
        if fit.implausible() or any(not_determined(effect, problem.kind)
                                    for effect in (*effects, kinetics)):
            return None
    return BenchKinetics([*vague, *effects, kinetics], profile.errors[0.0],
                         profile.errors[profile.best])


class _Profile:
    """
    RMSE of a row left out by the share that follows the kinetics, all else fitted to each.

    Attributes
    ----------
    errors : dict of float to float
    fits : dict of float to Fit
    """

    def __init__(self, fitter: BenchFitter, found: Sequence[Effect]) -> None:
        self._fitter, self._found = fitter, found
        self.errors: dict[float, float] = {}
        self.fits: dict[float, Fit] = {}
        self.evaluate((0.0,))
        problem = fitter.problem
        self._rows = independent_rows(
            problem.measured - self.fits[0.0].predicted, problem.trial,
            len(np.unique(problem.block)))

    @property
    def best(self) -> float:
        """Share with the least error."""
        return min(self.errors, key=lambda share: self.errors[share])

    def fitter_with(self, share: float) -> BenchFitter:
        """Return the fitter with kinetics of a share."""
        own = self._fitter.apart()
        if share:
            own.fixed = [*own.fixed, Kinetics(own.problem.model.surroundings, share=share)]
        return own

    def evaluate(self, shares: Sequence[float]) -> None:
        """Fit the effects with some shares."""
        for share in shares:
            near = min(self.fits, key=lambda one: abs(one - share), default=None)
            starts = [self._found]
            if near is not None:
                starts.append(self.fits[near].effects)
            for start in starts:
                own = self.fitter_with(share)
                fit = own.fit(start)
                error = own.problem.left_out_rmse([*own.fixed, *fit.effects])
                # What does not fit at all predicts nothing.
                error = error if np.isfinite(error) else np.inf
                if share not in self.fits or error < self.errors[share]:
                    self.errors[share], self.fits[share] = error, fit

    def proves(self) -> bool:
        """Whether the best share is better than none by more than one parameter makes it."""
        return schwarz_log_odds(
            self.errors[0.0], self.errors[self.best], self._rows, 1) > 0.0

    def unlikely(self, share: float) -> bool:
        """Whether a share is surely less likely than the best (95 %)."""
        # Rows times the logarithm is the log likelihood, twice which is of chi square.
        ratio = self._rows * np.log(self.errors[share] / self.errors[self.best])
        return bool(ratio > 0.5 * special.chdtri(1, SIGNIFICANCE))

    def interval(self) -> tuple[float, float]:
        """Return the nearest shares tried that are surely less likely than the best."""
        ends = [share for share in self.errors if self.unlikely(share)]
        return (max((share for share in ends if share < self.best), default=0.0),
                min((share for share in ends if share > self.best), default=1.0))


def _has_minor_loops(problem: BenchProblem) -> bool:
    """
    Whether the drive of some trial turns again after it has turned once.

    Branches of the major loop are those of H2 whatever the kinetics. A swing within an interval of
    the grid of H2 is noise.
    """
    # A drive that stands still is no signal.
    drive = problem.signals.get('drive', np.zeros(len(problem.measured)))
    least = float(np.ptp(drive)) / problem.levels
    return any(turns(drive[problem.trial == trial], least) > 1
               for trial in np.unique(problem.trial))
