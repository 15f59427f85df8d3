# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Structure that no effect explains: a flexible regression on the signals, and events in time.

What a regression can predict on held-out rows is no noise, whatever its cause. It serves as a
yardstick only and is never offered as a model.
"""

import dataclasses

import numpy as np

FEATURES = 60
RIDGES = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
# An event is a lasting step; on each side of it at least this share of the rows is needed.
EVENT_MARGIN = 0.06
# By so much of the residual's mean square a step has to beat a steady drift.
DRIFT_MARGIN = 0.1


@dataclasses.dataclass
class Leftover:
    """
    What is left in a residual.

    Attributes
    ----------
    explained : float
        Share of its mean square that a flexible regression predicts on held-out rows, 0 to 1.
    signal : str
        The signal that alone explains most; '' if nothing is explained.
    event : float or None
        Time [s] since the recording began of a lasting step, where one stands out.
    event_share : float
        Share of the mean square that the step explains.
    """

    explained: float
    signal: str
    event: float | None
    event_share: float


def flexible(signals: dict, residual: np.ndarray, fold: np.ndarray, seed: int = 0) -> float:
    """
    Share of the residual's mean square that a regression predicts on held-out rows.

    Random cosine features of all signals with ridge regression; the best of some ridges is taken,
    which favours the regression a little.
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


def lasting_step(residual: np.ndarray, shape: np.ndarray | None = None) -> tuple[int, float]:
    """
    Find the row from which the residual is another multiple of a shape.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Rows in the order of time.
    shape : ndarray, shape (n,), optional
        What a step of the cause does to each row; the same to all by default.

    Returns
    -------
    row : int
        First row of the second part.
    share : float
        Share of the mean square about one common multiple that the step explains, less what a
        steady drift explains; 0 if it explains no more than that.
    """
    count = len(residual)
    margin = max(2, int(EVENT_MARGIN * count))
    if count < 4 * margin:
        return 0, 0.0
    shape = np.ones(count) if shape is None else shape
    moment, size = np.cumsum(residual * shape), np.cumsum(shape * shape)
    common = moment[-1] ** 2 / max(size[-1], 1e-300)
    before, after = size[:-1], size[-1] - size[:-1]
    gain = (moment[:-1] ** 2 / np.maximum(before, 1e-300)
            + (moment[-1] - moment[:-1]) ** 2 / np.maximum(after, 1e-300) - common)
    gain[:margin] = gain[count - margin:] = 0.0
    row = int(np.argmax(gain))
    # A drift, too, is higher at its end than at its start.
    columns = shape[:, None] * np.stack([np.ones(count), np.arange(count) / count], axis=1)
    weights, *_ = np.linalg.lstsq(columns, residual, rcond=None)
    total = np.sum(residual ** 2)
    drift = total - np.sum((residual - columns @ weights) ** 2) - common
    left = max(total - common, 1e-300)
    if gain[row] < drift + DRIFT_MARGIN * left:
        return row + 1, 0.0
    return row + 1, float(gain[row] / left)


def event_of(problem, residual: np.ndarray, sensitivity=None) -> tuple[float | None, float]:
    """
    Find the moment at which something happened that lasts.

    Parameters
    ----------
    problem : Problem
        Rows.
    residual : ndarray, shape (n,)
        Measured less predicted.
    sensitivity : ndarray, shape (n,), optional
        How the response follows the muscle's length: a crimp that slips shows in proportion.

    Returns
    -------
    time : float or None
        Seconds since the first recording began; None where nothing stands out.
    share : float
        See `lasting_step`.
    """
    shapes = [None] if sensitivity is None else [None, sensitivity]
    row, share = max((lasting_step(residual, shape) for shape in shapes),
                     key=lambda found: found[1])
    return (float(problem.clock[row]), share) if share > 0.0 else (None, 0.0)


def examine(problem, residual: np.ndarray, sensitivity=None) -> Leftover:
    """
    Look for structure in a residual.

    Parameters
    ----------
    problem, residual, sensitivity
        As for `event_of`.
    """
    together = flexible(problem.signals, residual, problem.fold)
    # One signal alone may show what the regression on all of them does not learn from few rows.
    alone = {name: flexible({name: values}, residual, problem.fold)
             for name, values in problem.signals.items()}
    signal = max(alone, key=alone.get, default='')
    share = max([together, *alone.values()])
    event, event_share = event_of(problem, residual, sensitivity)
    return Leftover(share, signal if share > 0.1 else '', event, event_share)
