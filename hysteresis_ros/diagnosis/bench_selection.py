# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Select the set of effects that explains bench tables, by rows that were held out.

`bench_search` finds the sets that are compared here. A bench table is where H2's weights come
from, so that every set gets weights of its own. These are not negative, which no Gaussian evidence
knows; what a set predicts of trials that neither it nor its weights have seen takes the evidence's
place.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_search import (
    all_help, BenchSearch, not_universal, says_more)
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.diagnosis.significance import SIGNIFICANCE
from hysteresis_ros.effects import catalogue, Effect

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.workers import Progress

# Share of the gains and losses in all blocks that has to be gains.
CONSISTENT = 0.55
# Share of the loads on which an effect has to be named again, at least, with that load left out.
NAMED_AGAIN = 0.5


class BenchSelection:
    """
    What explains bench tables, as far as the catalogue goes.

    Parameters
    ----------
    problem : BenchProblem
        Sets are found on it, and judged on the same rows with H2 on a finer grid.
    settings : Settings
    rng : numpy.random.Generator
    jobs : int
        Processes.
    progress : callable

    Attributes
    ----------
    problem : BenchProblem
        On which sets are judged.
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
    unstable : dict of str to str
        Effects that explain something, but not on most loads or with no certain value, with that
        reason.
    """

    def __init__(self, problem: BenchProblem, settings: Settings, rng: np.random.Generator,
                 jobs: int, progress: Progress) -> None:
        self.problem, self.settings = problem.finer(), settings
        self.fitter, self.rng = BenchFitter(self.problem), rng
        self.base = self.found = self.fitter.cross_validate(self.fitter.fit([]))
        self.names, self.unobservable = observable(problem)
        self._search = BenchSearch(problem, self.fitter, self.names, settings, jobs, progress)
        self.unstable: dict[str, str] = {}
        self.alone: list[Fit] = []
        self.sets: list[Fit] = []
        self.tried: list[Fit] = []
        self.p_values: dict[tuple[str, ...], float] = {}
        # Each with its fit, which keeps the place that it is known by.
        self._counts: dict[int, tuple[Fit, int]] = {}
        self._known_notes: dict[int, tuple[Fit, dict[str, str]]] = {}

    def run(self) -> None:
        """Fit every effect by itself, grow sets from the best, and compare what they predict."""
        self.tried = self._judge(*self._search.run())
        self.alone = sorted((fit for fit in self.tried if len(fit.effects) == 1), key=self.error)
        values = self._significance(self.tried, self.base)
        self.p_values = {fit.names: float(value) for fit, value in zip(self.tried, values)}
        self.sets = [fit for fit, value in zip(self.tried, values)
                     if not fit.implausible() and self._helps(fit)
                     and (value <= SIGNIFICANCE or self._log_odds(fit, self.base) > 0.0)]
        if not self.sets:
            return
        self._choose()
        while (self._leave_out_chance() or self._take_fewer() or self._leave_out_unstable()
               or self._leave_out_undetermined() or self._take_simpler()):
            pass

    def _choose(self) -> None:
        """
        Take the most probable set of those whose sizes the rows determine, if there are any.

        Two effects that stand for each other are vague together; alone each competes.
        """
        self.found = self._most_probable(self.sets)
        determined = [fit for fit in self.sets if self._determines(fit)]
        if determined:
            vague, self.found = self._notes(self.found), self._most_probable(determined)
            self.unstable.update({name: _cannot_be_determined(name, note)
                                  for name, note in vague.items() if name not in self.found.names})

    def _most_probable(self, fits: Sequence[Fit]) -> Fit:
        """
        Return the most probable fit of those that predict loads held out alike, by rows fitted.

        Or one with as many effects that only some muscles have, if it is more probable by rows
        held out and by rows fitted together, and not sure to predict the former worse. Which form
        an equation has, and what every loaded muscle has besides, needs no difference that matters.
        """
        best = min(fits, key=self.typical_error)
        alike = max((fit for fit in fits if self._alike(fit, best)),
                    key=lambda fit: self._fitted_log_odds(fit, self.base))
        rivals = [fit for fit in fits if not_universal(fit) == not_universal(alike)
                  and self._as_good(fit, best)]
        return max([alike, *rivals], key=lambda fit: self._all_log_odds(fit, alike))

    def _alike(self, fit: Fit, best: Fit) -> bool:
        """
        Whether a fit predicts loads held out no worse than the best one does.

        By less than matters; or most loads better, and all by less than the standard error over
        them: one that the others are extrapolated to may outweigh all others.
        """
        practical = self.settings.practical
        squares = (self.problem.squares(one.held_out) + self.problem.small_error ** 2
                   for one in (fit, best))
        ratios = 0.5 * np.log(np.divide(*squares))
        mean = float(np.mean(ratios))
        if mean <= math.log1p(practical):
            return True
        most = np.mean(ratios < math.log1p(-practical)) > 0.5
        return bool(most and mean <= np.std(ratios, ddof=1) / math.sqrt(len(ratios)))

    def _judge(self, fits: Sequence[Fit], variants: Sequence[Fit]) -> list[Fit]:
        """
        Return fits that could be an answer, and single effects, with their held-out rows.

        Those with another form of an equation only where held-out rows ask for it; of what every
        loaded muscle has, where these and the rows fitted together do.
        """
        errors = {frozenset(fit.names): self.fitter.error(fit.predicted) for fit in fits}
        found = {fit.names: fit for fit in self._search.cross_validated([
            fit for fit in fits if len(fit.effects) == 1
            or all_help(fit, errors) and says_more(fit)])}
        for fit in self._search.cross_validated([
                fit for fit in variants if says_more(fit) and self._determines(fit)]):
            simpler = found.get(fit.names)
            if simpler is None or simpler.implausible() or self._better_form(fit, simpler):
                found[fit.names] = fit
        return list(found.values())

    def _better_form(self, fit: Fit, simpler: Fit) -> bool:
        """Whether rows ask for other forms of the same effects; see `_judge`."""
        if self.typical_error(fit) < (1.0 - self.settings.practical) * self.typical_error(simpler):
            return True
        return bool(not not_universal(fit) and self._as_good(fit, simpler)
                    and self._all_log_odds(fit, simpler) > 0.0)

    def _leave_out_chance(self) -> bool:
        """
        Leave out an effect that, given the others of the set, may well be none.

        It explains no more than chance: it was the best of all that could have been added to the
        others, which are tested together. Or the others alone are more probable, by rows held out
        and by those fitted.
        What every loaded muscle has needs no such proof.
        """
        doubts: dict[str, tuple[float, str, Fit]] = {}
        for effect in self.found.effects:
            others = frozenset(self.found.names) - {effect.id}
            smaller = next((fit for fit in [self.base, *self.tried]
                            if frozenset(fit.names) == others), None)
            # Without what takes the first stage's place the rest may not have been tried.
            if effect.universal or smaller is None:
                continue
            added = [self.found, *(fit for fit in self.tried if fit is not self.found and (
                len(fit.names) == len(self.found.names) and others < frozenset(fit.names)))]
            value = float(self._significance(added, smaller)[0])
            absent = 1.0 / (1.0 + math.exp(min(self._log_odds(self.found, smaller), 700.0)))
            if value > SIGNIFICANCE:
                doubts[effect.id] = (
                    1.0 + value, f'it explains no more than chance (p = {value:.2f})', smaller)
            elif absent > 0.5 and self._fitted_log_odds(self.found, smaller) < 0.0:
                doubts[effect.id] = (
                    absent, f'it acts with a probability of {1.0 - absent:.2f}', smaller)
        if not doubts:
            return False
        name = max(doubts, key=lambda one: doubts[one][0])
        _, reason, smaller = doubts[name]
        self._leave_out(name, f'given the others {reason}', smaller)
        return True

    def _take_fewer(self) -> bool:
        """
        Take a set with fewer effects that only some muscles have, if it is more probable.

        That is by the rows fitted, and by these and the rows held out together, and it is not sure
        to predict these worse: of a few loads one may be predicted better by chance.
        """
        fewer = []
        for fit in self.sets:
            if (not_universal(fit) < not_universal(self.found) and self._determines(fit)
                    and not set(self.unstable).intersection(fit.names)
                    and self._as_good(fit, self.found)):
                fitted = self._fitted_log_odds(fit, self.found)
                together = self._all_log_odds(fit, self.found)
                if min(fitted, together) > 0.0:
                    fewer.append((together, fit))
        if not fewer:
            return False
        together, chosen = max(fewer, key=lambda one: one[0])
        # Both odds are of the same question.
        acts = 1.0 / (1.0 + math.exp(min(0.5 * together, 700.0)))
        for effect in self.found.effects:
            if effect.id not in chosen.names and not effect.universal:
                self._leave_out(effect.id, 'against fewer effects it acts with a probability of '
                                f'{acts:.2f}', chosen)
        return True

    def _leave_out_unstable(self) -> bool:
        """
        Leave out the effect that is named again on the fewest loads, if that is on less than half.

        With a load left out, an effect is named again if the best set with it predicts that load
        better than the best set without it, where both were fitted to the other loads. On half of
        them is enough: then the sizes of the errors decide, by which the set was chosen.
        """
        if not self.found.effects:
            return False
        without = {name: self._best_without(name) for name in self.found.names}
        share = {name: self._named_again(other) for name, other in without.items()}
        name = min(share, key=lambda one: share[one])
        if share[name] >= NAMED_AGAIN:
            return False
        self._leave_out(name, f'with one load left out it is named again on '
                        f'{100.0 * share[name]:.0f} % of them', without[name])
        return True

    def _leave_out_undetermined(self) -> bool:
        """Leave out the effect whose size the rows do not determine and that is missed least."""
        notes = self._notes(self.found)
        if not notes:
            return False
        without = {name: self._best_without(name) for name in notes}
        name = min(without, key=lambda one: self.typical_error(without[one]))
        self._leave_out(name, notes[name], without[name])
        return True

    def _take_simpler(self) -> bool:
        """Take a simpler effect for one that may as well be that, if it predicts loads as well."""
        for name in {effect.limit for effect in self.found.effects if effect.limit}:
            if name in (*self.found.names, *self.unstable):
                continue
            for effect in self._in_limit(self.found, name):
                simpler = self._with_instead(effect.id, name)
                if (not simpler.implausible() and name not in self._notes(simpler)
                        and self._as_good(simpler, self.found)):
                    self._leave_out(effect.id, f'it may as well be {name}', simpler)
                    return True
        return False

    def _as_good(self, fit: Fit, other: Fit) -> bool:
        """Whether a fit may predict rows held out as well as another one."""
        return self.problem.predicts_as_well(
            fit.held_out, other.held_out, self.settings.practical)

    def _with_instead(self, name: str, other: str) -> Fit:
        """Return the set found with another effect in the place of one of its own."""
        wanted = {other, *self.found.names} - {name}
        known = next((fit for fit in self.tried if set(fit.names) == wanted), None)
        if known is not None:
            return known
        kept = [effect for effect in self.found.effects if effect.id != name]
        new = usual([catalogue()[other](self.problem.model.surroundings)], self.problem.kind)
        fit = self.fitter.cross_validate(self.fitter.fit([*kept, *new]))
        self.tried.append(fit)
        self.sets.append(fit)
        self.p_values[fit.names] = float(self._significance([fit], self.base)[0])
        return fit

    def _notes(self, fit: Fit) -> dict[str, str]:
        """Return why the rows do not determine the size of an effect, of those of a fit."""
        if id(fit) not in self._known_notes:
            notes = {effect.id: not_determined(effect, self.problem.kind)
                     for effect in self.fitter.with_intervals(fit)}
            self._known_notes[id(fit)] = fit, {name: note for name, note in notes.items() if note}
        return self._known_notes[id(fit)][1]

    def _determines(self, fit: Fit) -> bool:
        """Whether the rows determine the size of each effect of a fit."""
        return not self._notes(fit)

    def _leave_out(self, name: str, reason: str, instead: Fit) -> None:
        self.unstable[name] = _cannot_be_determined(name, reason)
        self.found = instead

    def _best_without(self, name: str) -> Fit:
        """
        Return the best set that lacks an effect, and those that were left out before.

        It could be an answer itself: the rows determine all of its effects. Else of two effects
        that stand for each other neither would be left. And it has no more effects that only some
        muscles have, which are no reason to leave out what every loaded one has.
        """
        without = [fit for fit in self.sets
                   if not {name, *self.unstable}.intersection(fit.names)
                   and not_universal(fit) <= not_universal(self.found)]
        return next((fit for fit in sorted(without, key=self.typical_error)
                     if self.typical_error(fit) < self.typical_error(self.base)
                     and self._determines(fit) and not self._in_limit(fit, name)), self.base)

    def _in_limit(self, fit: Fit, name: str) -> list[Effect]:
        """Return the effects of a fit that may as well be another one, which is simpler."""
        if all(effect.limit != name for effect in fit.effects):
            return []
        return [effect for effect in self.fitter.with_intervals(fit)
                if effect.limit == name and effect.in_limit()]

    def _named_again(self, other: Fit) -> float:
        """Return the share of folds that the set found predicts no worse than another one."""
        own, others = (np.sqrt(self.problem.squares(fit.held_out) + self.problem.small_error ** 2)
                       for fit in (self.found, other))
        return float(np.mean(own <= (1.0 + self.settings.practical) * others))

    def error(self, fit: Fit) -> float:
        """Return the held-out RMSE of a fit, in the unit of the response."""
        return self.fitter.error(fit.held_out)

    def typical_error(self, fit: Fit, least: float | None = None) -> float:
        """
        Return the geometric mean over the folds of the RMSE held out there, which sets go by.

        Else the least load, for which the others are extrapolated, would decide alone. Differences
        below `least` count as none; by default below what matters.
        """
        return self.problem.typical_error(fit.held_out, least)

    def typical_rmse(self, fit: Fit) -> float:
        """
        Return the typical error as a reader expects it: without what was added to each fold.

        It is less for one set than for another exactly where `typical_error` is.
        """
        return float(significance.typical_rmse(
            self.problem.squares(fit.held_out), self.problem.small_error))

    def gain_interval(self, fit: Fit, base: Fit) -> tuple[float, float]:
        """Return the 95 % interval of the share by which a fit lowers a base's typical RMSE."""
        problem = self.problem
        before, after = (problem.measured - one.held_out for one in (base, fit))
        return significance.typical_gain_interval(
            before, after, problem.block, problem.fold, problem.small_error, self.rng)

    def _log_odds(self, fit: Fit, base: Fit) -> float:
        """Return the log posterior odds of a fit against another one; see `probabilities`."""
        count = len(np.unique(self.problem.block))
        before, after = (self.typical_error(one, self.problem.noise) for one in (base, fit))
        return self._prior_log_odds(fit, base) + count * math.log(before / after)

    def _fitted_log_odds(self, fit: Fit, base: Fit) -> float:
        """
        Return the log posterior odds of a fit against another one by the rows that both fit.

        By Schwarz's criterion, with as many independent rows as there are blocks.
        """
        count = len(np.unique(self.problem.block))
        before, after = (self.problem.typical_error(one.predicted, self.problem.noise)
                         for one in (base, fit))
        return self._prior_log_odds(fit, base) + significance.schwarz_log_odds(
            before, after, count, self._parameters(fit) - self._parameters(base))

    def _all_log_odds(self, fit: Fit, base: Fit) -> float:
        """Return the sum of the log odds by rows held out and by rows fitted, of one question."""
        return self._log_odds(fit, base) + self._fitted_log_odds(fit, base)

    def _prior_log_odds(self, fit: Fit, base: Fit) -> float:
        """
        Return the log odds of a fit's effects against those of another one, before any data.

        What every loaded muscle has is not improbable, or a rare effect would stand for two of it.
        """
        one = math.log(self.settings.prior / (1.0 - self.settings.prior))
        return one * (not_universal(fit) - not_universal(base))

    def _parameters(self, fit: Fit) -> int:
        """Return how many parameters of a fit the response depends on."""
        if id(fit) not in self._counts:
            self._counts[id(fit)] = fit, self.fitter.parameters_in_use(fit)
        return self._counts[id(fit)][1]

    def _gains(self, fit: Fit, base: Fit) -> np.ndarray:
        """
        Return the reduction of a base's squared error in each block, over the error there.

        Of fitted rows: a load that is held out has its errors in few places, so that blocks say
        little of chance. The shares are from -1 to 1, or the worst block would decide alone; and
        errors too small to matter, as where the muscle is at one of its ends, count as none.
        """
        before, after = (significance.block_sums(
            (self.problem.measured - one.predicted) ** 2, self.problem.block)
            for one in (base, fit))
        return (before - after) / (
            before + after + self.problem.small_error ** 2 * np.bincount(self.problem.block))

    def _significance(self, fits: Sequence[Fit], base: Fit) -> np.ndarray:
        """Return family-wise p values of what fits explain beyond a base."""
        if not fits:
            return np.zeros(0)
        return significance.paired_p_values(
            np.stack([self._gains(fit, base) for fit in fits]), self.rng, self.settings.draws)

    def _helps(self, fit: Fit) -> bool:
        """
        Whether a fit explains enough of held-out rows to matter, and not by chance.

        It surely predicts loads that are left out better, or helps in most blocks of the rows that
        are fitted. Weights without effects may follow each load that they are fitted to, and say
        nothing of any other.
        """
        if self.typical_error(fit) > (1.0 - self.settings.practical) * self.typical_error(
                self.base):
            return False
        gains = self._gains(fit, self.base)
        return (significance.surely_larger(
            self.problem.squares(self.base.held_out), self.problem.squares(fit.held_out),
            self.problem.small_error)
            or bool(np.sum(gains[gains > 0.0]) >= CONSISTENT * np.sum(np.abs(gains))))

    def could_be(self, rival: Fit) -> bool:
        """Whether a rival could be the truth although the set found is better."""
        largest = (1.0 + self.settings.practical) * self.typical_error(self.found)
        if self.typical_error(rival) <= largest:
            return True
        theirs, own = (self.problem.measured - fit.held_out for fit in (rival, self.found))
        low, _ = significance.gain_interval(theirs, own, self.problem.block, self.rng)
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

        As many independent rows as there are blocks, of unknown variance on each load: the
        likelihood goes with the typical error to the power of minus that number.
        """
        fits = [self.base, *self.sets]
        logs = np.array([self._log_odds(fit, self.base) for fit in fits])
        weights = np.exp(logs - logs.max())
        return list(zip(fits, (weights / weights.sum()).tolist()))


def _cannot_be_determined(name: str, reason: str) -> str:
    """Say why the size of an effect is not known, and what would show it."""
    return (f'cannot be determined here: {reason}; it would be by: '
            f'{catalogue()[name].experiment}')
