# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a session gives the page to show: effects, errors, and curves along an axis."""

from __future__ import annotations

import dataclasses

import numpy as np

from hysteresis_ros.measurements.quantities import QUANTITIES


@dataclasses.dataclass(frozen=True)
class Entry:
    """
    An effect of the catalogue as the page lists it.

    Attributes
    ----------
    name, stage, sentence : str
        Identifier, stage, and what it is.
    ticked : bool
        Whether it is added now.
    built_in : bool
        Whether the model has it for good.
    hidden : str
        Why these recordings cannot show it; '' if they can.
    probability : float or None
        That it is missing, after a diagnosis.
    """

    name: str
    stage: str
    sentence: str
    ticked: bool
    built_in: bool
    hidden: str
    probability: float | None


@dataclasses.dataclass(frozen=True)
class Errors:
    """RMSE of the base model and of the present one, in the unit of the response."""

    before: float
    now: float


@dataclasses.dataclass(frozen=True)
class Curves:
    """
    What the charts draw, one value a row, in the units that a person thinks in.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Time, or the number of the row.
    x_label, y_label, unit : str
        What is drawn, and the unit of the response.
    measured, before, now : ndarray, shape (n,)
        The response: measured, of the base model, of the present one.
    trial : ndarray of int, shape (n,)
        Trials of all recordings; a line ends where the next begins.
    unseen : list of (float, float)
        Where on the axis the rows lie that are not fitted.
    """

    x: np.ndarray
    x_label: str
    y_label: str
    unit: str
    measured: np.ndarray
    before: np.ndarray
    now: np.ndarray
    trial: np.ndarray
    unseen: list[tuple[float, float]]


def axis(time: np.ndarray | None, rows: int) -> tuple[np.ndarray, str]:
    """
    Return what runs along the charts, and its name.

    Parameters
    ----------
    time : ndarray, shape (n,), or None
        s, of all trials one after the other.
    rows : int
        n.
    """
    if time is None:
        return np.arange(rows, dtype=float), 'row'
    for name, seconds in (('h', 3600.0), ('min', 60.0)):
        if time[-1] > (10800.0 if name == 'h' else 600.0):
            return time / seconds, f'time [{name}]'
    return time, f'time [{QUANTITIES["time"].unit}]'
