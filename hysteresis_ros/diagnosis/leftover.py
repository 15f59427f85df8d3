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


@dataclasses.dataclass
class Leftover:
    """
    What is left in a residual.

    Attributes
    ----------
    explained : float
        Share of its mean square that a flexible regression predicts on held-out rows, 0 to 1.
    signal : str
        The signal without which that regression loses most; '' if it explains nothing.
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


def lasting_step(residual: np.ndarray) -> tuple[int, float]:
    """
    Find the row from which the residual has another mean, and the share that this explains.

    Rows are in the order of time. The share is that of the mean square about the common mean.
    """
    count = len(residual)
    margin = max(2, int(EVENT_MARGIN * count))
    if count < 4 * margin:
        return 0, 0.0
    centred = residual - residual.mean()
    before = np.cumsum(centred)[:-1]
    rows = np.arange(1, count)
    gain = before ** 2 * count / (rows * (count - rows))
    gain[:margin] = gain[count - margin:] = 0.0
    row = int(np.argmax(gain))
    return row + 1, float(gain[row] / max(np.sum(centred ** 2), 1e-300))


def examine(problem, residual: np.ndarray) -> Leftover:
    """Look for structure in the residual of all judged rows, shape (n,)."""
    share = flexible(problem.signals, residual, problem.fold)
    signal = ''
    if share > 0.1:
        losses = {}
        for name in problem.signals:
            only = {name: problem.signals[name]}
            losses[name] = flexible(only, residual, problem.fold)
        signal = max(losses, key=losses.get)
    row, step = lasting_step(residual)
    event = None
    if step > 0.0:
        event = float(problem.clock[row])
    return Leftover(share, signal, event, step)
