# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How pictures are drawn: sizes, labels, and as many points as can be seen.

matplotlib is imported where something is drawn, through its figures alone: no window system and
no global state.
"""

from __future__ import annotations

import base64
import functools
import io
from typing import Any, TYPE_CHECKING, TypeVar

from hysteresis_ros.comparison.signals import label
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.comparison.compare import Comparison

# One value or an array of them.
Values = TypeVar('Values', float, np.ndarray)

MOST_POINTS = 4000
MOST_DOTS = 5000


def png(figure: Figure, dpi: float = 110) -> bytes:
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


def data_address(picture: bytes) -> str:
    """Return a PNG file's bytes as an address that a page can hold in itself."""
    return 'data:image/png;base64,' + base64.b64encode(picture).decode('ascii')


@functools.cache
def figure_class() -> type[Figure]:
    """Return the class of our figures, which a notebook shows without pyplot."""
    from matplotlib.figure import Figure

    class NotebookFigure(Figure):
        """A figure that IPython shows as a PNG picture."""

        def _repr_png_(self) -> bytes:
            return png(self)

    return NotebookFigure


def new_figure(width: float, height: float, rows: int = 1, columns: int = 1,
               **options: Any) -> tuple[Figure, np.ndarray]:
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


def along(comparison: Comparison) -> tuple[np.ndarray, str]:
    """Return what runs along a recording, (rows,), and its name: time, or the row's number."""
    if comparison.time is None:
        return np.arange(comparison.rows, dtype=float), 'row'
    if comparison.time[-1] > 3 * 3600:
        return comparison.time / 3600, 'time [h]'
    if comparison.time[-1] > 600:
        return comparison.time / 60, 'time [min]'
    return comparison.time, 'time [s]'


def axis_label(name: str) -> str:
    """Return a signal's name and unit for an axis."""
    text, unit, _ = label(name)
    return f'{text} [{unit}]' if unit else text


def scaled(name: str, values: Values) -> Values:
    """Return values in the unit that `axis_label` names."""
    return values * label(name)[2]


def thinned(x: np.ndarray, y: np.ndarray,
            most: int = MOST_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """
    Leave out points that a line does not need: each stretch keeps its extremes.

    Parameters
    ----------
    x, y : ndarray, shape (rows,)
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


def some_rows(rows: int, most: int = MOST_DOTS) -> np.ndarray:
    """Return evenly chosen rows, an index for scatter plots."""
    return np.linspace(0, rows - 1, min(rows, most)).astype(int)
