# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Something that happened once and lasts: a step of the response at an unknown moment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.discrepancy import sensitivity

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.selection import Selection

# On each side of the moment at least this share of the rows is needed.
MARGIN = 0.06


def most_probable(problem: ArmProblem, selection: Selection) -> tuple[float | None, float]:
    """
    Return when something may have happened, and how probable that is against the sets of effects.

    A step of unknown size in the response, or in the muscle's length, is one more column of the
    response; its size has a Gaussian prior of the size of the residual, and each moment the same
    probability.

    Parameters
    ----------
    problem : ArmProblem
    selection : Selection

    Returns
    -------
    time : float or None
        Seconds since the first recording began; None for a recording that is too short.
    log_posterior : float
        On the scale of `FittedSets.log_posterior`.
    """
    count = len(problem.measured)
    margin = max(2, int(MARGIN * count))
    if count < 4 * margin:
        return None, -np.inf
    residual = problem.measured - selection.sets.base.predicted
    rows = np.arange(margin, count - margin)
    steps = (np.arange(count)[:, None] >= rows[None, :]).astype(float)
    gain = sensitivity(problem, selection.fixed)
    shapes = [np.ones(count), gain / max(float(np.sqrt(np.mean(gain ** 2))), 1e-300)]
    prior = max(float(np.mean(residual ** 2)), 1e-300)
    best, moment = -np.inf, rows[0]
    # As any effect, it has to explain more than the base model's own error.
    own = selection.covariance.discrepancy.besides_courses(residual)
    large = [_explained(own, steps * shape[:, None]) > selection.covariance.size ** 2
             for shape in shapes]
    for point in selection.covariance.points:
        whitened = point.whiten(residual)
        for shape, explains in zip(shapes, large):
            columns = point.whiten(steps * shape[:, None])
            precision = np.sum(columns ** 2, axis=0) + 1.0 / prior
            slope = columns.T @ whitened
            size = slope / precision
            evidence = (point.log_density(whitened[:, None] - columns * size)
                        - 0.5 * size ** 2 / prior - 0.5 * np.log(precision * prior))
            evidence[~explains] = -np.inf
            index = int(np.argmax(evidence))
            if evidence[index] > best:
                best, moment = float(evidence[index]), rows[index]
    total = best / selection.sets.temper + selection.sets.odds - math.log(len(rows) * len(shapes))
    return float(problem.clock[moment]), total


def _explained(residual: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return by how much each column (n, m) lowers the mean square of a residual, shape (m,)."""
    return (columns.T @ residual) ** 2 / np.sum(columns ** 2, axis=0) / len(residual)
