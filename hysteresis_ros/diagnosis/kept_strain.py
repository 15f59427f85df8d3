# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What martensite that keeps strain would explain of an arm's error.

No bench of constant loads shows it, so that it is part of the base model's own error and nothing
that the arm lacks. Where it explains much, a user had better know: it can be added.
"""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.diagnosis.observable import unaffected
from hysteresis_ros.effects.formation_memory import FormationMemory

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.selection import Selection


def kept_strain(selection: Selection, fit: Fit) -> dict[str, Any] | None:
    """
    Return what `formation_memory` would explain besides the effects of a fit.

    Parameters
    ----------
    selection : Selection
        Problem, settings and random numbers.
    fit : Fit
        The set that was chosen.

    Returns
    -------
    dict or None
        'effect', 'kept' and the RMSE 'rmse_before' and 'rmse_after' of the rows diagnosed, in the
        unit of the response; None where that effect was tried or is known, or where it is not sure
        to lower the RMSE by what matters.
    """
    problem, surroundings = selection.problem, selection.problem.model.surroundings
    before = problem.measured - fit.predicted
    discrepancy = (fit.covariance or selection.covariance).discrepancy
    kept, (size,) = discrepancy.kept_share(before), FormationMemory.parameters
    if kept < size.low:
        return None
    effects = [*unaffected(selection.fixed, fit.effects), *fit.effects]
    response, = problem.simulate_many([[*effects, FormationMemory(surroundings, kept=kept)]])
    after = problem.measured - response
    gain, _ = significance.gain_interval(before, after, problem.block, selection.rng)
    if not gain >= selection.settings.practical:
        return None
    return {'effect': FormationMemory.id, 'kept': kept,
            **{name: float(np.sqrt(np.mean(residual ** 2)))
               for name, residual in (('rmse_before', before), ('rmse_after', after))}}
