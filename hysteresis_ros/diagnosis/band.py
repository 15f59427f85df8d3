# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far an arm may be off its model without anything being missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.arm_problem import ArmProblem
from hysteresis_ros.diagnosis.covariance import Covariance
from hysteresis_ros.diagnosis.discrepancy import discrepancy_along
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.measurements.table import Measurement

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel

# Holds of the sweep, up and down, and seconds of each.
HOLDS, SECONDS = 30, 30.0


def error_band(model: MuscleModel, settings: Settings = Settings(), seed: int = 0) -> float:
    """
    Return the RMSE [rad] that the base model's own error stays below at 95 %.

    It is that of the diagnosis (`Covariance.largest_error`), for an arm that goes once through its
    whole range and back: from the errors that the bench has shown, and from what no bench shows.

    Parameters
    ----------
    model : MuscleModel
        With an arm.
    settings : Settings
    seed : int
        Of the random draws.

    Returns
    -------
    float
    """
    low, high = model.ranges[model.drive]
    up = np.linspace(low, high, HOLDS + 1)[1:]
    drive = np.concatenate((up, up[-2::-1]))
    time = SECONDS * np.arange(1, len(drive) + 1)
    ramp = np.linspace(1.0, 2.0, len(drive))    # no response yet, but not a constant
    problem = ArmProblem(model, [Measurement.from_columns(
        {'time': time, model.drive: drive, 'angle': ramp}, 'sweep')])
    effects = list(model.effects)
    predicted = problem.simulate(effects)
    discrepancy = discrepancy_along(problem, effects, predicted, settings)
    covariance = Covariance(discrepancy, problem.clock, problem.trial, 0.0, 1.0,
                            settings.scale_spread)
    return covariance.largest_error(np.random.default_rng(seed), settings.draws)
