# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Add effects to a model, fit them, and show the error before and after on data not fitted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import dataclasses
import hashlib
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.determined import not_determined, undetermined, undetermined_names
from hysteresis_ros.diagnosis.forms import with_best_forms
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.located import can_be_located
from hysteresis_ros.diagnosis.observable import may_differ, observable, present, unaffected
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.diagnosis.replicates import with_replicates
from hysteresis_ros.diagnosis.selection import Selection
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import Effect, effect_class
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.model import MuscleModel, Simulator
from hysteresis_ros.result import Brief, Result
from hysteresis_ros.workers import one_blas_thread

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem
    from hysteresis_ros.measurements import Measurement

# Of the last fit, whose values are kept.
EVALUATIONS, TOLERANCE = 30, 1e-4

# Effects with intervals, and the names of parameters outside their physical range.
Fitted = tuple[list[Effect], list[str]]


@dataclasses.dataclass(repr=False)
class Extension(Result):
    """
    An extended model with what it gained.

    Attributes
    ----------
    model : MuscleModel
        With the effects.
    added : list of Effect
        The new ones, fitted, with 95 % intervals.
    train, test : dict
        ``rmse_before`` and ``rmse_after`` on fitted and on other recordings, in the unit of the
        response; `test` is empty without one.
    steps : list of (str, float)
        Error on `test`, or on `train` without one, of the base and after each effect.
    implausible : list of str
        Parameters outside their physical range.
    quantity : str
        What was measured: 'angle', 'length' or 'strain'.
    warnings : list of str
        Effects that the recordings cannot show, and parameters that they do not determine.
    """

    model: MuscleModel
    added: list[Effect]
    train: dict[str, float]
    test: dict[str, float]
    steps: list[tuple[str, float]]
    implausible: list[str]
    quantity: str = ''
    warnings: list[str] = dataclasses.field(default_factory=list)

    def to_dict(self) -> dict:
        """Return plain types for JSON."""
        return {
            'added': [effect.id for effect in self.added],
            'parameters': {effect.id: effect.to_dict()['parameters'] for effect in self.added},
            'train': self.train, 'test': self.test,
            'steps': [{'model': name, 'rmse': value} for name, value in self.steps],
            'implausible': self.implausible, 'warnings': self.warnings}

    def brief(self) -> Brief:
        """Return the error before and after, with the table of the parameters."""
        unit, scale = shown(self.quantity)
        lines = ['Extension: + ' + ' + '.join(effect.id for effect in self.added)]
        lines += [f'RMSE on data {what}: {scale * error["rmse_before"]:.3g} -> '
                  f'{scale * error["rmse_after"]:.3g} {unit}'.rstrip()
                  for what, error in (('fitted', self.train), ('not fitted', self.test)) if error]
        if self.implausible:
            lines.append('outside their physical range: ' + ', '.join(self.implausible))
        lines += self.warnings[:1]
        rows = [[effect.id, name, f'{entry["value"]:.4g}', f'{entry["low"]:.4g}',
                 f'{entry["high"]:.4g}', entry['unit']] for effect in self.added
                for name, entry in effect.to_dict()['parameters'].items()]
        return Brief(lines, ['effect', 'parameter', 'value', 'low', 'high', 'unit'], rows)

    def plot(self) -> Figure:
        """
        Draw how the error falls with every effect that was added.

        Returns
        -------
        matplotlib.figure.Figure

        """
        from hysteresis_ros.report.plots import waterfall
        return waterfall(self.steps, None, self.quantity)


def rmse(model: MuscleModel, measurements: Iterable[Measurement],
         before: Sequence[Effect] | None = None) -> float:
    """
    Return the root mean square error of a model over recordings, in the response's unit.

    Parameters
    ----------
    model : MuscleModel
    measurements : iterable of Measurement
    before : sequence of Effect, optional
        Effects that act before the onset, in recordings that have one; all of the model by default.
    """
    squares, rows = 0.0, 0
    for measurement in measurements:
        predicted = Simulator(model, measurement, before=before).run(model.effects, exact=True)
        error = predicted - measurement.column(measurement.response)
        squares += float(np.sum(error ** 2))
        rows += len(error)
    return float(np.sqrt(squares / rows))


@one_blas_thread()
def extend(model: MuscleModel, names: Sequence[str], train: Sequence[Measurement],
           test: Sequence[Measurement] = (), *, force: bool = False) -> Extension:
    """
    Add effects and fit them together.

    On arm runs the weights of the bench stay as they are; on bench tables they are fitted again.

    Parameters
    ----------
    model : MuscleModel
    names : sequence of str
        Effects of the catalogue, in the order in which they are added. An effect of the wire that
        the bench has shown is fitted anew to the wires of the arm.
    train : sequence of Measurement
        Recordings to fit.
    test : sequence of Measurement
        Recordings of the same kind that are only predicted.
    force : bool
        Whether effects that these recordings cannot show are fitted, with a warning.

    Returns
    -------
    Extension

    Raises
    ------
    ParameterError
        If an effect is unknown, named twice, already there, or cannot show in this kind of data,
        or in these recordings and is not forced. One of the wire that the bench has shown is
        there may be fitted anew to an arm.
    MeasurementError
        If the recordings do not fit together.
    """
    problem_for(model, [*train, *test])     # which refuses what does not fit together
    warnings = _unobservable(model, names, train, force)
    problem, classes, fits = _fitted(model, names, train)
    warnings += [note for effect in fits[-1][0] for note in undetermined(effect, problem.kind)]
    if not _trials(train).isdisjoint(_trials(test)):
        warnings.append('trials of the test are among those that are fitted: what is said of data '
                        'not fitted does not hold for them')
    stages = [(f'+ {kind.id}', effects) for kind, (effects, _) in zip(classes, fits)]
    found = _gained(model, problem, stages, train, test, fits[-1][1], warnings)
    practical = Settings().practical
    if found.steps[-1][1] > (1.0 - practical) * found.steps[0][1]:
        found.warnings.append(
            f'{", ".join(names)} takes less than {100.0 * practical:.0f} % off the error: nothing '
            'of the kind acts here, or the model has it already')
    return found


def _trials(recordings: Iterable[Measurement]) -> set[tuple[bytes, ...]]:
    """Return what tells one trial from another: its measured values and its drive."""
    return {tuple(one.column(name)[one.column('trial') == trial].tobytes()
                  for name in (one.response, one.drive))
            for one in recordings for trial in one.trials}


@one_blas_thread()
def extend_by_hand(model: MuscleModel, effects: Sequence[Effect], train: Sequence[Measurement],
                   test: Sequence[Measurement] = ()) -> Extension:
    """
    Add effects with the values that they have, and show the error before and after.

    Nothing is fitted but, on bench tables, the weights.

    Parameters
    ----------
    model : MuscleModel
    effects : sequence of Effect
        In the order in which they are added.
    train, test : sequence of Measurement
        As for `extend`.

    Returns
    -------
    Extension

    Raises
    ------
    ParameterError, MeasurementError
        As `extend`, but an effect that cannot show in these recordings is no error.
    """
    problem_for(model, [*train, *test])
    problem, classes = _without(model, [effect.id for effect in effects], train)
    stages = [(f'+ {kind.id}', list(effects[:number])) for number, kind in enumerate(classes, 1)]
    implausible = [f'{effect.id}.{name}' for effect in effects
                   for name in effect.implausible(duration=problem.duration)]
    return _gained(model, problem, stages, train, test, implausible, [], by_hand=True)


def _gained(model: MuscleModel, problem: ArmProblem | BenchProblem,
            stages: Sequence[tuple[str, list[Effect]]], train: Sequence[Measurement],
            test: Sequence[Measurement], implausible: list[str], warnings: list[str],
            by_hand: bool = False) -> Extension:
    """Return what effects gain that are added in stages, each with its name."""
    judged = list(test) or list(train)
    models = [('base', model)]
    for name, effects in stages:
        models.append((name, problem.completed(
            [*unaffected(problem.model.effects, effects), *effects])))
    added = stages[-1][1]
    extended = _stamped(models[-1][1], added, train, problem.kind, by_hand)
    if problem.refits:
        extended = with_replicates(extended, problem, by_hand)
    models[-1] = (models[-1][0], extended)
    steps = [(name, rmse(one, judged, model.effects)) for name, one in models]
    # Where weights are refitted, the fair base is one that was refitted to the same rows.
    before = problem.completed(model.effects) if problem.refits else model

    def both(recordings: Sequence[Measurement]) -> dict[str, float]:
        if not recordings:
            return {}
        return {'rmse_before': rmse(before, recordings, model.effects),
                'rmse_after': rmse(extended, recordings, model.effects)}
    return Extension(extended, added, both(list(train)), both(list(test)), steps,
                     implausible, problem.response, warnings)


@one_blas_thread()
def extended_model(model: MuscleModel, names: Sequence[str], train: Sequence[Measurement],
                   known: Sequence[Effect] = ()) -> tuple[MuscleModel, list[Effect]]:
    """
    Return the extended model and the effects added; `extend` also says what each of them gained.

    The parameters, and what is raised, are those of `extend`; `known` are effects of these names
    that a diagnosis of the same bench has fitted before.
    """
    problem, classes = _without(model, names, train)
    if problem.refits:
        added = _fitted_together(problem, model, classes, known)
        problem = problem.balanced(added)
        added = _balanced(problem, added)
    else:
        added = _on_arm(problem, model, classes)[-1][0]
    completed = problem.completed([*unaffected(problem.model.effects, added), *added])
    return _stamped(completed, added, train, problem.kind), added


def _fitted_together(problem: BenchProblem, model: MuscleModel, classes: Sequence[type[Effect]],
                     known: Sequence[Effect]) -> list[Effect]:
    """Return the better fit of effects of a bench, with the simplest forms that do."""
    fitter, kind = BenchFitter(problem.finer()), problem.kind
    # What held-out rows have determined is not fitted again to rows that cannot tell it.
    fixed = {effect.id for effect in known
             if (can_be_located(effect, kind) or isinstance(effect, Kinetics))
             and not not_determined(effect, kind)}
    if fixed:
        added = with_best_forms(fitter, known, fixed)
        # A form that rows do not determine says less than one that they do.
        vague = undetermined_names(added, kind) - undetermined_names(known, kind)
        return with_best_forms(fitter, known, fixed | vague) if vague else added
    added = with_best_forms(fitter, _on_bench(problem, model, classes)[-1][0])
    if not known:
        return added
    rivals = [fitter.fit(effects, evaluations=EVALUATIONS, tolerance=TOLERANCE)
              for effects in (known, added)]
    best = min(rivals, key=lambda fit: (
        len(fit.implausible()), fitter.error(fit.predicted)))
    # A fit that runs out of the physical range explains something else.
    if best.implausible() and not any(effect.implausible() for effect in known):
        return with_best_forms(fitter, known, {effect.id for effect in known})
    return with_best_forms(fitter, fitter.with_intervals(best))


def _balanced(problem: BenchProblem, added: list[Effect]) -> list[Effect]:
    """Return effects of a bench fitted to rows of unequal weight; as they are if these are not."""
    if np.ptp(problem.emphasis) == 0.0:
        return added
    fit, found = BenchFitter(problem.finer()).fit_but_kinetics(added)
    return added if fit.implausible() else found


def _unobservable(model: MuscleModel, names: Sequence[str], train: Sequence[Measurement],
                  force: bool) -> list[str]:
    """Return why recordings cannot show the effects named; refuse those that are not forced."""
    wanted = [effect_class(name) for name in names]
    base = model.with_effects([effect for effect in model.effects if effect.id not in names])
    _, hidden = observable(problem_for(base, train))
    notes = [f'these recordings cannot show {kind.id}: {hidden[kind.id]}' for kind in wanted
             if kind.id in hidden]
    if notes and not force:
        experiments = '; '.join(kind.experiment for kind in wanted if kind.id in hidden)
        raise ParameterError(f'{"; ".join(notes)}. To see it: {experiments}. --force (in Python '
                             'force=True) fits it none the less')
    return notes


def _fitted(model: MuscleModel, names: Sequence[str], train: Sequence[Measurement]
            ) -> tuple[ArmProblem | BenchProblem, list[type[Effect]], list[Fitted]]:
    """Return the problem, the classes of the effects named, and the fit after each."""
    problem, classes = _without(model, names, train)
    return problem, classes, (_on_bench(problem, model, classes) if problem.refits
                              else _on_arm(problem, model, classes))


def _without(model: MuscleModel, names: Sequence[str], train: Sequence[Measurement]
             ) -> tuple[ArmProblem | BenchProblem, list[type[Effect]]]:
    """
    Return the problem and the classes of the effects named.

    Without these effects, but on an arm what the model has of one acts until its turn.
    """
    classes = _checked(problem_for(model, train), names)
    problem = problem_for(base_of(model, classes), train)
    if not problem.refits:
        replaced = {name for kind in classes for name in kind.replaces}
        problem = problem_for(model.with_effects(
            [one for one in model.effects if one.id not in replaced]), train)
    for kind in classes:
        if problem.kind not in kind.kinds:
            raise ParameterError(f'effect {kind.id} cannot be fitted to a {problem.kind} '
                                 'measurement; give an arm run')
    return problem, classes


def base_of(model: MuscleModel, classes: Iterable[type[Effect]]) -> MuscleModel:
    """Return the model without what effects of these classes take the place of."""
    replaced = {name for kind in classes for name in (kind.id, *kind.replaces)}
    return model.with_effects([e for e in model.effects if e.id not in replaced])


def _checked(problem: ArmProblem | BenchProblem, names: Iterable[str]) -> list[type[Effect]]:
    """Return the classes of the effects named, which are neither there nor named twice."""
    names = list(names)
    fixed = {e.id for e in problem.model.effects if not may_differ(problem, e)}
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f'effect {name} is named twice')
        if name in fixed:
            raise ParameterError(f'the model already has the effect {name}')
    if not names:
        raise ParameterError('no effect is named; `hysteresis effects` lists them')
    return [effect_class(name) for name in names]


def _on_bench(problem: BenchProblem, model: MuscleModel, classes: Sequence[type[Effect]]
              ) -> list[Fitted]:
    """Fit effects one after the other, each with those before; the weights are refitted."""
    fitter = BenchFitter(problem.finer())
    known: list[Effect] = []
    found: list[Fitted] = []
    for number, kind in enumerate(classes, 1):
        known = [effect for effect in known if effect.id not in kind.replaces]
        effect = present(model, kind, problem.settled)
        fits = [fitter.search(known, effect)]
        if known:
            fits.append(fitter.fit(usual([*known, effect], problem.kind)))
        fit = min(fits, key=lambda one: fitter.error(one.predicted))
        if number == len(classes):
            fit = fitter.fit(fit.effects, evaluations=EVALUATIONS, tolerance=TOLERANCE)
        known = fit.effects
        found.append((fitter.with_intervals(fit), fit.implausible()))
    return found


def _on_arm(problem: ArmProblem, model: MuscleModel, classes: Sequence[type[Effect]]
            ) -> list[Fitted]:
    """Fit effects one after the other, each with those before; the weights stay."""
    selection = Selection(problem, Settings(), np.random.default_rng(0), lambda items, total: items)
    fit = selection.sets.base
    found: list[Fitted] = []
    for number, kind in enumerate(classes, 1):
        fit = selection.add(fit, present(model, kind, problem.settled))
        if number == len(classes) > 1:
            fit = selection.each_anew(fit)
        best = selection.fitter.least_squares(fit)
        added = sorted(selection.fitter.with_intervals(best),
                       key=lambda effect: classes.index(type(effect)))
        found.append((added, best.implausible()))
    return found


def _stamped(model: MuscleModel, added: Iterable[Effect], train: Iterable[Measurement],
             kind: str, by_hand: bool = False) -> MuscleModel:
    """Note in the provenance what was added from which recordings."""
    provenance = dict(model.provenance)
    history = list(provenance.get('extended', []))
    history.append({
        'kind': kind,
        'effects': [effect.id for effect in added],
        'data': [{'source': str(m.source).rsplit('/', 1)[-1],
                  'sha256': m.digest or hashlib.sha256(
                      m.column(m.response).tobytes()).hexdigest()} for m in train],
        **({'by_hand': True} if by_hand else {})})
    provenance['extended'] = history
    return dataclasses.replace(model, provenance=provenance)
