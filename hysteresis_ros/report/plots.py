# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The pictures of a comparison.

Lines differ in shape and lightness, so that grey print keeps them.
"""

from __future__ import annotations

from collections.abc import Sequence

from typing import Any, TYPE_CHECKING

from hysteresis_ros.report.drawing import (
    along, axis_label, MOST_POINTS, new_figure, scaled, some_rows, thinned)
from hysteresis_ros.comparison.signals import label
from hysteresis_ros.comparison.where import binned, blocks_of, correlogram
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.report.words import short_name
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hysteresis_ros.comparison.compare import Comparison
    from hysteresis_ros.diagnosis.verdict import Diagnosis

MEASURED: dict[str, Any] = {'color': '#000000', 'linewidth': 1.3, 'linestyle': '-'}
MODEL: dict[str, Any] = {'color': '#2f6db5', 'linewidth': 1.3, 'linestyle': (0, (5, 1.5))}
LINEAR: dict[str, Any] = {'color': '#d98a1f', 'linewidth': 1.3, 'linestyle': (0, (1, 1))}
AFTER: dict[str, Any] = {'color': '#1f8a4c', 'linewidth': 1.3, 'linestyle': '-'}
DOTS: dict[str, Any] = {'color': '#9aa7b5', 'markersize': 2.0, 'linestyle': 'none',
                        'marker': '.', 'alpha': 0.5}
MEANS: dict[str, Any] = {'color': '#12355b', 'linewidth': 1.4, 'marker': 'o',
                         'markersize': 3.5, 'capsize': 2.5}
SIGNED = 'cividis'
FOUND, TRIED = '#2ca02c', '#1f77b4'


def figures(comparison: Comparison) -> dict[str, Figure]:
    """
    Draw everything that a comparison has to show.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By file name without suffix: `overlay`, `signals`, `loop`, and where
        there is what they need `waterfall`, `plane`, `since_step`, `correlogram`, `coverage`.

    """
    drawn = {'overlay': overlay(comparison), 'signals': residual_against_signals(comparison),
             'loop': residual_on_loop(comparison)}
    if comparison.extensions:
        drawn['waterfall'] = waterfall([(name, values.rmse) for name, values
                                        in comparison.extensions],
                                       comparison.floor.value, comparison.quantity)
    drive, load = comparison.drive, load_of(comparison)
    if load is not None:
        drawn['plane'] = residual_on_plane(comparison, drive, load)
    if 'time_since_step' in comparison.signals:
        drawn['since_step'] = residual_since_step(comparison)
    if comparison.rows >= 20:
        drawn['correlogram'] = correlogram_of(comparison)
    drawn['coverage'] = coverage(comparison)
    return drawn


def overlay(comparison: Comparison, after: Comparison | None = None) -> Figure:
    """
    Draw measured and predicted response, and below the residual; trials are not joined.

    Parameters
    ----------
    comparison : Comparison
    after : Comparison, optional
        Another model on the same rows, such as one with more effects.

    Returns
    -------
    matplotlib.figure.Figure

    """
    quantity = comparison.quantity
    figure, axes = new_figure(9, 5.2, 2, 1, sharex=True, height_ratios=[2, 1])
    top, bottom = axes[:, 0]
    x, name = along(comparison)
    curves = [(comparison.predicted, short_name(comparison.name), MODEL)]
    if after is not None:
        curves.append((after.predicted, short_name(after.name), AFTER))
    if comparison.linear_predicted is not None:
        curves.insert(0, (comparison.linear_predicted, 'linear', LINEAR))

    def draw(axis: Axes, values: np.ndarray, **style: Any) -> None:
        axis.plot(*separated(x, scaled(quantity, values), comparison.trial), **style)

    for values, text, style in curves:
        draw(bottom, comparison.measured - values, **style)
    # The measured response lies above the linear model, and below those that should meet it.
    curves.insert(int(comparison.linear_predicted is not None),
                  (comparison.measured, 'measured', MEASURED))
    for values, text, style in curves:
        draw(top, values, label=text, **style)
    bottom.axhline(0.0, color='black', linewidth=0.8)
    noise = scaled(quantity, comparison.floor.value)
    bottom.axhspan(-noise, noise, color='#cccccc', alpha=0.6, linewidth=0)
    for start in x[np.flatnonzero(np.diff(comparison.trial)) + 1]:
        for axis in (top, bottom):
            axis.axvline(start, color='#888888', linewidth=0.7, linestyle=':')
    top.set_ylabel(axis_label(quantity))
    bottom.set_ylabel(f'measured - predicted\n[{label(quantity)[1] or "1"}]', fontsize=8)
    bottom.set_xlabel(name)
    top.legend(fontsize=8, ncols=4, frameon=False, loc='lower left', bbox_to_anchor=(0, 1))
    return figure


def separated(x: np.ndarray, y: np.ndarray, trial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a line, thinned trial by trial, with a gap (NaN) between trials."""
    count = int(trial[-1]) + 1
    xs, ys = [], []
    for number in range(count):
        inside = trial == number
        few_x, few = thinned(x[inside], y[inside], max(MOST_POINTS // count, 40))
        gap = [np.nan] * (number < count - 1)
        xs.append(np.concatenate([few_x, gap]))
        ys.append(np.concatenate([few, gap]))
    return np.concatenate(xs), np.concatenate(ys)


def residual_against_signals(comparison: Comparison) -> Figure:
    """
    Draw the residual against every signal, with binned means and their 95 % intervals.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    matplotlib.figure.Figure

    """
    names = list(comparison.signals)
    columns = min(3, max(len(names), 1))
    rows = -(-len(names) // columns) or 1
    figure, axes = new_figure(9, 2.5 * rows, rows, columns, sharey=True)
    residual = comparison.residual
    block = blocks_of(residual, comparison.trial)
    for axis, name in zip(axes.flat, names):
        against(axis, comparison, name, comparison.signals[name], residual, block)
    for axis in axes.flat[len(names):]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel(f'measured - predicted\n[{label(comparison.quantity)[1] or "1"}]',
                        fontsize=8)
    return figure


def against(axis: Axes, comparison: Comparison, name: str, values: np.ndarray,
            residual: np.ndarray, block: np.ndarray) -> None:
    """Draw the residual against one signal into an axis."""
    quantity = comparison.quantity
    chosen = some_rows(len(values))
    axis.plot(scaled(name, values[chosen]), scaled(quantity, residual[chosen]), **DOTS)
    bins = binned(name, values, residual, block)
    half = np.where(np.isfinite(bins.half), bins.half, 0.0)
    axis.errorbar(scaled(name, bins.centre), scaled(quantity, bins.mean),
                  scaled(quantity, half), **MEANS)
    axis.axhline(0.0, color='black', linewidth=0.8)
    largest = scaled(quantity, float(np.max(np.abs(bins.mean) + half)))
    spread = scaled(quantity, float(np.quantile(np.abs(residual), 0.995)))
    limit = 1.1 * max(largest if largest < 3 * spread else spread, spread, 1e-12)
    axis.set_ylim(-limit, limit)
    axis.set_xlabel(axis_label(name), fontsize=8)
    low, high = np.quantile(values, [0.005, 0.995])
    if np.ptp(values) > 3 * (high - low) > 0:
        # A few rows far out, as a rate has at steps, would press all others together.
        axis.set_xlim(*scaled(name, np.array([1.1 * low - 0.1 * high, 1.1 * high - 0.1 * low])))
    if name == 'direction':
        axis.set_xticks([-1, 1], ['falling', 'rising'])
        axis.set_xlim(-1.5, 1.5)


def residual_on_loop(comparison: Comparison) -> Figure:
    """
    Draw the hysteresis loop, measured and predicted, coloured by the residual.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    matplotlib.figure.Figure

    """
    figure, axes = new_figure(9, 3.8, 1, 2, sharex=True, sharey=True)
    quantity, drive = comparison.quantity, comparison.drive
    signal = comparison.signals.get(drive, np.zeros(comparison.rows))
    chosen = some_rows(comparison.rows)
    x = scaled(drive, signal[chosen])
    for values, style, text in ((comparison.measured, MEASURED, 'measured'),
                                (comparison.predicted, MODEL, short_name(comparison.name))):
        line = {**style, 'linewidth': 0.9}
        for trial in np.unique(comparison.trial[chosen]):
            inside = comparison.trial[chosen] == trial
            axes[0, 0].plot(x[inside], scaled(quantity, values[chosen][inside]), label=text, **line)
            text = ''     # once in the legend
    axes[0, 0].legend(fontsize=8, ncols=2, frameon=False, loc='lower left', bbox_to_anchor=(0, 1))
    coloured(figure, axes[0, 1], x, scaled(quantity, comparison.measured[chosen]),
             comparison.residual[chosen], quantity)
    axes[0, 1].set_title('measured, by the residual', fontsize=9, loc='left')
    for axis in axes[0]:
        axis.set_xlabel(axis_label(drive))
    axes[0, 0].set_ylabel(axis_label(quantity))
    return figure


def coloured(figure: Figure, axis: Axes, x: np.ndarray, y: np.ndarray, residual: np.ndarray,
             quantity: str) -> None:
    """Scatter points whose lightness is the residual, with its scale beside them."""
    limit = max(scaled(quantity, float(np.quantile(np.abs(residual), 0.99))), 1e-12)
    order = np.argsort(np.abs(residual))
    points = axis.scatter(x[order], y[order], c=scaled(quantity, residual[order]), s=9,
                          cmap=SIGNED, vmin=-limit, vmax=limit, linewidths=0)
    bar = figure.colorbar(points, ax=axis)
    bar.set_label(f'measured - predicted [{label(quantity)[1] or "1"}]', fontsize=8)
    bar.ax.tick_params(labelsize=8)


def load_of(comparison: Comparison) -> str | None:
    """Return the name of the load that varies, or None."""
    return next((name for name in ('force', 'stress') if name in comparison.signals
                 and name != comparison.drive), None)


def waterfall(steps: Sequence[tuple[str, float]], floor: float | None, quantity: str) -> Figure:
    """
    Draw how the error falls with every effect that was added.

    Parameters
    ----------
    steps : list of (str, float)
        What the model had and its RMSE, in the unit of files; the first without the effects.
    floor : float or None
        RMSE of the noise alone; None where it is not known.
    quantity : str
        The response.

    Returns
    -------
    matplotlib.figure.Figure

    """
    figure, axes = new_figure(6.5, 0.9 + 0.45 * len(steps))
    axis = axes[0, 0]
    names = [name for name, _ in steps]
    values = scaled(quantity, np.array([value for _, value in steps]))
    axis.barh(range(len(steps)), values, height=0.6, edgecolor='#12355b', linewidth=0.8,
              color=['#12355b', *['#9db7d3'] * (len(steps) - 1)])
    for row, value in enumerate(values):
        axis.annotate(f'{value:.3g}', (value, row), (4, 0), textcoords='offset points',
                      va='center', fontsize=8)
    if floor is not None:
        axis.axvline(scaled(quantity, floor), color='black', linewidth=1.0, linestyle=':')
        axis.annotate('noise', (scaled(quantity, floor), -0.5), (3, 0),
                      textcoords='offset points', fontsize=7, va='bottom')
    axis.set_yticks(range(len(steps)), names)
    axis.set_ylim(len(steps) - 0.4, -0.7)
    axis.set_xlim(0, 1.12 * max(float(values.max()), 1e-12))
    axis.set_xlabel(f'RMSE of the {label(quantity)[0]} [{label(quantity)[1] or "1"}]')
    return figure


def ranking(found: Diagnosis, most: int = 15) -> Figure:
    """
    Draw the error with each effect added alone, with 95 % intervals.

    Parameters
    ----------
    found : Diagnosis
    most : int
        Effects that are drawn, from the best on.

    Returns
    -------
    matplotlib.figure.Figure

    """
    unit, scale = shown(found.quantity)
    rows = found.ranking[:most][::-1]
    figure, axes = new_figure(8.5, 0.8 + 0.28 * max(len(rows), 2))
    axis = axes[0, 0]
    for place, row in enumerate(rows):
        chosen = row['effect'] in found.missing
        colour = FOUND if chosen else TRIED
        ends = [scale * row['rmse_before'] * (1.0 - row[key]) for key in ('gain_high', 'gain_low')]
        axis.plot(ends, [place, place], color=colour, lw=2.0 if chosen else 1.2)
        axis.plot(scale * row['rmse_after'], place, 'o', color=colour,
                  mfc=colour if row['plausible'] else 'white')
    axis.axvline(scale * found.rmse_before, color='black', ls='--', lw=0.9)
    axis.set_yticks(range(len(rows)), [row['effect'] for row in rows])
    axis.set_xlabel(f'{found.error_name} on rows not fitted [{unit or "1"}]')
    axis.set_xlim(left=0.0)
    return figure


def residual_on_plane(comparison: Comparison, drive: str, load: str) -> Figure:
    """
    Draw the residual over drive and load, the plane in which the muscle works.

    Parameters
    ----------
    comparison : Comparison
    drive, load : str
        Signals.

    Returns
    -------
    matplotlib.figure.Figure

    """
    figure, axes = new_figure(6, 3.8)
    chosen = some_rows(comparison.rows)
    signals = comparison.signals
    x = signals.get(drive, np.zeros(comparison.rows))[chosen]
    coloured(figure, axes[0, 0], scaled(drive, x), scaled(load, signals[load][chosen]),
             comparison.residual[chosen], comparison.quantity)
    axes[0, 0].set_xlabel(axis_label(drive))
    axes[0, 0].set_ylabel(axis_label(load))
    return figure


def residual_since_step(comparison: Comparison) -> Figure:
    """
    Draw the residual against the time since the last step, logarithmic, by direction.

    Parameters
    ----------
    comparison : Comparison
        With the signal `time_since_step`.

    Returns
    -------
    matplotlib.figure.Figure

    """
    from matplotlib.ticker import NullFormatter

    figure, axes = new_figure(6, 3.6)
    axis, quantity = axes[0, 0], comparison.quantity
    since, residual = comparison.signals['time_since_step'], comparison.residual
    block = blocks_of(residual, comparison.trial)
    direction = comparison.signals.get('direction', np.ones(comparison.rows))
    for way, text, style in ((1.0, 'after a rise', {'color': '#12355b', 'marker': '^'}),
                             (-1.0, 'after a fall', {'color': '#c9822b', 'marker': 'v',
                                                     'linestyle': '--'})):
        inside = (direction == way) & (since > 0)
        if np.sum(inside) < 10:
            continue
        edges = np.geomspace(since[inside].min(), since[inside].max(), 13)[1:-1]
        bins = binned('time_since_step', since[inside], residual[inside], block[inside], edges)
        half = np.where(np.isfinite(bins.half), bins.half, 0.0)
        axis.errorbar(bins.centre, scaled(quantity, bins.mean), scaled(quantity, half),
                      label=text, **{**MEANS, **style, 'markersize': 5})
    axis.set_xscale('log')
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.axhline(0.0, color='black', linewidth=0.8)
    axis.set_xlabel(axis_label('time_since_step'))
    axis.set_ylabel(f'measured - predicted [{label(quantity)[1] or "1"}]', fontsize=8)
    if axis.get_legend_handles_labels()[1]:
        axis.legend(fontsize=8, frameon=False)
    return figure


def correlogram_of(comparison: Comparison) -> Figure:
    """
    Draw the autocorrelation of the residual with the band that white noise would stay in.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    matplotlib.figure.Figure

    """
    figure, axes = new_figure(6, 3.2)
    axis = axes[0, 0]
    values = correlogram(comparison.residual)
    lag, name = np.arange(len(values), dtype=float), 'lag [rows]'
    if comparison.time is not None and comparison.continuous:
        lag, name = lag * float(np.median(np.diff(comparison.time))), 'lag [s]'
    axis.plot(*thinned(lag, values), **{**MODEL, 'linestyle': '-'})
    band = 1.96 / np.sqrt(comparison.rows)
    axis.axhspan(-band, band, color='#cccccc', alpha=0.8, linewidth=0)
    axis.axhline(0.0, color='black', linewidth=0.8)
    axis.set_xlabel(name)
    axis.set_ylabel('autocorrelation of the residual', fontsize=8)
    return figure


def coverage(comparison: Comparison) -> Figure:
    """
    Draw what the recording covers: where drive and response were, and how long.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    matplotlib.figure.Figure

    """
    names = [name for name in (comparison.drive, load_of(comparison),
                               f'{comparison.drive}_rate', 'ambient_temperature')
             if name is not None and name in comparison.signals]
    figure, axes = new_figure(9, 2.6, 1, len(names) + 1, sharey=False)
    columns = [(name, comparison.signals[name]) for name in names]
    columns.append((comparison.quantity, comparison.measured))
    for axis, (name, values) in zip(axes[0], columns):
        low, high = np.quantile(values, [0.002, 0.998])
        axis.hist(scaled(name, np.clip(values, low, high)), bins=30, color='#9db7d3',
                  edgecolor='#12355b', linewidth=0.5)
        axis.set_xlabel(axis_label(name), fontsize=8)
    axes[0, 0].set_ylabel('rows', fontsize=8)
    return figure
