# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The rows of a comparison as data for the charts of a page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
import json
import os
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np

from hysteresis_ros.comparison.signals import label
from hysteresis_ros.comparison.where import binned, blocks_of, number, placed, Region
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.report.drawing import along, axis_label, scaled, some_rows

if TYPE_CHECKING:
    from hysteresis_ros.comparison.compare import Comparison

# As many rows as leave a page well below 1.5 MB.
MOST_ROWS = 12000
# Dots of each of the small charts.
MOST_DOTS = 400
DIRECTIONS = [{'value': -1, 'text': 'falling'}, {'value': 1, 'text': 'rising'}]
# A region of more than this share of the rows is everywhere, and not shaded.
EVERYWHERE = 0.95
# This share of a range is not seen in a small chart.
RESOLUTION = 1e-3


class Curve(NamedTuple):
    """A predicted response: its name, `model`, `linear` or `after`, and its values (rows,)."""

    name: str
    role: str
    values: np.ndarray


def recording(comparison: Comparison, curves: Sequence[Curve], main: int = 0) -> dict[str, Any]:
    """
    Return what the charts of a page draw.

    Parameters
    ----------
    comparison : Comparison
        Its residual colours the loop, and its regions are shaded.
    curves : sequence of Curve
        Predicted responses.
    main : int
        Which of them is that of `comparison`.

    Returns
    -------
    dict
        Plain types, in the units that a person thinks in.
    """
    quantity, drive = comparison.quantity, comparison.drive
    rows = chosen_rows(comparison, curves)
    x, x_label = along(comparison)
    signal = comparison.signals.get(drive, np.zeros(comparison.rows))
    residual = scaled(quantity, comparison.residual)
    floor = scaled(quantity, comparison.floor.value)
    return {
        'x': {'label': x_label, 'unit': unit_in(x_label), 'values': packed(x[rows], 32)},
        'drive': {'label': axis_label(drive), 'unit': label(drive)[1],
                  'values': packed(scaled(drive, signal[rows]))},
        'response': {'label': axis_label(quantity), 'unit': shown(quantity)[0]},
        'measured': packed(scaled(quantity, comparison.measured[rows])),
        'predictions': [{'name': curve.name, 'role': curve.role,
                         'values': packed(scaled(quantity, curve.values[rows]))}
                        for curve in curves],
        'main': main,
        'limit': max(float(np.quantile(np.abs(residual), 0.99)), 1e-12),
        'noise': float(floor) if np.isfinite(floor) else 0.0,
        'trials': trials(comparison, rows),
        'regions': [{'name': placed(one.signal, one.low, one.high), 'rows': runs(inside[rows])}
                    for one, inside in shaded(comparison)],
        'drawn': len(rows),
        'continuous': comparison.continuous,
        **signals(comparison)}


def as_json(content: dict[str, Any]) -> str:
    """Return data as JSON that cannot end the element of a page in which it stands."""
    text = json.dumps(content, separators=(',', ':'), allow_nan=False)
    return text.replace('<', '\\u003c').replace('>', '\\u003e').replace('&', '\\u0026')


def chosen_rows(comparison: Comparison, curves: Sequence[Curve],
                most: int = MOST_ROWS) -> np.ndarray:
    """
    Choose the rows that are drawn, in order: all, or of each stretch the extremes.

    Parameters
    ----------
    comparison : Comparison
    curves : sequence of Curve
    most : int
        About how many.

    Returns
    -------
    ndarray of int
        Extremes of the measured response and of each residual, and both ends of each trial.
    """
    return extremes([comparison.measured, *(comparison.measured - curve.values
                                            for curve in curves)], comparison.trial, most)


def extremes(series: Sequence[np.ndarray], trial: np.ndarray, most: int) -> np.ndarray:
    """
    Choose rows that show the extremes of some series, in order; all, if they are not many.

    Parameters
    ----------
    series : sequence of ndarray, each shape (rows,)
    trial : ndarray of int, shape (rows,)
        Both ends of each trial are chosen, too.
    most : int
        About how many.

    Returns
    -------
    ndarray of int
    """
    rows = len(trial)
    if rows <= most:
        return np.arange(rows)
    starts = np.flatnonzero(np.diff(trial, prepend=-1))
    found = [starts, np.append(starts[1:], rows) - 1]
    size = -(-rows // max(most // (2 * len(series)), 1))
    edges = np.arange(0, rows, size)
    for values in series:
        filled = np.concatenate([values, np.full(len(edges) * size - rows, values[-1])])
        table = filled.reshape(len(edges), size)
        found += [edges + table.argmin(axis=1), edges + table.argmax(axis=1)]
    return np.unique(np.minimum(np.concatenate(found), rows - 1))


def signals(comparison: Comparison) -> dict[str, Any]:
    """Return the residual against every signal, as rows and as means, and the range of all."""
    quantity, residual = comparison.quantity, comparison.residual
    unit, scale = shown(quantity)
    block = blocks_of(residual, comparison.trial)
    some = some_rows(comparison.rows, MOST_DOTS)
    found = []
    # Intervals of few independent rows would press the rows themselves flat; they are cut.
    largest = 1.5 * float(np.quantile(np.abs(residual), 0.995))
    ends_y = [0.0, *np.quantile(residual, [0.005, 0.995])]
    for name, values in comparison.signals.items():
        bins = binned(name, values, residual, block)
        half = np.where(np.isfinite(bins.half), bins.half, np.nan)
        for sign in (-1.0, 1.0):
            ends_y += list(np.clip(bins.mean + sign * np.nan_to_num(half), -largest, largest))
        low, high = np.quantile(values, [0.005, 0.995])
        ends = np.array([values.min(), values.max()])
        if np.ptp(values) > 3 * (high - low) > 0:
            # A few rows far out, as a rate has at steps, would press all others together.
            ends = np.array([low, high])
        ends = ends + np.array([-0.05, 0.05]) * max(float(np.ptp(ends)), 1e-12)
        found.append({
            'name': name, 'label': axis_label(name), 'unit': label(name)[1],
            'text': f'residual against {axis_label(name)}: means from '
                    f'{number(scale * float(bins.mean.min()))} to '
                    f'{number(scale * float(bins.mean.max()))} {unit}',
            'range': [float(value) for value in scaled(name, ends)],
            'ticks': DIRECTIONS if name == 'direction' else None,
            'centre': plain(scaled(name, bins.centre)), 'rows': [int(n) for n in bins.rows],
            'mean': plain(scaled(quantity, bins.mean)), 'half': plain(scaled(quantity, half)),
            'dots': [plain(scaled(name, values[some])),
                     plain(scaled(quantity, residual[some]))]})
    low, high = scale * min(ends_y), scale * max(ends_y)
    margin = 0.05 * max(high - low, 1e-12)
    return {'signals': found, 'signalRange': [float(low - margin), float(high + margin)]}


def trials(comparison: Comparison, rows: np.ndarray) -> list[dict[str, Any]]:
    """Return name, error, and the first and the last but one of the drawn rows of each trial."""
    unit, scale = shown(comparison.quantity)
    sources = {entry['source'] for entry in comparison.by_trial}
    files = {source: os.path.basename(os.path.normpath(source)) for source in sources}
    if len(set(files.values())) < len(files):
        files = {source: source for source in sources}
    found = []
    for index, entry in enumerate(comparison.by_trial):
        name = f'{entry["trial"]:g}'
        if len(files) > 1:
            name += f' of {files[entry["source"]]}'
        place = np.searchsorted(comparison.trial[rows], [index, index + 1])
        found.append({'name': name, 'from': int(place[0]), 'to': int(place[1]),
                      'error': f'{number(scale * entry["model"].rmse)} {unit} RMS'})
    return found


def shaded(comparison: Comparison) -> list[tuple[Region, np.ndarray]]:
    """Return the regions that are a part of the rows, each with its rows, bool (rows,)."""
    found = []
    for one in comparison.where:
        values = comparison.signals.get(one.signal)
        if values is None and one.signal in ('trial', 'trial_number'):
            values = comparison.trial
            if one.signal == 'trial':
                values = np.array([entry['trial'] for entry in comparison.by_trial])[values]
        if values is None:
            continue
        inside = (values >= one.low) & (values <= one.high)
        if 0 < np.sum(inside) <= EVERYWHERE * len(inside):
            found.append((one, inside))
    return found


def runs(inside: np.ndarray) -> list[list[int]]:
    """Return the runs of true entries, each as its first and the one after its last."""
    steps = np.flatnonzero(np.diff(np.concatenate(([0], inside.astype(np.int8), [0]))))
    return steps.reshape(-1, 2).tolist()


def packed(values: np.ndarray, bits: int = 16) -> dict[str, Any]:
    """
    Pack a column into whole numbers between its ends, which takes a third of its digits.

    Parameters
    ----------
    values : ndarray, shape (rows,)
    bits : {16, 32}
        Of each number.

    Returns
    -------
    dict
        `low` and `high` that the numbers 0 and 2^bits - 2 stand for, `bits`, and `data`: the
        numbers, lowest byte first, in base 64; 2^bits - 1 stands for what is no number.
    """
    finite = np.isfinite(values)
    known = values[finite] if np.any(finite) else np.zeros(1)
    low, high = float(known.min()), float(known.max())
    none = 2 ** bits - 1
    shares = (np.where(finite, values, low) - low) / ((high - low) or 1.0)
    whole = np.where(finite, np.rint(shares * (none - 1)), none).astype(f'<u{bits // 8}')
    return {'low': low, 'high': high, 'bits': bits,
            'data': base64.b64encode(whole.tobytes()).decode('ascii')}


def plain(values: np.ndarray) -> list[float | None]:
    """Return values with as many digits as are seen; None for what is no number."""
    finite = np.isfinite(values)
    span = float(np.ptp(values[finite])) if np.any(finite) else 0.0
    digits = int(np.clip(np.ceil(-np.log10(max(RESOLUTION * span, 1e-12))), 0, 12))
    return [round(float(value), digits) if known else None
            for value, known in zip(values, finite)]


def unit_in(text: str) -> str:
    """Return the unit that stands in brackets in a label, '' without one."""
    return text.partition('[')[2].rstrip(']')
