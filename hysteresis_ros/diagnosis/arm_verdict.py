# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The verdict on runs of an arm, from the posterior probabilities of the sets of effects.

A set with a larger residual than the base model's own error could be does not explain the
recording: something unknown acts as well, whose probability beforehand is that of any effect, and
the set's probability is that of an unknown cause. So is the probability of something that happened
once. Sets that cannot be told apart are one answer.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis import events, significance, verdict
from hysteresis_ros.diagnosis.fitted_sets import rms
from hysteresis_ros.diagnosis.not_on_bench import not_on_bench
from hysteresis_ros.diagnosis.observable import present
from hysteresis_ros.diagnosis.residual import unexplained_signal
from hysteresis_ros.diagnosis.selection import Selection
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.effects.formation_memory import FormationMemory
from hysteresis_ros.effects.kinetics import Kinetics

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.workers import Progress

# A drive that moves over less than this share of its range excites nothing.
LEAST_DRIVE = 0.05
# An effect that changes less than this share of the largest error of its own is not excited.
LEAST_CHANGE = 0.3
# More than this share of the effects not excited: nothing is.
MOST_UNOBSERVABLE = 0.8
# An implausible set whose residual is less than this share of the best one's resembles it.
RESEMBLES = 0.6


def arm_verdict(problem: ArmProblem, settings: Settings, rng: np.random.Generator,
                progress: Progress) -> verdict.Diagnosis:
    """
    Diagnose runs of an arm.

    Parameters
    ----------
    problem : ArmProblem
    settings : Settings
    rng : numpy.random.Generator
    progress : callable
        ``progress(items, total)``, for a progress bar.

    Returns
    -------
    Diagnosis
    """
    selection = Selection(problem, settings, rng, progress)
    selection.run()
    return _Verdict(selection).sum_up()


class _Verdict:
    """What follows from a selection."""

    def __init__(self, selection: Selection) -> None:
        self.selection, self.sets = selection, selection.sets
        self.problem, self.fitter = selection.problem, selection.fitter
        self.settings = selection.settings

    def sum_up(self) -> verdict.Diagnosis:
        """Judge the residual, and put all together."""
        selection, problem = self.selection, self.problem
        valid = self.sets.valid()
        event, event_log = events.most_probable(problem, selection)
        shares = self._probabilities(valid, event_log)
        unknown = shares.pop('unknown') > 0.5
        chosen = frozenset() if unknown else self._most_probable(shares)
        best = valid[0] if valid else frozenset()
        unobservable = {**selection.unobservable, **self._too_weak()}
        resembles = self._resembles(best) if unknown else []
        explains_most = self._explains_most(best) if unknown and not resembles else []
        kind = 'unknown' if unknown else self._known(chosen, unobservable)
        alternatives = self._alternatives(chosen, valid)
        fits = self.fitter.cross_validate([self.sets.base, self.sets.fits[chosen]])
        before, after = (self.fitter.error(fit.held_out) for fit in fits)
        effects = self._in_order(self.fitter.with_intervals(self.sets.fits[chosen]))
        missing = [effect.id for effect in effects]
        besides = {} if unknown else not_on_bench(selection, self.sets.fits[chosen])
        to_add = missing or resembles or explains_most or list(besides)
        happened = event if unknown and event_log > self._log_mass(valid) else None
        return verdict.Diagnosis(
            verdict=kind, missing=missing,
            alternatives=[alternatives[name] for name in missing],
            ranking=self._ranking(missing, before), sets=self._sets(shares),
            noise_floor=self.sets.fits[chosen].noise,
            structural_error=selection.covariance.discrepancy.size,
            bench_error=selection.covariance.discrepancy.size_besides_courses,
            unexplained=self._unexplained(chosen),
            experiment=verdict.next_experiment(
                kind, to_add, [alternatives[name] for name in missing], unobservable),
            effects=effects, rmse_before=before, rmse_after=after, not_excited=unobservable,
            event=happened, single_row=self._single_row(best) if unknown else None,
            resembles=resembles, explains_most=explains_most,
            uneven=unknown and self.sets.uneven(chosen),
            signal=unexplained_signal(problem, problem.measured - self.sets.fits[
                chosen].predicted) if unknown else '',
            kept_strain=besides.get(FormationMemory.id), kinetics=besides.get(Kinetics.id))

    def _single_row(self, best: frozenset[str]) -> float | None:
        """
        Return the time [s] of the row that has more than half of a residual's square.

        Of the base model's residual, or of that of the best set.
        """
        for names in (frozenset(), best):
            squares = (self.problem.measured - self.sets.fits[names].predicted) ** 2
            row = int(np.argmax(squares))
            if 2.0 * squares[row] > np.sum(squares):
                return float(self.problem.clock[row])
        return None

    def _in_order(self, effects: Iterable[Effect]) -> list[Effect]:
        """Return effects, that first which explains most by itself."""
        def alone(effect: Effect) -> float:
            return self.sets.error(frozenset([effect.id]))
        return sorted(effects, key=alone)

    def _log_mass(self, valid: Iterable[frozenset[str]]) -> float:
        return max((self.sets.log_posterior(names) for names in valid), default=-np.inf)

    def _most_probable(self, shares: Mapping[frozenset[str], float]) -> frozenset[str]:
        """Return the most probable set of those that are most probable together."""
        twins = {names: [other for other in shares if self._twins(names, other)]
                 for names in shares}
        best = max(shares, key=lambda names: sum(shares[other] for other in twins[names]))
        return max(twins[best], key=shares.__getitem__)

    def _twins(self, names: frozenset[str], other: frozenset[str]) -> bool:
        """Whether sets of as many effects differ by less than matters of what they explain."""
        if len(names) != len(other):
            return False
        own, its = (self.sets.fits[one].predicted for one in (names, other))
        return rms(own - its) <= self.settings.practical * rms(own - self.sets.base.predicted)

    def _probabilities(self, valid: Sequence[frozenset[str]], event_log: float
                       ) -> dict[Any, float]:
        """Return the posterior probability of each set, and of 'unknown'."""
        # What does not suffice needs one cause more, as improbable as any other effect. Drift and
        # discrepancy stand for that cause, and are no evidence against a set that does suffice.
        further = math.log(self.settings.prior / (1.0 - self.settings.prior))
        logs = {names: self.sets.log_posterior(names) for names in valid}
        most = max((logs[names] for names in valid if self.sets.sufficient(names)),
                   default=np.inf)
        weights = {names: (value if self.sets.sufficient(names)
                           else min(value, most) + further)
                   for names, value in logs.items()}
        top = max([event_log, *weights.values()])
        mass = {names: math.exp(value - top) for names, value in weights.items()}
        unknown = math.exp(event_log - top)
        known = {}
        for names, value in mass.items():
            if self.sets.sufficient(names):
                known[names] = value
            else:
                unknown += value
        total = unknown + sum(known.values())
        return {**{names: value / total for names, value in known.items()},
                'unknown': unknown / total}

    def _sets(self, shares: dict[frozenset[str], float]) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = [
            {'effects': sorted(names), 'probability': float(share),
             'rmse': self.sets.error(names)}
            for names, share in shares.items() if share >= 1e-3]
        rest = 1.0 - sum(row['probability'] for row in rows)
        rows.append({'effects': ['unknown'], 'probability': float(max(rest, 0.0)),
                     'rmse': self.sets.error(frozenset())})
        return sorted(rows, key=lambda row: -row['probability'])

    def _known(self, chosen: frozenset[str], unobservable: Collection[str]) -> str:
        if chosen:
            return 'missing'
        names = {*self.selection.names, *self.selection.unobservable}
        count = len(names.intersection(unobservable))
        drive = self.problem.signals.get('drive', np.zeros(1))
        still = np.ptp(drive) < LEAST_DRIVE * self.problem.model.drive_range
        if still or count > MOST_UNOBSERVABLE * max(len(names), 1):
            return 'not_excited'
        return 'adequate'

    def _unexplained(self, chosen: frozenset[str]) -> float:
        """Share of the first mean square that neither set nor base model nor noise explains."""
        beyond = (self.sets.own_error(chosen) ** 2 - self.sets.white_noise(chosen) ** 2
                  - self.sets.largest_rmse ** 2)
        first = self.sets.own_error(frozenset()) ** 2
        return float(np.clip(beyond / max(first, 1e-300), 0.0, 1.0))

    def _alternatives(self, chosen: frozenset[str], valid: Sequence[frozenset[str]]
                      ) -> dict[str, list[str]]:
        """For each effect of the answer, name those that could as well be in its place."""
        found: dict[str, list[str]] = {name: [] for name in chosen}
        if not chosen:
            return found
        best = self.sets.log_posterior(chosen)
        least = best + math.log(self.settings.reported)
        for names in valid:
            if (names == chosen or len(names) != len(chosen)
                    or self.sets.log_posterior(names) < least
                    or not self.sets.sufficient(names)):
                continue
            places, new = sorted(chosen - names), sorted(names - chosen)
            for place, other in zip(places, new):
                if all(other not in named for named in found.values()):
                    found[place].append(other)
        return found

    def _resembles(self, best: frozenset[str]) -> list[str]:
        """Name the effects of an implausible set that explains far more than the best one."""
        sets = [names for names, fit in self.sets.fits.items()
                if names and len(names) <= max(len(best), 1) and fit.implausible()]
        names = min(sets, key=self.sets.error, default=None)
        if names is None or self.sets.error(names) > RESEMBLES * self.sets.error(best):
            return []
        return sorted(names)

    def _explains_most(self, best: frozenset[str]) -> list[str]:
        """Name the effects of a set that takes most of the mean square error off."""
        if not self.sets.own_error(best) ** 2 < 0.5 * self.sets.own_error(frozenset()) ** 2:
            return []
        return [effect.id for effect in self._in_order(self.sets.fits[best].effects)]

    def _too_weak(self) -> dict[str, str]:
        """Effects that neither at the upper end of their range nor at a start stand out here."""
        weak = self._weak(self.selection.names, self._strongest)
        # Some show at other values than the largest: what creeps fast, or yields under little load.
        weak = self._weak(weak, self._started)
        return {name: 'even a strong one would change less than the noise' for name in weak}

    def _weak(self, names: Sequence[str], values: Callable[[Effect], list[Effect]]) -> list[str]:
        """Return which of some effects would not stand out at any of their values."""
        tried = {name: values(present(self.problem.model, catalogue()[name], self.problem.settled))
                 for name in names}
        changes = self.fitter.simulate(
            [[one] for some in tried.values() for one in some]) - self.sets.base.predicted
        sizes = iter(np.sqrt(np.mean(changes ** 2, axis=1)))
        # What cannot be simulated may show.
        shows = {name: any(not size < LEAST_CHANGE * self.sets.largest_rmse
                           for size in [next(sizes) for _ in some])
                 for name, some in tried.items()}
        return [name for name in names if not shows[name]]

    def _strongest(self, effect: Effect) -> list[Effect]:
        """Return an effect with all parameters at the upper ends of their ranges."""
        ends = {parameter.name: parameter.choices[-1] if parameter.choices else parameter.high
                for parameter in effect.parameters if self.problem.kind in parameter.kinds}
        return [effect.with_values(**{**ends, **_simplest(effect)})]

    def _started(self, effect: Effect) -> list[Effect]:
        """Return an effect where a fit may start, as it is and with the largest first parameter."""
        first, simplest = effect.parameters[0], _simplest(effect)
        starts = [start for start in self.selection.starts_of(effect, self.sets.base)
                  if simplest.items() <= start.values.items()]
        return [*starts, *(start.with_values(**{first.name: first.high}) for start in starts)]

    def _ranking(self, missing: Sequence[str], before: float) -> list[dict[str, Any]]:
        selection, problem = self.selection, self.problem
        alone = [fit for names, fit in self.sets.fits.items() if len(names) == 1]
        if not alone:
            return []
        rows = []
        for fit in self.fitter.cross_validate(alone):
            effect = self.fitter.with_intervals(fit)[0]
            gain = significance.gain_interval(
                problem.measured - self.sets.base.predicted, problem.measured - fit.held_out,
                problem.block, selection.rng)
            rows.append(verdict.ranking_row(
                effect, fit, before, self.fitter.error(fit.held_out),
                self.sets.p_values.get(effect.id, 1.0), gain))
        verdict.add_signatures(
            rows, np.stack([fit.predicted - self.sets.base.predicted for fit in alone]),
            problem.weight_columns(selection.fixed))
        return verdict.in_order(rows, missing)


def _simplest(effect: Effect) -> dict[str, float]:
    """
    Return by name the neutral values of parameters that may be chosen neutral.

    What could not have shown is said of these: other forms, as a play that is zeroed in its middle,
    move an arm at rest, which does not show the effect.
    """
    return {parameter.name: parameter.neutral for parameter in effect.parameters
            if parameter.neutral in parameter.choices}
