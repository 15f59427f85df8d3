# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Find and fit the sets of effects that could explain bench tables.

Sets are found with H2 on the grid of the model, and fitted again on a finer one. Which of them is
the answer, `bench_selection` says.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
import itertools
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.forms import other_forms, simplest_forms
from hysteresis_ros.diagnosis.observable import present
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.diagnosis.restarts import at_other_shifts
from hysteresis_ros.diagnosis.whole_sets import starts_together, subsets
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.workers import delayed, in_parallel, map_in_forks, must_be_sent

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.workers import Progress

# Sets of each size that are grown by one more effect, and judged on held-out rows.
GROWN = 3
# Share by which an effect has to lower the error of the rows that its set is fitted to.
WORTH_JUDGING = 0.01


class BenchSearch:
    """
    Sets of effects, fitted to bench tables.

    Parameters
    ----------
    problem : BenchProblem
        Sets are found on it.
    fitter : BenchFitter
        Fits them again, on a finer grid.
    names : sequence of str
        Effects that the tables can show.
    settings : Settings
    jobs : int
        Processes.
    progress : callable
    """

    def __init__(self, problem: BenchProblem, fitter: BenchFitter, names: Sequence[str],
                 settings: Settings, jobs: int, progress: Progress) -> None:
        self._coarse, self.fitter = BenchFitter(problem), fitter
        self._names, self._most = names, settings.most_on_bench
        self._practical = settings.practical
        self._jobs, self._progress = jobs, progress

    def run(self) -> tuple[list[Fit], list[Fit]]:
        """
        Fit every effect by itself, and grow sets from the best.

        Returns
        -------
        fits : list of Fit
            All single effects, and larger sets.
        variants : list of Fit
            The best of each size again, in other forms of its effects' equations, sets in the
            simplest ones, and what every loaded muscle has, fitted together.
        """
        fits = self._begun_where_larger_ended(
            self._in_parallel(_refitted, self.fitter, [fit.effects for fit in self._grown()]))
        fits = self._begun_at_other_shifts(fits)
        return fits, [*self._in_other_forms(fits), *self._in_simplest_forms(fits),
                      *self._together()]

    def cross_validated(self, fits: Sequence[Fit]) -> list[Fit]:
        """Return fits with their held-out rows, without those that predict none."""
        return self._in_parallel(_judged, self.fitter, fits)

    def _grown(self) -> list[Fit]:
        """
        Return all single effects and the best larger sets, fitted, not cross-validated.

        An effect need not help by itself: the paper's first stage already does a part of what a
        load does, so that one effect of the load alone may well make it worse. What every loaded
        muscle has is therefore grown from, too.
        """
        singles = self._in_parallel(_alone, self._coarse, self._names)
        found = list(singles)
        single = {fit.names[0]: fit.effects[0] for fit in singles}
        generation = self._best(singles, GROWN)
        errors = {frozenset(fit.names): self._fitted_error(fit) for fit in singles}
        for _ in range(1, self._most):
            larger = {frozenset((*fit.names, name)): [*fit.effects, effect]
                      for fit in generation for name, effect in single.items()
                      if name not in fit.names}
            begun = self._in_parallel(_begun, self._coarse, [
                effects for effects in larger.values() if not _replaced(effects)])
            # What every loaded muscle has, and one effect more, may well begin worse than it ends.
            chosen = self._best(begun, 2 * GROWN)
            chosen += [fit for fit in begun if fit not in chosen and _but_one_universal(fit)]
            fitted = self._in_parallel(_fitted, self._coarse, [fit.effects for fit in chosen])
            generation = self._best(fitted, GROWN)
            errors.update((frozenset(fit.names), self._fitted_error(fit)) for fit in fitted)
            # On the coarse grid a loop's width hides what an effect of the load does.
            found += [fit for fit in fitted if _but_one_universal(fit)
                      or fit in generation and all_help(fit, errors)]
        return found + self._with_universal(found, single)

    def _with_universal(self, found: Sequence[Fit], single: Mapping[str, Effect]) -> list[Fit]:
        """
        Return what every loaded muscle has with two effects that only some have, fitted.

        Both may show only together, and what a load does only with both. Sought where two explain
        more of the rows fitted than one does with whatever a load does.
        """
        order = sorted(found, key=self._fitted_error)
        two = [fit for fit in order if len(fit.effects) == not_universal(fit) == 2]
        if not two or not_universal(order[0]) < 2:
            return []
        known = {frozenset(fit.names) for fit in found}
        universal = [effect for effect in single.values() if effect.universal]
        sets = [[*two[0].effects, *some] for count in range(1, self._most - 1)
                for some in itertools.combinations(universal, count)]
        begun = self._in_parallel(_begun, self._coarse, [
            effects for effects in sets
            if frozenset(effect.id for effect in effects) not in known and not _replaced(effects)])
        fitted = self._in_parallel(_fitted, self._coarse, [fit.effects for fit in begun])
        return [fit for size in range(3, self._most + 1) for fit in self._best(
            [fit for fit in fitted if len(fit.effects) == size], GROWN)]

    def _best(self, fits: Sequence[Fit], count: int) -> list[Fit]:
        """Return those with the least errors of fitted rows, and those of universal effects."""
        order = sorted(fits, key=self._fitted_error)
        return order[:count] + [fit for fit in order[count:]
                                if all(effect.universal for effect in fit.effects)]

    def _fitted_error(self, fit: Fit) -> float:
        return self._coarse.error(fit.predicted)

    def _begun_where_larger_ended(self, fits: Sequence[Fit]) -> list[Fit]:
        """
        Return fits, again from the values that a larger set has found if that had less error.

        What the larger set adds may do nothing but lead out of a local minimum.
        """
        found = {frozenset(fit.names): fit for fit in fits}
        errors = {names: self.fitter.error(fit.predicted) for names, fit in found.items()}
        starts = []
        for names in found:
            larger = [other for other in found if names < other
                      and errors[other] < (1.0 - WORTH_JUDGING) * errors[names]]
            if larger:
                ended = found[min(larger, key=lambda one: errors[one])]
                starts.append(([[effect for effect in ended.effects if effect.id in names]],
                               (1.0 + WORTH_JUDGING) * errors[names]))
        for fit in self._in_parallel(_fitted_below, self.fitter, starts):
            names = frozenset(fit.names)
            if self.fitter.error(fit.predicted) < errors[names]:
                found[names] = fit
        return list(found.values())

    def _begun_at_other_shifts(self, fits: Sequence[Fit]) -> list[Fit]:
        """
        Return fits, again from other shifts by the load where that gives so much less error.

        See `restarts`.
        """
        found = {fit.names: fit for fit in fits}
        errors = {fit.names: self.fitter.error(fit.predicted) for fit in fits}
        for fit in self._in_parallel(_fitted_below, self.fitter, [
                (starts, (1.0 + WORTH_JUDGING) * errors[one.names])
                for one in fits for starts in [at_other_shifts(one.effects)] if starts]):
            error = self.fitter.error(fit.predicted)
            if error < (1.0 - self._practical) * errors[fit.names] and not fit.implausible():
                found[fit.names] = fit
        return list(found.values())

    def _in_other_forms(self, fits: Sequence[Fit]) -> list[Fit]:
        """
        Return fits in the other forms that their effects can have.

        Of each size the best one, and what every loaded muscle has: in the simplest form it may be
        behind what only stands for the form that it has.
        """
        chosen: dict[int, Fit] = {}
        order = sorted(fits, key=lambda one: self.fitter.error(one.predicted))
        for fit in order:
            if other_forms(fit.effects):
                chosen.setdefault(len(fit.effects), fit)
        some = [*chosen.values(), *(fit for fit in order if len(fit.effects) > 1
                                    and not not_universal(fit)
                                    and fit is not chosen.get(len(fit.effects)))]
        return self._in_parallel(_fitted, self.fitter, [
            [usual([effect], self.fitter.problem.kind)[0].with_values(**forms[effect.id])
             if effect.id in forms else effect for effect in fit.effects]
            for fit in some for forms in other_forms(fit.effects)])

    def _in_simplest_forms(self, fits: Sequence[Fit]) -> list[Fit]:
        """
        Return fits of several effects in the simplest forms of their equations.

        A form that fitted rows prefer by little may predict loads that are left out far worse.
        """
        sets = []
        for fit in fits:
            forms = simplest_forms(fit.effects)
            if forms and len(fit.effects) > 1:
                sets.append([effect.with_values(**forms.get(effect.id, {}))
                             for effect in fit.effects])
        return self._in_parallel(_fitted, self.fitter, sets)

    def _together(self) -> list[Fit]:
        """
        Return fits of all that a loaded muscle has, and of parts of it from where that ended.

        Of each kind of shift, in proportion to the load or to the strain, the form of the growth
        that predicts loads left out best: rows fitted prefer another one; see `whole_sets`.
        """
        problem = self.fitter.problem
        begun = self._in_parallel(_begun_at_best, self.fitter, starts_together(
            problem.model.surroundings, self._names))
        best: dict[bool, Fit] = {}
        for fit in sorted(self.cross_validated(begun),
                          key=lambda fit: problem.typical_error(fit.held_out)):
            best.setdefault(any(effect.follows_strain for effect in fit.effects), fit)
        return self._in_parallel(_fitted, self.fitter, [
            effects for whole in best.values() for effects in subsets(whole.effects)])

    def _in_parallel(self, task: Callable[[BenchFitter, Any], Fit | None], fitter: BenchFitter,
                     items: Sequence) -> list[Fit]:
        results: Iterable[Fit | None]
        if must_be_sent(self._jobs):
            results = self._progress(
                in_parallel([delayed(task)(fitter, item) for item in items], self._jobs),
                len(items))
        else:
            bar = iter(self._progress(range(len(items)), len(items)))
            next(bar, None)
            results = map_in_forks(lambda item: task(fitter.apart(), item), items, self._jobs,
                                   lambda: next(bar, None))
        return [fit for fit in results if fit is not None]


def all_help(fit: Fit, errors: Mapping[frozenset[str], float]) -> bool:
    """
    Whether no effect can be left out of a set at no cost.

    Of what every loaded muscle has only held-out loads can tell: the weights take up much of
    it under the loads that they are fitted to.
    """
    largest = (1.0 - WORTH_JUDGING) * np.array([
        errors.get(frozenset(fit.names) - {effect.id}, np.inf) for effect in fit.effects
        if not effect.universal])
    return bool(np.all(errors[frozenset(fit.names)] <= largest))


def says_more(fit: Fit) -> bool:
    """Whether a fit could be an answer, and none of its effects has vanished."""
    return not fit.implausible() and not any(map(_vanished, fit.effects))


def not_universal(fit: Fit) -> int:
    """Count the effects of a fit that not every loaded muscle has."""
    return sum(not effect.universal for effect in fit.effects)


def _but_one_universal(fit: Fit) -> bool:
    """Whether every loaded muscle has all but one of the effects of a fit."""
    return not_universal(fit) == 1


def _replaced(effects: Sequence[Effect]) -> bool:
    """Whether one of some effects replaces another one."""
    return any(other.id in effect.replaces for effect in effects for other in effects)


def _alone(fitter: BenchFitter, name: str) -> Fit | None:
    """Fit one effect."""
    problem = fitter.problem
    effect = present(problem.model, catalogue()[name], problem.settled)
    if not problem.loads_return:
        effect = effect.within_trials()
    with np.errstate(all='ignore'):
        return _finite(fitter.search([], effect))


def _begun(fitter: BenchFitter, effects: Sequence[Effect]) -> Fit | None:
    """Begin to fit effects, the last of them new, from usual values or those that each had."""
    kind = fitter.problem.kind
    return _begun_at_best(fitter, [
        usual(effects, kind), effects, [*effects[:-1], *usual(effects[-1:], kind)]])


def _begun_at_best(fitter: BenchFitter, starts: Sequence[Sequence[Effect]]) -> Fit | None:
    """Begin to fit effects from the best of several starts."""
    with np.errstate(all='ignore'):
        return _finite(fitter.begin(starts))


def _fitted(fitter: BenchFitter, effects: Sequence[Effect]) -> Fit | None:
    """Fit some effects from their present values."""
    with np.errstate(all='ignore'):
        return _finite(fitter.fit(effects))


def _fitted_below(fitter: BenchFitter, begun: tuple[Sequence[Sequence[Effect]], float]
                  ) -> Fit | None:
    """Fit some effects from the best of several starts, unless the error stays above another."""
    starts, error = begun
    with np.errstate(all='ignore'):
        fit = fitter.fit_below(starts, error)
        return None if fit is None else _finite(fit)


def _refitted(fitter: BenchFitter, effects: Sequence[Effect]) -> Fit | None:
    """Fit some effects from their present values, and those that have vanished from usual ones."""
    kind = fitter.problem.kind
    return _fitted(fitter, [usual([effect], kind)[0] if _vanished(effect) else effect
                            for effect in effects])


def _judged(fitter: BenchFitter, fit: Fit) -> Fit | None:
    """Cross-validate a fit."""
    with np.errstate(all='ignore'):
        fit = fitter.cross_validate(fit)
        return fit if np.all(np.isfinite(fit.held_out)) else None


def _vanished(effect: Effect) -> bool:
    """Whether the size of an effect has come out neutral, from where no fit begins."""
    size = effect.size_parameter
    return effect.values[size.name] == size.neutral


def _finite(fit: Fit) -> Fit | None:
    return fit if np.all(np.isfinite(fit.predicted)) else None
