# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How pictures are drawn: sizes, labels, and as many points as can be seen.

matplotlib is imported where something is drawn, through its figures alone: no window system and
no global state.
"""

import base64
import functools
import io
from typing import TYPE_CHECKING

from hysteresis_ros.comparison.signals import label
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_POINTS = 4000
MOST_DOTS = 5000


def png(figure, dpi=110):
    """
    Render a figure.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    dpi : float

    Returns
    -------
    bytes
        A PNG file.

    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format='png', dpi=dpi)
    return stream.getvalue()


def data_address(picture):
    """Return a PNG file's bytes as an address that a page can hold in itself."""
    return 'data:image/png;base64,' + base64.b64encode(picture).decode('ascii')


@functools.cache
def figure_class() -> 'type[Figure]':
    """Return the class of our figures, which a notebook shows without pyplot."""
    from matplotlib.figure import Figure

    class NotebookFigure(Figure):
        """A figure that IPython shows as a PNG picture."""

        def _repr_png_(self) -> bytes:
            return png(self)

    return NotebookFigure


def new_figure(width, height, rows=1, columns=1, **options):
    """Return a figure and its axes, ndarray of Axes (rows, columns)."""
    figure = figure_class()(figsize=(width, height), layout='constrained')
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for axis in axes.flat:
        axis.grid(True, color='#dddddd', linewidth=0.6)
        axis.set_axisbelow(True)
        for side in ('top', 'right'):
            axis.spines[side].set_visible(False)
        axis.tick_params(labelsize=8)
    return figure, axes


def axis_label(name):
    """Return a signal's name and unit for an axis."""
    text, unit, _ = label(name)
    return f'{text} [{unit}]' if unit else text


def scaled(name, values):
    """Return values in the unit that `axis_label` names."""
    return values * label(name)[2]


def thinned(x, y, most=MOST_POINTS):
    """
    Leave out points that a line does not need: each stretch keeps its extremes.

    Parameters
    ----------
    x, y : ndarray, (rows,)
        x ascending.
    most : int
        About how many points may stay.

    Returns
    -------
    x, y : ndarray

    """
    rows = len(y)
    if rows <= most:
        return x, y
    size = -(-rows // (most // 2))
    starts = np.arange(0, rows, size)
    padded = np.concatenate([y, np.full(len(starts) * size - rows, y[-1])])
    table = padded.reshape(len(starts), size)
    chosen = np.unique(np.concatenate([
        starts + table.argmin(axis=1), starts + table.argmax(axis=1), [0, rows - 1]]))
    chosen = chosen[chosen < rows]
    return x[chosen], y[chosen]


def some_rows(rows, most=MOST_DOTS):
    """Return evenly chosen rows, an index for scatter plots."""
    return np.linspace(0, rows - 1, min(rows, most)).astype(int)
