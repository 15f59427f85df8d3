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

from collections.abc import Collection, Sequence
import dataclasses

import numpy as np
from scipy import special

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.determined import undetermined_names
from hysteresis_ros.diagnosis.forms import other_forms, simplest_forms
from hysteresis_ros.diagnosis.parameters import universal
from hysteresis_ros.diagnosis.significance import (
    independent_rows, schwarz_log_odds, SIGNIFICANCE)
from hysteresis_ros.effects import Effect
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.measurements.turns import turns
from hysteresis_ros.model.chain import Chain

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


def shown_kinetics(fitter: BenchFitter, found: Sequence[Effect], excluded: Collection[str] = ()
                   ) -> BenchKinetics | None:
    """
    Return the effects found on a bench with the kinetics of the wire.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    found : sequence of Effect
        Effects with values.
    excluded : collection of str
        Effects that are not to be sought with them.

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
    shown = _shown(fitter, found, excluded)
    finest = problem.finest([*fitter.fixed, *found])
    if shown is None and finest.levels > problem.levels:
        # Coarse weights follow fewer minor loops one by one, fine ones less of a steep branch.
        shown = _shown(fitter.on(finest), found, excluded)
    return shown


def _shown(fitter: BenchFitter, found: Sequence[Effect], excluded: Collection[str]
           ) -> BenchKinetics | None:
    """Return what `shown_kinetics` does, with the weights of one problem."""
    with np.errstate(all='ignore'):
        profile = _Profile(fitter, found)
        profile.search()
        surroundings = fitter.problem.model.surroundings
        if Chain([*fitter.fixed, *found, Kinetics(surroundings, share=1.0, orients=1.0)],
                 surroundings).orients:
            profile = _orienting(fitter, found, profile, excluded)
        if profile.best == 0.0 or not profile.proves():
            return None
        return profile.shown()


def _orienting(fitter: BenchFitter, found: Sequence[Effect], plain: _Profile,
               excluded: Collection[str]) -> _Profile:
    """
    Return the profile of branches that orient anew what a low load has left twinned, if it shows.

    Under constant loads a softer martensite lengthens the stroke as orientation does. Where minor
    loops tell how much of it a load orients, what every loaded muscle has, and the form of the
    growth with the load, are sought again.
    """
    as_found = _Profile(fitter, found, orients=1.0, plain=plain)
    as_found.search()
    if as_found.best == 0.0 or not as_found.proves(plain):
        return plain
    others = [_Profile(fitter, found, start, orients=1.0, plain=plain)
              for start in _variations(fitter, as_found.fits[as_found.best].effects, excluded)]
    for other in others:
        # What another effect had stood for may have had a share of the kinetics' part, too.
        other.evaluate([as_found.best, 1.0])
    for other in sorted(others, key=lambda one: one.errors[one.best]):
        if other.proves(as_found):
            other.search()
            if other.shown() is not None:
                return other
    return as_found if as_found.shown() is not None else plain


def _variations(fitter: BenchFitter, effects: Sequence[Effect], excluded: Collection[str]
                ) -> list[list[Effect]]:
    """Return effects in other forms, and each with one more that every loaded muscle has."""
    surroundings = fitter.problem.model.surroundings
    known = {effect.id for effect in (*fitter.fixed, *effects)}
    more = universal(surroundings, {*known, *excluded})
    found = []
    for forms in ({}, *other_forms(effects), *filter(None, [simplest_forms(effects)])):
        formed = [effect.with_values(**forms.get(effect.id, {})) for effect in effects]
        found += [formed, *([*formed, one] for one in more)]
    return found[1:]


class _Profile:
    """
    RMSE of a row left out by the share that follows the kinetics, all else fitted to each.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    found : sequence of Effect
        Effects with values.
    start : sequence of Effect, optional
        Where fits of these, and perhaps of others, begin.
    orients : float
        Form of the kinetics.
    plain : _Profile, optional
        Profile with the fit without kinetics; by default it is fitted.

    Attributes
    ----------
    errors : dict of float to float
    fits : dict of float to Fit
    """

    def __init__(self, fitter: BenchFitter, found: Sequence[Effect],
                 start: Sequence[Effect] | None = None, orients: float = 0.0,
                 plain: _Profile | None = None) -> None:
        self._fitter, self._found, self._orients = fitter, found, orients
        self._start = found if start is None else start
        self.errors: dict[float, float] = {}
        self.fits: dict[float, Fit] = {}
        if plain is None:
            self.evaluate((0.0,))
        else:
            self.errors[0.0], self.fits[0.0] = plain.errors[0.0], plain.fits[0.0]
        problem = fitter.problem
        self._rows = independent_rows(
            problem.measured - self.fits[0.0].predicted, problem.trial,
            len(np.unique(problem.block)))

    def search(self) -> None:
        """Fit the effects with the shares among which the best is."""
        self.evaluate(COARSE[:1])
        # The error bends but once.
        if self.best == 0.0 and self.unlikely(COARSE[0]):
            return
        self.evaluate(COARSE[1:])
        if self.best != 0.0:
            self.evaluate(FINE)

    def kinetics_of(self, share: float) -> Kinetics:
        """Return the kinetics of a share."""
        return Kinetics(self._fitter.problem.model.surroundings, share=share,
                        orients=self._orients)

    def shown(self) -> BenchKinetics | None:
        """Return the effects with the best share; None where rows do not determine them."""
        problem = self._fitter.problem
        kinetics = self.kinetics_of(self.best)
        kinetics.intervals['share'] = self.interval()
        own = self.fitter_with(self.best)
        fit = self.fits[self.best]
        effects = own.with_intervals(fit)
        # What loads held out have determined is not refitted to rows that do not determine it.
        names = undetermined_names(effects, problem.kind).intersection(
            one.id for one in self._found)
        vague = [one for one in self._found if one.id in names]
        if vague:
            own = own.holding(vague)
            fit = own.fit([one for one in fit.effects if one.id not in names])
            effects = own.with_intervals(fit)
        if fit.implausible() or undetermined_names((*effects, kinetics), problem.kind):
            return None
        return BenchKinetics([*vague, *effects, kinetics], self.errors[0.0],
                             self.errors[self.best])

    @property
    def best(self) -> float:
        """Share with the least error."""
        return min(self.errors, key=lambda share: self.errors[share])

    def fitter_with(self, share: float) -> BenchFitter:
        """Return the fitter with kinetics of a share."""
        return self._fitter.apart().holding([self.kinetics_of(share)] if share else [])

    def evaluate(self, shares: Sequence[float]) -> None:
        """Fit the effects with some shares, but for those that were."""
        for share in [one for one in shares if one not in self.errors]:
            near = min(self.fits, key=lambda one: abs(one - share), default=None)
            starts = [self._start]
            if near is not None and len(self.fits[near].effects) == len(self._start):
                starts.append(self.fits[near].effects)
            for start in starts:
                own = self.fitter_with(share)
                fit = own.fit(start)
                error = own.problem.left_out_rmse([*own.fixed, *fit.effects])
                # What does not fit at all predicts nothing.
                error = error if np.isfinite(error) else np.inf
                if share not in self.fits or error < self.errors[share]:
                    self.errors[share], self.fits[share] = error, fit

    def proves(self, other: _Profile | None = None) -> bool:
        """Whether the best share is better than none, or another profile's, by a parameter more."""
        error = self.errors[0.0] if other is None else other.errors[other.best]
        return schwarz_log_odds(error, self.errors[self.best], self._rows, 1) > 0.0

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
