# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Settled states of continuous runs: the ends of the stretches in which the drive is held."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from hysteresis_ros.measurements.table import SETTLED_HOLD
import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement


def settled_rows(measurement: Measurement, hold: float = SETTLED_HOLD,
                 average: float = 1.0) -> Measurement | None:
    """
    Take the settled state at the end of every hold of a continuous run.

    Parameters
    ----------
    measurement : Measurement
        A run whose drive goes in steps.
    hold : float
        Only holds of at least this many seconds count as settled.
    average : float
        Seconds at the end of the hold that are averaged.

    Returns
    -------
    Measurement or None
        One row a hold; `time` is the end of the hold. None if the drive is not held, because
        such a run has no settled rows. A settled measurement is returned as it is.

    """
    if measurement.settled:
        return measurement
    windows = hold_ends(measurement, hold, average)
    if windows is None:
        return None
    exact = ('time', 'trial', 'step', measurement.drive)
    return replace(measurement, columns={
        name: values[windows[:, 1] - 1] if name in exact else mean_of_windows(values, windows)
        for name, values in measurement.columns.items()})


def hold_ends(measurement: Measurement, hold: float = SETTLED_HOLD,
              average: float = 1.0) -> np.ndarray | None:
    """
    Find the rows at the end of every hold.

    Parameters
    ----------
    measurement : Measurement
        With times.
    hold, average : float
        As for `settled_rows`.

    Returns
    -------
    ndarray of int, shape (holds, 2), or None
        First row that is averaged and row after the last. None if a hold is shorter, unless it
        begins or ends its trial, or if there is none.

    """
    time = measurement.column('time')
    found = []
    for _, rows in measurement.split():
        for low, high in holds(measurement.column(measurement.drive), rows):
            end = time[high] if high < rows.stop else time[high - 1]
            if end - time[low] >= hold * (1 - 1e-3):
                begin = np.searchsorted(time[low:high], time[high - 1] - average, side='left')
                found.append((low + int(begin), high))
            elif low > rows.start and high < rows.stop:
                return None
    return np.array(found) if found else None


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


def holds(drive: np.ndarray, rows: slice, tolerance: float = 1e-3) -> list[tuple[int, int]]:
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
