# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Find the physical effects that a model is missing, or say why none can be named.

The best effect on held-out rows is added if it explains more than chance and more than the base
model's own error could, then all others are tried again beside it, until nothing more is found.
What is left after that is compared with what the base model and the sensor leave by themselves.
"""

import dataclasses
import itertools

import numpy as np

from hysteresis_ros.diagnosis import leftover, significance, structure
from hysteresis_ros.diagnosis.candidates import (
    Candidate, consider_all, consider_sets, possible, present, subsets)
from hysteresis_ros.diagnosis.fit import Fitter, beside
from hysteresis_ros.diagnosis.problem import problem_for
from hysteresis_ros.effects import catalogue

SIGNIFICANCE = 0.05
# Smallest reduction of the RMSE that matters to a user.
PRACTICAL = 0.05
# Share of blocks in which an effect has to help.
CONSISTENT = 0.55
MOST_EFFECTS = 3
# First effects from which sets are grown.
MOST_SEEDS = 2
# Effects of which all sets are tried on the bench.
MOST_IN_SETS = 5
# Effects of which all pairs are tried on the arm.
MOST_IN_PAIRS = 5
# A pair is fitted if a straight extrapolation comes within this factor of the best mean square.
LINEAR_MARGIN = 1.5
# Effects whose signatures agree more than this cannot be told apart.
CONFUSED = 0.9
# The base model's error on the arm may be this many times that of the bench's verification.
STRUCTURE_MARGIN = 1.6
# More than this share of the first mean square left over means that the cause is not known.
UNEXPLAINED = {'arm': 0.08, 'bench': 0.3}
# A structured error on the bench below this share of the response's range is that of any model.
LEAST_STRUCTURE = 0.02
# A held-out error on the bench above this share of the range: the model predicts nothing.
LARGEST_ERROR = 0.15
# Share of the residual's mean square that one event has to explain to count as the cause.
EVENT_SHARE = 0.5
# A drive that moves over less than this share of its range excites nothing.
LEAST_DRIVE = 0.05
MOST_ALTERNATIVES = 3
# Effects that are fitted beside those found, the most promising of a straight extrapolation.
MOST_RIVALS = 8
# Rivals that are fitted again when a set of effects is checked.
RIVALS = 6


@dataclasses.dataclass
class Diagnosis:
    """
    The verdict and what it rests on; `to_json` gives the fields by the names users rely on.

    Attributes
    ----------
    verdict : str
        'adequate', 'missing', 'unknown' or 'not_excited'.
    missing : list of str
        Effects to add, in order.
    alternatives : list of list of str
        For each missing effect those that the data cannot tell from it.
    ranking : list of dict
        Every effect that was tried, best first.
    noise_floor, structural_error : float
        What sensor and base model leave by themselves, in the unit of the response.
    unexplained : float
        Share of the mean square error that nothing explains.
    experiment : str
        What to measure next.
    effects : list of Effect
        The missing ones, fitted, with intervals.
    rmse_before, rmse_after : float
        Held-out error without and with them.
    not_excited : dict of str to str
        Effects that could not have shown, with the reason.
    event : float or None
        Time [s] at which something happened that lasts.
    signal : str
        Signal in which unexplained structure shows.
    """

    verdict: str
    missing: list
    alternatives: list
    ranking: list
    noise_floor: float
    structural_error: float
    unexplained: float
    experiment: str
    effects: list
    rmse_before: float
    rmse_after: float
    not_excited: dict
    event: float | None
    signal: str

    def to_json(self) -> dict:
        """Return plain types for JSON."""
        content = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)
                   if field.name != 'effects'}
        content['effects'] = [effect.to_dict() for effect in self.effects]
        return content


def _silent(iterable, total):
    return iterable


def diagnose(model, measurements, jobs: int = 1, seed: int = 0, progress=_silent) -> Diagnosis:
    """
    Find what the model is missing.

    Parameters
    ----------
    model : MuscleModel
        With the effects it already has.
    measurements : sequence of Measurement
        Bench tables or arm runs.
    jobs : int
        Processes; -1 for all cores. Any joblib backend in force is used.
    seed : int
        Of the random draws behind the significance.
    progress : callable
        ``progress(iterable, total)`` returns the iterable, for a progress bar.

    Returns
    -------
    Diagnosis

    Raises
    ------
    MeasurementError, ParameterError
        If measurement and model do not fit together.
    """
    return _Diagnostician(problem_for(model, measurements), jobs, seed, progress).run()


def _simplest(candidates) -> list:
    """Return the one with fewest parameters of those nearly as good as the first; [] if none."""
    enough = [candidate for candidate in candidates
              if candidate.rmse <= (1.0 + PRACTICAL) * candidates[0].rmse]
    return sorted(enough, key=lambda candidate: len(candidate.fit.vector))[:1]


class _Diagnostician:
    """The procedure with its state: what was found, and the fit with it."""

    def __init__(self, problem, jobs, seed, progress):
        self.problem = problem
        self.fitter = Fitter(problem)
        self.jobs = jobs
        self.progress = progress
        self.rng = np.random.default_rng(seed)
        self.fixed = list(problem.model.effects)
        self.known: list = []
        self.current = self._refit([])
        self.base = self.current
        self.before = self.fitter.error(self.base.held_out)

    def _refit(self, known):
        fit = self.fitter.fit(self.fixed, known)
        return self.fitter.cross_validate(self.fixed, fit)

    def run(self) -> Diagnosis:
        """Search, check, and sum up."""
        problem = self.problem
        self._draw_structure()
        names, hopeless = possible(problem, [])
        first = consider_all(
            self.fitter, [], self.current, names, self.jobs, self.progress)
        self._test(first, self.current)
        # An effect that is fitted alone may need impossible values to stand in for two, so sets
        # are grown from the best plausible one and from the best of all.
        if problem.refits:
            sets = consider_sets(self.fitter, subsets(self._few(first), MOST_EFFECTS), self.jobs,
                                 self.progress)
            sets = [fit for fit in sets if not fit.implausible() and self._helps(fit)]
        else:
            sets = [self._grow(seed, first) for seed in self._seeds(first)]
            sets = [found for found in sets if found is not None]
            sets += self._pairs(first, sets)
        if sets:
            best = min(self.fitter.error(fit.held_out) for fit in sets)
            enough = [fit for fit in sets
                      if self.fitter.error(fit.held_out) <= (1.0 + PRACTICAL) * best]
            self.current = min(enough, key=lambda fit: (
                len(fit.effects), len(fit.vector), self.fitter.error(fit.held_out)))
            self.known = self.current.effects
            if not problem.refits:
                self._drop()
        return self._sum_up(first, hopeless)

    def _seeds(self, first):
        """Best significant effect that is plausible, and those that fit clearly better."""
        significant = [candidate for candidate in first
                       if self._significant(candidate, self.current)]
        plausible = [candidate for candidate in significant if not candidate.implausible]
        seeds = _simplest(plausible)
        limit = (1.0 - PRACTICAL) * plausible[0].rmse if plausible else np.inf
        better = [candidate for candidate in significant
                  if candidate.implausible and candidate.rmse < limit]
        return seeds + better[:MOST_SEEDS - len(seeds)]

    def _few(self, first):
        """
        Effects of which sets are made on the bench: those that fit best by themselves.

        They need not help by themselves: the paper's first stage already does a part of what a
        load does, so that one effect of the load alone may well make it worse.
        """
        return [candidate.effect for candidate in first][:MOST_IN_SETS]

    def _helps(self, fit) -> bool:
        """Whether a set of effects explains more than chance, of mostly one sign, and enough."""
        problem = self.problem
        if self.fitter.error(fit.held_out) > (1.0 - PRACTICAL) * self.before:
            return False
        gains = significance.block_sums(
            (problem.measured - self.base.held_out) ** 2
            - (problem.measured - fit.held_out) ** 2, problem.block)
        p_value = significance.paired_p_values(gains[None, :], self.rng)[0]
        return bool(p_value <= SIGNIFICANCE and np.mean(gains > 0.0) >= CONSISTENT)

    def _grow(self, seed: Candidate, first):
        """Add effects to a first one while each explains more; None if it ends implausible."""
        fit = seed.fit
        while (len(fit.effects) < MOST_EFFECTS
               and self.fitter.error(fit.held_out) > STRUCTURE_MARGIN * self.floor):
            known = fit.effects
            possibly, _ = possible(self.problem, known)
            names = [name for name in self._worth_another_look(first, fit) if name in possibly]
            rivals = consider_all(self.fitter, known, fit, names, self.jobs, self.progress)
            self._test(rivals, fit)
            rivals = [rival for rival in rivals if self._significant(rival, fit)]
            plausible = [rival for rival in rivals if not rival.fit.implausible()]
            chosen = _simplest(plausible or (rivals if fit.implausible() else []))
            if not chosen:
                break
            fit = self._refit(chosen[0].fit.effects)
        return None if fit.implausible() else fit

    def _pairs(self, first, grown):
        """
        Pairs of the leading effects that explain more than what was grown from single ones.

        One effect can mask another: the best by itself may stand in for two that are not.
        """
        if not grown or all(len(fit.effects) == 1 and self.fitter.error(fit.held_out)
                            <= STRUCTURE_MARGIN * self.floor for fit in grown):
            return []
        # What was grown from one effect has been tried with all others.
        seeds = {fit.effects[0].id for fit in grown}
        leading = [
            candidate for candidate in first
            if not seeds & {candidate.id, *candidate.effect.replaces}
            and self._significant(candidate, self.current)][:MOST_IN_PAIRS]
        worth = [[one.effect, other.effect] for one, other in itertools.combinations(leading, 2)
                 if other.id not in one.effect.replaces and one.id not in other.effect.replaces
                 and self._promising(one, other, grown)]
        pairs = [fit for fit in consider_sets(self.fitter, worth, self.jobs, self.progress)
                 if not fit.implausible()]
        singles = [fit for fit in grown if len(fit.effects) == 1]
        best = min(singles, key=lambda fit: self.fitter.error(fit.held_out), default=None)
        if best is None or not pairs:
            return pairs
        error = self.fitter.error(best.held_out)
        gains = np.array([error ** 2 - self.fitter.error(fit.held_out) ** 2 for fit in pairs])
        chance = np.stack([self._chance(fit.jacobian, best.jacobian, self.decoys)
                           for fit in pairs])
        values = significance.family_p_values(gains, chance)
        return [fit for fit, value in zip(pairs, values) if value <= SIGNIFICANCE]

    def _promising(self, one, other, grown):
        """Whether what two effects do alone, scaled and added, explains more than what is found."""
        columns = np.column_stack([one.signature, one.fit.jacobian,
                                   other.signature, other.fit.jacobian])
        left = self.problem.measured - self.base.predicted
        error = significance.held_out_errors(columns, left[None, :], self.problem.fold)[0]
        best = min(self.fitter.error(fit.held_out) for fit in grown)
        return error < LINEAR_MARGIN * best ** 2

    def _draw_structure(self):
        problem = self.problem
        if problem.refits:
            self.structure = 0.0
            self.decoys = None
            return
        decoys = structure.decoys(problem, self.fixed, self.base.predicted, self.rng)
        self.decoys = STRUCTURE_MARGIN * decoys
        self.structure = float(np.sqrt(np.mean(decoys ** 2)))

    @property
    def floor(self) -> float:
        """What sensor and base model leave by themselves."""
        return float(np.hypot(self.structure, self.problem.noise))

    def _worth_another_look(self, first, fit):
        """Effects that have anything to say about what is left, judged by their signatures."""
        left = self.problem.measured - fit.predicted
        limit = (1.0 - PRACTICAL) * float(np.mean(left ** 2))
        worth = {}
        for candidate in first:
            columns = np.column_stack(
                [fit.jacobian, candidate.fit.jacobian, candidate.signature])
            worth[candidate.id] = significance.held_out_errors(
                columns, left[None, :], self.problem.fold)[0]
        names = [name for name in sorted(worth, key=worth.get) if worth[name] < limit]
        return names[:MOST_RIVALS]

    def _test(self, candidates: list[Candidate], current) -> None:
        """Fill in the p values of candidates beside the `current` fit."""
        if not candidates:
            return
        problem = self.problem
        gains = np.array([candidate.gain for candidate in candidates])
        error = problem.measured - current.held_out
        if problem.refits:
            blocks = np.stack([
                significance.block_sums(
                    error ** 2 - (problem.measured - candidate.fit.held_out) ** 2, problem.block)
                for candidate in candidates])
            values = significance.paired_p_values(blocks, self.rng)
        else:
            values = np.zeros(len(candidates))
            for draws in (self.decoys, significance.flipped(error, problem.block, self.rng)):
                chance = np.stack([
                    self._chance(candidate.fit.jacobian, current.jacobian, draws)
                    for candidate in candidates])
                values = np.maximum(values, significance.family_p_values(gains, chance))
        for candidate, value in zip(candidates, values):
            candidate.p_value = float(value)

    def _chance(self, with_it, without, draws):
        """Gain of a Jacobian over another in draws without an effect, shape (m,)."""
        fold = self.problem.fold
        return (significance.held_out_errors(without, draws, fold)
                - significance.held_out_errors(with_it, draws, fold))

    def _significant(self, candidate, current) -> bool:
        before, after = self.fitter.error(current.held_out), candidate.rmse
        if candidate.p_value > SIGNIFICANCE or after > (1.0 - PRACTICAL) * before:
            return False
        measured, block = self.problem.measured, self.problem.block
        gains = significance.block_sums(
            (measured - current.held_out) ** 2 - (measured - candidate.fit.held_out) ** 2, block)
        return bool(np.mean(gains > 0.0) >= CONSISTENT)

    def _drop(self) -> None:
        """Take out effects that a later one has made needless."""
        for effect in self.known[:-1]:
            others = [other for other in self.known if other is not effect]
            without = self._refit(others)
            limit = (1.0 + PRACTICAL) * self.fitter.error(self.current.held_out)
            if self.fitter.error(without.held_out) <= limit:
                self.known, self.current = without.effects, without
                return

    def _alternatives(self, first) -> list:
        """For each missing effect, those that could as well be the truth in its place."""
        result = []
        for effect in self.known:
            others = [other for other in self.known if other is not effect]
            taken = {other.id for other in self.known}
            if others:
                without = self._refit(others)
                names = [c.id for c in first if c.id not in taken][:RIVALS]
                rivals = consider_all(
                    self.fitter, others, without, names, self.jobs, self.progress)
            else:
                without = self.base
                rivals = [candidate for candidate in first if candidate.id not in taken]
            close = [rival for rival in rivals
                     if not rival.implausible and self._could_be(rival, without)]
            result.append([rival.id for rival in close[:MOST_ALTERNATIVES]])
        return result

    def _could_be(self, rival: Candidate, without) -> bool:
        """
        Whether the rival could be the truth although the chosen set fits better.

        If the rival were the truth, the data would be its response with the base model's error;
        how far behind would it then fall by chance? A test of models that do not contain each
        other, by simulation.
        """
        problem = self.problem
        margin = rival.rmse ** 2 - self.fitter.error(self.current.held_out) ** 2
        if margin <= 0.0:
            return True
        if problem.refits:
            low, _ = significance.gain_interval(
                problem.measured - rival.fit.held_out,
                problem.measured - self.current.held_out, problem.block, self.rng)
            return low <= 0.0
        if rival.rmse > 2.0 * max(self.floor, self.fitter.error(self.current.held_out)):
            return False
        draws = self.decoys
        own = significance.held_out_errors(rival.fit.jacobian, draws, problem.fold)
        shift = rival.fit.predicted - self.current.predicted
        other = significance.held_out_errors(
            self.current.jacobian, draws + shift, problem.fold)
        return bool(margin <= np.quantile(own - other, 0.95))

    def _sum_up(self, first, hopeless) -> Diagnosis:
        problem = self.problem
        after = self.fitter.error(self.current.held_out)
        # Weights that are refitted extrapolate badly, which is no structure.
        predicted = self.current.predicted if problem.refits else self.current.held_out
        residual = problem.measured - predicted
        sensitivity = None if problem.refits else structure.sensitivity(problem, self.fixed)
        left = leftover.examine(problem, residual, sensitivity)
        limit = self._limit()
        excess = max(after ** 2 - limit ** 2, 0.0) if after > limit else 0.0
        unexplained = excess / max(self.before ** 2, 1e-300)
        if problem.refits:
            unexplained = self._unexplained_on_bench(left.explained, after)
        # Something that happened once explains what no steady effect can.
        event, share = leftover.event_of(
            problem, problem.measured - self.base.held_out, sensitivity)
        happened = (share > EVENT_SHARE and self.before > limit
                    and np.sqrt(1.0 - share) * self.before < (1.0 - PRACTICAL) * after)
        if not happened:
            event = left.event if left.event_share > EVENT_SHARE else None
        hidden = self._hidden(first, hopeless, limit)
        if unexplained > UNEXPLAINED[problem.kind] or happened:
            # What explains a part of it stands in the ranking; the cause is none of these.
            verdict = 'unknown'
            self.known, self.current, after = [], self.base, self.before
        elif self.known:
            verdict = 'missing'
        elif self._still() or (not problem.refits and len(hidden) > 0.8 * max(len(first), 1)):
            verdict = 'not_excited'
        else:
            verdict = 'adequate'
        alternatives = self._alternatives(first)
        effects = self.fitter.with_intervals(self.current)
        missing = [effect.id for effect in effects]
        return Diagnosis(
            verdict=verdict, missing=missing, alternatives=alternatives,
            ranking=self._ranking(first, missing), noise_floor=problem.noise,
            structural_error=self.structure, unexplained=float(min(unexplained, 1.0)),
            experiment=self._experiment(verdict, missing, alternatives, {**hopeless, **hidden}),
            effects=effects, rmse_before=self.before, rmse_after=after,
            not_excited={**hopeless, **hidden},
            event=event if verdict == 'unknown' else None,
            signal=left.signal if verdict == 'unknown' else '')

    def _unexplained_on_bench(self, explained, after) -> float:
        """Share of the first mean square that has structure, where that matters to a user."""
        error, span = self.fitter.error(self.current.predicted), np.ptp(self.problem.measured)
        if after > LARGEST_ERROR * span:
            # It fits what it was given and says nothing of another trial: not such a muscle.
            return 1.0
        if error < LEAST_STRUCTURE * span:
            return 0.0
        return explained * (error / self.fitter.error(self.base.predicted)) ** 2

    def _still(self) -> bool:
        """Whether the drive hardly moved."""
        drive = self.problem.signals.get('drive', np.zeros(1))
        return bool(np.ptp(drive) < LEAST_DRIVE * self.problem.model.drive_range)

    def _limit(self) -> float:
        """Largest error that base model and sensor may leave by themselves."""
        if self.decoys is None:
            return self.floor
        return float(np.quantile(np.sqrt(np.mean(self.decoys ** 2, axis=1)), 0.95))

    def _hidden(self, first, hopeless, limit) -> dict:
        """Effects that even at the upper end of their range would not stand out here."""
        hidden = {}
        for candidate in first:
            strongest = present(self.problem.model, catalogue()[candidate.id])
            strongest = strongest.with_values(**{
                parameter.name: (parameter.choices[-1] if parameter.choices else parameter.high)
                for parameter in strongest.parameters if self.problem.kind in parameter.kinds})
            if self.problem.refits:
                continue
            changed = self.problem.simulate(
                [*beside(self.fixed, [strongest]), strongest]) - self.base.predicted
            size = float(np.sqrt(np.mean(changed ** 2)))
            if np.isfinite(size) and size < 0.3 * limit:
                hidden[candidate.id] = 'even a strong one would change less than the noise'
        return hidden

    def _ranking(self, first, missing) -> list:
        problem = self.problem
        if not first:
            return []
        columns = problem.weight_columns(self.fixed)
        signatures = np.stack([candidate.signature for candidate in first])
        alike = significance.cosines(signatures)
        left = significance.residualise(columns, signatures)
        size = np.linalg.norm(signatures, axis=1)
        absorbed = 1.0 - (np.linalg.norm(left, axis=1) / np.maximum(size, 1e-300)) ** 2
        measured = problem.measured
        rows = []
        for index, candidate in enumerate(first):
            low, high = significance.gain_interval(
                measured - self.base.held_out, measured - candidate.fit.held_out, problem.block,
                self.rng)
            effect = self.fitter.with_intervals(candidate.fit)[-1]
            rows.append({
                'effect': candidate.id, 'rmse_before': self.before, 'rmse_after': candidate.rmse,
                'gain': 1.0 - candidate.rmse / self.before, 'gain_low': low, 'gain_high': high,
                'p_value': candidate.p_value, 'parameters': effect.to_dict()['parameters'],
                'plausible': not candidate.implausible,
                'absorbed': float(np.clip(absorbed[index], 0.0, 1.0)),
                'confused_with': [other.id for other, cosine in zip(first, alike[index])
                                  if other is not candidate and cosine > CONFUSED]})
        order = {name: position for position, name in enumerate(missing)}
        return sorted(rows, key=lambda row: (order.get(row['effect'], len(order)),
                                             not row['plausible'], row['rmse_after']))

    def _experiment(self, verdict, missing, alternatives, hidden) -> str:
        effects = catalogue()
        if verdict == 'unknown':
            return ('repeat the recording with another sequence of the drive and look at the '
                    'residual; no effect of the catalogue explains it')
        for name, others in zip(missing, alternatives):
            if others:
                return (f'to tell {name} from {" and ".join(others)}: '
                        + '; '.join(effects[one].experiment for one in [name, *others]))
        if missing:
            return (f'record again after `extend --add {",".join(missing)}` and compare')
        if hidden:
            name = next(iter(hidden))
            return f'to see {name}, too: {effects[name].experiment}'
        return 'nothing: the model explains this recording'
