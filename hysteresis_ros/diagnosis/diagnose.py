# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Find the physical effects that a model is missing, or say why none can be named.

What the search has found is the answer only if it leaves no more than the base model and the
sensor leave by themselves, and if nothing that happened once explains the recording better.
"""

import dataclasses

import numpy as np

from hysteresis_ros.diagnosis import leftover, significance, structure
from hysteresis_ros.diagnosis.candidates import present
from hysteresis_ros.diagnosis.evidence import PRACTICAL
from hysteresis_ros.diagnosis.fit import beside
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.search import Search
from hysteresis_ros.effects import catalogue
from hysteresis_ros.workers import one_blas_thread

# Effects whose signatures agree more than this cannot be told apart.
CONFUSED = 0.9
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
# An effect that changes less than this share of the largest error of its own is not excited.
LEAST_CHANGE = 0.3
# More than this share of the effects not excited: nothing is.
MOST_HIDDEN = 0.8


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
    resembles : list of str
        Effects that an unknown one is like; they explain it with values that are not physical.
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
    resembles: list = dataclasses.field(default_factory=list)

    def to_json(self) -> dict:
        """Return plain types for JSON."""
        content = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)
                   if field.name != 'effects'}
        content['effects'] = [effect.to_dict() for effect in self.effects]
        return content


def _silent(iterable, total):
    return iterable


@one_blas_thread()
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
    search = Search(problem_for(model, measurements), jobs, seed, progress)
    search.run()
    return _Verdict(search).sum_up()


def most_unexplained(kind: str, count: int) -> float:
    """
    Return the share of the first mean square that `count` effects may leave over.

    Together they fit more, so that they have to explain more.
    """
    return UNEXPLAINED[kind] / max(count, 1)


class _Verdict:
    """What follows from a search."""

    def __init__(self, search):
        self.search = search
        self.problem = search.problem
        self.fitter = search.fitter
        self.before, self.after = search.error(search.base), search.error(search.found)

    def sum_up(self) -> Diagnosis:
        """Judge what is left, and put all together."""
        search, problem, limit = self.search, self.problem, self.search.evidence.limit
        sensitivity = None if problem.refits else structure.sensitivity(problem, search.fixed)
        # Weights that are refitted extrapolate badly, which is no structure.
        predicted = search.found.predicted if problem.refits else search.found.held_out
        left = leftover.examine(problem, problem.measured - predicted, sensitivity)
        unexplained = self._unexplained(left.explained)
        event, share = leftover.event_of(
            problem, problem.measured - search.base.held_out, sensitivity)
        # Something that happened once explains what no steady effect can.
        happened = (share > EVENT_SHARE and self.before > limit
                    and np.sqrt(1.0 - share) * self.before < (1.0 - PRACTICAL) * self.after)
        if not happened:
            event = left.event if left.event_share > EVENT_SHARE else None
        stand_in = search.stand_in()
        resembles = [effect.id for effect in stand_in.effects] if stand_in else []
        unknown = bool(happened or resembles) or unexplained > most_unexplained(
            problem.kind, len(search.found.effects))
        if unknown:
            # What explains a part of it stands in the ranking; the cause is none of these.
            search.found, search.rivals, self.after = search.base, [], self.before
        not_excited = {**search.hopeless, **self._hidden()}
        verdict = 'unknown' if unknown else self._known(not_excited)
        alternatives = search.alternatives()
        effects = self.fitter.with_intervals(search.found)
        missing = [effect.id for effect in effects]
        return Diagnosis(
            verdict=verdict, missing=missing, alternatives=alternatives,
            ranking=self._ranking(missing), noise_floor=problem.noise,
            structural_error=search.evidence.structure, unexplained=float(min(unexplained, 1.0)),
            experiment=self._experiment(verdict, missing or resembles, alternatives, not_excited),
            effects=effects, rmse_before=self.before, rmse_after=self.after,
            not_excited=not_excited, event=event if unknown else None,
            signal=left.signal if unknown else '',
            resembles=resembles)

    def _known(self, not_excited) -> str:
        if self.search.found.effects:
            return 'missing'
        count = sum(candidate.id in not_excited for candidate in self.search.first)
        if self._still() or count > MOST_HIDDEN * max(len(self.search.first), 1):
            return 'not_excited'
        return 'adequate'

    def _unexplained(self, explained) -> float:
        """Share of the first mean square that neither model nor sensor may leave."""
        if self.problem.refits:
            return self._unexplained_on_bench(explained)
        limit = self.search.evidence.limit
        return max(self.after ** 2 - limit ** 2, 0.0) / max(self.before ** 2, 1e-300)

    def _unexplained_on_bench(self, explained) -> float:
        """Share of the first mean square that has structure, where that matters to a user."""
        error = self.fitter.error(self.search.found.predicted)
        span = np.ptp(self.problem.measured)
        if self.after > LARGEST_ERROR * span:
            # It fits what it was given and says nothing of another trial: not such a muscle.
            return 1.0
        if error < LEAST_STRUCTURE * span:
            return 0.0
        return explained * (error / self.fitter.error(self.search.base.predicted)) ** 2

    def _still(self) -> bool:
        """Whether the drive hardly moved."""
        drive = self.problem.signals.get('drive', np.zeros(1))
        return bool(np.ptp(drive) < LEAST_DRIVE * self.problem.model.drive_range)

    def _hidden(self) -> dict:
        """Effects that even at the upper end of their range would not stand out here."""
        hidden = {}
        if self.problem.refits:
            return hidden
        fixed, limit = self.search.fixed, self.search.evidence.limit
        for candidate in self.search.first:
            strongest = present(self.problem.model, catalogue()[candidate.id])
            strongest = strongest.with_values(**{
                parameter.name: (parameter.choices[-1] if parameter.choices else parameter.high)
                for parameter in strongest.parameters if self.problem.kind in parameter.kinds})
            changed = self.problem.simulate(
                [*beside(fixed, [strongest]), strongest]) - self.search.base.predicted
            size = float(np.sqrt(np.mean(changed ** 2)))
            if np.isfinite(size) and size < LEAST_CHANGE * limit:
                hidden[candidate.id] = 'even a strong one would change less than the noise'
        return hidden

    def _ranking(self, missing) -> list:
        problem, first, base = self.problem, self.search.first, self.search.base
        if not first:
            return []
        columns = problem.weight_columns(self.search.fixed)
        signatures = np.stack([candidate.signature for candidate in first])
        alike = significance.cosines(signatures)
        left = significance.residualise(columns, signatures)
        size = np.linalg.norm(signatures, axis=1)
        absorbed = 1.0 - (np.linalg.norm(left, axis=1) / np.maximum(size, 1e-300)) ** 2
        measured = problem.measured
        rows = []
        for index, candidate in enumerate(first):
            low, high = significance.gain_interval(
                measured - base.held_out, measured - candidate.fit.held_out, problem.block,
                self.search.rng)
            effect = self.fitter.with_intervals(candidate.fit)[-1]
            rows.append({
                'effect': candidate.id, 'rmse_before': self.before, 'rmse_after': candidate.rmse,
                'gain': 1.0 - candidate.rmse / self.before, 'gain_low': low, 'gain_high': high,
                'p_value': candidate.p_value, 'parameters': effect.to_dict()['parameters'],
                'plausible': not candidate.fit.implausible(),
                'absorbed': float(np.clip(absorbed[index], 0.0, 1.0)),
                'confused_with': [other.id for other, cosine in zip(first, alike[index])
                                  if other is not candidate and cosine > CONFUSED]})
        order = {name: position for position, name in enumerate(missing)}
        return sorted(rows, key=lambda row: (order.get(row['effect'], len(order)),
                                             not row['plausible'], row['rmse_after']))

    def _experiment(self, verdict, missing, alternatives, not_excited) -> str:
        effects = catalogue()
        if verdict == 'unknown':
            return '; '.join([
                'repeat the recording with another sequence of the drive and look at the residual',
                *(f'what is like {name} shows best so: {effects[name].experiment}'
                  for name in missing)])
        for name, others in zip(missing, alternatives):
            if others:
                return (f'to tell {name} from {" and ".join(others)}: '
                        + '; '.join(effects[one].experiment for one in [name, *others]))
        if missing:
            return (f'record again after `extend --add {",".join(missing)}` and compare')
        if not_excited:
            name = next(iter(not_excited))
            return f'to see {name}, too: {effects[name].experiment}'
        return 'nothing: the model explains this recording'
