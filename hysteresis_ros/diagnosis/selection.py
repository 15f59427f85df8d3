# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Select the set of effects that explains runs of an arm, by its posterior probability.

All effects and all pairs are scored by linearisation at every start; the best are fitted in full.
Sets are then grown from the most probable ones, again by linearisation at each and full fits of the
best, until none of the most probable sets has not been grown from. What is compared in the end are
full fits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import dataclasses
import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit, Fitter
from hysteresis_ros.diagnosis.covariance import Covariance
from hysteresis_ros.diagnosis.discrepancy import discrepancy_along, room_is_calm
from hysteresis_ros.diagnosis.fitted_sets import FittedSets
from hysteresis_ros.diagnosis.linearised import (
    Linearised, linearised_starts, singles_as_started, Start)
from hysteresis_ros.diagnosis.observable import observable, unaffected
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of
from hysteresis_ros.diagnosis.set_fitter import BEGUN, FIRST_STEPS, SetFitter
from hysteresis_ros.effects import Effect

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.discrepancy import Discrepancy
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.workers import Progress

# Drift and noise of the first covariances, as shares of the discrepancy.
FIRST_POINTS = ((0.1, 0.05), (0.4, 0.3), (1.5, 0.3), (6.0, 0.3))


class Selection:
    """
    What explains runs of an arm, as far as the catalogue goes.

    Parameters
    ----------
    problem : ArmProblem
    settings : Settings
    rng : numpy.random.Generator
    progress : callable
        ``progress(items, total)``, for a progress bar.

    Attributes
    ----------
    sets : FittedSets
        What was fitted, at first without any further effect.
    fitting : SetFitter
    covariance : Covariance
        Of the base model's residuals.
    unobservable : dict of str to str
        Effects that this data cannot show, with the reason.
    """

    def __init__(self, problem: ArmProblem, settings: Settings, rng: np.random.Generator,
                 progress: Progress) -> None:
        self.problem, self.settings = problem, settings
        self.rng, self.progress = rng, progress
        self.names, self.unobservable = observable(problem)
        self.fixed = list(problem.model.effects)
        predicted = problem.simulate(self.fixed)
        without = discrepancy_along(problem, self.fixed, predicted, settings, self.names)
        # Once for all sets, or it would decide between two of them.
        self._calm = room_is_calm(problem, without)
        self.covariance = Covariance(
            self._along(self.fixed, predicted) if self._calm else without, problem.clock,
            problem.trial, problem.noise, problem.largest_noise, settings.scale_spread)
        self.fitter = Fitter(problem, self.covariance, self._discrepancy)
        for drift, noise in FIRST_POINTS:
            self.covariance.add(self.covariance.start(drift, noise))
        self.covariance.add(self.covariance.fit(problem.measured - predicted))
        self.sets = FittedSets(self.fitter, settings, rng)
        self.sets.keep(self.fitter.judge(
            Fit([], np.zeros(0), predicted, np.zeros((len(predicted), 0)))))
        self.fitting = SetFitter(self.sets)
        self._grown: set[frozenset[str]] = set()
        self._exchanged: set[frozenset[str]] = set()
        # Responses of single effects when they were tested against chance.
        self._tested: dict[frozenset[str], np.ndarray] = {}
        # Each with the response that it belongs to.
        self._linearised: dict[frozenset[str], tuple[np.ndarray, Linearised]] = {}
        self.alone: Linearised

    def _discrepancy(self, fit: Fit) -> Discrepancy:
        """
        Return the discrepancy of base model and effects where the arm goes with a fit.

        What an effect changes is off by the share by which its equation may be: the size of that
        share is two standard deviations.
        """
        effects = [*unaffected(self.fixed, fit.effects), *fit.effects]
        found = self._along(effects, fit.predicted, self.problem.measured - fit.predicted)
        without = self.fitter.simulate([
            [one for one in fit.effects if one is not effect] for effect in fit.effects])
        return dataclasses.replace(
            found, equations=0.5 * self.settings.form * (fit.predicted - without).T)

    def _along(self, effects: Sequence[Effect], predicted: np.ndarray,
               residual: np.ndarray | None = None) -> Discrepancy:
        """Return the base model's own error where the arm goes with all effects of a model."""
        return discrepancy_along(self.problem, effects, predicted, self.settings, self.names,
                                 self._calm, residual)

    def run(self) -> None:
        """Score all single effects and pairs, fit the best, and grow sets from them."""
        stages = (self._score, self._fit_alone, self._grow_sets)
        for stage in self.progress(stages, len(stages)):
            stage()

    def _score(self) -> None:
        self.alone = self._linearised_with(frozenset())

    def _fit_alone(self) -> None:
        """
        Fit every effect by itself, from its best few starts; only the best ones to the end.

        Where a response bends, the start that scores best by linearisation may be the only one from
        which a fit goes astray.
        """
        starts = [[effect] for effect in self.alone.best_starts()]
        for fit in self.fitting.begin(starts, BEGUN * self.settings.refits):
            self.sets.keep(fit)
        self._test_singles()
        self._grown.add(frozenset())
        self.fitting.refine(1)

    def _grow_sets(self) -> None:
        """Grow sets, size by size, while the residual of the best one is too large."""
        for size in range(1, self.settings.most_effects):
            grown_from = self._worth_growing(size)
            if not grown_from:
                break
            if size == 1:
                self.fitting.fit_best(self.alone.pairs())
            for names in grown_from:
                self.grow(names)
            self.fitting.refine(size + 1)
            if size == 1 and not any(map(self.sets.sufficient, self.sets.valid())):
                self._fit_from_all_starts(2)
        self._refine_best()
        self._exchange()

    def _refine_best(self) -> None:
        """Fit the most probable sets on, and test anew what that has changed."""
        self.fitting.refine_best()
        self._test_singles()

    def _test_singles(self) -> None:
        """Test single effects anew where some were fitted better than when they were tested."""
        singles = {names: fit for names, fit in self.sets.fits.items() if len(names) == 1}
        predicted = {names: fit.predicted for names, fit in singles.items()}
        if predicted.keys() != self._tested.keys() or any(
                predicted[names] is not self._tested[names] for names in predicted):
            self._tested = predicted
            self.sets.p_values = self._significance(singles.values())

    def _significance(self, singles: Iterable[Fit]) -> dict[str, float]:
        """Return family-wise p values of single effects, linearised at starts and at fits too."""
        fitted, base = [], self.sets.base
        for fit in singles:
            if len(fit.vector):
                mean, spread = ParameterVector(fit.effects, self.problem.kind).prior()
                change = fit.predicted - base.predicted + fit.jacobian @ (mean - fit.vector)
                fitted.append(Start(fit.effects[0], change, fit.jacobian * spread))
        family = Linearised(self.covariance.points, self.problem.measured - base.predicted,
                            [*self.alone.starts, *fitted])
        return family.p_values(self.fitter.point(base), self.rng, self.settings.draws)

    def _worth_growing(self, size: int) -> list[frozenset[str]]:
        """
        Return the sets of a size that are worth one more effect.

        The most probable ones, if the best set's residual is too large, or what cannot be the
        answer is more probable, and stands for it. If not, but more is left than the base model is
        off by: all of these single effects, and of larger sets the best alone, where one more
        effect makes it more probable.
        """
        valid = self.sets.valid()
        best = next(filter(self.sets.sufficient, valid), valid[0] if valid else None)
        if best is None or self.sets.noise_free_rmse(best) > self.sets.largest_rmse or (
                best and best != self.sets.ranked()[0]):
            return self.sets.best_of(size)
        # What a further effect explains has to exceed the base model's own error.
        own_error, expected = self.sets.own_error(best), self.covariance.size
        if not best or own_error <= expected:
            return []
        if size == 1 and own_error > math.hypot(expected, self.sets.rmse_50):
            # That leaves as much as the base model is off by in half of all cases. Two effects that
            # change much may take the place of one, which no linearisation shows.
            return self.sets.best_of(size)
        return [best] if len(best) == size and self._promising(best) else []

    def _promising(self, names: frozenset[str]) -> bool:
        """Whether one more effect makes a set more probable, by linearisation."""
        further = self._linearised_with(names)
        alone, = further.evidences(np.zeros((1, 0), dtype=int))
        gain = max((value for value, _ in further.singles().values()), default=-np.inf) - alone
        return gain / self.sets.temper > -self.sets.odds

    def grow(self, names: frozenset[str]) -> None:
        """Fit the best sets of one more effect than those named."""
        if names in self._grown:
            return
        self._grown.add(names)
        fit = self.sets.fits[names]
        found = self._linearised_with(names).singles()
        self.fitting.fit_best({key: (value, _with(fit.effects, effects))
                               for key, (value, effects) in found.items()})

    def add(self, fit: Fit, effect: Effect) -> Fit:
        """
        Return the best fit of one more effect together with those of a fit.

        Parameters
        ----------
        fit : Fit
        effect : Effect
            Its values are one of the starts.

        Returns
        -------
        Fit

        Raises
        ------
        ValueError
            If no start can be simulated.
        """
        others = [one for one in fit.effects if one.id not in effect.replaces]
        starts = [*self.starts_of(effect, fit), effect]
        found = self.fitter.fit([[*others, start] for start in starts], self.fitting.metric,
                                FIRST_STEPS, exact=False)
        found.sort(key=lambda one: -one.log_evidence)
        found = self.fitter.fit([one.effects for one in found[:2]], self.fitting.metric)
        best = max(found, key=lambda one: one.log_evidence)
        values = self.fitter.covariance_values(best)
        self.covariance.add(values)
        return self.fitter.refined(best, values)

    def each_anew(self, fit: Fit) -> Fit:
        """
        Return the best fit in which each effect has begun anew beside the others.

        What an effect was fitted to before the others came may be far from what it is with them.
        """
        for effect in fit.effects:
            others = [one for one in fit.effects if one.id != effect.id]
            for rest in self.fitter.fit([others], self.fitting.metric, 0):
                fit = max(fit, self.add(rest, effect), key=lambda one: one.log_evidence)
        return fit

    def starts_of(self, effect: Effect, fit: Fit) -> list[Effect]:
        """Return where to start an effect together with those of a fit."""
        problem = self.problem
        return starts_of(effect, problem.kind, problem.measured,
                         residual=problem.measured - fit.predicted, clock=problem.own_clock)

    def _linearised_with(self, names: frozenset[str]) -> Linearised:
        """Return all other effects, linearised at the values that those of a set have."""
        fit = self.sets.fits[names]
        known = self._linearised.get(names)
        if known is None or known[0] is not fit.predicted:
            self._linearised[names] = known = (fit.predicted, self._linearised_at(fit))
        return known[1]

    def _linearised_at(self, fit: Fit) -> Linearised:
        """Return all other effects, linearised at the values of a fit."""
        others = self._others(fit)
        _, spread = ParameterVector(fit.effects, self.problem.kind).prior()
        residual = self.problem.measured - fit.predicted
        if not fit.effects:
            return Linearised(self.covariance.points, residual,
                              linearised_starts(self.fitter, fit, others))
        own = self.fitter.point(fit)
        starts = linearised_starts(self.fitter, fit, others, self.alone.starts, own)
        return Linearised([own] if fit.covariance else self.covariance.points, residual, starts,
                          fit.jacobian * spread)

    def _others(self, fit: Fit) -> list[str]:
        """Return the names of the effects that can act together with those of a fit."""
        taken = {name for effect in fit.effects for name in (effect.id, *effect.replaces)}
        return [name for name in self.names if name not in taken]

    def _fit_from_all_starts(self, size: int) -> None:
        """
        Fit the most probable sets of a size from all starts of their effects.

        The start that scores best by linearisation may be one that no fit gets away from.
        """
        probable = [names for names in self.sets.ranked() if len(names) == size]
        starts: list[tuple[Effect, ...]] = []
        for names in probable[:self.settings.refits]:
            starts += itertools.product(*(
                self.starts_of(effect, self.sets.base)
                for effect in self.sets.fits[names].effects))
        self.fitting.begin(starts, self.settings.refits)
        self.fitting.refine(size)

    def _exchange(self) -> None:
        """
        Exchange single effects of the answer for others, until no other set is more probable.

        The other effects start at their values in the answer. Where a set is grown from a smaller
        one they start at their values in that, which may be far away. What takes the place of an
        effect that changes much has to change as much, which no linearisation shows: starts are
        tried as they are, too.
        """
        for _ in range(self.settings.most_effects):
            names, exchanged = self._to_exchange()
            if names in self._exchanged or not names:
                return
            if len(names) == 1:
                self._end_confused_with(names)
                return
            self._exchanged.add(names)
            whole = self.sets.fits[names]
            self._fit_containing(whole)
            for out in (effect for effect in whole.effects if effect.id in exchanged):
                others = [effect for effect in whole.effects if effect is not out]
                for fit in self.fitter.fit([others], self.fitting.metric, 0):
                    rest = dataclasses.replace(
                        fit, covariance=whole.covariance, values=whole.values)
                    singles = self._linearised_at(rest).singles()
                    best = self._best_with(others, singles, out.id)
                    # Of many that fit alike some would not be compared at all.
                    self.fitting.fit([*best, *(effects for effects in self._confused_with(
                        others, singles, out) if _names(effects) not in map(_names, best))])
                    singles = singles_as_started(self.fitter, rest, self._others(rest))
                    self.fitting.begin(self._best_with(others, singles, out.id), 1)
            self.fitting.refine(len(names))
            self._refine_best()

    def _end_confused_with(self, answer: frozenset[str]) -> None:
        """
        Fit to the end what is easily taken for an answer of one effect, and was only begun.

        Also what is easily taken for other single effects that could as well be the answer. And an
        equation that contains that of one of these is fitted from where it has ended, too.
        """
        least = self.sets.log_posterior(answer) + math.log(self.settings.reported)
        singles, sets, further = self.alone.singles(), {}, []
        for names in self.sets.valid():
            if len(names) == 1 and self.sets.log_posterior(names) >= least:
                effect, = self.sets.fits[names].effects
                for effects in self._confused_with([], singles, effect):
                    sets[_names(effects)] = effects
                further += [[own] for own in self._containing(effect)]
        # One that could not be begun may be fitted from another start.
        self.fitting.fit([*further, *(effects for names, effects in sets.items() if (
            names not in self.sets.fits or self.sets.fits[names].covariance is None))])
        self._test_singles()

    def _fit_containing(self, whole: Fit) -> None:
        """
        Fit equations that contain that of one effect of a set in the place of it and of another.

        What is more in such an equation may be what the other effect stands for.
        """
        sets = []
        for effect in whole.effects:
            for own in self._containing(effect):
                others = [other for other in whole.effects if other is not effect]
                sets += [[*(one for one in others if one is not other), own] for other in others]
        self.fitting.fit(sets)
        if sets:
            self.fitting.refine(len(whole.effects) - 1)
            self._test_singles()

    def _containing(self, effect: Effect) -> list[Effect]:
        """Return the effects whose equation contains that of an effect, with its values."""
        found = [start.effect.with_values(**{name: value for name, value in effect.values.items()
                                             if name in start.effect.values})
                 for start in self.alone.starts if effect.id in start.effect.replaces]
        return list({(own.id, *own.values.values()): own for own in found}.values())

    def _best_with(self, others: Sequence[Effect],
                   scored: Mapping[tuple[str, ...], tuple[float, list[Effect]]], out: str
                   ) -> list[list[Effect]]:
        """Return other effects with each of the best ones scored, but for the one named."""
        order = sorted((item for key, item in scored.items() if key != (out,)),
                       key=lambda item: -item[0])
        return [_with(others, effects) for _, effects in order[:self.settings.refits]]

    def _confused_with(self, others: Sequence[Effect],
                       scored: Mapping[tuple[str, ...], tuple[float, list[Effect]]], out: Effect
                       ) -> list[list[Effect]]:
        """Return other effects with each one scored that is easily taken for that given."""
        return [_with(others, effects) for (name,), (_, effects) in scored.items()
                if name in out.confused_with or out.id in effects[0].confused_with]

    def _to_exchange(self) -> tuple[frozenset[str], list[str]]:
        """
        Return a set with those of its effects that others may have to take the place of.

        Those whose values are not physical, of the most probable set of all if that would suffice:
        they stand for something else. Then all of the answer.
        """
        answer = next(iter(self.sets.valid()), frozenset())
        best = next(names for names in self.sets.ranked()
                    if names not in self._exchanged or names == answer)
        implausible = {one.split('.')[0] for one in self.sets.fits[best].implausible()}
        if implausible and len(best) > 1 and self.sets.sufficient(best):
            return best, sorted(implausible)
        return (answer, sorted(answer)) if self.sets.sufficient(answer) else (frozenset(), [])


def _with(others: Sequence[Effect], effects: Sequence[Effect]) -> list[Effect]:
    """Return effects with one more, which may replace some of them."""
    return [*(one for one in others if one.id not in effects[0].replaces), *effects]


def _names(effects: Iterable[Effect]) -> frozenset[str]:
    """Return the identifiers of effects."""
    return frozenset(effect.id for effect in effects)
