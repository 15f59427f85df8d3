# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a prediction is off (Eqs. 23 and 24), and how near it can come at all."""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

from hysteresis_ros.measurements import Measurement, settled_rows
import numpy as np

FEWEST_REPEATED_ROWS = 5
# Loads that differ by less than this share of the largest are one.
SAME_LOAD = 0.02
# Passes of the rule by which the parts of an error are found, and the least variance, of one.
PASSES, SMALLEST = 200, 1e-12


class Errors(NamedTuple):
    """
    Errors of a prediction over some rows.

    Attributes
    ----------
    mean_abs : float
        Mean of ``|e|``, in the unit of the response.
    std : float
        Standard deviation of e, divided by M as Eq. 24 needs (its print leaves the M out).
    rmse : float
        Root of the mean of e^2.
    mean_percent, std_percent : float
        The first two as a share of the output range in percent: Eqs. 23 and 24. NaN where the
        response does not vary.

    """

    mean_abs: float
    std: float
    rmse: float
    mean_percent: float
    std_percent: float

    def to_dict(self) -> dict[str, float | None]:
        """Return the numbers by name; those that are not finite become None."""
        return {name: finite(value) for name, value in self._asdict().items()}


def errors(residual: np.ndarray, output_range: float) -> Errors:
    """
    Return the errors of Eqs. 23 and 24 and the RMSE.

    Parameters
    ----------
    residual : ndarray, shape (rows,)
        Measured less predicted.
    output_range : float
        P of Eqs. 23 and 24: largest less smallest measured output, same unit.

    Returns
    -------
    Errors

    """
    mean_abs = float(np.mean(np.abs(residual)))
    std = float(np.sqrt(np.mean((residual - np.mean(residual)) ** 2)))
    rmse = float(np.sqrt(np.mean(residual ** 2)))
    percent = 100.0 / output_range if output_range > 0 else np.nan
    return Errors(mean_abs, std, rmse, mean_abs * percent, std * percent)


def rmse_by_load(residual: np.ndarray, load: np.ndarray, trial: np.ndarray
                 ) -> dict[str, list[float]]:
    """
    Return the error under each load of a bench.

    Parameters
    ----------
    residual : ndarray, shape (rows,)
    load : ndarray, shape (rows,)
        Of which each trial has one, or goes about a mean.
    trial : ndarray, shape (rows,)

    Returns
    -------
    dict
        'loads', ascending, in the unit of the load, and 'rmse_by_load', in that of the residual.

    """
    means = {one: float(np.mean(load[trial == one])) for one in np.unique(trial)}
    largest = max(map(abs, means.values()))
    groups: list[list[float]] = []
    for one in sorted(means, key=means.__getitem__):
        if groups and means[one] - means[groups[-1][0]] <= SAME_LOAD * largest:
            groups[-1].append(one)
        else:
            groups.append([one])
    chosen = [np.isin(trial, group) for group in groups]
    return {'loads': [float(np.mean(load[rows])) for rows in chosen],
            'rmse_by_load': [float(np.sqrt(np.mean(residual[rows] ** 2))) for rows in chosen]}


def relative_rmse(residual: np.ndarray, response: np.ndarray, trial: np.ndarray,
                  slope: np.ndarray | None = None) -> dict[str, Any]:
    """
    Return of what an error consists, over that of all rows.

    Its mean square in a row is laid out as

        e^2 (1 - h) + m^2 h + d^2 s^2 / s0^2,    h = 4 p (1 - p),

    with p the place of the response between the ends of its trial, s its slope and s0 the root mean
    square of that: an error of the ends, one of the middle, and one of the drive. They are those of
    normal errors that are most likely, found by the multiplicative rule that never lowers the
    likelihood (Fevotte, Bertin and Durrieu, Neural Computation 21 (2009) 793), and add up to the
    mean square that was seen: likelihood keeps the ratio of error to expected error, and where
    the steepest rows are off by less than their slope says, the parts would be more than it.

    Parameters
    ----------
    residual, response, trial : ndarray, shape (rows,)
    slope : ndarray, shape (rows,), optional
        How the response follows the drive squared.

    Returns
    -------
    dict
        'relative_rmse' with 'ends', 'halfway' and, with a slope, 'drive', e, m and d; then
        'drive_slope', s0. Nothing where no trial has response and error.

    """
    squares, shares, chosen = [], [], np.zeros(len(residual), dtype=bool)
    for one in np.unique(trial):
        rows = trial == one
        mean, span = float(np.mean(residual[rows] ** 2)), float(np.ptp(response[rows]))
        if mean > 0.0 and span > 0.0:
            squares.append(residual[rows] ** 2 / mean)
            shares.append(halfway((response[rows] - np.min(response[rows])) / span))
            chosen |= rows
    if not squares:
        return {}
    share = np.concatenate(shares)
    parts = {'ends': 1.0 - share, 'halfway': share}
    found: dict[str, Any] = {}
    if slope is not None and np.any(slope[chosen]):
        # Rows are in the order of their trials.
        along = np.concatenate([slope[trial == one] for one in np.unique(trial[chosen])])
        found['drive_slope'] = float(np.sqrt(np.mean(along ** 2)))
        parts['drive'] = (along / found['drive_slope']) ** 2
    square, layout = np.concatenate(squares), np.column_stack(list(parts.values()))
    variances = _most_likely(square, layout)
    variances *= np.mean(square) / np.mean(layout @ variances)
    found['relative_rmse'] = dict(zip(parts, np.sqrt(variances).tolist()))
    return found


def _most_likely(squares: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Return the variances (k,) whose parts (n, k) are those of normal errors with squares (n,)."""
    variances = np.full(parts.shape[1], float(np.mean(squares)))
    for _ in range(PASSES):
        total = np.maximum(parts @ variances, SMALLEST)
        variances = variances * (parts.T @ (squares / total ** 2)) / np.maximum(
            parts.T @ (1.0 / total), SMALLEST)
    return variances


def halfway(place: np.ndarray) -> np.ndarray:
    """Return 4 p (1 - p), from 0 at the ends of a transformation to 1 halfway, for places p."""
    return 4.0 * place * (1.0 - place)


def finite(value: float) -> float | None:
    """Return a float that JSON can hold, or None."""
    return float(value) if np.isfinite(value) else None


class Floor(NamedTuple):
    """
    What no model of the recorded inputs can be better than.

    Attributes
    ----------
    value : float
        RMSE in the unit of the response.
    origin : str
        'repeats' (the same input applied again), 'samples' (what changes from sample to sample
        of a continuous run) or 'resolution' (the steps of the sensor).

    """

    value: float
    origin: str


def noise_floor(measurements: Sequence[Measurement]) -> Floor:
    """
    Estimate the noise of the response from the recordings alone.

    Parameters
    ----------
    measurements : list of Measurement

    Returns
    -------
    Floor
        The largest of what repeats, samples and resolution show: each is a lower bound.

    """
    found = [Floor(max(resolution_noise(m) for m in measurements), 'resolution')]
    repeated = repeat_noise(measurements)
    if repeated is not None:
        found.append(Floor(repeated, 'repeats'))
    sampled = [sample_noise(m) for m in measurements if not m.settled]
    if sampled:
        found.append(Floor(max(sampled), 'samples'))
    return max(found, key=lambda floor: floor.value)


def resolution_noise(measurement: Measurement) -> float:
    """
    Return the standard deviation of rounding to the sensor's steps: step / sqrt(12).

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    float
        0 if no two rows differ.

    """
    values = np.unique(measurement.column(measurement.response))
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * np.ptp(values)]
    return float(steps.min() / np.sqrt(12.0)) if steps.size else 0.0


def sample_noise(measurement: Measurement) -> float:
    """
    Return the standard deviation of what is new in every sample of a continuous run.

    White noise of standard deviation s makes second differences of variance 6 s^2, to which a
    motion that is slow against the sampling adds nothing. The median resists steps of the drive.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    float

    """
    values = measurement.column(measurement.response)
    seconds = np.concatenate([np.diff(values[rows], 2) for _, rows in measurement.split()])
    if seconds.size < 10:
        return 0.0
    return float(1.4826 * np.median(np.abs(seconds)) / np.sqrt(6.0))


def largest_noise(measurement: Measurement) -> float:
    """
    Return the largest standard deviation that white noise of a recording can have.

    White noise of variance s^2 makes differences of order p of variance C(2p, p) s^2, and a motion
    can only add to it; of the orders up to four the one counts to which it adds least.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    float
        With three standard errors of the mean square; infinite where these are all of it.

    """
    values = measurement.column(measurement.response)
    trials = [values[rows] for _, rows in measurement.split()]
    bounds = [np.inf]
    for order in range(1, 5):
        differences = np.concatenate([np.diff(one, order) for one in trials])
        if not differences.size:
            continue
        # Neighbouring differences are correlated, so that of so many one counts.
        share = math.comb(4 * order, 2 * order) / math.comb(2 * order, order) ** 2
        least = 1.0 - 3.0 * math.sqrt(2.0 * share / differences.size)
        if least > 0.0:
            variance = np.mean(differences ** 2) / math.comb(2 * order, order)
            bounds.append(math.sqrt(variance / least))
    return float(min(bounds))


def repeat_noise(measurements: Sequence[Measurement]) -> float | None:
    """
    Return the standard deviation between trials with the same inputs.

    Parameters
    ----------
    measurements : list of Measurement

    Returns
    -------
    float or None
        None if no settled trial was repeated.

    """
    groups: dict[tuple, list[np.ndarray]] = {}
    for measurement in measurements:
        settled = settled_rows(measurement)
        if settled is None:
            continue
        inputs = [settled.drive] + ([settled.load] if settled.load else [])
        span = [max(np.ptp(settled.column(name)), 1e-12) for name in inputs]
        for _, rows in settled.split():
            if rows.stop - rows.start >= FEWEST_REPEATED_ROWS:
                key = tuple(tuple(np.round(settled.column(name)[rows] / (1e-3 * size)))
                            for name, size in zip(inputs, span))
                groups.setdefault(key, []).append(settled.column(settled.response)[rows])
    repeated = [np.array(trials) for trials in groups.values() if len(trials) > 1]
    if not repeated:
        return None
    variance = np.concatenate([np.var(trials, axis=0, ddof=1) for trials in repeated])
    return float(np.sqrt(np.mean(variance)))
