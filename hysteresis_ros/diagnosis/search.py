# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Search the catalogue for the smallest set of effects that explains a recording.

Every effect is fitted by itself. On an arm sets are then grown: the best effect, and what explains
more beside it. Because one effect can stand in for two that are not like it, pairs are fitted as
well where a grown set leaves more than the base model's own error. A straight extrapolation says
in which order. On bench tables all sets of the best few effects are fitted.
"""

import itertools

import numpy as np

from hysteresis_ros.diagnosis.candidates import (
    changes_beside, consider_all, consider_beside, hopeful, possible)
from hysteresis_ros.diagnosis.evidence import Evidence, PRACTICAL, SIGNIFICANCE
from hysteresis_ros.diagnosis.extrapolation import Extrapolation, promising
from hysteresis_ros.diagnosis.fit import Fitter
from hysteresis_ros.diagnosis.sets import consider_sets, finish_sets, subsets, try_sets

MOST_EFFECTS = 3
# What is added to others has to take this share off the first error, or a user would not see it.
LEAST_SHARE = 0.015
# First effects from which sets are grown.
MOST_SEEDS = 2
# Effects of which all sets are tried on the bench.
MOST_IN_SETS = 5
# Effects that are fitted beside those found, the most promising of a straight extrapolation.
MOST_RIVALS = 8
# Numbers of pairs that are fitted one after the other until one explains it all, and how many of
# the best are then fitted to the end, by whether rows are settled: a continuous one takes longer.
BATCHES = {True: (12, 12, 12, 12, 12), False: (8,)}
MOST_PAIRS = {True: 4, False: 2}
# Only so many of the batches where a set leaves less than this many times as much as ends the
# search: pairs have little more to explain.
FEW_BATCHES, NEARLY = 1, 2.0
# One effect that leaves no more of a continuous run's error than this share hardly stands in for
# two others, and pairs take long there. Settled rows show little more than a curve; there it may.
HARDLY_TWO = 0.1
# Sets that are begun for the alternatives to each effect of a set.
RIVALS = 6
MOST_ALTERNATIVES = 3
# What leaves less than this share of what the effects found leave explains far more.
STRANGE = 0.6


def _names(effects) -> frozenset:
    return frozenset(effect.id for effect in effects)


class Search:
    """
    What explains a recording, as far as the catalogue goes.

    Parameters
    ----------
    problem : Problem
        Rows and model.
    jobs : int
        Processes.
    seed : int
        Of the random draws.
    progress : callable
        ``progress(iterable, total)``, for a progress bar.

    Attributes
    ----------
    base : Fit
        Without any further effect.
    found : Fit
        With the effects found.
    first : list of Candidate
        Every effect by itself, best first.
    rivals : list of Fit
        Other sets of as many effects.
    strange : list of Fit
        Grown sets with a value that is not physical.
    hopeless : dict of str to str
        Effects that this data cannot show, with the reason.
    """

    def __init__(self, problem, jobs, seed, progress):
        self.problem = problem
        self.fitter = Fitter(problem)
        self.jobs = jobs
        self.progress = progress
        self.rng = np.random.default_rng(seed)
        self.fixed = list(problem.model.effects)
        self.base = self.found = self.refit([])
        self.evidence = Evidence(problem, self.fixed, self.base.predicted, self.rng)
        self.rivals, self.strange = [], []
        # Fits of one more effect beside those that were known, by their names.
        self._beside = {}
        names, self.hopeless = possible(problem, [])
        self.first = consider_all(self.fitter, self.base, names, jobs, progress)
        self._beside[frozenset()] = self._judged(self.first, self.base)
        self.extrapolation = Extrapolation(problem, self.base, self.first)

    def error(self, fit) -> float:
        """Return the held-out RMSE of a fit."""
        return self.fitter.error(fit.held_out)

    def refit(self, effects):
        """Fit effects from their present values, and cross-validate them."""
        return self.fitter.cross_validate(self.fixed, self.fitter.fit(self.fixed, effects))

    def _judged(self, candidates, current, family=()) -> list:
        """Fill in the p values of candidates, best of a family, and return their fits."""
        fits = [candidate.fit for candidate in candidates]
        values = self.evidence.p_values(fits, current, family)
        for candidate, value in zip(candidates, values):
            candidate.p_value = float(value)
        return fits

    def consider(self, current, looks) -> list:
        """Fit each effect beside those of a fit; the best of them first, with p values."""
        candidates, hopeless = consider_beside(
            self.fitter, current, looks, self.evidence.floor, self.jobs, self.progress)
        self._beside[_names(current.effects)] = self._judged(
            candidates, current, [fit.jacobian for fit in hopeless])
        return candidates

    def run(self) -> None:
        """Find the smallest set of those that are nearly as good as the best."""
        sets = self._on_bench() if self.problem.refits else self._on_arm()
        if not sets:
            return
        best = min(map(self.error, sets))
        enough = [fit for fit in sets if self.error(fit) <= (1.0 + PRACTICAL) * best]
        self.found = min(enough, key=lambda fit: (
            len(fit.effects), len(fit.vector), self.error(fit)))
        self.rivals = [fit for fit in sets if fit is not self.found
                       and len(fit.effects) == len(self.found.effects)]

    def alternatives(self) -> list:
        """For each effect found, list the names of those that could as well be in its place."""
        result = []
        taken = {effect.id for effect in self.found.effects}
        for effect in self.found.effects:
            others = [other for other in self.found.effects if other is not effect]
            rivals = [fit for fit in self._beside.get(_names(others), [])
                      if fit.effects[-1].id not in taken]
            if others:
                fitted = {fit.effects[-1].id for fit in rivals} | taken
                sets = self.extrapolation.in_order([
                    [*others, candidate.effect] for candidate in self.first
                    if candidate.id not in fitted])
                rivals += self._fitted(sets[:RIVALS])
            close = [fit for fit in sorted(rivals, key=self.error) if not fit.implausible()
                     and self.evidence.could_be(fit, self.found)]
            result.append([fit.effects[-1].id for fit in close[:MOST_ALTERNATIVES]])
        self._add_rivals(result)
        return result

    def _fitted(self, sets) -> list:
        """Fit sets of effects, to their end where they may be about as good as the one found."""
        if self.problem.refits:
            return consider_sets(self.fitter, sets, self.jobs, self.progress)
        begun = try_sets(self.fitter, sets, self.jobs, self.progress)
        good = hopeful(self.fitter, [self.found, *begun], self.evidence.floor)
        return finish_sets(self.fitter, [fit for fit in good if fit is not self.found],
                           self.jobs, self.progress)

    def _add_rivals(self, alternatives) -> None:
        """Add the effects of whole sets that could as well be the truth."""
        for rival in sorted(self.rivals, key=self.error):
            if not self.evidence.could_be(rival, self.found):
                continue
            names = [effect.id for effect in rival.effects]
            places = [place for place, effect in enumerate(self.found.effects)
                      if effect.id not in names]
            taken = {effect.id for effect in self.found.effects}
            new = [name for name in names if name not in taken]
            for place, name in zip(places, new):
                if not any(name in named for named in alternatives):
                    alternatives[place].append(name)

    def stand_in(self):
        """
        Return the fit of no more effects that explains far more with values that are not physical.

        Then what is missing is like them, and is neither them nor what was found. None if there
        is no such fit, or what was found leaves no more than it may.
        """
        found = self.error(self.found)
        if found <= self.evidence.enough:
            return None
        strange = self.strange + [candidate.fit for candidate in self.first
                                  if candidate.fit.implausible()]
        best = min((fit for fit in strange if len(fit.effects) <= len(self.found.effects)),
                   key=self.error, default=None)
        return best if best and self.error(best) < STRANGE * found else None

    def _on_bench(self):
        """
        Fit all sets of those effects that fit best by themselves.

        They need not help by themselves: the paper's first stage already does a part of what a
        load does, so that one effect of the load alone may well make it worse.
        """
        few = [candidate.effect for candidate in self.first][:MOST_IN_SETS]
        sets = consider_sets(self.fitter, subsets(few, MOST_EFFECTS), self.jobs, self.progress)
        return [fit for fit in sets if not fit.implausible()
                and self.evidence.helps(fit, self.base)
                and self.evidence.p_values([fit], self.base)[0] <= SIGNIFICANCE]

    def _on_arm(self):
        """Grow sets, from the best plausible effect and from those that fit clearly better."""
        sets = []
        for seed in self._seeds():
            fit = self._grow(seed.fit)
            (self.strange if fit.implausible() else sets).append(fit)
            # Several effects may do what two others are the cause of.
            if any(len(fit.effects) == 1 and not self._leaves(fit) for fit in sets):
                return sets
        if not self._leaves(self.base) or (not self.problem.settled and any(
                len(fit.effects) == 1 and self.error(fit) <= HARDLY_TWO * self.error(self.base)
                for fit in sets)):
            return sets
        return sets + self._pairs(sets)

    def _seeds(self):
        significant = [candidate for candidate in self.first
                       if self._significant(candidate, self.base)]
        plausible = [candidate for candidate in significant if not candidate.fit.implausible()]
        seeds = self._simplest(plausible)
        limit = (1.0 - PRACTICAL) * plausible[0].rmse if plausible else np.inf
        better = [candidate for candidate in significant
                  if candidate.fit.implausible() and candidate.rmse < limit]
        return seeds + better[:MOST_SEEDS - len(seeds)]

    def _simplest(self, candidates) -> list:
        """
        Return the one with fewest parameters of those nearly as good as the first, or [].

        One that the first contains is as good as long as what it lacks could be chance.
        """
        enough = [candidate for candidate in candidates
                  if candidate.rmse <= (1.0 + PRACTICAL) * candidates[0].rmse
                  or candidate.id in candidates[0].effect.replaces
                  and self.evidence.p_values([candidates[0].fit], candidate.fit)[0] > SIGNIFICANCE]
        return sorted(enough, key=lambda candidate: len(candidate.fit.vector))[:1]

    def _matters(self, fit, current) -> bool:
        """Whether more effects take off enough to be seen beside what was wrong at first."""
        return self.error(current) - self.error(fit) >= LEAST_SHARE * self.error(self.base)

    def _leaves(self, fit) -> bool:
        """Whether a fit leaves so much that what takes it away could matter."""
        left = self.error(fit)
        return (left > self.evidence.enough
                and left - self.evidence.floor >= LEAST_SHARE * self.error(self.base))

    def _significant(self, candidate, current) -> bool:
        return (candidate.p_value <= SIGNIFICANCE
                and self.evidence.helps(candidate.fit, current))

    def _grow(self, fit):
        """Add effects to a fit while each explains more; take out what is then needless."""
        while len(fit.effects) < MOST_EFFECTS and self._leaves(fit):
            rivals = [rival for rival in self.consider(fit, self._worth_another_look(fit))
                      if self._matters(rival.fit, fit) and self._significant(rival, fit)]
            plausible = [rival for rival in rivals if not rival.fit.implausible()]
            chosen = self._simplest(plausible or (rivals if fit.implausible() else []))
            if (rivals and not self._leaves(rivals[0].fit)
                    and all(self._leaves(rival.fit) for rival in plausible)):
                # What has stood in for the newest is not needed any more.
                without = self._without_needless(rivals[0].fit)
                if not without.implausible():
                    return without
            if not chosen:
                break
            fit = self.refit(chosen[0].fit.effects)
        return self._without_needless(fit)

    def _worth_another_look(self, fit) -> list:
        """
        Return effects that have anything to say about what is left, the most promising first.

        Each at its most promising starts.
        """
        left = self.problem.measured - fit.predicted
        limit = (1.0 - PRACTICAL) * float(np.mean(left ** 2))
        names, _ = possible(self.problem, fit.effects)
        candidates = [candidate for candidate in self.first if candidate.id in names]
        changes = changes_beside(self.problem, fit.effects, candidates, self.jobs, self.progress)
        return promising(changes, fit.jacobian, left, limit)[:MOST_RIVALS]

    def _pairs(self, grown) -> list:
        """
        Fit pairs of effects in the order of a straight extrapolation, until one explains it all.

        Kept are those that explain more than the best single effect would with chance's help.
        """
        tried = {_names(fit.effects) for fits in self._beside.values() for fit in fits}
        pairs = self.extrapolation.in_order([pair for pair in subsets(
            [candidate.effect for candidate in self.first], 2)
                                if len(pair) == 2 and _names(pair) not in tried])
        singles = [fit for fit in grown if len(fit.effects) == 1] or [self.base]
        single = min(singles, key=self.error)
        fits, waiting, settled = [], iter(pairs), self.problem.settled
        batches = BATCHES[settled]
        if any(self.error(fit) <= NEARLY * self.evidence.enough for fit in grown):
            batches = batches[:FEW_BATCHES]
        for count in batches:
            chosen = list(itertools.islice(waiting, count))
            fits += try_sets(self.fitter, chosen, self.jobs, self.progress)
            fits.sort(key=lambda fit: self.fitter.error(fit.predicted))
            if fits and self.fitter.error(fits[0].predicted) <= self.evidence.floor:
                break
        plausible = [fit for fit in fits if not fit.implausible()]
        best = finish_sets(self.fitter, plausible[:MOST_PAIRS[settled]], self.jobs, self.progress)
        best = [fit for fit in best if not fit.implausible()]
        # Any of the pairs might have come out best by chance.
        jacobians = {candidate.id: candidate.fit.jacobian for candidate in self.first}
        family = [np.column_stack([jacobians[effect.id] for effect in pair]) for pair in pairs]
        values = self.evidence.p_values(best, single, family)
        good = [fit for fit, value in zip(best, values)
                if value <= SIGNIFICANCE and self.evidence.helps(fit, single)
                and self._matters(fit, single)]
        # What an effect leaves that sets were grown from has been seen.
        seeds = frozenset().union(*(names for names in self._beside if len(names) == 1))
        best = sorted(good, key=self.error)[:1]
        grown = [self._grow(fit) for fit in best if not seeds & _names(fit.effects)]
        return good + [fit for fit in grown if not fit.implausible()]

    def _without_needless(self, fit):
        """Take out an effect that a later one has made needless."""
        for effect in fit.effects if len(fit.effects) > 1 else ():
            without = self.refit([other for other in fit.effects if other is not effect])
            if self.error(without) <= (1.0 + PRACTICAL) * self.error(fit):
                return without
        return fit
