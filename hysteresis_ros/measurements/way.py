# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Over which drives a response varies: its total variation, as a share of the whole."""

import numpy as np

# Decimals, in parts of its range, to which two drives differ.
DRIVE_DECIMALS = 9


def way_done(drive: np.ndarray, response: np.ndarray, trial: np.ndarray) -> np.ndarray:
    """
    Return for each row the share of the response's way that is done below its drive, from 0 to 1.

    Each change from row to row counts evenly over the drives between the two, or, while the drive
    is held, over those next to it.

    Parameters
    ----------
    drive, response : ndarray, shape (n,)
    trial : ndarray of int, shape (n,)
        Trial of each row.

    Returns
    -------
    ndarray, shape (n,)
        All 0 where drive or response stand still.
    """
    return way_below(drive, np.where(np.diff(trial) == 0, np.abs(np.diff(response)), 0.0))


def way_below(drive: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """
    Return the share of a total variation that lies below each row's drive.

    Parameters
    ----------
    drive : ndarray, shape (n,)
    steps : ndarray, shape (n - 1,)
        Variation from each row to the next, not negative.

    Returns
    -------
    ndarray, shape (n,)
        See `way_done`.
    """
    span = float(np.ptp(drive))
    if span == 0.0:
        return np.zeros(len(drive))
    # Drives that differ by rounding are one.
    levels, place = np.unique(np.round((drive - drive.min()) / span, DRIVE_DECIMALS),
                              return_inverse=True)
    low, high = (edge(place[:-1], place[1:]) for edge in (np.minimum, np.maximum))
    held, last = low == high, len(levels) - 1
    low, high = np.maximum(low - held, 0), np.minimum(high + held, last)
    share = steps / (levels[high] - levels[low])
    slope = np.zeros(len(levels))
    np.add.at(slope, low, share)
    np.add.at(slope, high, -share)
    done = np.cumsum(np.cumsum(slope)[:-1] * np.diff(levels))
    return unit(np.append(0.0, done))[place]


def unit(values: np.ndarray) -> np.ndarray:
    """Return values (n,) shifted and scaled to 0 to 1; all 0 where they are equal."""
    return (values - values.min()) / max(np.ptp(values), 1e-12)
