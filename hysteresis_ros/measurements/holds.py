# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Settled states of continuous runs: the ends of the stretches in which the drive is held."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement

# Share of the drive's range that is no change: the board rounds a voltage that is held.
TOLERANCE = 1e-3
# Time [s] at the end of a hold that is averaged, and the largest share of a hold that this may be.
AVERAGED, LARGEST_SHARE = 1.0, 0.2


def settled_rows(measurement: Measurement) -> Measurement | None:
    """
    Take the settled state at the end of every hold of a continuous run.

    Parameters
    ----------
    measurement : Measurement
        A run whose drive goes in steps; only holds of at least its `settled_time` count.

    Returns
    -------
    Measurement or None
        One row a hold, the mean of its last second, or fifth of the settled time if that is less;
        `time` is the end of the hold. None if the drive is not held, because such a run has no
        settled rows. A settled measurement is returned as it is.

    """
    if measurement.settled:
        return measurement
    windows = hold_ends(measurement)
    if windows is None:
        return None
    exact = ('time', 'trial', 'step', measurement.drive)
    ends = measurement.where(windows[:, 1] - 1)
    return replace(ends, columns={
        name: ends.columns[name] if name in exact else mean_of_windows(values, windows)
        for name, values in measurement.columns.items()})


def hold_ends(measurement: Measurement) -> np.ndarray | None:
    """
    Find the rows at the end of every hold.

    Parameters
    ----------
    measurement : Measurement
        With times.

    Returns
    -------
    ndarray of int, shape (holds, 2), or None
        First row that is averaged and row after the last. None if there is none, or if a hold is
        shorter: unless it begins or ends its trial, or the drive lies on its way from one hold to
        the next, as with a limited rate. Hysteresis forgets such a way (return-point memory), but
        not one that goes beyond.

    """
    windows, elsewhere = _windows(measurement)
    return np.array(windows) if windows and elsewhere is None else None


def not_held_since(measurement: Measurement) -> tuple[float, float]:
    """
    Return where the drive first goes its way without a hold, for a message.

    Parameters
    ----------
    measurement : Measurement
        A run of which `hold_ends` finds none.

    Returns
    -------
    trial : float
        Number of the trial.
    time : float
        In that trial [s].
    """
    trial, row = _windows(measurement)[1] or next(
        (trial, rows.start) for trial, rows in measurement.split())
    return trial, float(measurement.column('time')[row])


def _windows(measurement: Measurement
             ) -> tuple[list[tuple[int, int]], tuple[float, int] | None]:
    """Return what `hold_ends` does, and trial and row from which holds are too short, or None."""
    time, drive = measurement.column('time'), measurement.column(measurement.drive)
    hold = measurement.settled_time
    average = min(AVERAGED, LARGEST_SHARE * hold)
    band = TOLERANCE * float(np.ptp(drive))
    found: list[tuple[int, int]] = []
    for trial, rows in measurement.split():
        last, lowest, highest, left = drive[rows.start], np.inf, -np.inf, rows.start
        for low, high in holds(drive, rows):
            end = time[high] if high < rows.stop else time[high - 1]
            if end - time[low] >= hold * (1 - 1e-3):
                if (lowest < min(last, drive[low]) - band
                        or highest > max(last, drive[low]) + band):
                    return found, (trial, left)
                begin = np.searchsorted(time[low:high], time[high - 1] - average, side='left')
                found.append((low + int(begin), high))
                last, lowest, highest, left = drive[low], np.inf, -np.inf, high
            elif low > rows.start and high < rows.stop:
                lowest = min(lowest, float(np.min(drive[low:high])))
                highest = max(highest, float(np.max(drive[low:high])))
        if np.isfinite(lowest):
            return found, (trial, left)
    return found, None


def mean_of_windows(values: np.ndarray, windows: np.ndarray) -> np.ndarray:
    """
    Average a column over windows of rows.

    Parameters
    ----------
    values : ndarray, shape (rows,)
    windows : ndarray of int, shape (n, 2)
        As `hold_ends` gives them.

    Returns
    -------
    ndarray of float64, shape (n,)

    """
    return np.array([values[low:high].mean() for low, high in windows])


def holds(drive: np.ndarray, rows: slice, tolerance: float = TOLERANCE) -> list[tuple[int, int]]:
    """
    Divide a trial into stretches in which the drive stays where it was when each began.

    Parameters
    ----------
    drive : ndarray, shape (rows,)
    rows : slice
        The trial.
    tolerance : float
        Share of the drive's range that is no change: the board rounds a voltage that is held.

    Returns
    -------
    list of (int, int)
        First row and row after the last.

    """
    values = drive[rows]
    band = tolerance * float(np.ptp(drive))
    bounds, level = [0], values[0]
    for row in np.flatnonzero(np.diff(values) != 0) + 1:
        if abs(values[row] - level) > band:
            bounds.append(int(row))
            level = values[row]
    bounds.append(len(values))
    return [(low + rows.start, high + rows.start) for low, high in zip(bounds[:-1], bounds[1:])]
