# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How well a model meets the bench tables: on trials fitted, on others, on loads left out."""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
from typing import Any

import numpy as np

from hysteresis_ros.identification.trials import choose_trials
from hysteresis_ros.identification.weight_fit import WeightFit
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.measurements.metrics import errors, relative_rmse, rmse_by_load
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model.chain import Chain

# By which share of the largest drive squared thresholds are moved to see what that does: a tenth of
# the interval of a grid.
SHIFT = 0.003


def measure(model: MuscleModel, force: Measurement | None, force_trials: Sequence[float] | None,
            length: Measurement | None, length_trials: Sequence[float] | None,
            slope: np.ndarray | None = None) -> dict[str, Any]:
    """
    Return the model's metrics: errors on fitted and on other trials, of both methods.

    Parameters
    ----------
    model : MuscleModel
        With effects or without.
    force, length : Measurement or None
        The bench tables.
    force_trials, length_trials : sequence of numbers or None
        Trials that were fitted.
    slope : ndarray, shape (rows,), optional
        `drive_slope` of the length table, where it is known.

    Returns
    -------
    dict
        By 'force' and 'length', as far as there is a table.
    """
    metrics = {}
    for name, measurement, trials in (('force', force, force_trials),
                                      ('length', length, length_trials)):
        if measurement is None:
            continue
        rows = choose_trials(measurement, trials, name)
        measured = measurement.column(measurement.response)
        span = float(np.ptp(measured))
        predicted = {method: model.predict(measurement, method)
                     for method in ('preisach', 'linear')}
        if name == 'length' and slope is None:
            slope = drive_slope(model, measurement)
        entry: dict[str, dict[str, Any]] = {}
        for part, chosen in (('identification', rows), ('verification', ~rows)):
            if np.any(chosen):
                entry[part] = {
                    label: errors((predicted[method] - measured)[chosen], span).to_dict()
                    for label, method in (('model', 'preisach'), ('linear', 'linear'))}
                entry[part]['rmse'] = entry[part]['model']['rmse']
                entry[part]['rows'] = int(np.count_nonzero(chosen))
                if name == 'length' and slope is not None:
                    residual = (predicted['preisach'] - measured)[chosen]
                    trial = measurement.column('trial')[chosen]
                    entry[part].update(relative_rmse(
                        residual, measured[chosen], trial, slope[chosen]))
                    if measurement.load:
                        load = measurement.column(measurement.load)[chosen]
                        entry[part].update(rmse_by_load(residual, load, trial))
        metrics[name] = entry
    return metrics


def drive_slope(model: MuscleModel, measurement: Measurement) -> np.ndarray:
    """
    Return how each row of a bench table follows an error of all thresholds, shape (rows,).

    Parameters
    ----------
    model : MuscleModel
    measurement : Measurement

    Returns
    -------
    ndarray, shape (rows,)
        Change of the response per drive squared (per drive where that is no voltage or current) by
        which that of the whole trial is larger. It is that of the last turn where nothing moves.
    """
    chain = Chain([], model.surroundings)
    step = SHIFT * model.surroundings.full_drive_squared
    squared = chain.to_drive_squared(measurement.column(model.drive))
    up, down = (model.predict(dataclasses.replace(measurement, columns={
        **measurement.columns, model.drive: chain.to_drive(squared + change)}))
        for change in (step, -step))
    return (up - down) / (2.0 * step)


def left_out(fit: WeightFit, response: np.ndarray, groups: np.ndarray,
             load: np.ndarray | None = None, slope: np.ndarray | None = None) -> dict[str, Any]:
    """
    Return the metric of trials, mostly of other loads, that were left out of the fit.

    Parameters
    ----------
    fit : WeightFit
        Of H2.
    response : ndarray, shape (n,)
        Of the rows fitted, as measured.
    groups : ndarray, shape (n,)
        Trial of each row fitted.
    load, slope : ndarray, shape (n,), optional
        Their load, and their `drive_slope`.

    Returns
    -------
    dict
        'left_out', or nothing where there is one trial or none was left out.
    """
    if len(np.unique(groups)) < 2 or not np.isfinite(fit.held_out_rmse):
        return {}
    by_load = {} if load is None else rmse_by_load(fit.held_out, load, groups)
    return {'left_out': {'rmse': fit.held_out_rmse, **by_load,
                         **relative_rmse(fit.held_out, response, groups, slope)}}


def rows_left_out(fit: WeightFit, groups: np.ndarray, load: np.ndarray | None = None
                  ) -> dict[str, Any]:
    """
    Return the metric of rows that were left out of the fit, one at a time.

    Parameters
    ----------
    fit : WeightFit
        Of H2.
    groups : ndarray, shape (n,)
        Trial of each row fitted.
    load : ndarray, shape (n,), optional
        Their load.

    Returns
    -------
    dict
        'rows_left_out'.
    """
    residual = fit.rows_left_out
    by_load = {} if load is None else rmse_by_load(residual, load, groups)
    return {'rows_left_out': {'rmse': float(np.sqrt(np.mean(residual ** 2))), **by_load}}
