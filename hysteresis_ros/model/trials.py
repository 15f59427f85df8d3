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
        In the order of the table; `Inputs.clock` and `Inputs.cycles` run on from one to the next,
        also over trials of the recording that are not in the measurement.

    Raises
    ------
    MeasurementError
        If the table lacks the model's drive.
    """
    own = dict(measurement.split())
    recording = measurement.part_of or measurement
    settled = measurement.settled
    low, high = model.ranges.get(model.drive, (0.0, 1.0))
    trials, clock, travel = [], 0.0, 0.0
    for name, whole in recording.split():
        table, rows = (measurement, own[name]) if name in own else (recording, whole)
        drive = table.column(model.drive)[rows]
        time = HOLD * np.arange(1, len(drive) + 1) if table.time is None else table.time[rows]
        travelled = travel + np.cumsum(np.abs(np.diff(drive, prepend=model.cold_drive)))
        if name in own:
            dt = np.diff(time, prepend=0.0)
            if settled:
                # The first row is a settled state, too, even where its time is 0.
                dt[0] = max(dt[0], HOLD)
            unknown = np.full(len(drive), np.nan)
            load, ambient, supply = (
                unknown if table.columns.get(column) is None else table.columns[column][rows]
                for column in (model.load_name, 'ambient_temperature', 'supply_voltage'))
            trials.append(Trial(rows, drive, 0.0 * drive if load is unknown else load, Inputs(
                time=time, clock=clock + time, dt=dt, ambient=ambient, phase=unknown,
                cycles=travelled / (2.0 * max(high - low, 1e-12)), supply=supply, load=load)))
        clock += float(time[-1])
        travel = float(travelled[-1])
    return trials
