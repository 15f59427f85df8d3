# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What properties of the wire that hardly any bench shows would explain of an arm's error.

Martensite that keeps strain, and kinetics that leave minor loops open: part of the base model's own
error, and nothing that the arm lacks. Where one of them explains much, a user had better know: it
can be added.
"""

from __future__ import annotations

import itertools
from typing import Any, TYPE_CHECKING

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.diagnosis.discrepancy import COURSES
from hysteresis_ros.diagnosis.fitted_sets import rms
from hysteresis_ros.diagnosis.observable import unaffected

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.selection import Selection
    from hysteresis_ros.effects import Effect


def not_on_bench(selection: Selection, fit: Fit) -> dict[str, dict[str, Any]]:
    """
    Return what each of them would explain besides the effects of a fit.

    Parameters
    ----------
    selection : Selection
        Problem, settings and random numbers.
    fit : Fit
        The set that was chosen.

    Returns
    -------
    dict of str to dict
        By the effect's identifier 'effect', its parameter with the share of it, and the RMSE
        'rmse_before' and 'rmse_after' of the rows diagnosed, in the unit of the response. Without
        those that were tried or are known, or are not sure to lower the RMSE by what matters.
    """
    problem, surroundings = selection.problem, selection.problem.model.surroundings
    before = problem.measured - fit.predicted
    discrepancy = (fit.covariance or selection.covariance).discrepancy
    effects = [*unaffected(selection.fixed, fit.effects), *fit.effects]
    found: dict[str, dict[str, Any]] = {}
    kept, kinetics, hung_cold, *_ = discrepancy.shares(before).tolist()
    for kind, share in zip(COURSES, (min(kept + hung_cold, 1.0), kinetics)):
        size = kind.parameters[0]
        if share < size.low:
            continue
        responses = problem.simulate_many([
            [*effects, kind(surroundings, **{size.name: share}, **form)] for form in _forms(kind)])
        after = min((problem.measured - response for response in responses), key=rms)
        gain, _ = significance.gain_interval(before, after, problem.block, selection.rng)
        if gain >= selection.settings.practical:
            found[kind.id] = {'effect': kind.id, size.name: share,
                              'rmse_before': rms(before), 'rmse_after': rms(after)}
    return found


def _forms(kind: type[Effect]) -> list[dict[str, float]]:
    """Return the values of what is chosen of an effect on an arm, in all combinations."""
    chosen = [parameter for parameter in kind.parameters
              if parameter.choices and 'arm' in parameter.kinds]
    return [dict(zip([one.name for one in chosen], values))
            for values in itertools.product(*(one.choices for one in chosen))]
