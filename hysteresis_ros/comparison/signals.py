# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The signals against which a residual is looked at: recorded, or derived from what was."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hysteresis_ros.measurements.quantities import QUANTITIES, shown
import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.measurements import Measurement

DEAD_BAND = 2e-3
"""Share of the drive's range within which it counts as held."""

STEP = 3.0
"""A change of more than this many dead bands from one row to the next is a step, not a ramp."""

MOVING_SHARE = 0.2

LEAST_CHANGE = {'ambient_temperature': 0.5}
"""A recorded signal that changes by less is a constant with noise on it; in units of files."""

LEAST_RELATIVE_CHANGE = 0.01
"""The same for signals without an entry above, as a share of the largest value."""


def signals_of(measurement: Measurement, predicted: np.ndarray,
               geometry: BicepGeometry | None = None) -> dict[str, np.ndarray]:
    """
    Return every signal that varies in a recording.

    Parameters
    ----------
    measurement : Measurement
    predicted : ndarray, shape (rows,)
        The model's response; used instead of the measured one, whose noise is in the residual.
    geometry : BicepGeometry, optional
        Gives the muscle's force in an arm run.

    Returns
    -------
    dict of str to ndarray of float64 (rows,)
        In SI units. `direction` is 1 while the drive was last rising and -1 while falling.

    """
    drive = measurement.column(measurement.drive)
    response = measurement.response
    found = {measurement.drive: drive, f'predicted_{response}': predicted}
    for name in QUANTITIES:
        if name in measurement.columns and name not in (measurement.drive, response, 'time'):
            found[name] = measurement.column(name)
    if geometry is not None and response == 'angle':
        found['force'] = geometry.force(np.clip(predicted, *geometry.angle_range))
    last, jump = changes(measurement)
    # The cold state that every trial begins in was reached by cooling.
    direction = np.where(jump > 0, 1.0, -1.0)
    found['direction'] = direction
    time = measurement.time
    if time is None:
        found['row'] = np.concatenate([np.arange(r.stop - r.start, dtype=float)
                                       for _, r in measurement.split()])
    else:
        found['time'] = time
        if len(measurement.trials) > 1:
            found['elapsed_time'] = elapsed(measurement)
    if time is not None and not measurement.settled:
        band = DEAD_BAND * float(np.ptp(drive))
        held = (last < np.arange(len(last))) & (np.abs(jump) > STEP * band)
        if np.mean(held) > MOVING_SHARE:
            found['time_since_step'] = time - time[last]
        if np.mean(~held) > MOVING_SHARE:
            found[f'{measurement.drive}_rate'] = rate(measurement)
    span = float(np.ptp(drive))
    if span > 0:
        travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(drive)))])
        found['cycle'] = travel / (2.0 * span)
    return {name: values for name, values in found.items()
            if np.all(np.isfinite(values)) and varies(
                values, name if name in measurement.columns and name != measurement.drive else '')}


def varies(values: np.ndarray, recorded: str = '') -> bool:
    """
    Tell whether a signal changes.

    Parameters
    ----------
    values : ndarray, shape (rows,)
    recorded : str
        Name of a signal that has noise of its own, such as the temperature of the air; others
        change if they change by more than rounding.

    """
    largest = max(float(np.max(np.abs(values))), 1e-300)
    least = LEAST_CHANGE.get(recorded, (LEAST_RELATIVE_CHANGE if recorded in QUANTITIES
                                        and recorded != 'time' else 1e-9) * largest)
    return float(np.ptp(values)) > least


def changes(measurement: Measurement) -> tuple[np.ndarray, np.ndarray]:
    """
    Find when the drive last changed, and by how much, ignoring ripple within a dead band.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    last : ndarray of int, shape (rows,)
        Row at which the drive last left the dead band, the trial's first row before that.
    jump : ndarray of float64, shape (rows,)
        By how much it had changed then, 0 before any change.

    """
    drive = measurement.column(measurement.drive)
    band = DEAD_BAND * float(np.ptp(drive))
    last, jump = np.empty(len(drive), dtype=int), np.zeros(len(drive))
    for _, rows in measurement.split():
        level, since, change = drive[rows.start], rows.start, 0.0
        for row, value in enumerate(drive[rows].tolist(), rows.start):
            if abs(value - level) > band:
                level, since, change = value, row, value - level
            last[row], jump[row] = since, change
    return last, jump


def elapsed(measurement: Measurement) -> np.ndarray:
    """Return the time since the recording began, the trials one after the other, (rows,), s."""
    result, before = np.empty(measurement.rows), 0.0
    for _, rows in measurement.split():
        result[rows] = before + measurement.column('time')[rows]
        before = float(result[rows][-1])
    return result


def rate(measurement: Measurement) -> np.ndarray:
    """Return the rate of the drive per second, (rows,)."""
    drive, time = measurement.column(measurement.drive), measurement.column('time')
    result = np.zeros(measurement.rows)
    for _, rows in measurement.split():
        if rows.stop - rows.start > 1:
            step = np.maximum(np.diff(time[rows]), 1e-9)
            slope = np.diff(drive[rows]) / step
            result[rows] = np.concatenate([slope[:1], slope])
    return result


def label(name: str) -> tuple[str, str, float]:
    """
    Return what a signal is called on an axis, and the factor to its unit there.

    Parameters
    ----------
    name : str

    Returns
    -------
    text, unit : str
    scale : float

    """
    special = {'direction': ('direction of the drive', '', 1.0),
               'time': ('time in the trial', 's', 1.0),
               'elapsed_time': ('time since the recording began', 's', 1.0),
               'time_since_step': ('time since the last step', 's', 1.0),
               'cycle': ('cycles so far', '', 1.0), 'row': ('row of the trial', '', 1.0)}
    if name in special:
        return special[name]
    base, per = (name.removesuffix('_rate'), '/s') if name.endswith('_rate') else (name, '')
    unit, scale = shown(base.removeprefix('predicted_'))
    text = base.replace('_', ' ') + (' rate' if per else '')
    return text, (unit or '1') + per if per else unit, scale
