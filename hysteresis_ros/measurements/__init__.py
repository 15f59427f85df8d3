# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements: one table type, read from CSV files or rosbag2 recordings."""

from collections.abc import Collection, Sequence
from dataclasses import replace
import os
from pathlib import Path

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.bag import is_bag, read_bag
from hysteresis_ros.measurements.columns import Mapped, parse_columns
from hysteresis_ros.measurements.csv import read_csv, read_reference, write_csv
from hysteresis_ros.measurements.holds import not_held_since, settled_rows
from hysteresis_ros.measurements.quantities import QUANTITIES, Quantity
from hysteresis_ros.measurements.table import Measurement, MeasurementWarning, SETTLED_HOLD

__all__ = [
    'Mapped', 'Measurement', 'MeasurementWarning', 'parse_columns', 'QUANTITIES', 'Quantity',
    'read_bag', 'read_csv', 'read_measurement', 'read_reference', 'SETTLED_HOLD', 'settled_rows',
    'write_csv']


def read_measurement(path: str | os.PathLike[str], namespace: str | None = None,
                     settled: bool = False, columns: str | Collection[Mapped] = (),
                     trials: Sequence[float] | None = None,
                     settled_time: float = SETTLED_HOLD) -> Measurement:
    """
    Read a CSV file or a rosbag2 recording.

    Parameters
    ----------
    path : str or Path
        A CSV file, a rosbag2 folder (mcap or sqlite3, plain or zstd), or one of its storage
        files.
    namespace : str, optional
        Which arm to take from a bag that recorded several.
    settled : bool
        Of a continuous run take only the ends of its holds.
    columns : str or collection of Mapped
        What the columns of a table mean, such as ``angle=theta_deg:deg,time=t_s``; a recording
        has topics and needs none.
    trials : sequence of float, optional
        Those to take; the others may be as they are.
    settled_time : float
        Time [s] for which the drive has to be held until muscle and arm have settled. Rows of a
        table that are so far apart are settled states.

    Returns
    -------
    Measurement

    Raises
    ------
    MeasurementError
        If the file is missing, is no measurement, lacks a trial or has no settled states; the
        message says what to do.

    """
    path = Path(path)
    if not path.exists():
        raise MeasurementError(f'{path}: no such file or folder')
    mapping = parse_columns(columns) if isinstance(columns, str) else columns
    found = replace(read_bag(path, namespace) if is_bag(path) else read_csv(path, mapping),
                    settled_time=settled_time)
    if trials is not None:
        found = found.select(trials)
    reduced = settled_rows(found) if settled else found
    if reduced is None:
        trial, time = not_held_since(found)
        raise MeasurementError(f'{path}: the drive is not held for {settled_time:g} s at a time, '
                               f'first from {time:.1f} s of trial {trial:g} on, so there are no '
                               'settled states; take the whole run, without "settled", or say by '
                               '"settled time" if this arm settles sooner')
    return reduced
