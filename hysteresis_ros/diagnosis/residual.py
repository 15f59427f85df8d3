# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a flexible regression on the recorded signals predicts of a residual.

What it can predict on held-out rows is no noise, whatever its cause. It serves as a yardstick
only and is never offered as a model.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.problem import Problem

FEATURES = 60
RIDGES = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
# A signal that explains less than this share says nothing.
LEAST_SHARE = 0.1


def predictable(signals: Mapping[str, np.ndarray], residual: np.ndarray, fold: np.ndarray,
                seed: int = 0) -> float:
    """
    Share of the residual's mean square that a regression predicts on held-out rows.

    Random cosine features of all signals with ridge regression; the best of some ridges is taken,
    which favours the regression a little.

    Parameters
    ----------
    signals : dict of str to ndarray, shape (n,)
    residual : ndarray, shape (n,)
    fold : ndarray of int, shape (n,)
        Which rows are held out together.
    seed : int
        Of the features.

    Returns
    -------
    float
        From 0 to 1.
    """
    if not signals:
        return 0.0
    columns = np.column_stack([
        (values - values.mean()) / max(values.std(), 1e-12) for values in signals.values()])
    columns = np.clip(columns, -4.0, 4.0)
    rng = np.random.default_rng(seed)
    waves = rng.standard_normal((columns.shape[1], FEATURES)) * rng.choice(
        (0.3, 1.0), size=FEATURES)
    features = np.column_stack([
        np.ones(len(columns)), columns,
        np.cos(columns @ waves + rng.uniform(0.0, 2.0 * np.pi, FEATURES))])
    errors = np.zeros(len(RIDGES))
    for number in np.unique(fold):
        test = fold == number
        train = features[~test]
        gram, moment = train.T @ train, train.T @ residual[~test]
        for index, ridge in enumerate(RIDGES):
            weights = np.linalg.solve(gram + ridge * len(train) / 10.0 * np.eye(len(gram)), moment)
            errors[index] += np.sum((residual[test] - features[test] @ weights) ** 2)
    total = np.sum(residual ** 2)
    return float(max(0.0, 1.0 - np.min(errors) / max(total, 1e-300)))


def heteroscedasticity_p_value(residual: np.ndarray, trial: np.ndarray,
                               rng: np.random.Generator, draws: int) -> float:
    """
    Return the p value of a residual that is not as large at all times, as noise is.

    Residuals of neighbouring rows are alike in size then: the correlation of the ranks of their
    sizes, against that of rows in random order (McLeod and Li, J. Time Series Anal. 4 (1983) 269,
    who take squares, of which a single row can decide).

    Parameters
    ----------
    residual : ndarray, shape (n,)
        In the order in which the rows were recorded.
    trial : ndarray, shape (n,)
        Whose rows lie side by side.
    rng : numpy.random.Generator
    draws : int
        Random orders; 1 / (1 + draws) is the smallest p value.

    Returns
    -------
    float
    """
    ranks = np.argsort(np.argsort(np.abs(residual))) - 0.5 * (len(residual) - 1)
    neighbours = np.flatnonzero(np.diff(trial) == 0)

    def alike(values: np.ndarray) -> float:
        return float(values[neighbours] @ values[neighbours + 1])

    by_chance = [alike(rng.permutation(ranks)) for _ in range(draws)]
    return float(1.0 + np.sum(np.array(by_chance) >= alike(ranks))) / (1.0 + draws)


def shares(problem: Problem, residual: np.ndarray) -> dict[str, float]:
    """
    Return the share of a residual's mean square that each signal predicts, and 'all' together.

    Parameters
    ----------
    problem : Problem
    residual : ndarray, shape (n,)

    Returns
    -------
    dict of str to float
    """
    found = {name: predictable({name: values}, residual, problem.fold)
             for name, values in problem.signals.items()}
    return {**found, 'all': predictable(problem.signals, residual, problem.fold)}


def unexplained_signal(problem: Problem, residual: np.ndarray) -> str:
    """Return the signal that alone predicts most of a residual (n,), '' if none predicts any."""
    found = shares(problem, residual)
    del found['all']
    name = max(found, key=found.__getitem__, default='')
    return name if found.get(name, 0.0) > LEAST_SHARE else ''
