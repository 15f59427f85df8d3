# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis invert`: voltages for a reference (Eqs. 12, 14, 15, 21 and 22)."""

from __future__ import annotations

import argparse

from collections.abc import Mapping

from typing import TYPE_CHECKING

from hysteresis_ros.cli.common import add_columns, add_model, Subparsers
from hysteresis_ros.cli.outputs import InputPath, OutputFile
from hysteresis_ros.errors import MeasurementError, ParameterError, RangeError
import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.model import Controller, MuscleModel, Setpoint

ROUNDING = 1e-6


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'invert', help='voltages for a reference, keeping the memory along each trial',
        description='Reads references with the columns trial, step and force, or force and '
        'length, or angle; adds the voltage (or whatever drives the muscle) for each, and '
        'whether it is saturated because the reference is out of reach.')
    add_model(parser)
    parser.add_argument('--reference', type=InputPath, required=True, metavar='REF.csv')
    add_columns(parser)
    parser.add_argument('--method', choices=('preisach', 'linear'), default='preisach',
                        help='the inverse with memory (default), or that of the linear model')
    parser.add_argument('-o', '--output', type=OutputFile, required=True, metavar='VOLTS.csv')
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.measurements import read_reference, write_csv
    from hysteresis_ros.model import MuscleModel

    model = MuscleModel.load(args.model)
    reference = read_reference(args.reference, args.columns)
    drive, saturated = invert(model, reference, args.method)
    columns = {name: values for name, values in reference.items()
               if name not in (model.drive, 'saturated')}
    write_csv({**columns, model.drive: drive, 'saturated': saturated}, args.output)
    count = int(saturated.sum())
    reached = f', {count} of them out of reach (see the column saturated)' if count else ''
    print(f'{args.output}: {len(drive)} rows with {model.drive}{reached}')


def invert(model: MuscleModel, reference: Mapping[str, np.ndarray],
           method: str = 'preisach') -> tuple[np.ndarray, np.ndarray]:
    """
    Find the drive for every row of a reference.

    Parameters
    ----------
    model : MuscleModel
    reference : dict of str to ndarray, shape (rows,)
        As `read_reference` gives it: force at resting length [N], or load and length, or angle
        [rad]; `trial` wipes the memory where it changes; `time`, `ambient_temperature` and
        `supply_voltage` are used if they are there.
    method : {'preisach', 'linear'}

    Returns
    -------
    drive : ndarray of float64, shape (rows,)
        In the unit of the model's drive, within the range it was identified on.
    saturated : ndarray of bool, shape (rows,)
        Where the reference is out of reach; the nearest drive is given, and the last one again
        where even the linkage cannot take the angle.

    Raises
    ------
    MeasurementError, ParameterError
        If columns or parts of the model are missing.

    """
    kind = kind_of(model, reference)
    if method == 'linear':
        return invert_linear(model, reference, kind)
    controller = model.controller()
    trial = reference['trial']
    drive, saturated = np.empty(len(trial)), np.zeros(len(trial), dtype=bool)
    last = model.cold_drive
    for row in range(len(trial)):
        if row == 0 or trial[row] != trial[row - 1]:
            controller.reset()
            last = model.cold_drive
        try:
            found = setpoint(controller, model, reference, kind, row)
            # A table holds rounded numbers: the very end of the range is still in reach.
            missed = not abs(found.error) <= ROUNDING * (1e-12 + abs(found.expected))
            last, saturated[row] = found.voltage, found.saturated and missed
        except RangeError:
            saturated[row] = True
        drive[row] = last
    return drive, saturated


def kind_of(model: MuscleModel, reference: Mapping[str, np.ndarray]) -> str:
    """Tell from the columns what is asked for: 'angle', 'length' or 'force'."""
    if 'angle' in reference:
        model.require_geometry()
        return 'angle'
    if model.response in reference and model.response != 'force':
        if model.load_name and model.load_name not in reference:
            raise MeasurementError(
                f'the reference has a {model.response} and no {model.load_name}; the model needs '
                'both')
        return 'length'
    if 'force' in reference:
        return 'force'
    raise MeasurementError(
        f'the reference has no column that the model knows: force, {model.response} or angle')


def setpoint(controller: Controller, model: MuscleModel, reference: Mapping[str, np.ndarray],
             kind: str, row: int) -> Setpoint:
    """Return the controller's answer to one row."""
    if kind == 'force':
        return controller.force_setpoint(float(reference['force'][row]))
    if kind == 'angle':
        length, force = controller.reference(float(reference['angle'][row]))
    else:
        length = float(reference[model.response][row])
        force = float(reference[model.load_name][row]) if model.load_name else 0.0
    time = reference.get('time')
    ambient, supply = (float(reference[name][row]) if name in reference else float('nan')
                       for name in ('ambient_temperature', 'supply_voltage'))
    return controller.setpoint(
        length, force, time=None if time is None else float(time[row]), ambient=ambient,
        supply=supply)


def invert_linear(model: MuscleModel, reference: Mapping[str, np.ndarray],
                  kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Find the drive by the linear model (Eq. 15); as `invert`."""
    if model.linear is None:
        raise ParameterError('the model has no linear part; identify it again')
    if kind == 'force':
        wanted = model.linear.drive_for_force(reference['force'])
    elif kind == 'angle':
        geometry = model.require_geometry()
        angle = np.clip(reference['angle'], *geometry.angle_range)
        wanted = model.linear.drive_for_length(geometry.length(angle), geometry.force(angle))
        wanted = np.where(angle == reference['angle'], wanted, np.nan)
    else:
        load = reference[model.load_name] if model.load_name else 0.0
        wanted = model.linear.drive_for_length(reference[model.response], load)
    drive = np.clip(wanted, *model.ranges.get(model.drive, (-np.inf, np.inf)))
    saturated = ~(np.abs(drive - wanted) <= 1e-9 * (1 + np.abs(drive)))
    trial, last = reference['trial'], model.cold_drive
    for row in range(len(drive)):
        if row == 0 or trial[row] != trial[row - 1]:
            last = model.cold_drive
        drive[row] = last = drive[row] if np.isfinite(drive[row]) else last
    return drive, saturated
