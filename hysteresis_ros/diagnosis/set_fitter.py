# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit sets of effects to runs of an arm, from starts to the maximum of their own covariance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import itertools
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.fitted_sets import FittedSets
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.covariance import Point

# Sets that are begun, for one that is fitted to the end, and steps of what is begun.
BEGUN, FIRST_STEPS = 3, 3
# Of as many sets as are fitted to the end for their evidence one more is for its little error.
FOR_ERROR = 3


class SetFitter:
    """
    Fits sets of effects, and keeps the best fit of each.

    Parameters
    ----------
    sets : FittedSets
        What was fitted, with the fitter of the runs.
    """

    def __init__(self, sets: FittedSets) -> None:
        self.sets, self.settings = sets, sets.settings
        self.fitter, self.covariance = sets.fitter, sets.covariance
        self._refined: set[frozenset[str]] = set()
        # By sets and those of one effect fewer: the response of the set where the latter began.
        self._reduced: dict[tuple[frozenset[str], frozenset[str]], np.ndarray] = {}

    def fit_best(self, scored: Mapping[tuple[str, ...], tuple[float, list[Effect]]]) -> None:
        """Fit the best sets of those scored."""
        order = sorted(scored.values(), key=lambda item: -item[0])
        self.begin([effects for _, effects in order[:BEGUN * self.settings.refits]],
                   self.settings.refits)

    def begin(self, sets: Sequence[Sequence[Effect]], most: int) -> list[Fit]:
        """
        Fit sets for a few steps, and the best of these to the end, each from one start.

        After a few steps an effect that bends the response may still be far from its maximum, and
        behind all that hardly change anything: those that leave the least error go on, too.

        Parameters
        ----------
        sets : sequence of list of Effect
        most : int
            How many are fitted to the end for their evidence.

        Returns
        -------
        list of Fit
            Those that were only begun, the best of each set of effects.
        """
        begun = self.fitter.fit(sets, self.metric, FIRST_STEPS, exact=False)
        best: dict[tuple[str, ...], Fit] = {}
        for fit in sorted(begun, key=lambda fit: -fit.log_evidence):
            best.setdefault(fit.names, fit)
        chosen = list(best.values())[:most]
        rest = sorted(begun, key=lambda fit: self.fitter.error(fit.predicted))
        for fit in rest[:max(1, most // FOR_ERROR)]:
            if all(fit.names != other.names for other in chosen):
                chosen.append(fit)
        self.fit([fit.effects for fit in chosen])
        done = {fit.names for fit in chosen}
        return [fit for names, fit in best.items() if names not in done]

    def fit(self, sets: Sequence[Sequence[Effect]]) -> None:
        """Fit sets to the end, and keep each where it is the best of its effects."""
        for fit in itertools.chain(*self.fitter.shared(self._fitted, sets)):
            self.sets.keep(fit)

    def _fitted(self, effects: Sequence[Effect]) -> list[Fit]:
        """Return a set fitted to the end and judged along its own way, nothing if that fails."""
        return [self.fitter.polished(self.fitter.along(fit))
                for fit in self.fitter.fit_one(effects, self.metric)]

    @property
    def metric(self) -> Point:
        """Return the covariance in whose units fits are made: the expected discrepancy's."""
        return self.covariance.points[1]

    def refine(self, size: int) -> None:
        """Give the most probable sets of a size covariances of their own, then judge all anew."""
        found = [names for names in self.sets.best_of(size) if names not in self._refined]
        self._refined.update(found)
        values = dict(zip(found, map_in_forks(
            self.fitter.covariance_values, [self.sets.fits[names] for names in found],
            self.fitter.problem.jobs)))
        for own in values.values():
            self.covariance.add(own)

        def refined(effects: Sequence[Effect]) -> list[Fit]:
            names = frozenset(effect.id for effect in effects)
            fit = self.fitter.refined(self.sets.fits[names], values[names])
            least = self.fitter.least_squares(fit)
            # Under a covariance the way to the maximum is rough, and not under white noise.
            return [fit, least, self.fitter.polished(self.fitter.along(least))]

        for names, (fit, least, polished) in zip(found, self.fitter.shared(
                refined, [self.sets.fits[names].effects for names in found])):
            self.sets.fits[names] = fit
            self.sets.keep_least(names, least.predicted)
            self.sets.keep(polished)
        self.sets.judge_all()

    def refine_best(self) -> None:
        """
        Fit what remains of the most probable sets without any one of their effects.

        Or with the equation that one of them contains. Again, where it has less error at once than
        its own fit: that has ended in a local minimum, out of which the further effect has led,
        whether it acts or not.
        """
        for _ in range(self.settings.most_effects):
            # The most probable of all may have an effect that is too small to be an answer.
            probable = dict.fromkeys([*self.sets.valid()[:self.settings.beam],
                                      *self.sets.ranked()[:1]])
            starts = [effects for names in probable
                      for effects in self._worth_fitting_without(names)]
            if not starts:
                return
            self.fit(starts)

    def _worth_fitting_without(self, names: frozenset[str]) -> list[list[Effect]]:
        """Return what a set holds without any one effect, where that is to be fitted from there."""
        fit, starts = self.sets.fits[names], []
        for effects in self._with_less(fit.effects):
            fewer = frozenset(effect.id for effect in effects)
            if self._reduced.get((names, fewer)) is fit.predicted:
                continue
            if fewer in self.sets.fits:
                predicted, = self.fitter.simulate([effects])
                if not self.fitter.error(predicted) < self.sets.error(fewer):
                    continue
            self._reduced[names, fewer] = fit.predicted
            starts.append(effects)
        return starts

    def _with_less(self, effects: Sequence[Effect]) -> Iterator[list[Effect]]:
        """Give effects without any one of them, and with what one of their equations contains."""
        problem = self.fitter.problem
        for effect in effects:
            others = [other for other in effects if other is not effect]
            if others:
                yield others
            for name in effect.replaces:
                if problem.catalogue is not None and name not in problem.catalogue:
                    continue
                simpler = catalogue()[name](problem.model.surroundings)
                yield [*others, simpler.with_values(**{
                    key: value for key, value in effect.values.items() if key in simpler.values})]
