# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a least squares identification of weights found out, and how sure it is."""

from dataclasses import dataclass

import numpy as np
from scipy import special    # its stats take a second to import

# A row that alone determines a weight counts with its error over this.
LEAST_LEFT = 1e-3


@dataclass(frozen=True)
class WeightFit:
    """
    Identified weights and what the data says about them.

    Attributes
    ----------
    weights : ndarray, shape (K,)
        All >= 0 when `sign` is 1, all <= 0 when it is -1.
    bias : float
        Output where every row entry is zero, in the unit of the target.
    sign : int
        1 or -1.
    strength : float
        Strength of the penalty; 0 for the paper's plain problem.
    strengths, validation : ndarray, shape (S,)
        Strengths tried and the RMSE of what was left out at each, a trial or a step, in the unit
        of the target.
    fitted, residual : ndarray, shape (M,)
        Output at the rows of the fit, and output minus target.
    output_range : float
        P of Eqs. 23 and 24.
    rank : int
        Rank of rows and bias; below K + 1 the plain problem has no unique solution.
    condition : float
        Largest over smallest singular value within that rank.
    never_excited : tuple of int
        Columns that are constant along the data: nothing was learned about their weights.
    noise_std : float
        Standard deviation of one output about the prediction: from held-out rows, or from the
        residual and its degrees of freedom where nothing was held out.
    active : ndarray of int
        Weights off their bound, and last the bias if it is free.
    covariance : ndarray
        Of those, for a unit `noise_std`.
    origin : ndarray, shape (K,)
        Row at which the output is known exactly; zeros without an anchor.
    held_out : ndarray, shape (M,)
        Output minus target at the strength chosen, each row held out with its fold; NaN if nothing
        was held out.
    leverage : ndarray, shape (M,)
        By how much each row pulls the fit to itself, 0 to 1.
    """

    weights: np.ndarray
    bias: float
    sign: int
    strength: float
    strengths: np.ndarray
    validation: np.ndarray
    fitted: np.ndarray
    residual: np.ndarray
    output_range: float
    rank: int
    condition: float
    never_excited: tuple
    noise_std: float
    active: np.ndarray
    covariance: np.ndarray
    origin: np.ndarray
    held_out: np.ndarray
    leverage: np.ndarray

    @property
    def rows_left_out(self) -> np.ndarray:
        """
        Output minus target of each row, shape (M,), as if that row alone had been left out.

        Weights at their bound stay there (PRESS: Allen, Technometrics 16 (1974) 125).
        """
        left_out: np.ndarray = self.residual / np.maximum(1.0 - self.leverage, LEAST_LEFT)
        return left_out

    @property
    def held_out_rmse(self) -> float:
        """`validation` at the strength chosen; NaN if nothing was held out."""
        return float(np.append(self.validation[self.strengths == self.strength], np.nan)[0])

    @property
    def mean_percent(self) -> float:
        """Mean absolute error in percent of the output range (Eq. 23)."""
        return float(100.0 * np.mean(np.abs(self.residual)) / self.output_range)

    @property
    def std_percent(self) -> float:
        """Standard deviation of the error in percent of the output range (Eq. 24 over M)."""
        return float(100.0 * np.std(self.residual) / self.output_range)

    @property
    def rmse(self) -> float:
        """Root mean square error in the unit of the target."""
        return float(np.sqrt(np.mean(self.residual ** 2)))

    def predict(self, rows: np.ndarray) -> np.ndarray:
        """Return the output at `rows`, shape (m, K) -> (m,)."""
        return np.asarray(rows) @ self.weights + self.bias

    def prediction_interval(self, rows: np.ndarray, level: float = 0.95) -> tuple:
        """
        Return (low, high), each shape (m,), that hold one new output with probability `level`.

        A linear Gaussian posterior over the weights that are not at their bound. Its variance
        is scaled so that it explains the held-out errors, which contain the structural error
        of the model as well as the noise.
        """
        rows = np.asarray(rows, dtype=float)
        design = np.column_stack([rows - self.origin, np.ones(len(rows))])[:, self.active]
        spread = np.sum((design @ self.covariance) * design, axis=1)
        freedom = max(1, len(self.residual) - 1)
        half = (special.stdtrit(freedom, 0.5 + 0.5 * level) * self.noise_std
                * np.sqrt(1.0 + np.maximum(spread, 0.0)))
        centre = self.predict(rows)
        return centre - half, centre + half

    def summary(self) -> dict:
        """Return the numbers of the fit as plain types for JSON and YAML."""
        return {
            'rows': int(len(self.residual)),
            'unknowns': int(len(self.weights)) + 1,
            'sign': int(self.sign),
            'mean_abs': float(np.mean(np.abs(self.residual))),
            'std': float(np.std(self.residual)),
            'rmse': self.rmse,
            'mean_percent': self.mean_percent,
            'std_percent': self.std_percent,
            'output_range': float(self.output_range),
            'bias': float(self.bias),
            'rank': int(self.rank),
            'condition': float(self.condition),
            'never_excited': [int(k) for k in self.never_excited],
            'strength': float(self.strength),
            'cross_validation': [
                {'strength': float(s), 'rmse': float(v)}
                for s, v in zip(self.strengths, self.validation)],
            'noise_std': float(self.noise_std),
        }
