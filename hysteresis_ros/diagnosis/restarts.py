# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits of a bench that begin at other shifts by the load, which has several optima."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects.material import StressDependence
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit
    from hysteresis_ros.diagnosis.bench_fit import BenchFitter
    from hysteresis_ros.effects import Effect

# Shifts to begin at, over the one found.
OTHERS = 0.8, 0.9, 1.1, 1.25


def best_of_restarts(fitter: BenchFitter, effects: Sequence[Effect], practical: float
                     ) -> list[Effect]:
    """
    Return effects fitted from several shifts by the load, with the least error.

    Between two rows a steep wire may transform anywhere, so that shifts under which each load
    transforms between the same rows fit nearly alike, and a fit ends at the next of them.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    effects : sequence of Effect
        As fitted, some perhaps to loads held out.
    practical : float
        Share by which the error has to be less.

    Returns
    -------
    list of Effect
        In the same order: those given where no other start has so much less error, or where no
        effect shifts the transformation, else fitted anew, with intervals.
    """
    shift = next((one for one in effects if one.id == StressDependence.id), None)
    if shift is None:
        return list(effects)

    def begun_at(factor: float) -> tuple[float, Fit | None]:
        own = fitter.apart()
        start = [one.with_values(C=factor * one.C) if one is shift else one for one in effects]
        with np.errstate(all='ignore'):
            fit = own.fit(start)
        if not np.all(np.isfinite(fit.predicted)) or fit.implausible():
            return np.inf, None
        return own.error(fit.predicted), fit

    (present, _), *others = map_in_forks(begun_at, (1.0, *OTHERS), fitter.problem.jobs)
    error, best = min(others, key=lambda one: one[0])
    if best is None or not error < (1.0 - practical) * present:
        return list(effects)
    return fitter.with_intervals(best)
