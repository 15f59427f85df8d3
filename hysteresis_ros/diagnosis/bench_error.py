# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
By how much a model misses lengths on its bench, as the metrics in its file say.

On trials or loads that were held out: in all, under each load, at the ends of the transformation
and halfway, and by thresholds that are off.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.measurements.metrics import halfway

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel

# Of as many loads one lies between others, and tells what the model does between them.
FEWEST_LOADS = 3


def length_error(model: MuscleModel) -> float:
    """
    Return the root mean square error of the length [m] that the bench has shown.

    The largest of that on trials that were not fitted, that on loads left out of the fit, and,
    where neither is known, that on the trials fitted.
    """
    metrics = model.metrics.get('length', {})
    errors = [metrics.get(part, {}).get('rmse') for part in ('verification', 'left_out')]
    known = [float(error) for error in errors if error is not None and np.isfinite(error)]
    if known:
        return max(known)
    error = metrics.get('identification', {}).get('rmse')
    return float(error) if error is not None and np.isfinite(error) else 0.0


def length_errors(model: MuscleModel, load: np.ndarray) -> np.ndarray:
    """
    Return the root mean square error of the length [m] that the bench has shown under a load.

    Under the bench's own loads it is the larger one of that on rows left out one at a time and on
    trials that were not fitted. What a load shows beyond that when it is left out, it shows at its
    distance from the nearest one that stays; between and beyond the loads it counts in proportion
    to theirs, which are half as large in the middle between two. Errors of few rows are uncertain,
    so that those of near loads are averaged, with Gaussian weights as wide as loads are apart. With
    fewer than three loads it is one number for all.

    Parameters
    ----------
    model : MuscleModel
    load : ndarray, shape (n,)
        Tension of a muscle [N].

    Returns
    -------
    ndarray, shape (n,)
    """
    metrics = model.metrics.get('length', {})
    left_out, fitted, rows, verified = (
        [np.array(metrics.get(part, {}).get(key, ()), dtype=float)
         for key in ('loads', 'rmse_by_load')]
        for part in ('left_out', 'identification', 'rows_left_out', 'verification'))
    loads, errors = left_out
    if len(loads) < FEWEST_LOADS or len(fitted[0]) != len(loads):
        return np.full(len(load), length_error(model))
    at_loads = np.maximum(fitted[1], rows[1]) if len(rows[1]) == len(loads) else fitted[1]
    if len(verified[0]):
        at_loads = np.maximum(at_loads, np.interp(loads, verified[0], verified[1]))
    within = np.clip(load, loads[0], loads[-1])[:, None] - loads
    near = np.exp(-0.5 * (within / np.median(np.diff(loads))) ** 2)
    near /= np.sum(near, axis=1, keepdims=True)
    away, to_next = _distances(loads, load)
    growth = near @ np.maximum(errors ** 2 - at_loads ** 2, 0.0) / (near @ to_next ** 2)
    return np.sqrt(near @ at_loads ** 2 + growth * away ** 2)


def missing_load(model: MuscleModel, load: np.ndarray) -> np.ndarray:
    """
    Return how far a load is from the bench's, over how far one of these is from the others.

    What a load left out changes, it changes at its distance from the nearest one that stays. What
    the bench lacks between two of its loads is half as far from these at most.

    Parameters
    ----------
    model : MuscleModel
        With its replicates.
    load : ndarray, shape (n,)
        Of each muscle [N].

    Returns
    -------
    ndarray, shape (n, R)
        For each of the model's replicates; all 1 where they are not one for each of three loads or
        more.
    """
    loads = np.array(model.metrics.get('length', {}).get('left_out', {}).get('loads', ()),
                     dtype=float)
    count = len(model.replicates)
    if count < FEWEST_LOADS or len(loads) != count:
        return np.ones((len(load), count))
    away, to_next = _distances(loads, load)
    shares: np.ndarray = away[:, None] / to_next
    return shares


def _distances(loads: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far loads (n,) are from the nearest of a bench (m,), and these from the next."""
    gaps = np.diff(loads)
    return (np.min(np.abs(load[:, None] - loads), axis=1),
            np.minimum(np.append(np.inf, gaps), np.append(gaps, np.inf)))


def relative_errors(model: MuscleModel, martensite: np.ndarray) -> np.ndarray:
    """
    Return the error of the length at a share of martensite over that of all, as the bench says.

    The mean square is laid out between the ends and halfway by 4 xi (1 - xi).

    Parameters
    ----------
    model : MuscleModel
    martensite : ndarray, shape (n,)
        Share xi of martensite, 0 to 1.

    Returns
    -------
    ndarray, shape (n,)
        All 1 where the model's metrics say nothing of it.
    """
    known = _relative(model)
    if not known:
        return np.ones(len(martensite))
    ends, between = (np.mean([one[name] ** 2 for one in known]) for name in ('ends', 'halfway'))
    share = halfway(np.clip(martensite, 0.0, 1.0))
    return np.sqrt((1.0 - share) * ends + share * between)


def drive_error(model: MuscleModel) -> float:
    """
    Return the error of the thresholds for an error of the length, as the bench says.

    A wire that transforms within a few volts misses a threshold where it is steep, and nothing
    where it is cold or hot; and most rows of a bench are.

    Returns
    -------
    float
        Root mean square, drive squared per unit of the length; 0 where the model's metrics say
        nothing of it.
    """
    known = [(one['drive'] / one['drive_slope']) ** 2 for one in _relative(model)
             if 'drive' in one]
    return math.sqrt(np.mean(known)) if known else 0.0


def _relative(model: MuscleModel) -> list[dict[str, float]]:
    """Return of what the errors of trials and loads that were held out consist."""
    metrics = model.metrics.get('length', {})
    return [{**metrics[part]['relative_rmse'],
             **{name: metrics[part][name] for name in ('drive_slope',) if name in metrics[part]}}
            for part in ('verification', 'left_out') if 'relative_rmse' in metrics.get(part, {})]
