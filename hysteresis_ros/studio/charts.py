# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The charts of the page as options of ECharts: response above, residual below, one time axis."""

from __future__ import annotations

from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.studio.views import Curves

# Up to this many rows each is a dot on its line.
MOST_SYMBOLS = 400
# Digits that a chart can show.
DIGITS = 5
MARGIN = 0.06


class Colours(NamedTuple):
    """Colours of lines and text, as the browser prefers light or dark."""

    measured: str
    before: str
    now: str
    text: str
    grid: str
    unseen: str
    back: str


LIGHT = Colours('#14181d', '#b8690b', '#1f8a4c', '#48535f', '#e6eaee', 'rgba(47,109,181,0.10)',
                '#ffffff')
DARK = Colours('#f2f4f6', '#eda64a', '#5cc98a', '#a9b4bf', '#262e37', 'rgba(127,178,234,0.14)',
               '#1c2733')


def options(curves: Curves, colours: Colours) -> dict[str, Any]:
    """
    Return both charts of a recording.

    Parameters
    ----------
    curves : Curves
    colours : Colours
    """
    axis = {'nameTextStyle': {'color': colours.text},
            'axisLabel': {'color': colours.text, 'showMinLabel': False, 'showMaxLabel': False},
            'axisLine': {'lineStyle': {'color': colours.text}},
            'splitLine': {'lineStyle': {'color': colours.grid}}}
    along = {**axis, 'type': 'value', 'min': rounded(curves.x[0]), 'max': rounded(curves.x[-1])}
    response = limits(np.concatenate([curves.measured, curves.before]))
    largest = float(np.max(np.abs(curves.measured - curves.before)))
    limit = rounded(max((1.0 + MARGIN) * largest, 1e-9))
    areas = [[{'xAxis': rounded(low), 'itemStyle': {'color': colours.unseen}},
              {'xAxis': rounded(high)}] for low, high in curves.unseen]
    # Labels take no room from one of the charts: both have the same axis.
    sides = {'left': 66, 'right': 14, 'containLabel': False, 'outerBoundsMode': 'none'}
    symbols = len(curves.x) <= MOST_SYMBOLS

    def line(name: str, series: str, colour: str, chart: int, width: float,
             values: np.ndarray) -> dict[str, Any]:
        return {'id': series, 'name': name, 'type': 'line', 'xAxisIndex': chart,
                'yAxisIndex': chart, 'showSymbol': symbols, 'symbol': 'circle', 'symbolSize': 4,
                'lineStyle': {'width': width, 'color': colour},
                'itemStyle': {'color': colour}, 'emphasis': {'disabled': True},
                'data': points(curves, values)}

    series = [
        line('measured', 'measured', colours.measured, 0, 3, curves.measured),
        line('model as it was', 'before', colours.before, 0, 1.5, curves.before),
        line('model now', 'now', colours.now, 0, 1.8, curves.now),
        line('residual as it was', 'residual_before', colours.before, 1, 1.5,
             curves.measured - curves.before),
        line('residual now', 'residual_now', colours.now, 1, 1.8, curves.measured - curves.now)]
    if areas:
        for one in (series[0], series[3]):
            one['markArea'] = {'silent': True, 'data': areas}
    return {
        'animation': False, 'backgroundColor': 'transparent',
        'textStyle': {'color': colours.text},
        'aria': {'enabled': True, 'label': {'description': described(curves)}},
        'legend': {'data': ['measured', 'model as it was', 'model now'], 'top': 0,
                   'textStyle': {'color': colours.text}},
        'tooltip': {'trigger': 'axis', 'confine': True, 'backgroundColor': colours.back,
                    'textStyle': {'color': colours.measured}},
        'axisPointer': {'link': [{'xAxisIndex': 'all'}]},
        'toolbox': {'right': 0, 'top': -4, 'iconStyle': {'borderColor': colours.text},
                    'feature': {'dataZoom': {'yAxisIndex': 'none'}, 'restore': {}}},
        'grid': [{**sides, 'top': 44, 'height': '48%'},
                 {**sides, 'top': '66%', 'bottom': 44}],
        'xAxis': [{**along, 'gridIndex': 0, 'axisLabel': {'show': False}},
                  {**along, 'gridIndex': 1, 'name': curves.x_label, 'nameLocation': 'middle',
                   'nameGap': 26}],
        'yAxis': [{**axis, 'gridIndex': 0, 'name': curves.y_label, 'nameLocation': 'middle',
                   'nameGap': 44, 'min': response[0], 'max': response[1]},
                  {**axis, 'gridIndex': 1, 'name': f'residual [{curves.unit or "1"}]',
                   'nameLocation': 'middle', 'nameGap': 44, 'min': -limit, 'max': limit}],
        'series': series}


def described(curves: Curves) -> str:
    """Say what the charts show to whoever does not see them."""
    before, now = (float(np.mean(np.abs(curves.measured - values)))
                   for values in (curves.before, curves.now))
    return (f'{curves.y_label} over {curves.x_label}, {len(curves.x)} rows: measured from '
            f'{np.min(curves.measured):.4g} to {np.max(curves.measured):.4g}; mean residual of the '
            f'model as it was {before:.3g} {curves.unit}, now {now:.3g} {curves.unit}')


def moved(curves: Curves) -> dict[str, Any]:
    """Return what of the charts changes when a slider moves."""
    return {'series': [{'id': 'now', 'data': points(curves, curves.now)},
                       {'id': 'residual_now',
                        'data': points(curves, curves.measured - curves.now)}]}


def points(curves: Curves, values: np.ndarray) -> list[list[float | None]]:
    """
    Return the points of a line, which has a gap wherever a trial ends.

    Parameters
    ----------
    curves : Curves
    values : ndarray, shape (n,)
    """
    found: list[list[float | None]] = []
    for row, (x, value, trial) in enumerate(zip(curves.x, values, curves.trial)):
        if row and trial != curves.trial[row - 1]:
            found.append([rounded(x), None])
        found.append([rounded(x), rounded(value) if np.isfinite(value) else None])
    return found


def limits(values: np.ndarray) -> tuple[float, float]:
    """Return the ends of an axis that holds all values, with a margin."""
    low, high = float(np.min(values)), float(np.max(values))
    margin = MARGIN * max(high - low, 1e-9)
    return rounded(low - margin), rounded(high + margin)


def rounded(value: float) -> float:
    """Return a number with as many digits as a chart can show."""
    return float(f'{value:.{DIGITS}g}')
