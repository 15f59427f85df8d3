# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the pictures of a comparison show, in words for whoever does not see them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.comparison.signals import label
from hysteresis_ros.comparison.where import binned, blocks_of, correlogram, number
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.report.drawing import along

if TYPE_CHECKING:
    from hysteresis_ros.comparison.compare import Comparison


def descriptions(comparison: Comparison, after: Comparison | None = None) -> dict[str, str]:
    """
    Describe the pictures of a comparison.

    Parameters
    ----------
    comparison : Comparison
    after : Comparison, optional
        The same rows with more effects, where the picture has both.

    Returns
    -------
    dict of str to str
        By the name of the picture, as in `figures`; `waterfall` is bars with numbers on a page.
    """
    where = comparison.where[0].text if comparison.where else 'the error is much the same'
    found = {'overlay': _overlay(comparison, after), 'loop': _loop(comparison),
             'signals': f'Residual against {len(comparison.signals)} signals. {_worst(comparison)}',
             'plane': f'Residual over drive and load. Worst: {where}.',
             'since_step': f'Residual against the time since the last step. {_since(comparison)}',
             'correlogram': _correlogram(comparison),
             'coverage': 'How often each value was met. ' + '; '.join(
                 _range(name, values) for name, values in (
                     (comparison.drive, comparison.signals.get(comparison.drive)),
                     (comparison.quantity, comparison.measured)) if values is not None) + '.'}
    return found


def _range(name: str, values: np.ndarray) -> str:
    text, unit, scale = label(name)
    low, high = number(scale * float(values.min())), number(scale * float(values.max()))
    return f'{text} from {low} to {high} {unit}'.rstrip()


def _overlay(comparison: Comparison, after: Comparison | None) -> str:
    unit, scale = shown(comparison.quantity)
    residual = comparison.residual
    worst = int(np.argmax(np.abs(residual)))
    x, name = along(comparison)
    runs, _, x_unit = name.partition(' [')
    text = (f'{_range(comparison.quantity, comparison.measured)} over {runs}, in '
            f'{len(comparison.by_trial)} trials, measured and predicted, with the residual below. '
            f'The model is off by {number(scale * comparison.model.mean_abs)} {unit} on average')
    if after is not None:
        text += f', with the added effects by {number(scale * after.model.mean_abs)} {unit}'
    if comparison.linear is not None:
        text += f', the linear model by {number(scale * comparison.linear.mean_abs)} {unit}'
    trial = comparison.by_trial[comparison.trial[worst]]['trial']
    return (f'{text}. Its largest residual is {number(scale * float(residual[worst]))} {unit}, at '
            f'{runs} {number(float(x[worst]))} {x_unit.rstrip("]")}'.rstrip()
            + f' in trial {trial:g}.')


def _loop(comparison: Comparison) -> str:
    unit, scale = shown(comparison.quantity)
    residual = scale * comparison.residual
    text = (f'Loop of {label(comparison.drive)[0]} and {comparison.quantity}, coloured by the '
            'residual')
    drive = comparison.signals.get(comparison.drive)
    if drive is None:
        return text + '.'
    low, high = np.quantile(drive, [1 / 3, 2 / 3])
    thirds = [('low', drive <= low), ('middle', (drive > low) & (drive < high)),
              ('high', drive >= high)]
    return f'{text}. Mean residual: ' + ', '.join(
        f'{number(float(residual[inside].mean()))} {unit} at {name} drive'
        for name, inside in thirds if np.any(inside)) + '.'


def _worst(comparison: Comparison) -> str:
    """Say in which bin of which signal the mean residual is largest."""
    unit, scale = shown(comparison.quantity)
    block = blocks_of(comparison.residual, comparison.trial)
    best, text = 0.0, 'Every mean is 0 within its interval.'
    for name, values in comparison.signals.items():
        bins = binned(name, values, comparison.residual, block)
        sizes = np.where(bins.certain, np.abs(bins.mean), 0.0)
        place = int(np.argmax(sizes))
        if sizes[place] > best:
            best = float(sizes[place])
            words, of, factor = label(name)
            text = (f'The largest mean is {number(scale * float(bins.mean[place]))} {unit}, where '
                    f'{words} is about {number(factor * float(bins.centre[place]))} {of}'
                    ).rstrip() + '.'
    return text


def _since(comparison: Comparison) -> str:
    since = comparison.signals.get('time_since_step')
    if since is None:
        return ''
    unit, scale = shown(comparison.quantity)
    early = since <= np.quantile(since, 0.2)
    late = since >= np.quantile(since, 0.8)
    sizes = [scale * float(np.mean(np.abs(comparison.residual[rows]))) for rows in (early, late)]
    return (f'Its mean size is {number(sizes[0])} {unit} in the first fifth of the times and '
            f'{number(sizes[1])} {unit} in the last.')


def _correlogram(comparison: Comparison) -> str:
    below = np.flatnonzero(correlogram(comparison.residual) < 0.05)
    text = 'Autocorrelation of the residual: '
    if not below.size:
        return text + 'it stays above 0.05 throughout.'
    return text + f'it first falls below 0.05 at a lag of {below[0]} rows.'
