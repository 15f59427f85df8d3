# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Sets of effects fitted together, in parallel: begun to see which are worth more, and finished."""

import itertools

import numpy as np

from hysteresis_ros.diagnosis.candidates import finite
from hysteresis_ros.diagnosis.fit import Fit
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.workers import delayed, in_parallel

# Steps of what is begun, by whether rows are settled; others take longer.
BEGUN_EVALUATIONS = {True: 8, False: 4}


def _starts(effects, kind) -> tuple[list, list]:
    """Return usual values of some effects, and those that each had alone."""
    return usual(effects, kind), list(effects)


def _try_set(fitter, effects) -> Fit | None:
    """Fit some effects together for a few steps from both starts; which is better shows then."""
    problem = fitter.problem
    with np.errstate(all='ignore'):
        steps = BEGUN_EVALUATIONS[problem.settled]
        fits = (fitter.fit(problem.model.effects, start, evaluations=steps)
                for start in _starts(effects, problem.kind))
        return finite(min(fits, key=lambda fit: fitter.error(fit.predicted)))


def _finish_set(fitter, fit) -> Fit | None:
    """Fit to the end what was begun, and cross-validate the fit."""
    fixed = fitter.problem.model.effects
    with np.errstate(all='ignore'):
        return finite(fitter.cross_validate(fixed, fitter.finish(fixed, fit)))


def _consider_set(fitter, effects) -> Fit | None:
    """Fit some effects together to the end from both starts, and cross-validate the better fit."""
    problem = fitter.problem
    with np.errstate(all='ignore'):
        best = min((fitter.fit(problem.model.effects, start)
                    for start in _starts(effects, problem.kind)),
                   key=lambda fit: fitter.error(fit.predicted))
        return finite(fitter.cross_validate(problem.model.effects, best))


def subsets(effects, most: int) -> list[list]:
    """Return every set of at most `most` of the effects in which none contains another."""
    return [list(subset) for size in range(1, most + 1)
            for subset in itertools.combinations(effects, size)
            if not any(other.id in effect.replaces for effect in subset for other in subset)]


def consider_sets(fitter, sets, jobs: int, progress) -> list[Fit]:
    """Fit and cross-validate sets of effects, in parallel."""
    return _all_finite(_consider_set, fitter, sets, jobs, progress)


def try_sets(fitter, sets, jobs: int, progress) -> list[Fit]:
    """Fit sets of effects for a few steps, to see which are worth more; in parallel."""
    return _all_finite(_try_set, fitter, sets, jobs, progress)


def finish_sets(fitter, fits, jobs: int, progress) -> list[Fit]:
    """Fit to the end, and cross-validate, what `try_sets` has begun; in parallel."""
    return _all_finite(_finish_set, fitter, fits, jobs, progress)


def _all_finite(task, fitter, items, jobs, progress) -> list[Fit]:
    tasks = [delayed(task)(fitter, item) for item in items]
    return [fit for fit in progress(in_parallel(tasks, jobs), len(items)) if fit is not None]
