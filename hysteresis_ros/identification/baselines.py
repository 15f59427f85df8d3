# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The models that the paper compares with: linear, additive, embedded line, one load only.

=============== ================================== ==================
linear          L = k2 (F - k1 V - F0)             Eq. 11
additive        L = H3[F] - H4[V]                  Sec. III-B
embedded line   L = H5[F - a1 V - a0]              Sec. III-B
one load        L = H[V] at one load, another H    Fig. 9
                for the next
=============== ================================== ==================
"""

from __future__ import annotations


from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.least_squares import SLACK, WeightFit, fit_weights
from hysteresis_ros.identification.operators import fit_operator
from hysteresis_ros.identification.smoothness import smoothness
from hysteresis_ros.model.linear import LinearModel
from hysteresis_ros.model.muscle import COLD_DRIVE
from hysteresis_ros.operators import (
    Additive, Cascade, HysteresisOperator, Linear, Preisach, cell_areas, signed_areas)

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement


def fit_linear(length: Measurement | None = None, force: Measurement | None = None) -> LinearModel:
    """
    Fit Eq. 11 as the paper does: a line through the forces, then one through the lengths.

    The second goes through the origin, because Eq. 11 has no constant but F0. Without a force
    table all three constants come from the lengths at once, and without a load F is zero.

    Parameters
    ----------
    length, force : Measurement, optional
        The trials to fit; at least one table.

    Raises
    ------
    IdentificationError
        If there is no table, or the drive does not vary.
    """
    some = force if force is not None else length
    if some is None:
        raise IdentificationError('linear model: no table given; give forces or lengths')
    if not np.ptp(some.column(some.drive)) > 0.0:
        raise IdentificationError(f'{some.source}: the {some.drive} does not vary')
    if force is not None:
        slope, offset = np.polyfit(force.column(force.drive), force.column('force'), 1)
        return LinearModel(float(slope), 1.0 if length is None else _length_per_force(
            length, slope, offset), float(offset))
    drive, target = some.column(some.drive), some.column(some.response)
    load = _loads(some)
    if np.ptp(load) > 0.0:
        columns = np.column_stack([load, drive, np.ones(len(drive))])
        scale = np.abs(columns).max(axis=0)
        by_load, by_drive, offset = np.linalg.lstsq(
            columns / scale, target, rcond=None)[0] / scale
        if by_load != 0.0:
            return LinearModel(float(-by_drive / by_load), float(by_load),
                               float(-offset / by_load))
    # One load cannot tell a force from a length: k2 = 1.
    by_drive, offset = np.polyfit(drive, target, 1)
    return LinearModel(float(-by_drive), 1.0, float(np.mean(load) - offset))


def _loads(length: Measurement) -> np.ndarray:
    return length.column(length.load) if length.load else np.zeros(length.rows)


def _length_per_force(length: Measurement, slope: float, offset: float) -> float:
    z = _loads(length) - slope * length.column(length.drive) - offset
    square = float(z @ z)
    return float(z @ length.column(length.response)) / square if square > 0.0 else 1.0


def fit_additive(length: Measurement, levels: int = 20) -> tuple[Additive, WeightFit]:
    """
    Fit the additive model, both operators at once.

    Parameters
    ----------
    length : Measurement
        The trials to fit; under two loads at least, else H3 has nothing to act on.
    levels : int
        Levels of both grids.

    Returns
    -------
    Additive, WeightFit

    Raises
    ------
    IdentificationError
        If there is no load or it does not vary.
    """
    load = _loads(length)
    if not np.ptp(load) > 0.0:
        raise IdentificationError(
            f'{length.source}: the additive model needs lengths under two loads or more')
    grids = [np.linspace(values.min(), values.max(), levels + 1)
             for values in (load, length.column(length.drive))]
    rows = []
    for drives, loads in _parts(length):
        rows.append(np.hstack([signed_areas(grids[0], loads), -signed_areas(grids[1], drives)])[1:])
    areas = [cell_areas(grid) for grid in grids]
    penalties = [smoothness(grid) for grid in grids]
    penalty = np.block([[penalties[0], np.zeros((len(penalties[0]), len(areas[1])))],
                        [np.zeros((len(penalties[1]), len(areas[0]))), penalties[1]]])
    fit = fit_weights(np.concatenate(rows), length.column(length.response),
                      groups=length.column('trial'), scale=np.concatenate(areas),
                      penalty=penalty, slack=SLACK)
    count = len(areas[0])
    return Additive(Preisach(grids[1], fit.weights[count:]),
                    Preisach(grids[0], fit.weights[:count], fit.bias)), fit


def fit_embedded_line(length: Measurement, force: Measurement | None = None, levels: int = 20,
                      fitted: np.ndarray | None = None) -> tuple[Cascade, WeightFit | None]:
    """
    Fit L = H5[F - a1 V - a0]: the two-stage model with a line for its first stage.

    Parameters
    ----------
    length, force : Measurement
        The trials to fit; without a force table the line comes from the lengths.
    levels : int
        Levels of H5's grid.
    fitted : ndarray of bool, shape (rows,), optional
        Rows of the length table to fit; the memory is carried through the others.

    Returns
    -------
    Cascade, WeightFit
    """
    some = length if fitted is None else length.where(fitted)
    line = fit_linear(force=force) if force is not None else fit_linear(some)
    drive = np.append(length.column(length.drive), _cold(length))
    first = Linear(line.k1, line.F0, float(drive.min()), float(drive.max()))
    parts = [loads - first.simulate(drives) for drives, loads in _parts(length)]
    second, fit = fit_operator('preisach', parts, length.column(length.response),
                               length.column('trial'), levels, fitted=fitted)
    return Cascade([first, second]), fit


def fit_one_load(length: Measurement,
                 levels: int = 20) -> tuple[HysteresisOperator, WeightFit | None]:
    """
    Fit one Preisach operator of the drive to trials under one load (Fig. 9).

    Parameters
    ----------
    length : Measurement
        The trials to fit.
    levels : int
        Levels of the grid.

    Returns
    -------
    Preisach, WeightFit
        The operator takes the negative drive: it rises where the muscle cools.

    Raises
    ------
    IdentificationError
        If there is more than one load.
    """
    load = _loads(length)
    if np.ptp(load) > 1e-6 * max(float(np.max(np.abs(load))), 1e-300):
        raise IdentificationError(
            f'{length.source}: loads from {load.min():.4g} to {load.max():.4g}; select the trials '
            'under one load')
    return fit_operator('preisach', [-drives for drives, _ in _parts(length)],
                        length.column(length.response), length.column('trial'), levels)


def simulate(model: Additive | Cascade | HysteresisOperator, length: Measurement) -> np.ndarray:
    """
    Return the lengths that a baseline predicts for every row of a table, shape (rows,).

    Parameters
    ----------
    model : Additive, Cascade or Preisach
        As the functions of this module return it.
    length : Measurement
    """
    outputs = []
    for drives, loads in _parts(length):
        model.reset()
        inputs = -drives if isinstance(model, Preisach) else np.column_stack([drives, loads])
        outputs.append(model.simulate(inputs)[1:])
    return np.concatenate(outputs)


def _cold(length: Measurement) -> float:
    return COLD_DRIVE.get(length.drive, float(length.column(length.drive).min()))


def _parts(length: Measurement) -> list[tuple[np.ndarray, np.ndarray]]:
    """Drives and loads of each trial, the cold state first, each (1 + rows,)."""
    drive, load = length.column(length.drive), _loads(length)
    return [(np.append(_cold(length), drive[part]), np.append(load[part][0], load[part]))
            for _, part in length.split()]
