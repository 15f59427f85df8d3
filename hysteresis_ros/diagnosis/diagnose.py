# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Find the physical effects that a model is missing, or say why none can be named."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.arm_verdict import arm_verdict
from hysteresis_ros.diagnosis.bench_verdict import bench_verdict
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.diagnosis.verdict import Diagnosis, shown_or_not
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.workers import one_blas_thread

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.workers import Progress

__all__ = ['Diagnosis', 'diagnose']

# Fewer rows cannot be divided into folds of which each says something.
FEWEST_ROWS = 8


def _silent(items: Iterable, total: int) -> Iterable:
    return items


@one_blas_thread()
def diagnose(model: MuscleModel, measurements: Sequence[Measurement],
             effects: Sequence[str] | None = None, *, jobs: int = 1, seed: int = 0,
             settings: Settings = Settings(), progress: Progress = _silent) -> Diagnosis:
    """
    Find what the model is missing.

    Parameters
    ----------
    model : MuscleModel
        With the effects it already has.
    measurements : sequence of Measurement
        Bench tables or arm runs.
    effects : sequence of str, optional
        Effects to try; by default the whole catalogue.
    jobs : int
        Processes; -1 for all cores. Beside other threads, as in a notebook, long simulations of an
        arm are shared between threads instead.
    seed : int
        Of the random draws behind the p values and the intervals of the gains.
    settings : Settings
        Numbers that the selection rests on.
    progress : callable
        ``progress(items, total)`` returns the items, for a progress bar.

    Returns
    -------
    Diagnosis

    Raises
    ------
    MeasurementError, ParameterError
        If measurement and model do not fit together, there are too few rows, or an effect is
        unknown.
    """
    problem = problem_for(model, measurements, effects, jobs)
    if len(problem.measured) < FEWEST_ROWS:
        raise MeasurementError(f'a diagnosis needs at least {FEWEST_ROWS} rows, and the recordings '
                               f'have {len(problem.measured)}; record more, or give more files')
    rng = np.random.default_rng(seed)
    found = (bench_verdict(problem, settings, rng, jobs, progress) if problem.refits
             else arm_verdict(problem, settings, rng, progress))
    return shown_or_not(dataclasses.replace(
        found, quantity=problem.response, draws=settings.draws))
