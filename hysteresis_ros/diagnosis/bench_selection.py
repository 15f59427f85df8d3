# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Select the set of effects that explains bench tables, by rows that were held out.

A bench table is where H2's weights come from, so that every set gets weights of its own. These
are not negative, which no Gaussian evidence knows; what a set predicts of trials that neither it
nor its weights have seen takes the evidence's place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import itertools
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.observable import observable, present
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.workers import delayed, in_parallel

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.workers import Progress

SIGNIFICANCE = 0.05
# Share of blocks in which an effect has to help.
CONSISTENT = 0.55
# Effects of which all sets are tried.
MOST_IN_SETS = 5


class BenchSelection:
    """
    What explains bench tables, as far as the catalogue goes.

    Parameters
    ----------
    problem : BenchProblem
    settings : Settings
    rng : numpy.random.Generator
    jobs : int
        Processes.
    progress : callable

    Attributes
    ----------
    base : Fit
        Without any further effect.
    found : Fit
        With the effects found.
    alone : list of Fit
        Every effect by itself, best first.
    sets : list of Fit
        Sets that explain more than chance, with plausible values.
    p_values : dict of tuple of str to float
        Of every set that was tried, by its names; family-wise.
    unobservable : dict of str to str
        Effects that this data cannot show, with the reason.
    """

    def __init__(self, problem: BenchProblem, settings: Settings, rng: np.random.Generator,
                 jobs: int, progress: Progress) -> None:
        self.problem, self.settings = problem, settings
        self.fitter = BenchFitter(problem)
        self._rng, self._jobs, self._progress = rng, jobs, progress
        self.base = self.found = self.fitter.cross_validate(self.fitter.fit([]))
        self.names, self.unobservable = observable(problem)
        self.alone: list[Fit] = []
        self.sets: list[Fit] = []
        self.tried: list[Fit] = []
        self.p_values: dict[tuple[str, ...], float] = {}

    def run(self) -> None:
        """Fit every effect by itself, and all sets of the best few."""
        self.alone = self._in_parallel(_alone, self.names)
        self.alone.sort(key=self.error)
        few = [fit.effects[0] for fit in self.alone[:MOST_IN_SETS]]
        # An effect need not help by itself: the paper's first stage already does a part of what
        # a load does, so that one effect of the load alone may well make it worse.
        larger = [one for one in subsets(few, self.settings.most_effects) if len(one) > 1]
        self.tried = [*self.alone, *self._in_parallel(_together, larger)]
        values = self._significance(self.tried)
        self.p_values = {fit.names: float(value) for fit, value in zip(self.tried, values)}
        self.sets = [fit for fit, value in zip(self.tried, values)
                     if not fit.implausible() and value <= SIGNIFICANCE and self._helps(fit)]
        if not self.sets:
            return
        best = min(map(self.error, self.sets))
        near_best = [fit for fit in self.sets
                     if self.error(fit) <= (1.0 + self.settings.practical) * best]
        self.found = min(near_best, key=lambda fit: (
            len(fit.effects), len(fit.vector), self.error(fit)))

    def _in_parallel(self, task: Callable[[BenchFitter, Any], Fit | None],
                     items: Sequence) -> list[Fit]:
        tasks = [delayed(task)(self.fitter, item) for item in items]
        results = self._progress(in_parallel(tasks, self._jobs), len(tasks))
        fits = [fit for fit in results if fit is not None]
        return [fit for fit in fits if np.all(np.isfinite(fit.held_out))]

    def error(self, fit: Fit) -> float:
        """Return the held-out RMSE of a fit, in the unit of the response."""
        return self.fitter.error(fit.held_out)

    def _gains(self, fit: Fit) -> np.ndarray:
        """Return the reduction of the squared error in each block."""
        before, after = (self.problem.measured - one.held_out for one in (self.base, fit))
        return significance.block_sums(before ** 2 - after ** 2, self.problem.block)

    def _significance(self, fits: Sequence[Fit]) -> np.ndarray:
        if not fits:
            return np.zeros(0)
        return significance.paired_p_values(
            np.stack([self._gains(fit) for fit in fits]), self._rng, self.settings.draws)

    def _helps(self, fit: Fit) -> bool:
        """Whether a fit explains enough to matter, in most blocks."""
        return bool(self.error(fit) <= (1.0 - self.settings.practical) * self.error(self.base)
                    and np.mean(self._gains(fit) > 0.0) >= CONSISTENT)

    def could_be(self, rival: Fit) -> bool:
        """Whether a rival could be the truth although the set found is better."""
        if self.error(rival) <= (1.0 + self.settings.practical) * self.error(self.found):
            return True
        theirs, own = (self.problem.measured - fit.held_out for fit in (rival, self.found))
        low, _ = significance.gain_interval(theirs, own, self.problem.block, self._rng)
        return low <= 0.0

    def alternatives(self) -> dict[str, list[str]]:
        """For each effect found, name those that could as well be in its place."""
        found: dict[str, list[str]] = {effect.id: [] for effect in self.found.effects}
        chosen = frozenset(found)
        for rival in sorted(self.sets, key=self.error):
            names = frozenset(rival.names)
            if len(names) != len(chosen) or names == chosen or not self.could_be(rival):
                continue
            for place, other in zip(sorted(chosen - names), sorted(names - chosen)):
                if all(other not in named for named in found.values()):
                    found[place].append(other)
        return found

    def probabilities(self) -> list[tuple[Fit, float]]:
        """
        Return the tried sets with the probability that their held-out errors give them.

        As many independent rows as there are blocks, of unknown variance: the likelihood goes
        with the RMSE to the power of minus that number.
        """
        fits = [self.base, *self.sets]
        count = len(np.unique(self.problem.block))
        odds = math.log(self.settings.prior / (1.0 - self.settings.prior))
        logs = np.array([
            odds * len(fit.effects) - count * math.log(max(self.error(fit), 1e-300))
            for fit in fits])
        weights = np.exp(logs - logs.max())
        return list(zip(fits, (weights / weights.sum()).tolist()))


def subsets(effects: Sequence[Effect], most: int) -> list[list[Effect]]:
    """Return every set of at most `most` of the effects in which none replaces another."""
    return [list(subset) for size in range(1, most + 1)
            for subset in itertools.combinations(effects, size)
            if not any(other.id in effect.replaces for effect in subset for other in subset)]


def _alone(fitter: BenchFitter, name: str) -> Fit | None:
    """Fit and cross-validate one effect."""
    effect = present(fitter.problem.model, catalogue()[name])
    with np.errstate(all='ignore'):
        return _finite(fitter, lambda: fitter.search([], effect))


def _together(fitter: BenchFitter, effects: Sequence[Effect]) -> Fit | None:
    """Fit and cross-validate some effects, from usual values and from those that each had."""
    with np.errstate(all='ignore'):
        return _finite(fitter, lambda: fitter.best_of(
            [usual(effects, fitter.problem.kind), effects]))


def _finite(fitter: BenchFitter, make: Callable[[], Fit]) -> Fit | None:
    fit = make()
    if not np.all(np.isfinite(fit.predicted)) or not np.all(np.isfinite(fit.jacobian)):
        return None
    return fitter.cross_validate(fit)
