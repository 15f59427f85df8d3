# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One operator of each kind fitted to inputs and outputs, trial by trial."""

from collections.abc import Sequence

import numpy as np
from scipy import optimize

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.least_squares import Anchor, WeightFit, fit_weights
from hysteresis_ros.operators import (
    BoucWen, HysteresisOperator, Linear, Preisach, PrandtlIshlinskii, cell_areas, cells,
    signed_areas)

# The grid reaches this far beyond the data, as a share of the data's range.
MARGIN = 1e-6


def fit_operator(kind: str, parts: Sequence[np.ndarray], target: np.ndarray, groups: np.ndarray,
                 levels: int, anchor: tuple[float, float] | None = None,
                 strength: float | None = None) -> tuple[HysteresisOperator, WeightFit | None]:
    """
    Fit an operator that rises with its input.

    Parameters
    ----------
    kind : {'preisach', 'play', 'bouc-wen', 'linear'}
        Operator.
    parts : sequence of ndarray, each (1 + rows,)
        Inputs of each trial from a saturated memory on; the first, the cold one, has no output.
    target : ndarray, shape (n,)
        Outputs of all other inputs, trial after trial.
    groups : ndarray, shape (n,)
        Trial of each output.
    levels : int
        Levels of the Preisach grid, or number of plays.
    anchor : (float, float), optional
        Input, reached from saturation, at which the output is known.
    strength : float, optional
        Of the regularisation; 0 is the paper's plain problem. Default: cross-validated.

    Returns
    -------
    HysteresisOperator, WeightFit or None
        The second is None for operators that are not linear in their parameters.

    Raises
    ------
    IdentificationError
        If the inputs do not vary or the fit fails.
    """
    low = min(float(part.min()) for part in parts)
    high = max(float(part.max()) for part in parts)
    if not high > low:
        raise IdentificationError('the input of an operator does not vary; nothing to identify')
    margin = MARGIN * (high - low)
    low, high = low - margin, high + margin
    if kind == 'preisach':
        return _preisach(parts, target, groups, np.linspace(low, high, levels + 1), anchor,
                         strength)
    if kind == 'play':
        return _play(parts, target, groups, low, high, levels, strength)
    if kind == 'linear':
        slope, intercept = np.polyfit(np.concatenate([part[1:] for part in parts]), target, 1)
        return Linear(float(slope), float(intercept), low, high), None
    if kind == 'bouc-wen':
        return _bouc_wen(parts, target, low, high), None
    raise IdentificationError(f'no operator of kind {kind!r}')


def smoothness(nodes: np.ndarray) -> np.ndarray:
    """
    Return the root of the penalty on differences between neighbouring cells, shape (R, K).

    It acts on weight times area, taken back to the density, so that cells of any size count alike;
    a small multiple of the identity keeps cells without data at zero.
    """
    levels = len(nodes) - 1
    row, column = cells(levels)
    number = {place: k for k, place in enumerate(zip(row.tolist(), column.tolist()))}
    area = cell_areas(nodes)
    density = area.max() / area
    rows = []
    for (i, j), k in number.items():
        for other in (number.get((i + 1, j)), number.get((i, j + 1))):
            if other is not None:
                difference = np.zeros(len(area))
                difference[k], difference[other] = density[k], -density[other]
                rows.append(difference)
    return np.vstack([np.array(rows).reshape(-1, len(area)), 0.1 * np.diag(density)])


def _preisach(parts, target, groups, nodes, anchor, strength):
    rows = np.concatenate([signed_areas(nodes, part)[1:] for part in parts])
    anchors = ()
    if anchor is not None:
        anchors = (Anchor(signed_areas(nodes, np.array([anchor[0]]))[0], anchor[1]),)
    fit = fit_weights(rows, target, groups=groups, scale=2.0 * cell_areas(nodes), sign=1,
                      strength=strength, penalty=PENALTY(nodes), anchors=anchors)
    return Preisach(nodes, fit.weights, fit.bias), fit


PENALTY = smoothness


def _play(parts, target, groups, low, high, levels, strength):
    radii = np.linspace(0.0, 0.5 * (high - low), levels + 1)[:-1]
    columns = []
    for radius in radii:
        single = PrandtlIshlinskii([radius], [1.0], 0.0, low, high)
        outputs = []
        for part in parts:
            single.reset()
            outputs.append(single.simulate(part)[1:])
        columns.append(np.concatenate(outputs))
    rows = np.column_stack(columns)
    fit = fit_weights(rows, target, groups=groups, scale=np.maximum(np.ptp(rows, axis=0), 1e-300),
                      sign=1, strength=strength)
    return PrandtlIshlinskii(radii, fit.weights, fit.bias, low, high), fit


def _bouc_wen(parts, target, low, high):
    """Rate, shape and exponent by search; stiffness, gain and bias by linear least squares."""
    def design(vector):
        rate, shape, exponent = np.exp(vector[0]), 0.5 + np.exp(vector[1]), 1.0 + np.exp(vector[2])
        states = []
        for part in parts:
            unit = BoucWen(0.0, 1.0, rate, shape, exponent, 0.0, low, high)
            states.append(unit.simulate(part)[1:])
        inputs = np.concatenate([part[1:] for part in parts])
        rows = np.column_stack([inputs, np.concatenate(states)])
        fit = fit_weights(rows, target, scale=np.maximum(np.ptp(rows, axis=0), 1e-300), sign=1,
                          strength=1e-9)
        return fit, (rate, shape, exponent)

    start = np.array([np.log(6.0 / (high - low)), 0.0, 0.0])
    found = optimize.minimize(lambda vector: design(np.clip(vector, start - 4.0, start + 4.0))[
        0].rmse, start, method='Nelder-Mead', options={'maxfev': 120, 'xatol': 0.01, 'fatol': 0.0})
    fit, (rate, shape, exponent) = design(np.clip(found.x, start - 4.0, start + 4.0))
    return BoucWen(float(fit.weights[0]), float(fit.weights[1]), float(rate), float(shape),
                   float(exponent), float(fit.bias), low, high)
