# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which rows of a bench table are fitted: those of the trials that were named."""

from collections.abc import Sequence

import numpy as np

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.measurements import Measurement


def choose_trials(measurement: Measurement, trials: Sequence | None, name: str) -> np.ndarray:
    """
    Say which rows belong to the trials named; all of them by default.

    Raises
    ------
    IdentificationError
        If a trial is not in the table.
    """
    column = measurement.column('trial')
    if trials is None:
        return np.ones(len(column), dtype=bool)
    absent = sorted(set(trials) - set(np.unique(column).tolist()))
    if absent:
        there = ', '.join(f'{trial:g}' for trial in np.unique(column))
        raise IdentificationError(
            f'{measurement.source}: no {name} trial {", ".join(f"{t:g}" for t in absent)}; there '
            f'are {there}')
    return np.isin(column, list(trials))


def fitted_rows(length: Measurement, trials: Sequence[float] | None,
                some: np.ndarray | None) -> np.ndarray:
    """
    Say which rows of a length table are fitted.

    Parameters
    ----------
    length : Measurement
    trials : sequence of numbers or None
        Trials to fit; all if None.
    some : ndarray of bool, shape (rows,), or None
        Rows of them to fit; all if None.

    Returns
    -------
    ndarray of bool, shape (rows,)

    Raises
    ------
    IdentificationError
        If a trial is not in the table.
    """
    rows = choose_trials(length, trials, 'length')
    return rows if some is None else rows & some
