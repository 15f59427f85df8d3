# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Identify a bench model again without each of the bench's loads: its jackknife replicates."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_fit import MOST_EVALUATIONS, Response, TOLERANCE
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.identification.least_squares import folds_of
from hysteresis_ros.model.replicates import Replicate
from hysteresis_ros.operators import Preisach
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel


def with_replicates(model: MuscleModel, problem: BenchProblem, by_hand: bool = False
                    ) -> MuscleModel:
    """
    Return a model with H2 and effects as the bench gives them without each of its loads.

    Where all loads are the same, without each trial; of a single trial, without parts of it.

    Parameters
    ----------
    model : MuscleModel
        As identified, with effects or without.
    problem : BenchProblem
        Of the rows that it was identified from.
    by_hand : bool
        Whether the effects keep their values, and only the weights are fitted.

    Returns
    -------
    MuscleModel
    """
    stage = model.length_stage
    assert isinstance(stage, Preisach)      # no other one has effects on a bench
    levels = len(stage.nodes) - 1

    def replicate(left_out: np.ndarray) -> Replicate:
        effects = model.effects
        balanced = problem.balanced(effects, ~left_out)
        if not by_hand:
            response = Response(balanced.finer(), [], effects, ~left_out, informed=True)
            effects = response.parameters.with_vector(response.minimise(
                response.parameters.vector(), MOST_EVALUATIONS, TOLERANCE))
        return Replicate(balanced.stage(effects, levels, ~left_out), effects)

    return dataclasses.replace(model, replicates=map_in_forks(
        replicate, folds_of(problem.left_out_together), problem.jobs))
