# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which problem suits the kind of the measurements."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from hysteresis_ros.diagnosis.arm_problem import ArmProblem
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.effects import effect_class
from hysteresis_ros.errors import MeasurementError

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel


def problem_for(model: MuscleModel, measurements: Iterable[Measurement],
                effects: Iterable[str] | None = None, jobs: int = 1) -> ArmProblem | BenchProblem:
    """
    Return the problem that suits the kind of the measurements.

    Parameters
    ----------
    model : MuscleModel
    measurements : sequence of Measurement
    effects : sequence of str, optional
        Effects to try; by default the whole catalogue.
    jobs : int
        Processes for the fits; -1 for all cores.

    Returns
    -------
    ArmProblem or BenchProblem

    Raises
    ------
    MeasurementError
        If they are of kinds that cannot be judged together, or hold nothing to explain.
    ParameterError
        If an effect is unknown.
    """
    measurements = list(measurements)
    if not measurements:
        raise MeasurementError('no measurement was given; name CSV files or bag folders')
    if all(m.kind == 'bench' for m in measurements):
        measurements = [m for m in measurements if m.response != 'force']
        if not measurements:
            raise MeasurementError('a force table at resting length has no load to explain; give '
                                   'the length table as well')
    kinds = sorted({f'{m.kind} {m.response}' for m in measurements})
    if len(kinds) > 1:
        raise MeasurementError(f'the measurements are of several kinds ({", ".join(kinds)}); give '
                               'either bench tables or arm runs')
    kind: type[ArmProblem | BenchProblem] = (
        BenchProblem if measurements[0].kind == 'bench' else ArmProblem)
    problem = kind(model, measurements)
    problem.jobs = jobs
    if effects is not None:
        problem.catalogue = tuple(effect_class(name).id for name in effects)
    return problem
