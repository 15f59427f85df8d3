# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
H1 without a force table: how much load one unit of drive is worth, from the lengths alone.

In ``L = H2[F - H1[V]]`` a load shifts the loops along the drive by as much as H1 says. Lengths
under several loads therefore show H1, up to a constant, in the shift from one load to the next.
They show it only where the loops are, so H1 is kept simple: a power of the drive, without
hysteresis.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hysteresis_ros.identification.nonnegative import quick_weights
from hysteresis_ros.identification.operators import preisach_rows, thinned
from hysteresis_ros.identification.smoothness import smoothness
from hysteresis_ros.operators import Linear, Preisach, cell_areas

# Levels, strength and rows of the second stages that H1's candidates are compared by.
LEVELS, STRENGTH, MOST_ROWS = 14, 1e-6, 600
# Logarithms of the slope, in ranges of load over range of drive, and exponents that are tried.
SLOPES = np.linspace(-2.5, 4.0, 14)
EXPONENTS = (1.0, 2.0)
HIGHEST_EXPONENT = 4.0


def power_stage(slope: float, exponent: float, lower: float, upper: float,
                levels: int) -> Linear | Preisach:
    """
    Return ``x = slope * span * ((drive - lower) / span) ** exponent``, span = upper - lower.

    Parameters
    ----------
    slope : float
        Mean slope over the range of the drive, in unit of the load over unit of the drive.
    exponent : float
        1 gives a straight line, else the curve is straight between `levels` + 1 nodes.
    lower, upper : float
        Range of the drive.
    levels : int
        Intervals of the grid.
    """
    if exponent == 1.0:
        return Linear(slope, -slope * lower, lower, upper)
    nodes = np.linspace(lower, upper, levels + 1)
    span = upper - lower
    values = slope * span * ((nodes - lower) / span) ** exponent
    # A reversible weight counts twice: up instead of down.
    return Preisach(nodes, np.zeros(levels * (levels + 1) // 2),
                    0.5 * values[-1], 0.5 * np.diff(values) / np.diff(nodes))


def first_stage_from_lengths(
        drives: Sequence[np.ndarray], loads: Sequence[np.ndarray],
        lengths: Sequence[np.ndarray], cold: float, levels: int,
        squared: bool) -> Linear | Preisach:
    """
    Find the H1 with which H2 explains the lengths best, those under loads held out included.

    Parameters
    ----------
    drives, loads, lengths : sequence of ndarray, each shape (rows,)
        One entry a trial.
    cold : float
        Drive of the cold state.
    levels : int
        Intervals of H1's grid.
    squared : bool
        Whether the search may bend H1: a voltage heats with its square.

    Returns
    -------
    Linear or Preisach
    """
    lower = min(cold, min(float(drive.min()) for drive in drives))
    upper = max(cold, max(float(drive.max()) for drive in drives))
    most = max(8, MOST_ROWS // len(drives))
    kept = [thinned(drive, most) for drive in drives]
    drives = [np.append(cold, drive[rows]) for drive, rows in zip(drives, kept)]
    loads = [np.append(load[0], load[rows]) for load, rows in zip(loads, kept)]
    target = np.concatenate([length[rows] for length, rows in zip(lengths, kept)])
    groups = np.repeat(np.arange(len(kept)), [len(rows) for rows in kept])
    everything = np.concatenate(loads)
    # Loads that do not differ still say how large a load is.
    usual = float(np.ptp(everything)) or float(np.max(np.abs(everything))) or 1.0
    usual /= upper - lower
    held = _between(np.array([np.mean(load) for load in loads]), np.ptp(everything))

    def stage(vector: np.ndarray) -> Linear | Preisach:
        slope = usual * float(np.exp(np.clip(vector[0], SLOPES[0] - 1.0, SLOPES[-1] + 1.0)))
        exponent = float(np.clip(vector[1], 1.0, HIGHEST_EXPONENT))
        return power_stage(slope, exponent, lower, upper, levels)

    def score(vector: np.ndarray) -> float:
        first = stage(vector)
        parts = [load - first.simulate(drive) for load, drive in zip(loads, drives)]
        nodes = np.linspace(min(part.min() for part in parts),
                            max(part.max() for part in parts), LEVELS + 1)
        rows = np.concatenate([preisach_rows(nodes, part, True)[1:] for part in parts])
        scale = np.append(cell_areas(nodes), np.diff(nodes))
        root = smoothness(nodes, reversible=True)

        def rmse(fitted: np.ndarray, predicted: np.ndarray) -> float:
            weights, bias, _ = quick_weights(
                rows[fitted], target[fitted], scale, STRENGTH * root.T @ root)
            return float(np.sqrt(np.mean((rows @ weights + bias - target)[predicted] ** 2)))
        all_rows = np.ones(len(target), dtype=bool)
        result = rmse(all_rows, all_rows)
        if held:
            # Both count: few loads may agree by chance, and rows alone may be fitted by anything.
            apart = [rmse(~out, out) for out in (np.isin(groups, trials) for trials in held)]
            result *= float(np.sqrt(np.mean(np.square(apart))))
        return result

    return stage(_search(score, EXPONENTS if squared else (1.0,)))


def _between(means: np.ndarray, span: float) -> list:
    """
    Return the trials of each load that lies between others, to be held out in turn.

    The lowest and the highest load reach inputs of H2 that no other shows: to hold them out would
    ask for an extrapolation, which no H1 does well.
    """
    level = np.round(means / (1e-3 * span)) if span > 0.0 else np.zeros(len(means))
    return [np.flatnonzero(level == value) for value in np.unique(level)[1:-1]]


def _search(score: Callable, exponents: Sequence[float]) -> np.ndarray:
    """Return the best vector (log slope, exponent): a coarse grid, then a simplex from its best."""
    from scipy import optimize     # a third of a second that a force table saves
    starts = [np.array([slope, exponent]) for exponent in exponents for slope in SLOPES]
    values = [score(start) for start in starts]
    best = starts[int(np.argmin(values))]
    corners = [best, best + [0.25, 0.0], best - [0.25, 0.0]]
    if len(exponents) > 1:
        corners[2] = best + [0.0, 0.4]
        found = optimize.minimize(score, best, method='Nelder-Mead', options={
            'initial_simplex': corners, 'maxfev': 40, 'xatol': 0.02, 'fatol': 0.0})
        vector = found.x
    else:
        found = optimize.minimize_scalar(
            lambda slope: score(np.array([slope, best[1]])), method='bounded',
            bounds=(best[0] - 0.5, best[0] + 0.5), options={'xatol': 0.02, 'maxiter': 15})
        vector = np.array([found.x, best[1]])
    return vector if found.fun < min(values) else best
