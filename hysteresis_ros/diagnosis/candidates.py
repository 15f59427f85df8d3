# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects a recording can show at all, and how well each of them explains it."""

import dataclasses
import math

import numpy as np

from hysteresis_ros.diagnosis.fit import beside, FIRST_EVALUATIONS, Fit
from hysteresis_ros.diagnosis.parameters import starts_of, usual
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.workers import delayed, in_parallel

# A recorded temperature [degC] that changes by less is a constant with noise on it.
SMALLEST_CHANGE = 0.5
# Of what was fitted for a few steps, that is fitted to its end which errs by at most this many
# times as much as the best, or as the floor.
HOPEFUL = 1.5


@dataclasses.dataclass
class Candidate:
    """
    One effect, fitted beside those that are already in the model.

    Attributes
    ----------
    id : str
        The effect.
    fit : Fit
        With it; `fit.effects[-1]` is the effect.
    signature : ndarray, shape (n,)
        What it changes in the response.
    rmse : float
        Held-out error with it.
    p_value : float
        Family-wise; 1 until tested.
    """

    id: str
    fit: Fit
    signature: np.ndarray
    rmse: float
    p_value: float = 1.0

    @property
    def effect(self):
        """The fitted effect."""
        return self.fit.effects[-1]


def possible(problem, known) -> tuple[list[str], dict[str, str]]:
    """
    Divide the catalogue into effects to try and effects that this data cannot show.

    Returns
    -------
    list of str, dict of str to str
        Identifiers to try; identifiers that are left out with the reason.
    """
    surroundings = problem.model.surroundings
    taken = {effect.id for effect in known} | {
        effect.id for effect in problem.model.effects if not may_differ(problem, effect)}
    # What one that is known already contains is not tried beside it.
    taken |= {name for effect in known for name in effect.replaces}
    names, hopeless = [], {}
    for name, effect in catalogue().items():
        if name in taken or problem.kind not in effect.kinds:
            continue
        if not effect.available(surroundings):
            continue
        column = effect.needs_column
        if effect.needs_transients and problem.settled:
            hopeless[name] = 'every row is settled'
        elif column and not any(
                np.ptp(m.columns[column]) > SMALLEST_CHANGE if column in m.columns else False
                for m in problem.measurements):
            hopeless[name] = f'{column} was not recorded or did not change'
        else:
            names.append(name)
    return names, hopeless


def present(model, kind):
    """Return the model's own effect of a kind, or a neutral one."""
    own = [effect for effect in model.effects if effect.id == kind.id]
    return own[0] if own else kind(model.surroundings)


def may_differ(problem, effect) -> bool:
    """Whether an effect of the model may be another one here than on the bench that showed it."""
    return problem.kind == 'arm' and 'bench' in effect.kinds


def begin(fitter, known, starts) -> Fit | None:
    """
    Fit one effect for a few steps.

    Beside others from their values, and from usual values of all, where that does not take long:
    what stood in for the new effect may hold its own values fast.

    Parameters
    ----------
    fitter : Fitter
        For the problem.
    known : list of Effect
        Effects found before.
    starts : list of Effect
        The effect to try, from where it may start.

    Returns
    -------
    Fit or None
        None if the simulation with it is not finite.
    """
    others = [effect for effect in known if effect.id not in starts[0].replaces]
    fixed, together = fitter.problem.model.effects, [*others, starts[0]]
    with np.errstate(all='ignore'):
        fits = [fitter.begin(fixed, others, starts)]
        if others and not any(map(_takes_long, together)):
            fits.append(fitter.fit(fixed, usual(together, fitter.problem.kind),
                                   evaluations=FIRST_EVALUATIONS))
        return finite(min(fits, key=lambda fit: fitter.error(fit.predicted)))


def _takes_long(effect) -> bool:
    """Whether simulations with an effect take long: what follows the phase, or moves the arm."""
    return effect.needs_phase or getattr(effect, 'moves', False)


def finish(fitter, current: Fit, fit: Fit) -> Candidate | None:
    """
    Fit the last of some effects to the end, and cross-validate it.

    Parameters
    ----------
    fitter : Fitter
        For the problem.
    current : Fit
        The fit without it, cross-validated.
    fit : Fit
        See `begin`.
    """
    fixed, refits = fitter.problem.model.effects, fitter.problem.refits
    with np.errstate(all='ignore'):
        good = fitter.promises(fit, fitter.error(current.predicted))
        fit = fitter.finish(fixed, fit) if good else fit
        fit = fitter.cross_validate(fixed, fit, straight=not (good or refits))
    if finite(fit) is None:
        return None
    return Candidate(fit.effects[-1].id, fit, fit.predicted - current.predicted,
                     fitter.error(fit.held_out))


def consider(fitter, current: Fit, name: str) -> Candidate | None:
    """Fit and cross-validate one effect by itself; see `begin` and `finish`."""
    model = fitter.problem.model
    fit = begin(fitter, [], fitter.starts(model.effects, present(model, catalogue()[name])))
    return None if fit is None else finish(fitter, current, fit)


def consider_all(fitter, current: Fit, names, jobs: int, progress) -> list[Candidate]:
    """Try every effect named by itself, in parallel, best first; see `consider`."""
    # What takes longest begins first, so that no process has to wait for it: an arm in motion.
    names = sorted(names, key=lambda name: (
        not catalogue()[name].needs_transients, catalogue()[name].stage != 'mechanism'))
    tasks = [delayed(consider)(fitter, current, name) for name in names]
    return _ranked(progress(in_parallel(tasks, jobs), len(names)))


def consider_beside(fitter, current: Fit, looks, floor, jobs: int,
                    progress) -> tuple[list[Candidate], list[Fit]]:
    """
    Try effects beside those of a fit, in parallel.

    Parameters
    ----------
    fitter : Fitter
        For the problem.
    current : Fit
        With the effects that are known, cross-validated.
    looks : list of list of Effect
        Effects to try, each from where it may start.
    floor : float
        Error that base model and sensor leave by themselves.
    jobs, progress
        As for `Search`.

    Returns
    -------
    list of Candidate, list of Fit
        What was fitted to the end, best first; what a few steps showed to be hopeless.
    """
    tasks = [delayed(begin)(fitter, current.effects, starts) for starts in looks]
    begun = [fit for fit in progress(in_parallel(tasks, jobs), len(tasks)) if fit is not None]
    good = hopeful(fitter, begun, floor)
    tasks = [delayed(finish)(fitter, current, fit) for fit in good]
    candidates = _ranked(progress(in_parallel(tasks, jobs), len(good)))
    return candidates, [fit for fit in begun if not any(fit is one for one in good)]


def hopeful(fitter, fits, floor) -> list[Fit]:
    """Return the fits that may yet be among the best."""
    errors = [fitter.error(fit.predicted) for fit in fits]
    limit = HOPEFUL * max(min(errors, default=0.0), floor)
    return [fit for fit, error in zip(fits, errors) if error <= limit]


def _ranked(candidates) -> list[Candidate]:
    return sorted((candidate for candidate in candidates
                   if candidate is not None and math.isfinite(candidate.rmse)),
                  key=lambda candidate: candidate.rmse)


def finite(fit) -> Fit | None:
    """Return a fit, or None where the simulation with it is not finite."""
    judged = fit.predicted if fit.held_out is None else fit.held_out
    return fit if np.all(np.isfinite(judged)) and np.all(np.isfinite(fit.jacobian)) else None


def changes_beside(problem, effects, candidates, jobs: int,
                   progress) -> list[list[tuple[Effect, np.ndarray]]]:
    """
    Return what each candidate changes beside other effects, from each of its starts.

    What takes long to simulate, but hardly matters to what another changes, is left out of the
    others: the arm's own motion, and what follows the phase.

    Parameters
    ----------
    problem : Problem
        Rows and model.
    effects : sequence of Effect
        The others, with values.
    candidates : sequence of Candidate
        Fitted by themselves; those values are a start, too.
    jobs, progress
        As for `Search`.

    Returns
    -------
    list of list of (Effect, ndarray of shape (n,))
        For each candidate its starts with what they change.
    """
    effects = [effect for effect in effects if not _takes_long(effect)]
    without = problem.simulate([*beside(problem.model.effects, effects), *effects])
    tasks = [delayed(_changes)(problem, effects, candidate.effect, without)
             for candidate in candidates]
    return list(progress(in_parallel(tasks, jobs), len(tasks)))


def _changes(problem, effects, fitted, without):
    effect = present(problem.model, catalogue()[fitted.id])
    changes = []
    with np.errstate(all='ignore'):
        for start in [*starts_of(effect, problem.kind, problem.measured), fitted]:
            together = [*effects, start]
            change = problem.simulate(
                [*beside(problem.model.effects, together), *together]) - without
            changes.append((start, np.where(np.isfinite(change), change, 0.0)))
    return changes
