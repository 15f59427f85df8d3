# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether sets of effects explain more of held-out rows than the best of them would by chance.

All sets are tested together, because the family-wise error of the whole catalogue counts.
"""

import math

import numpy as np
from scipy import special    # its stats take a second to import

DRAWS = 400
# Probability of chance above which nothing is said to be shown.
SIGNIFICANCE = 0.05


def block_sums(values: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Sum values (n,) by the block (n,) that each is in, shape (blocks,)."""
    return np.bincount(block, weights=values)


def paired_p_values(gains: np.ndarray, rng: np.random.Generator, count: int = DRAWS) -> np.ndarray:
    """
    Family-wise p values from gains by block, by flipping the signs of whole blocks.

    Parameters
    ----------
    gains : ndarray, shape (c, blocks)
        Reduction of the squared error in each block by each candidate.
    rng : numpy.random.Generator
    count : int
        Number of draws of the signs.

    Returns
    -------
    ndarray, shape (c,)
    """
    def statistic(values: np.ndarray) -> np.ndarray:
        spread = np.std(values, axis=-1) + 1e-300
        return np.mean(values, axis=-1) / spread

    observed = statistic(gains)
    signs = rng.choice((-1.0, 1.0), size=(count, gains.shape[1]))
    best = np.max(statistic(gains[:, None, :] * signs[None, :, :]), axis=0)
    return (1.0 + np.sum(best[None, :] >= observed[:, None], axis=1)) / (1.0 + count)


def gain_interval(before: np.ndarray, after: np.ndarray, block: np.ndarray,
                  rng: np.random.Generator, level: float = 0.95, count: int = DRAWS
                  ) -> tuple[float, float]:
    """
    Interval of the relative reduction of the RMSE, by a bootstrap over blocks.

    Parameters
    ----------
    before, after : ndarray, shape (n,)
        Residuals without and with the effect.
    block : ndarray of int, shape (n,)
        Block of every row.
    rng : numpy.random.Generator
    level : float
        Probability of the interval.
    count : int
        Number of draws of the blocks.

    Returns
    -------
    low, high : float
        1 - RMSE after / RMSE before.
    """
    # Of one fold, whose error always matters, the typical RMSE is the RMSE.
    return typical_gain_interval(before, after, block, np.zeros(len(block), dtype=int), 0.0, rng,
                                 level, count)


def independent_rows(residual: np.ndarray, trial: np.ndarray, least: int) -> float:
    """
    Return how many independent rows tell as much as those of a residual, as if of a Markov chain.

    n (1 - r) / (1 + r) with the autocorrelation r of rows that follow each other (Bartlett, J. R.
    Stat. Soc. 98 (1935) 536).

    Parameters
    ----------
    residual : ndarray, shape (n,)
    trial : ndarray of int, shape (n,)
        Rows of different trials do not follow each other.
    least : int
        Number that is not undercut.
    """
    follows = trial[1:] == trial[:-1]
    square = float(np.mean(residual ** 2))
    if square == 0.0 or not follows.any():
        return float(len(residual))
    correlation = float(np.mean((residual[1:] * residual[:-1])[follows])) / square
    share = (1.0 - correlation) / max(1.0 + correlation, 1e-9)
    return float(np.clip(share * len(residual), min(least, len(residual)), len(residual)))


def schwarz_log_odds(before: float, after: float, rows: float, parameters: int) -> float:
    """
    Return the log odds of a least squares fit against one with fewer parameters.

    Of n independent rows of unknown variance, to the order of log n (Schwarz, Ann. Stat. 6 (1978)
    461)::

        n log(before / after) - (k / 2) log n

    Parameters
    ----------
    before, after : float
        RMSE with fewer and with more parameters, in the same unit.
    rows : float
        n.
    parameters : int
        k, how many more there are.

    Returns
    -------
    float
    """
    return rows * math.log(before / after) - 0.5 * math.log(rows) * parameters


def typical_error(squares: np.ndarray, small: float) -> np.ndarray:
    """
    Return the geometric mean of the RMSE of several folds, `small` added to each.

    Each fold has errors of its own size, unknown beforehand, so that the likelihood of all is that
    of this mean.

    Parameters
    ----------
    squares : ndarray, shape (..., folds)
        Mean square error of each fold.
    small : float
        RMSE below which a fold's error does not matter.

    Returns
    -------
    ndarray, shape (...)
    """
    return np.exp(0.5 * np.mean(np.log(np.maximum(squares + small ** 2, 1e-300)), axis=-1))


def typical_rmse(squares: np.ndarray, small: float) -> np.ndarray:
    """
    Return `typical_error` as a reader expects it: without what was added to each fold.

    Parameters
    ----------
    squares : ndarray, shape (..., folds)
        Mean square error of each fold.
    small : float
        RMSE below which a fold's error does not matter.

    Returns
    -------
    ndarray, shape (...)
        Between the least and the largest RMSE of the folds.
    """
    return np.sqrt(np.maximum(typical_error(squares, small) ** 2 - small ** 2, 0.0))


def surely_larger(squares: np.ndarray, others: np.ndarray, small: float,
                  level: float = SIGNIFICANCE) -> bool:
    """
    Whether errors are larger than others on the same folds, and that is hardly chance.

    By a paired t-test of the logarithms of the RMSE, one-sided: of what is extrapolated from the
    other folds a few may be off by far more than all others.

    Parameters
    ----------
    squares, others : ndarray, shape (folds,)
        Mean square error of each fold.
    small : float
        RMSE below which a fold's error does not matter.
    level : float
        Probability of chance, at most.
    """
    ratios = 0.5 * np.log((squares + small ** 2) / (others + small ** 2))
    if len(ratios) < 2:
        return False
    error = np.std(ratios, ddof=1) / math.sqrt(len(ratios))
    return bool(np.mean(ratios) > special.stdtrit(len(ratios) - 1, 1.0 - level) * error)


def typical_gain_interval(before: np.ndarray, after: np.ndarray, block: np.ndarray,
                          fold: np.ndarray, small: float, rng: np.random.Generator,
                          level: float = 0.95, count: int = DRAWS) -> tuple[float, float]:
    """
    Interval of the relative reduction of the typical RMSE, by a bootstrap over a fold's blocks.

    Parameters
    ----------
    before, after : ndarray, shape (n,)
        Residuals without and with the effect.
    block, fold : ndarray of int, shape (n,)
        Block and fold of every row.
    small : float
        See `typical_rmse`.
    rng : numpy.random.Generator
    level : float
        Probability of the interval.
    count : int
        Number of draws of the blocks.

    Returns
    -------
    low, high : float
        1 - typical RMSE after / typical RMSE before.
    """
    means = []
    for number in np.unique(fold):
        rows = fold == number
        _, own = np.unique(block[rows], return_inverse=True)
        drawn = rng.integers(own.max() + 1, size=(count, own.max() + 1))
        total = np.sum(np.bincount(own)[drawn], axis=1)
        means.append([np.sum(block_sums(values[rows] ** 2, own)[drawn], axis=1) / total
                      for values in (before, after)])
    first, second = typical_rmse(np.moveaxis(np.array(means), 0, -1), small)
    low, high = np.quantile(1.0 - second / np.maximum(first, 1e-300),
                            [0.5 - level / 2.0, 0.5 + level / 2.0])
    return float(low), float(high)


def residualise(columns: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (m, n) without what columns (n, k) explain of them."""
    if columns.shape[1] == 0:
        return vectors
    basis, triangle = np.linalg.qr(columns)
    size = np.abs(np.diag(triangle))
    basis = basis[:, size > 1e-9 * max(size.max(), 1e-300)]
    return vectors - (vectors @ basis) @ basis.T


def cosines(vectors: np.ndarray) -> np.ndarray:
    """Return the absolute cosines (m, m) between vectors (m, n)."""
    size = np.linalg.norm(vectors, axis=1)
    unit = vectors / np.maximum(size, 1e-300)[:, None]
    return np.abs(unit @ unit.T)
