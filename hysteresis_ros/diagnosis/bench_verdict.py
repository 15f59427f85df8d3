# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The verdict on bench tables, from what sets of effects predict of held-out rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis import verdict
from hysteresis_ros.diagnosis.bench_kinetics import shown_kinetics
from hysteresis_ros.diagnosis.bench_selection import BenchSelection
from hysteresis_ros.diagnosis.residual import shares, unexplained_signal
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.measurements.metrics import sample_noise

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.workers import Progress

# A residual of more than this share of the first mean square: the cause is not known.
UNEXPLAINED = 0.3
# A structured error below this share of the response's range is that of any model.
LEAST_STRUCTURE = 0.02
# A held-out error above this share of the range: the model predicts nothing.
LARGEST_ERROR = 0.15
# An implausible set whose residual is less than this share of the best one's resembles it.
RESEMBLES = 0.6


def bench_verdict(problem: BenchProblem, settings: Settings, rng: np.random.Generator,
                  jobs: int, progress: Progress) -> verdict.Diagnosis:
    """
    Diagnose bench tables.

    Parameters
    ----------
    problem : BenchProblem
    settings : Settings
    rng : numpy.random.Generator
    jobs : int
        Processes; -1 for all cores.
    progress : callable
        ``progress(items, total)``, for a progress bar.

    Returns
    -------
    Diagnosis
    """
    selection = BenchSelection(problem, settings, rng, jobs, progress)
    selection.run()
    fitter, base, found = selection.fitter, selection.base, selection.found
    unexplained = _unexplained(selection)
    resembles = _resembles(selection)
    unknown = bool(resembles) or unexplained > UNEXPLAINED / max(len(found.effects), 1)
    residual = problem.measured - found.predicted
    if unknown:
        # What explains a part of it stands in the ranking; the cause is none of these.
        selection.found = base
    alternatives = selection.alternatives()
    effects = fitter.with_intervals(selection.found)
    missing = [effect.id for effect in effects]
    kind = ('unknown' if unknown else 'missing' if missing else
            'not_excited' if not selection.alone and selection.unobservable else 'adequate')
    named = [alternatives[name] for name in missing]
    hidden = {**selection.unstable, **selection.unobservable}
    return verdict.Diagnosis(
        verdict=kind, missing=missing, alternatives=named,
        ranking=_ranking(selection, missing), sets=_sets(selection, unknown),
        # The weights are refitted: no error of the model is known beforehand.
        noise_floor=_sensor_noise(problem), structural_error=None, bench_error=None,
        unexplained=float(np.clip(unexplained, 0.0, 1.0)),
        experiment=verdict.next_experiment(
            kind, missing or resembles, named, hidden),
        effects=effects, rmse_before=selection.typical_rmse(base),
        rmse_after=selection.typical_rmse(selection.found), pooled_before=selection.error(base),
        pooled_after=selection.error(selection.found), small_error=selection.problem.small_error,
        not_excited=hidden, event=None,
        signal=unexplained_signal(problem, residual) if unknown else '', resembles=resembles,
        kinetics=None if unknown else _kinetics(selection))


def _kinetics(selection: BenchSelection) -> dict[str, Any] | None:
    """Return what kinetics explain of rows left out with the effects found; see `Diagnosis`."""
    if selection.problem.catalogue is not None:
        return None     # tried as any other effect, or not asked for
    shown = shown_kinetics(selection.fitter, selection.found.effects)
    if shown is None:
        return None
    size = Kinetics.parameters[0]
    return {'effect': Kinetics.id, size.name: shown.effects[-1].values[size.name],
            'rmse_before': shown.before, 'rmse_after': shown.after}


def _sensor_noise(problem: BenchProblem) -> float:
    """Return what the sensor's resolution and, of a continuous run, its samples show of noise."""
    return max([problem.noise, *(sample_noise(measurement) for measurement in problem.measurements
                                 if not measurement.settled)])


def _unexplained(selection: BenchSelection) -> float:
    """Share of the first mean square that has structure, where that matters to a user."""
    problem, found = selection.problem, selection.found
    error = selection.fitter.error(found.predicted)
    span = np.ptp(problem.measured)
    if selection.error(found) > LARGEST_ERROR * span:
        # It fits what it was given and says nothing of another trial: not such a muscle.
        return 1.0
    if error < LEAST_STRUCTURE * span:
        return 0.0
    # Weights that are refitted extrapolate badly, which is no structure: all rows are looked at.
    explained = max(shares(problem, problem.measured - found.predicted).values())
    return explained * (error / selection.fitter.error(selection.base.predicted)) ** 2


def _resembles(selection: BenchSelection) -> list[str]:
    """Name the effects of an implausible set that explains far more than what was found."""
    found = selection.found
    implausible = [fit for fit in selection.tried
                   if fit.implausible() and len(fit.effects) <= max(len(found.effects), 1)]
    best = min(implausible, key=selection.error, default=None)
    if best is None or selection.error(found) <= selection.problem.noise or selection.error(
            best) > RESEMBLES * selection.error(found):
        return []
    return sorted(best.names)


def _sets(selection: BenchSelection, unknown: bool) -> list[dict[str, Any]]:
    """Return the probabilities of sets; all of it is 'unknown' where the verdict is."""
    rows: list[dict[str, Any]] = [
        {'effects': list(fit.names), 'probability': 0.0 if unknown else float(share),
         'rmse': selection.typical_rmse(fit)}
        for fit, share in selection.probabilities() if share >= 1e-3]
    rest = max(1.0 - sum(row['probability'] for row in rows), 0.0)
    rows.append({'effects': ['unknown'], 'probability': float(rest),
                 'rmse': selection.typical_rmse(selection.base)})
    return sorted(rows, key=lambda row: -row['probability'])


def _ranking(selection: BenchSelection, missing: Sequence[str]) -> list[dict[str, Any]]:
    problem, base = selection.problem, selection.base
    rows: list[dict[str, Any]] = []
    if not selection.alone:
        return rows
    for fit in selection.alone:
        rows.append(verdict.ranking_row(
            selection.fitter.with_intervals(fit)[0], fit, selection.typical_rmse(base),
            selection.typical_rmse(fit), selection.p_values[fit.names],
            selection.gain_interval(fit, base)))
    verdict.add_signatures(
        rows, np.stack([fit.predicted - base.predicted for fit in selection.alone]),
        problem.weight_columns(selection.fitter.fixed))
    return verdict.in_order(rows, missing)
