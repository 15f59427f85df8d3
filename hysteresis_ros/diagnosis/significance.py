# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether an effect explains more than the best of all effects would by chance.

All candidates are tested together (the family-wise error of the whole catalogue counts), on rows
that were held out, and against two kinds of chance: residuals whose blocks have random signs, and
decoys, errors that the base model is known to have.
"""

import numpy as np

FLIPS = 400
RIDGE = 1e-9


def held_out_errors(columns: np.ndarray, targets: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """
    Mean squared held-out error of linear fits.

    Parameters
    ----------
    columns : ndarray, shape (n, k)
        What is fitted; k may be 0.
    targets : ndarray, shape (m, n)
        Each row is fitted by itself.
    fold : ndarray of int, shape (n,)
        Rows of one fold are predicted from the others.

    Returns
    -------
    ndarray, shape (m,)
    """
    total = np.zeros(len(targets))
    for number in np.unique(fold):
        test = fold == number
        error = targets[:, test]
        if columns.shape[1]:
            train = columns[~test]
            gram = train.T @ train
            gram += (RIDGE * np.trace(gram) + 1e-300) * np.eye(len(gram))
            weights = np.linalg.solve(gram, train.T @ targets[:, ~test].T)
            error = error - (columns[test] @ weights).T
        total += np.sum(error ** 2, axis=1)
    return total / targets.shape[1]


def flipped(residual: np.ndarray, block: np.ndarray, rng, count: int = FLIPS) -> np.ndarray:
    """Return copies (count, n) of residuals (n,) with a random sign for every block."""
    signs = rng.choice((-1.0, 1.0), size=(count, int(block.max()) + 1))
    return residual * signs[:, block]


def shifted(residual: np.ndarray, block: np.ndarray, rng, count: int = FLIPS) -> np.ndarray:
    """
    Return copies (count, n) of a residual (n,), each shifted around by another number of rows.

    Every block has a random sign, too. What acts in a few blocks only, such as an end stop, cannot
    be told from chance by signs: of four blocks all have the same one in every eighth draw.
    """
    size = len(residual)
    least = min(size // (int(block.max()) + 1), size // 2)
    start = rng.integers(least, size - least + 1, size=count)
    rows = (np.arange(size) + start[:, None]) % size
    return flipped(residual[rows], block, rng, count)


def family_p_values(gains: np.ndarray, chance: np.ndarray) -> np.ndarray:
    """
    Return p values that hold for the whole family.

    Parameters
    ----------
    gains : ndarray, shape (c,)
        Reduction of the mean squared error by each candidate.
    chance : ndarray, shape (c, m)
        The same in m draws in which there is nothing to find.

    Returns
    -------
    ndarray, shape (c,)
    """
    best = np.max(chance, axis=0)
    return (1.0 + np.sum(best[None, :] >= gains[:, None], axis=1)) / (1.0 + len(best))


def block_sums(values: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Sum values (n,) by block, shape (blocks,)."""
    return np.bincount(block, weights=values)


def paired_p_values(gains: np.ndarray, rng, count: int = FLIPS) -> np.ndarray:
    """
    Family-wise p values from gains by block, by flipping the signs of whole blocks.

    Parameters
    ----------
    gains : ndarray, shape (c, blocks)
        Reduction of the squared error in each block by each candidate.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (c,)
    """
    def statistic(values):
        spread = np.std(values, axis=-1) + 1e-300
        return np.mean(values, axis=-1) / spread

    observed = statistic(gains)
    signs = rng.choice((-1.0, 1.0), size=(count, gains.shape[1]))
    best = np.max(statistic(gains[:, None, :] * signs[None, :, :]), axis=0)
    return (1.0 + np.sum(best[None, :] >= observed[:, None], axis=1)) / (1.0 + count)


def gain_interval(before: np.ndarray, after: np.ndarray, block: np.ndarray, rng,
                  level: float = 0.95, count: int = FLIPS) -> tuple[float, float]:
    """
    Interval of the relative reduction of the RMSE, by a bootstrap over blocks.

    Parameters
    ----------
    before, after : ndarray, shape (n,)
        Residuals without and with the effect.
    block : ndarray of int, shape (n,)
        Block of every row.
    """
    squares = [block_sums(values ** 2, block) for values in (before, after)]
    blocks = len(squares[0])
    drawn = rng.integers(blocks, size=(count, blocks))
    ratio = np.sum(squares[1][drawn], axis=1) / np.maximum(
        np.sum(squares[0][drawn], axis=1), 1e-300)
    low, high = np.quantile(1.0 - np.sqrt(ratio), [0.5 - level / 2.0, 0.5 + level / 2.0])
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
