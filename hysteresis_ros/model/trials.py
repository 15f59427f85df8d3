# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The trials of a measurement, with the inputs that effects may look at."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import Inputs

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model.muscle import MuscleModel

# Rows of a settled table without times are this far apart [s] (Sec. III-A).
HOLD = 30.0


@dataclasses.dataclass
class Trial:
    """One trial's inputs: rows of the table, drive and load of shape (rows,), and the rest."""

    rows: slice
    drive: np.ndarray
    load: np.ndarray
    inputs: Inputs


def trials_of(model: MuscleModel, measurement: Measurement) -> list[Trial]:
    """
    Split a measurement into trials with the inputs that effects may look at.

    Parameters
    ----------
    model : MuscleModel
        For the scale on which cycles are counted.
    measurement : Measurement
        Bench table or arm run.

    Returns
    -------
    list of Trial
        In the order of the table; `Inputs.clock` and `Inputs.cycles` run on from one to the next.

    Raises
    ------
    MeasurementError
        If the table lacks the model's drive.
    """
    drive = measurement.column(model.drive)
    known = (measurement.columns.get(model.load_name) if model.load_name else None)
    load = np.zeros(measurement.rows) if known is None else known
    ambient, supply = (measurement.columns.get(name, np.full(measurement.rows, np.nan))
                       for name in ('ambient_temperature', 'supply_voltage'))
    low, high = model.ranges.get(model.drive, (0.0, 1.0))
    trials, clock, travel = [], 0.0, 0.0
    for _, rows in measurement.split():
        values = drive[rows]
        count = len(values)
        if measurement.time is None:
            time = HOLD * np.arange(1, count + 1)
        else:
            time = measurement.time[rows]
        dt = np.diff(time, prepend=0.0)
        if measurement.settled:
            # The first row is a settled state, too, even where its time is 0.
            dt[0] = max(dt[0], HOLD)
        travelled = travel + np.cumsum(np.abs(np.diff(values, prepend=model.cold_drive)))
        inputs = Inputs(
            time=time, clock=clock + time, dt=dt,
            ambient=ambient[rows], phase=np.full(count, np.nan),
            cycles=travelled / (2.0 * max(high - low, 1e-12)), supply=supply[rows],
            load=load[rows] if known is not None else np.full(count, np.nan))
        trials.append(Trial(rows, values, load[rows], inputs))
        clock += float(time[-1])
        travel = float(travelled[-1])
    return trials
