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
from hysteresis_ros.effects import Effect, Parameter
from hysteresis_ros.workers import map_in_forks

# Values over the physical range at which held-out rows are predicted, and of the posterior density.
VALUES, POSTERIOR = 7, 601


def can_be_located(effect: Effect, kind: str) -> bool:
    """Whether an effect has one parameter, which is positive, on a kind of measurement."""
    free = _free(effect, kind)
    return len(free) == 1 and free[0].log


def _free(effect: Effect, kind: str) -> list[Parameter]:
    return [parameter for parameter in effect.parameters
            if kind in parameter.kinds and not parameter.choices]


def located(fitter: BenchFitter, known: Sequence[Effect], effect: Effect
            ) -> tuple[float, list[Effect]] | None:
    """
    Return the effects with the most probable value of the last one, given held-out rows.

    Beforehand every value of the plausible range is as likely as another, on a logarithmic scale.
    The errors of held-out rows have an unknown variance and are as many as there are blocks of
    rows, so that the likelihood goes with their root mean square to the power of minus that number.
    None where held-out rows speak for an end of the range: for no effect, or for one beyond it.

    Parameters
    ----------
    fitter : BenchFitter
        Rows.
    known : sequence of Effect
        Effects that are fitted for every value.
    effect : Effect
        The other one, of one positive parameter.

    Returns
    -------
    error : float
        Held-out RMSE, in the unit of the response.
    effects : list of Effect
        All, with intervals.
    """
    if not can_be_located(effect, fitter.problem.kind):
        return None
    free = _free(effect, fitter.problem.kind)
    name = free[0].name

    def fitter_at(value: float) -> BenchFitter:
        return fitter.apart().holding([effect.with_values(**{name: value})])

    def error_at(value: float) -> float:
        other = fitter_at(value)
        return other.error(other.cross_validate(other.fit(known)).held_out)

    values = np.geomspace(free[0].low, free[0].high, VALUES)
    errors = np.array(map_in_forks(error_at, values.tolist(), fitter.problem.jobs))
    best = int(np.argmin(errors))
    if best in (0, len(values) - 1):
        return None
    between = np.sqrt(values[best - 1:best + 1] * values[best:best + 2])
    values = np.insert(values, [best, best + 1], between)
    errors = np.insert(errors, [best, best + 1], map_in_forks(
        error_at, between.tolist(), fitter.problem.jobs))
    # Between the values that were tried the logarithm of the error is a line.
    fine = np.linspace(np.log(values[0]), np.log(values[-1]), POSTERIOR)
    density = -len(np.unique(fitter.problem.block)) * np.interp(
        fine, np.log(values), np.log(errors))
    below = np.cumsum(np.exp(density - density.max()))
    low, high = np.exp(np.interp([0.025, 0.975], below / below[-1], fine))
    value = float(np.exp(fine[np.argmax(density)]))
    other = fitter_at(value)
    fit = other.fit(known)
    found = effect.with_values(**{name: value})
    found.intervals[name] = float(low), float(high)
    return (other.error(other.cross_validate(fit).held_out), [*other.with_intervals(fit), found])
