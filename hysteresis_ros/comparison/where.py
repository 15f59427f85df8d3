# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a model fails: the residual against every signal, and the worst regions in words.

Residuals of neighbouring rows are alike, so a mean over many rows is not as certain as their
number suggests. Its interval is therefore taken between blocks of the recording that are longer
than the residual's memory, not between rows.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from hysteresis_ros.measurements.metrics import finite
from hysteresis_ros.comparison.signals import label
import numpy as np
from scipy import special    # its stats take a second to import

MOST_BINS = 12
FEWEST_ROWS = 4
FEWEST_BLOCKS = 12
LEAST_SHARE = 0.05
MOST_REGIONS = 8
SAME_ROWS = 0.9
"""Two regions that share more of their rows than this are one."""
CONFIDENCE = 0.95
TAIL, EVERYWHERE = 0.02, 0.5
"""An error is one everywhere if all but this share of the rows have this share of its mean."""


class Bins(NamedTuple):
    """
    The residual in bins of one signal; all arrays have shape (bins,), units as in the files.

    Attributes
    ----------
    signal : str
    low, high, centre : ndarray
        Smallest, largest and mean value of the signal in the bin.
    rows : ndarray of int
    mean, rmse : ndarray
        Of the residual.
    half : ndarray
        Half width of the 95 % interval of the mean; infinite where one block alone was there.

    """

    signal: str
    low: np.ndarray
    high: np.ndarray
    centre: np.ndarray
    rows: np.ndarray
    mean: np.ndarray
    rmse: np.ndarray
    half: np.ndarray

    @property
    def certain(self) -> np.ndarray:
        """Whether the mean differs from 0, ndarray of bool (bins,)."""
        return np.abs(self.mean) > self.half


class Region(NamedTuple):
    """
    A part of a signal's range in which the model fails.

    Attributes
    ----------
    signal : str
    low, high : float
        The part, in the unit of files.
    mean_residual : float
        Mean of measured less predicted.
    rmse : float
    rows : int
    share : float
        Of the squared error of all rows that this region's rows make up.
    text : str
        The same in words.
    same_rows : tuple of (str, float, float)
        Other signals that single out the same rows, each with its part.

    """

    signal: str
    low: float
    high: float
    mean_residual: float
    rmse: float
    rows: int
    share: float
    text: str
    same_rows: tuple[tuple[str, float, float], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of `where` in the JSON of compare."""
        return {'signal': self.signal, 'from': finite(self.low), 'to': finite(self.high),
                'mean_residual': finite(self.mean_residual), 'rmse': finite(self.rmse),
                'rows': int(self.rows), 'share': finite(self.share), 'text': self.text,
                'same_rows': [{'signal': name, 'from': finite(low), 'to': finite(high)}
                              for name, low, high in self.same_rows]}


def blocks_of(residual: np.ndarray, trial: np.ndarray) -> np.ndarray:
    """
    Divide the rows into blocks that are longer than the memory of the residual.

    Parameters
    ----------
    residual : ndarray, shape (rows,)
    trial : ndarray of int, shape (rows,)
        Counts from 0; a block never spans two trials.

    Returns
    -------
    ndarray of int, shape (rows,)
        Block of each row, from 0.

    """
    length = max(1, int(np.ceil(2.0 * memory(residual))))
    length = max(1, min(length, len(residual) // FEWEST_BLOCKS))
    starts = np.flatnonzero(np.concatenate(([True], np.diff(trial) != 0)))
    inside = np.arange(len(trial)) - starts[trial]
    number = inside // length
    fresh = np.concatenate(([True], (np.diff(number) != 0) | (np.diff(trial) != 0)))
    return np.cumsum(fresh) - 1


def memory(residual: np.ndarray) -> float:
    """
    Return after how many rows the residual has forgotten itself.

    Parameters
    ----------
    residual : ndarray, shape (rows,)

    Returns
    -------
    float
        1 + 2 sum of the autocorrelations up to the first one below 0.05.

    """
    correlation = correlogram(residual)[1:]
    below = np.flatnonzero(correlation < 0.05)
    end = below[0] if below.size else len(correlation)
    return float(1.0 + 2.0 * np.sum(correlation[:end]))


def correlogram(residual: np.ndarray, most: int | None = None) -> np.ndarray:
    """
    Return the autocorrelation of a residual.

    Parameters
    ----------
    residual : ndarray, shape (rows,)
    most : int, optional
        Largest lag in rows; a quarter of the rows by default.

    Returns
    -------
    ndarray of float64, shape (lags + 1,)
        1 at lag 0; 0 everywhere else for a residual that does not vary.

    """
    rows = len(residual)
    most = min(rows - 1, rows // 4 if most is None else most)
    centred = residual - np.mean(residual)
    spectrum = np.fft.rfft(centred, 1 << int(2 * rows - 1).bit_length())
    covariance = np.fft.irfft(spectrum * np.conj(spectrum))[:most + 1]
    if covariance[0] <= 1e-30:
        return np.concatenate(([1.0], np.zeros(most)))
    return covariance / covariance[0]


def binned(signal: str, values: np.ndarray, residual: np.ndarray, block: np.ndarray,
           edges: np.ndarray | None = None) -> Bins:
    """
    Average a residual in bins of a signal.

    Parameters
    ----------
    signal : str
    values, residual : ndarray, shape (rows,)
    block : ndarray of int, shape (rows,)
        As `blocks_of` gives them.
    edges : ndarray, shape (bins - 1,), optional
        Where one bin ends and the next begins.

    Returns
    -------
    Bins
        Without edges: as many rows in each as the values allow, one value a bin if there are
        few values. Bins without rows are left out.

    """
    if edges is None:
        index = bin_index(values)
    else:
        index = np.unique(np.searchsorted(edges, values), return_inverse=True)[1]
    rows = np.bincount(index)
    mean = np.bincount(index, residual) / rows
    rmse = np.sqrt(np.bincount(index, residual ** 2) / rows)
    order = np.argsort(index, kind='stable')
    starts = np.concatenate(([0], np.cumsum(rows)[:-1]))
    low = np.minimum.reduceat(values[order], starts)
    high = np.maximum.reduceat(values[order], starts)
    centre = np.bincount(index, values) / rows
    half = half_width(residual - mean[index], index, block, rows)
    return Bins(signal, low, high, centre, rows, mean, rmse, half)


def bin_index(values: np.ndarray) -> np.ndarray:
    """Return the bin of each row, from 0 without gaps, ascending with the value."""
    unique, inverse = np.unique(values, return_inverse=True)
    if len(unique) <= MOST_BINS:
        return inverse
    bins = int(np.clip(len(values) // FEWEST_ROWS, 1, MOST_BINS))
    edges = np.unique(np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1]))
    index = np.searchsorted(edges, values, side='right')
    return np.unique(index, return_inverse=True)[1]


def half_width(deviation: np.ndarray, index: np.ndarray, block: np.ndarray,
               rows: np.ndarray) -> np.ndarray:
    """Return the half widths of the intervals of the means, between blocks, (bins,)."""
    bins, blocks = len(rows), int(block.max()) + 1
    cell = index * blocks + block
    sums = np.bincount(cell, deviation, bins * blocks).reshape(bins, blocks)
    visited = np.bincount(cell, minlength=bins * blocks).reshape(bins, blocks) > 0
    count = visited.sum(axis=1)
    half = np.full(bins, np.inf)
    many = count > 1
    correction = count[many] / (count[many] - 1.0)
    error = np.sqrt(correction * np.sum(sums[many] ** 2, axis=1)) / rows[many]
    half[many] = special.stdtrit(count[many] - 1, 0.5 + CONFIDENCE / 2) * error
    return half


def regions(signals: Mapping[str, np.ndarray], residual: np.ndarray, block: np.ndarray,
            quantity: str) -> list[Region]:
    """
    Name the worst regions, worst first.

    Parameters
    ----------
    signals : dict of str to ndarray, shape (rows,)
    residual : ndarray, shape (rows,)
    block : ndarray of int, shape (rows,)
    quantity : str
        The response, for units.

    Returns
    -------
    list of Region
        At most one a signal, and one for signals that single out the same rows: its text names
        them all. Empty if the residual is the same everywhere; a residual that is off everywhere by
        much the same is one region over the whole range of the first signal.

    """
    total = float(np.sum(residual ** 2))
    if total <= 0:
        return []
    scored = []
    for name, values in signals.items():
        bins = binned(name, values, residual, block)
        best = worst_run(bins, float(np.mean(residual)))
        if best is not None and best[0] > LEAST_SHARE * total:
            score, first, last = best[:3]
            inside = (values >= bins.low[first]) & (values <= bins.high[last])
            scored.append((score, inside, region(
                name, bins.low[first], bins.high[last], residual[inside], total, len(residual),
                quantity)))
    scored.sort(key=lambda item: -item[0])
    overall = offset_everywhere(signals, residual, block, quantity, total)
    everything = np.full(len(residual), overall is not None)
    found = [one for rows, one in united(scored) if not same_rows(rows, everything)]
    found = found[:MOST_REGIONS]
    return ([overall] if overall else []) + found


def united(scored: Sequence[tuple[float, np.ndarray, Region]]) -> list[
        tuple[np.ndarray, Region]]:
    """
    Make one region of those that are the same rows, seen in several signals.

    Parameters
    ----------
    scored : sequence of (float, ndarray of bool, shape (rows,), Region)
        Worst first.

    Returns
    -------
    list of (ndarray of bool (rows,), Region)
        The worst of each group, with where the others are in its text.

    """
    groups: list[tuple[np.ndarray, list[Region]]] = []
    for _, inside, one in scored:
        for rows, members in groups:
            if same_rows(rows, inside):
                members.append(one)
                break
        else:
            groups.append((inside, [one]))
    return [(rows, with_others(members[0], members[1:])) for rows, members in groups]


def same_rows(one: np.ndarray, other: np.ndarray) -> bool:
    """Tell whether two regions, ndarray of bool (rows,), are the same rows but for a few."""
    return bool(np.sum(one & other) >= SAME_ROWS * np.sum(one | other))


def with_others(one: Region, others: Sequence[Region]) -> Region:
    """Return a region that also names the signals which single out the same rows."""
    if not others:
        return one
    places = ', '.join(placed(other.signal, other.low, other.high) for other in others)
    return one._replace(text=f'{one.text}; the same rows are those {places}',
                        same_rows=tuple((other.signal, other.low, other.high)
                                        for other in others))


def worst_run(bins: Bins, overall: float) -> tuple[float, int, int, bool] | None:
    """
    Find the neighbouring bins that fail most.

    Parameters
    ----------
    bins : Bins
    overall : float
        Mean of all rows: what is off everywhere says nothing about where.

    Returns
    -------
    tuple of (float, int, int, bool) or None
        Squared error that the run has above the overall, first and last bin, and whether it is
        off in one direction; otherwise its rows scatter more than others.

    """
    sign = np.where(bins.certain, np.sign(bins.mean), 0.0)
    beyond = np.where(sign == np.sign(overall), np.abs(bins.mean) - abs(overall),
                      np.abs(bins.mean))
    systematic = bins.rows * np.where(sign != 0, np.maximum(beyond, 0.0), 0.0) ** 2
    typical = float(np.sum(bins.rows * bins.rmse ** 2) / np.sum(bins.rows))
    scatter = bins.rows * np.maximum(bins.rmse ** 2 - 2.0 * typical, 0.0)
    best = None
    for score, kind, one_way in ((systematic, sign, True), (scatter, np.sign(scatter), False)):
        first = 0
        while first < len(score):
            last = first
            while (last + 1 < len(score) and score[first] > 0 and score[last + 1] > 0
                   and kind[last + 1] == kind[first]):
                last += 1
            found = float(np.sum(score[first:last + 1]))
            # Scatter is named only where it says clearly more than a mean would.
            needed = 0.0 if best is None else best[0] * (1.0 if one_way == best[3] else 2.0)
            if found > needed:
                best = found, first, last, one_way
            first = last + 1
    return best


def offset_everywhere(signals: Mapping[str, np.ndarray], residual: np.ndarray, block: np.ndarray,
                      quantity: str, total: float) -> Region | None:
    """Return the region over everything, if most of the error is one constant, else None."""
    mean = float(np.mean(residual))
    half = half_width(residual - mean, np.zeros(len(residual), dtype=int), block,
                      np.array([len(residual)]))[0]
    if len(residual) * mean ** 2 < 0.5 * total or abs(mean) <= half:
        return None
    name, values = next(iter(signals.items()))
    return region(name, values.min(), values.max(), residual, total, len(residual), quantity,
                  whole=True)


def region(name: str, low: float, high: float, residual: np.ndarray, total: float, rows: int,
           quantity: str, whole: bool = False) -> Region:
    """Build a region from its rows' residual, with its sentence."""
    mean, rmse = float(np.mean(residual)), float(np.sqrt(np.mean(residual ** 2)))
    share = float(np.sum(residual ** 2)) / total
    _, unit, scale = label(quantity)
    what = 'longer' if quantity in ('length', 'strain') else 'larger'
    less = 'shorter' if quantity in ('length', 'strain') else 'smaller'
    if abs(mean) < 0.5 * rmse:
        error = (f'the error is {number(scale * rmse)} {unit} RMS, of both signs '
                 f'(mean {number(scale * mean)} {unit}),')
    else:
        error = (f'the measured {quantity} is {number(abs(scale * mean))} {unit} '
                 f'{what if mean > 0 else less} than predicted')
    least, most = float(np.min(residual)), float(np.max(residual))
    everywhere = np.quantile(np.sign(mean) * residual, TAIL) > EVERYWHERE * abs(mean)
    place = placed(name, low, high) if not whole else 'everywhere' if everywhere else (
        f'on average ({number(scale * least)} to {number(scale * most)} {unit})')
    text = (f'{error} {place}' + ('' if whole else f': {100 * share:.0f} % of the squared error '
            f'in {100 * len(residual) / rows:.0f} % of the rows'))
    return Region(name, float(low), float(high), mean, rmse, len(residual), share, text)


def placed(name: str, low: float, high: float) -> str:
    """Say in words which part of a signal's range is meant."""
    text, unit, scale = label(name)
    if name == 'direction':
        return 'while the drive falls' if high < 0 else 'while the drive rises'
    if name in ('trial', 'trial_number'):
        after = '' if name == 'trial' else ' of all recordings (counted from 0)'
        return (f'in trial {low:g}' if low == high else f'in trials {low:g} to {high:g}') + after
    unit = f' {unit}' if unit else ''
    if low == high:
        return f'where {text} is {number(scale * low)}{unit}'
    return f'where {text} is {number(scale * low)} to {number(scale * high)}{unit}'


def number(value: float) -> str:
    """Return a number as a person would write it: three digits, no exponent where avoidable."""
    if value == 0 or not np.isfinite(value):
        return f'{value:g}'
    digits = 2 - int(np.floor(np.log10(abs(value))))
    if digits > 6 or digits < -9:
        return f'{value:.3g}'
    rounded = round(value, digits)
    return f'{rounded:.{max(digits, 0)}f}'
