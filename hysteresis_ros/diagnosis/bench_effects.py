# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that belong to the bench model: found in its own tables, or named by the user."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_error import FEWEST_LOADS
from hysteresis_ros.diagnosis.bench_expansion import with_expansion
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_kinetics import shown_kinetics
from hysteresis_ros.diagnosis.bench_overlooked import with_overlooked
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.between_loads import best_between_loads
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.extend import extended_model
from hysteresis_ros.diagnosis.forms import with_best_forms
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.located import located
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.diagnosis.parameters import universal, usual
from hysteresis_ros.diagnosis.replicates import with_replicates
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.effects.ambient import AmbientTemperature
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.effects.thermal_expansion import ThermalExpansion
from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.bench_metrics import measure
from hysteresis_ros.identification.trials import choose_trials
from hysteresis_ros.workers import one_blas_thread

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.workers import Progress


def _silent(items: Iterable, total: int) -> Iterable:
    return items


@one_blas_thread()
def add_effects(model: MuscleModel, length: Measurement, force: Measurement | None = None,
                names: Sequence[str] | None = None, length_trials: Sequence[float] | None = None,
                force_trials: Sequence[float] | None = None, jobs: int = 1,
                progress: Progress = _silent) -> tuple[MuscleModel, list[Effect]]:
    """
    Add effects to an identified model and refit H2's weights with them.

    Parameters
    ----------
    model : MuscleModel
        As identified on the same trials.
    length, force : Measurement
        The bench tables; `force` only for the metrics.
    names : sequence of str, optional
        Effects to add; by default those that the length table proves, and with them those that
        every loaded muscle has, and kinetics, where loads held out show them, and what rows and
        loads left out show besides; and the room's, where that was recorded.
    length_trials, force_trials : sequence of numbers, optional
        Trials that are fitted; the others verify.
    jobs : int
        Processes.
    progress : callable
        ``progress(items, total)``, for a progress bar.

    Returns
    -------
    model : MuscleModel
        With effects and new metrics.
    added : list of Effect

    Raises
    ------
    IdentificationError
        If a trial is not in the table, or none is left to fit.
    MeasurementError
        If the table has too few rows, or the length stage is none of Preisach's.
    ParameterError
        If an effect is unknown, named twice, already there, or cannot show in a bench table.
    """
    rows = choose_trials(length, length_trials, 'length')
    if not rows.any():
        raise IdentificationError('no trial is left to fit')
    fitted = length.select(sorted(set(length.column('trial')[rows].tolist())))
    problem = problem_for(model, [fitted], jobs=jobs)
    assert isinstance(problem, BenchProblem)
    if names is None:
        room = _recorded_room(problem)
        found = diagnose(model.with_effects([*model.effects, *room]), [fitted], jobs=jobs,
                         progress=progress).effects
        if room:
            fitter = BenchFitter(problem.finer())
            found = fitter.with_intervals(fitter.fit([*found, *room]))
        extended, added = _determined(model, found, problem)
    elif names:
        extended, added = extended_model(model, names, [fitted])
    else:
        return model, []
    if added:
        extended = with_replicates(extended, problem)
    metrics = measure(extended, force, force_trials, length, length_trials)
    # The errors of loads left out of the last fit of the weights stay with the new ones.
    for name, entry in metrics.items():
        metrics[name] = {**extended.metrics.get(name, {}), **entry}
    return dataclasses.replace(extended, metrics=metrics), added


def _recorded_room(problem: BenchProblem) -> list[Effect]:
    """
    Return what the room typically does, where its temperature was recorded and has changed.

    Nobody has to prove that a room acts. While other effects are sought, it is taken to be as
    large as is usual: else what the load does would stand for it.
    """
    surroundings = problem.model.surroundings
    reference = AmbientTemperature.column_on_bench(surroundings)
    if reference is None or AmbientTemperature.id not in observable(problem)[0]:
        return []
    return [AmbientTemperature.typical(surroundings, reference)]


def _determined(model: MuscleModel, found: Sequence[Effect], problem: BenchProblem
                ) -> tuple[MuscleModel, list[Effect]]:
    """Return the model with the effects found and usual, all of them determined by the rows."""
    excluded: list[str] = []
    extended, added = _extended_without(excluded, model, found, problem)
    while undetermined := _undetermined(added):
        # What every loaded muscle has goes last.
        name = min(undetermined, key=lambda effect: effect.universal).id
        without = _extended_without([*excluded, name], model, found, problem)
        # Two effects may stand for each other, so that of neither the size is determined until one
        # of them goes.
        rivals = {effect.id: _extended_without([*excluded, effect.id], model, found, problem)
                  for effect in added if effect.id != name
                  and _determined_without(effect, name, added, problem)}
        largest = (1.0 - Settings().practical) * _left_out_rmse(without[0])
        clear = [other for other, (rival, kept) in rivals.items()
                 if _left_out_rmse(rival) < largest
                 and all(effect.id != name for effect in _undetermined(kept))]
        if clear:
            name = min(clear, key=lambda other: _left_out_rmse(rivals[other][0]))
            without = rivals[name]
        excluded.append(name)
        extended, added = without
    return extended, added


def _determined_without(other: Effect, name: str, effects: Sequence[Effect],
                        problem: BenchProblem) -> bool:
    """Whether the rows determine an effect of some, by name, once another one of them is gone."""
    _, found = BenchFitter(problem.finer()).fit_but_kinetics(
        [effect for effect in effects if effect is not other])
    return all(effect.id != name for effect in _undetermined(found))


def _extended_without(excluded: Collection[str], model: MuscleModel, found: Sequence[Effect],
                      problem: BenchProblem) -> tuple[MuscleModel, list[Effect]]:
    """Return the model with the effects found and usual but for some, and those effects."""
    known = [effect for effect in found if effect.id not in excluded]
    if len(known) < len(found):
        # What stood for the form of another effect is gone.
        fitter = BenchFitter(problem.finer())
        fit = fitter.best_of([known, usual(known, 'bench')])
        known = with_best_forms(fitter, fitter.with_intervals(fit))
    known = _with_universal(model, known, problem, excluded)
    known = _in_simpler_terms(BenchFitter(problem.finer()), known, excluded)
    if ThermalExpansion.id not in excluded:
        known = with_expansion(BenchFitter(problem.finer()), known, Settings().practical)
    if Kinetics.id not in excluded:
        shown = shown_kinetics(BenchFitter(problem.finer()), known, excluded)
        known = shown.effects if shown else known
    if not known:
        return model, []
    known = with_overlooked(BenchFitter(problem.finer()), known, excluded, Settings().practical)
    return extended_model(model, [one.id for one in known], problem.measurements, known)


def _in_simpler_terms(fitter: BenchFitter, known: Sequence[Effect], excluded: Collection[str]
                      ) -> list[Effect]:
    """Return the effects known, with simpler ones for those that may as well be these."""
    def held_out(one: Fit) -> np.ndarray:
        return np.asarray(fitter.cross_validate(one).held_out)

    fit = fitter.fit(known)
    for effect in fitter.with_intervals(fit):
        name = effect.limit
        if name is None or name in (*fit.names, *excluded) or not effect.in_limit():
            continue
        new, = usual([catalogue()[name](fitter.problem.model.surroundings)], 'bench')
        simpler = fitter.fit([*(one for one in fit.effects if one.id != effect.id), new])
        found = fitter.with_intervals(simpler)
        if not (simpler.implausible() or _undetermined([one for one in found if one.id == name])
                ) and fitter.problem.predicts_as_well(
                    held_out(simpler), held_out(fit), Settings().practical):
            return found
    return list(known)


def _undetermined(effects: Sequence[Effect]) -> list[Effect]:
    """Return those of some effects that the rows of a bench do not determine."""
    return [effect for effect in effects
            if effect.implausible() or not_determined(effect, 'bench')]


def _left_out_rmse(model: MuscleModel) -> float:
    """Return the RMSE of trials left out of the fit of H2's weights, infinite if none was."""
    entry = model.metrics.get('length', {}).get('left_out', {})
    return float(entry.get('rmse', np.inf))


def _with_universal(model: MuscleModel, found: Sequence[Effect], problem: BenchProblem,
                    excluded: Collection[str] = ()) -> list[Effect]:
    """
    Return the effects found, and those that every loaded muscle has where they do no harm.

    Constant loads on a bench hardly tell the wire's own elasticity from the growth of its stroke,
    and few rows may not prove either; but on an arm the load moves while the wire does. What is
    known beforehand needs no proof against chance, only rows that determine its parameters, be it
    those that are held out, and that do not speak against it.
    """
    fitter = BenchFitter(problem.finer())
    names = [effect.id for effect in found]
    rest = universal(model.surroundings, (*names, *excluded))
    if not rest:
        return list(found)
    practical = Settings().practical
    if not found and len(np.unique(problem.left_out_together)) >= FEWEST_LOADS:
        between = best_between_loads(fitter, rest, practical)
        return _with_universal(model, between, problem, excluded) if between else []

    def held_out(fit: Fit) -> float:
        return fitter.error(fitter.cross_validate(fit).held_out)

    def usual_undetermined(effects: Sequence[Effect]) -> list[Effect]:
        return [one for one in effects if one.universal and not_determined(one, 'bench')]

    # Alone they have to help; together with one that was found they only must not harm.
    largest = held_out(fitter.fit(found)) * ((1.0 + practical) if names else (1.0 - practical))

    def tried(effects: Sequence[Effect]) -> tuple[float, list[Effect]]:
        fit = fitter.fit(effects)
        fitted_effects = fitter.with_intervals(fit)
        new = [one.id for one in usual_undetermined(fitted_effects) if one.id not in names]
        # Where no effect explains the load, held-out loads would tell of what is missing.
        if fit.implausible() or len(new) > (1 if found else 0):
            return np.inf, fitted_effects
        if not usual_undetermined(fitted_effects):
            error = held_out(fit)
            # Fitted anew without a load, one more parameter may predict that load worse.
            if error <= largest:
                return error, fitted_effects
        last = next(one for one in fit.effects if one.id == (new or [effects[-1].id])[0])
        error, located_effects = located(
            fitter, [one for one in fit.effects if one is not last], last) or (np.inf, [])
        # What was found is not to be given up for what could stand for it.
        return (np.inf if usual_undetermined(located_effects) else error), located_effects

    for more in (rest, *([effect] for effect in rest)):
        error, effects = tried([*found, *more])
        if error > largest:
            continue
        lost = [one.id for one in _undetermined(effects) if not one.universal]
        # What only explained the residual of another effect leaves its range once that is there.
        return _with_universal(model, [one for one in found if one.id not in lost],
                               problem, excluded) if lost else effects
    return list(found)
