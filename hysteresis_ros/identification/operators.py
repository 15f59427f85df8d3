# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One operator of each kind fitted to inputs and outputs, trial by trial."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.bouc_wen import fit_bouc_wen
from hysteresis_ros.identification.grid import MARGIN
from hysteresis_ros.identification.least_squares import (
    SLACK, STRENGTHS, Anchor, WeightFit, fit_weights, quick_weights)
from hysteresis_ros.identification.smoothness import smoothness
from hysteresis_ros.operators import (
    HysteresisOperator, Linear, Preisach, PrandtlIshlinskii, cell_areas, signed_areas,
    signed_lengths)

# And, where its place is searched for, up to one interval of the usual grid at either end.
MARGINS = (0.0, 0.0125, 0.025, 0.0375, 0.05)
# Rows that a search over parameters that are not weights looks at, besides the turning points.
SEARCH_ROWS = 400


def fit_operator(kind: str, parts: Sequence[np.ndarray], target: np.ndarray, groups: np.ndarray,
                 levels: int, anchor: tuple[float, float] | None = None,
                 strength: float | None = None, strengths: Sequence[float] | None = None,
                 reversible: bool = True, placed: bool = False,
                 fitted: np.ndarray | None = None
                 ) -> tuple[HysteresisOperator, WeightFit | None]:
    """
    Fit an operator that rises with its input.

    Parameters
    ----------
    kind : {'preisach', 'play', 'bouc-wen', 'linear'}
        Operator.
    parts : sequence of ndarray, each shape (1 + rows,)
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
    strengths : sequence of float, optional
        That cross-validation chooses from.
    reversible : bool
        Whether a Preisach operator gets reversible weights, for the part of its output without
        hysteresis: elastic stretch, a force that hardly loops. The paper's has none.
    placed : bool
        Whether a Preisach grid is moved to where its jumps suit the data best.
    fitted : ndarray of bool, shape (n,), optional
        Outputs to fit; the memory is carried through the others. Default: all.

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
    if fitted is None:
        fitted = np.ones(len(target), dtype=bool)
    options: dict[str, Any] = {
        'groups': groups, 'strength': strength, 'strengths': strengths, 'fitted': fitted}
    if kind == 'preisach':
        nodes = np.linspace(low, high, levels + 1)
        if placed:
            nodes = _placed(parts, target, nodes, reversible, fitted)
        return fit_preisach(parts, target, nodes, anchor=anchor, reversible=reversible, **options)
    if kind == 'play':
        return _play(parts, target, low, high, levels, options)
    if kind == 'linear':
        inputs = np.concatenate([part[1:] for part in parts])
        slope, intercept = np.polyfit(inputs[fitted], target[fitted], 1)
        return Linear(float(slope), float(intercept), low, high), None
    if kind == 'bouc-wen':
        return fit_bouc_wen(parts, target, low, high, _kept(parts), fitted=fitted), None
    raise IdentificationError(f'no operator of kind {kind!r}')


def preisach_rows(nodes: np.ndarray, inputs: np.ndarray, reversible: bool = False) -> np.ndarray:
    """Return what every weight contributes after each input from the cold state, (M, K [+ N])."""
    rows = signed_areas(nodes, inputs)
    return np.hstack([rows, signed_lengths(nodes, inputs)]) if reversible else rows


def fit_preisach(parts: Sequence[np.ndarray], target: np.ndarray, nodes: np.ndarray, *,
                 groups: np.ndarray | None = None, anchor: tuple[float, float] | None = None,
                 reversible: bool = True, strength: float | None = None,
                 strengths: Sequence[float] | None = None,
                 fitted: np.ndarray | slice = slice(None)) -> tuple[Preisach, WeightFit]:
    """Fit a Preisach operator on a given grid; the parameters are those of `fit_operator`."""
    rows = np.concatenate([preisach_rows(nodes, part, reversible)[1:] for part in parts])[fitted]
    known = None if anchor is None else Anchor(
        preisach_rows(nodes, np.array([anchor[0]]), reversible)[0], anchor[1])
    groups = None if groups is None else groups[fitted]
    fit = fit_weights(rows, target[fitted], groups=groups, scale=_scale(nodes, reversible), sign=1,
                      strength=strength, strengths=strengths, slack=SLACK,
                      penalty=smoothness(nodes, reversible), anchor=known)
    count = len(cell_areas(nodes))
    return Preisach(nodes, fit.weights[:count], fit.bias,
                    fit.weights[count:] if reversible else None), fit


def _scale(nodes: np.ndarray, reversible: bool) -> np.ndarray:
    """Sizes of the cells, and of the diagonal's intervals."""
    areas = cell_areas(nodes)
    return np.append(areas, np.diff(nodes)) if reversible else areas


def thinned(drive: np.ndarray, most: int) -> np.ndarray:
    """
    Return the rows of one trial to keep, ascending: about `most` and every turning point.

    An operator without rate gives the same output in the rows kept as with all of them.
    """
    count = len(drive)
    keep = np.zeros(count, dtype=bool)
    keep[:: max(1, -(-count // most))] = True
    keep[[0, -1]] = True
    moves = np.flatnonzero(np.diff(drive))
    turns = np.flatnonzero(np.diff(np.sign(np.diff(drive)[moves])))
    keep[moves[turns] + 1] = True
    return np.flatnonzero(keep)


def _kept(parts: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return the rows of each part that a search looks at, about `SEARCH_ROWS` of them."""
    return [thinned(part, max(1, SEARCH_ROWS // len(parts))) for part in parts]


def _fewer(parts: Sequence[np.ndarray], target: np.ndarray,
           fitted: np.ndarray) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Return the inputs and outputs of the rows kept, and which of them are fitted."""
    kept = _kept(parts)
    # Row n of a part is output n - 1 of its trial.
    starts = np.cumsum([0] + [len(part) - 1 for part in parts[:-1]])
    outputs = np.concatenate([start + rows[1:] - 1 for start, rows in zip(starts, kept)])
    return [part[rows] for part, rows in zip(parts, kept)], target[outputs], fitted[outputs]


def _placed(parts: Sequence[np.ndarray], target: np.ndarray, nodes: np.ndarray, reversible: bool,
            fitted: np.ndarray) -> np.ndarray:
    """
    Return the grid, of those reaching a little beyond `nodes`, that fits the rows best.

    The weight jumps only at nodes. Where the material changes fast, a shift by part of an
    interval matters as much as a finer grid would, and costs nothing.
    """
    low, high, levels = nodes[0], nodes[-1], len(nodes) - 1
    grids = [np.linspace(low - below * (high - low), high + above * (high - low), levels + 1)
             for below in MARGINS for above in MARGINS]
    parts, target, fitted = _fewer(parts, target, fitted)
    target = target[fitted]
    errors, passive = [], None
    for grid in grids:
        rows = np.concatenate(
            [preisach_rows(grid, part, reversible)[1:] for part in parts])[fitted]
        root = smoothness(grid, reversible)
        weights, bias, passive = quick_weights(
            rows, target, _scale(grid, reversible), STRENGTHS[0] * root.T @ root, passive)
        errors.append(np.sqrt(np.mean((rows @ weights + bias - target) ** 2)))
    return grids[int(np.argmin(errors))]


def _play(parts: Sequence[np.ndarray], target: np.ndarray, low: float, high: float, levels: int,
          options: dict[str, Any]) -> tuple[HysteresisOperator, WeightFit]:
    fitted, groups = options.pop('fitted'), options.pop('groups')
    radii = np.linspace(0.0, 0.5 * (high - low), levels + 1)[:-1]
    columns = []
    for radius in radii:
        single = PrandtlIshlinskii([radius], [1.0], 0.0, low, high)
        outputs = []
        for part in parts:
            single.reset()
            outputs.append(single.simulate(part)[1:])
        columns.append(np.concatenate(outputs))
    rows = np.column_stack(columns)[fitted]
    # A play whose clearance is never taken up contributes nothing.
    scale = np.maximum(np.ptp(rows, axis=0), 1e-12 * (high - low))
    fit = fit_weights(rows, target[fitted], groups=groups[fitted], scale=scale, sign=1,
                      slack=SLACK, **options)
    return PrandtlIshlinskii(radii.tolist(), fit.weights.tolist(), fit.bias, low, high), fit
