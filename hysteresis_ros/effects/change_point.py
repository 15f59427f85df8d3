# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""When something may have happened that lasts: where a residual is another one from a row on."""

import numpy as np

# On each side of the event at least so many rows, and this share of all, are needed.
LEAST_ROWS, MARGIN = 3, 0.04
# How far before the first row after the event, as a share of its time, a fit starts.
BEFORE = 0.01
# A time [s] at which no recording goes on any more, the last one that a fit can come to: no event.
NEVER = 5e5


def change_points(residual: np.ndarray, clock: np.ndarray) -> list[float]:
    """
    Return moments [s] at which the residual changes in its mean and size.

    The largest change, and that of the rows before and after it: where the load throws the arm
    from one end to the other, that may come long after the event.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        In any unit.
    clock : ndarray, shape (n,)
        Time since the recording began [s].

    Returns
    -------
    list of float
        Shortly before the first row after each change, none where there are too few rows.
    """
    found, parts = [], [(0, len(residual))]
    change = _change(residual)
    if change is not None:
        parts += [(0, change), (change, len(residual))]
    for first, end in parts:
        change = _change(residual[first:end])
        if change is not None:
            found.append(_shortly_before(clock, first + change))
    return found


def change_of_line(residual: np.ndarray, response: np.ndarray, clock: np.ndarray
                   ) -> float | None:
    """
    Return the moment [s] from which a residual goes with the response in another way.

    As two straight lines over the response, one before and one after it, fit the residual best.

    Parameters
    ----------
    residual, response : ndarray, shape (n,)
        In any units.
    clock : ndarray, shape (n,)
        Time since the recording began [s].

    Returns
    -------
    float or None
        Shortly before the first row after the change; None where there are too few rows.
    """
    count = len(residual)
    margin = _margin(count)
    if count < 2 * margin + 1:
        return None
    before = np.arange(margin, count - margin + 1)
    squares = (_about_lines(residual, response)[before - 1]
               + _about_lines(residual[::-1], response[::-1])[count - before - 1])
    return _shortly_before(clock, int(before[np.argmin(squares)]))


def _about_lines(residual: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Return the sum of squares about the line through the first rows, for each last row (n,)."""
    x, y = response - response.mean(), residual - residual.mean()
    rows = np.arange(1.0, len(x) + 1.0)
    sum_x, sum_y = np.cumsum(x), np.cumsum(y)
    xx, xy, yy = (np.cumsum(one) - sums / rows for one, sums in (
        (x * x, sum_x ** 2), (x * y, sum_x * sum_y), (y * y, sum_y ** 2)))
    return yy - xy ** 2 / np.maximum(xx, 1e-12 * max(xx[-1], 1e-300))


def _change(residual: np.ndarray) -> int | None:
    """Return the first row (n,) of another mean and size than before; None where n is small."""
    count = len(residual)
    margin = _margin(count)
    if count < 2 * margin + 1:
        return None
    before = np.arange(margin, count - margin + 1)
    logs = np.zeros(len(before))
    # Gaussian noise of another mean and size on each side (a change point's likelihood).
    for values, rows in ((residual, before), (residual[::-1], count - before)):
        sums, squares = np.cumsum(values), np.cumsum(values ** 2)
        variance = squares[rows - 1] / rows - (sums[rows - 1] / rows) ** 2
        logs += rows * np.log(np.maximum(variance, 1e-12 * squares[-1] + 1e-300))
    return int(before[np.argmin(logs)])


def _margin(count: int) -> int:
    """Return how many rows are needed on each side of an event, of so many."""
    return max(LEAST_ROWS, int(MARGIN * count))


def _shortly_before(clock: np.ndarray, row: int) -> float:
    """Return a time [s] between a row and the one before, near the row."""
    last, first = clock[row - 1:row + 1].tolist()
    time = (1.0 - BEFORE) * first
    return time if time > last else 0.5 * (last + first)
