# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The value of a parameter that fitted rows of a bench do not determine, by rows that are held out.

H2's weights take up what a small elastic stretch does under the loads that they are fitted to. They
cannot do so for a load that they have not seen, and what is predicted there tells the stretch.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.effects import Effect

# Values over the physical range at which held-out rows are predicted.
VALUES = 7


def located(fitter: BenchFitter, known: Sequence[Effect], effect: Effect, practical: float
            ) -> tuple[float, list[Effect]] | None:
    """
    Return the effects with the value of the last one that predicts held-out rows best.

    None where held-out rows do not determine the value, either.

    Parameters
    ----------
    fitter : BenchFitter
        Rows.
    known : sequence of Effect
        Effects that are fitted for every value.
    effect : Effect
        The other one, of one positive parameter.
    practical : float
        Share by which the error has to be larger outside the parameter's interval.

    Returns
    -------
    error : float
        Held-out RMSE, in the unit of the response.
    effects : list of Effect
        All, with intervals.
    """
    free = [parameter for parameter in effect.parameters if fitter.problem.kind in parameter.kinds]
    if len(free) != 1 or not free[0].log:
        return None
    name = free[0].name
    other = BenchFitter(fitter.problem)

    def error_at(value: float) -> float:
        other.fixed = [*fitter.fixed, effect.with_values(**{name: value})]
        return other.error(other.cross_validate(other.fit(known)).held_out)

    values = np.geomspace(free[0].low, free[0].high, VALUES)
    errors = np.array([error_at(value) for value in values.tolist()])
    best = int(np.argmin(errors))
    if best in (0, len(values) - 1):
        return None
    between = np.sqrt(values[best - 1:best + 1] * values[best:best + 2])
    values = np.insert(values, [best, best + 1], between)
    errors = np.insert(errors, [best, best + 1], [error_at(value) for value in between.tolist()])
    best = int(np.argmin(errors))
    most = (1.0 + practical) * errors[best]
    ends = []
    for side in (slice(best, None, -1), slice(best, None)):
        inside, there = errors[side], np.log(values[side])
        beyond = np.flatnonzero(inside > most)
        # It has to rise, and to stay there: else it is noise that has a minimum.
        if len(beyond) == 0 or np.any(inside[beyond[0]:] <= most):
            return None
        pair = slice(beyond[0] - 1, beyond[0] + 1)
        ends.append(float(np.exp(np.interp(most, inside[pair], there[pair]))))
    value = float(values[best])
    other.fixed = [*fitter.fixed, effect.with_values(**{name: value})]
    found = effect.with_values(**{name: value})
    found.intervals[name] = ends[0], ends[1]
    return float(errors[best]), [*other.with_intervals(other.fit(known)), found]
