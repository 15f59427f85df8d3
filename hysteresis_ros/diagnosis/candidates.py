# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects a recording can show at all, and how well each of them explains it."""

import dataclasses
import itertools
import math

import joblib
import numpy as np

from hysteresis_ros.diagnosis.fit import beside, FIRST_EVALUATIONS, Fit
from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.effects import catalogue

# A recorded temperature [degC] that changes by less is a constant with noise on it.
SMALLEST_CHANGE = 0.5


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


def consider(fitter, known, current: Fit, name: str) -> Candidate | None:
    """
    Fit and cross-validate one effect.

    Parameters
    ----------
    fitter : Fitter
        For the problem.
    known : list of Effect
        Effects found before.
    current : Fit
        The fit with them, cross-validated.
    name : str
        The effect to try.

    Returns
    -------
    Candidate or None
        None if the simulation with it is not finite.
    """
    problem = fitter.problem
    kind = catalogue()[name]
    others = [effect for effect in known if effect.id not in kind.replaces]
    effect = present(problem.model, kind)
    with np.errstate(all='ignore'):
        fit = fitter.search(
            problem.model.effects, others, effect, fitter.error(current.predicted))
        fit = fitter.cross_validate(problem.model.effects, fit)
    if _finite(fit) is None:
        return None
    return Candidate(name, fit, fit.predicted - current.predicted, fitter.error(fit.held_out))


def _in_parallel(tasks, jobs):
    """Return the results in order, one by one where joblib's backend in force can do that."""
    try:
        parallel = joblib.Parallel(n_jobs=jobs, return_as='generator')
    except ValueError:
        # Dask before joblib 1.4 gives all of them at the end.
        parallel = joblib.Parallel(n_jobs=jobs)
    return parallel(tasks)


def consider_all(fitter, known, current: Fit, names, jobs: int, progress) -> list[Candidate]:
    """Try every effect named, in parallel; see `consider`."""
    # What takes longest begins first, so that no process has to wait for it: an arm in motion.
    names = sorted(names, key=lambda name: (
        not catalogue()[name].needs_transients, catalogue()[name].stage != 'mechanism'))
    tasks = [joblib.delayed(consider)(fitter, known, current, name) for name in names]
    found = []
    for candidate in progress(_in_parallel(tasks, jobs), len(names)):
        if candidate is not None and math.isfinite(candidate.rmse):
            found.append(candidate)
    return sorted(found, key=lambda candidate: candidate.rmse)


def _starts(effects, kind) -> tuple[list, list]:
    """Return usual values of some effects, and those that each had alone."""
    usual = []
    for effect in effects:
        starts = starts_of(effect, kind)
        # What is not fitted but chosen was chosen well by the effect alone.
        usual.append(starts[len(starts) // 2].with_values(**{
            parameter.name: effect.values[parameter.name]
            for parameter in effect.parameters if parameter.choices}))
    return usual, list(effects)


def _try_set(fitter, effects) -> Fit | None:
    """Fit some effects together for a few steps from the better start."""
    problem = fitter.problem

    def error(start):
        predicted = problem.simulate([*beside(problem.model.effects, start), *start])
        return fitter.error(predicted)
    with np.errstate(all='ignore'):
        start = min(_starts(effects, problem.kind), key=error)
        return _finite(fitter.fit(problem.model.effects, start, evaluations=FIRST_EVALUATIONS))


def _consider_set(fitter, effects) -> Fit | None:
    """Fit some effects together from the better start, and cross-validate the fit."""
    problem = fitter.problem
    # Which start is the better one shows soon, but for weights that are refitted.
    first = None if problem.refits else FIRST_EVALUATIONS
    with np.errstate(all='ignore'):
        fits = [fitter.fit(problem.model.effects, start, evaluations=first)
                for start in _starts(effects, problem.kind)]
        best = min(fits, key=lambda fit: fitter.error(fit.predicted))
        if not (best.converged or problem.refits):
            best = fitter.fit(problem.model.effects, best.effects)
        return _finite(fitter.cross_validate(problem.model.effects, best))


def _finite(fit) -> Fit | None:
    """Return a fit, or None where the simulation with it is not finite."""
    judged = fit.predicted if fit.held_out is None else fit.held_out
    return fit if np.all(np.isfinite(judged)) and np.all(np.isfinite(fit.jacobian)) else None


def subsets(effects, most: int) -> list[list]:
    """Return every set of at most `most` of the effects in which none contains another."""
    return [list(subset) for size in range(1, most + 1)
            for subset in itertools.combinations(effects, size)
            if not any(other.id in effect.replaces for effect in subset for other in subset)]


def consider_sets(fitter, sets, jobs: int, progress) -> list[Fit]:
    """Fit and cross-validate sets of effects, in parallel."""
    tasks = [joblib.delayed(_consider_set)(fitter, effects) for effects in sets]
    return [fit for fit in progress(_in_parallel(tasks, jobs), len(sets)) if fit is not None]


def try_sets(fitter, sets, jobs: int, progress) -> list[Fit]:
    """Fit sets of effects for a few steps, to see which are worth more; in parallel."""
    tasks = [joblib.delayed(_try_set)(fitter, effects) for effects in sets]
    return [fit for fit in progress(_in_parallel(tasks, jobs), len(sets)) if fit is not None]
