# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weights of one sign and a free bias by constrained linear least squares (Sec. IV-B3, Eqs. 8 to 10).

The operators of this package are linear in their parameters: output = rows @ weights + bias,
where a row holds what every weight contributes at one step (for a Preisach operator the signed
areas of its cells). The paper minimises the plain sum of squares under a sign constraint. With
148 rows and 211 unknowns that problem has many solutions, and which of them a solver returns
depends on its version. The default here therefore adds a small quadratic penalty::

    minimise  mean((rows @ weights + bias - target)^2) / P^2  +  strength * |penalty @ x|^2

with P the range of the target and x the weights as shares of P. The solution is unique; its
strength is chosen by cross-validation over whole trials, because memory is wiped between trials
and leaks through any finer split. With one trial only, contiguous blocks of steps are held out
while the memory, which depends on the inputs alone, is carried through.

A whole trial held out is often a load that was never seen, and what then fails is the form of the
model, not the weights: cross-validation alone would flatten weights that the data determines well.
So the penalty may be confined to what it is there for, the choice among weights that fit the rows
equally well (`slack`). Where the form is known to be right, what the penalty has to choose is how
the output goes between two steps that were measured, and a step left out tells that best (`press`).
"""

from dataclasses import dataclass, replace
import functools
from typing import Optional, Sequence

import numpy as np
from scipy import linalg, sparse

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.nonnegative import (
    extrapolated, quick_weights, solve_nonnegative)
from hysteresis_ros.identification.weight_fit import LEAST_LEFT, WeightFit
from hysteresis_ros.workers import one_blas_thread

__all__ = ['Anchor', 'SLACK', 'STRENGTHS', 'WeightFit', 'fit_weights', 'folds_of',
           'quick_weights', 'solve_nonnegative']

STRENGTHS = np.logspace(-9.0, -2.0, 15)
# Those tried where steps are left out one by one: a steep branch is followed further. Still weaker
# ones follow what the model has not, too, which a step left out cannot tell: with 1e-11 Brinson's
# wires of Table I are compensated worse than with 3e-10 by a sixth, all others alike.
WEAKER_STRENGTHS = np.logspace(-9.5, -7.0, 6)
# Weights fit equally well if their RMSE is larger by at most this share of the output range plus
# this share of the smallest RMSE.
SLACK = 2.5e-4, 0.01
BLOCKS = 5          # blocks of steps held out in turn when there is one trial only
FOLDS = 8           # more trials than this share folds, so that the time stays bounded


@dataclass(frozen=True)
class Anchor:
    """
    An output that is known beforehand, for example H1(0) = pretension or H2(0) = 0.

    Parameters
    ----------
    row : ndarray, shape (K,)
        What every weight contributes in the anchored state, like one row of the design.
    value : float
        Output there, in the unit of the target.
    """

    row: np.ndarray
    value: float


def folds_of(groups: np.ndarray) -> list:
    """
    Return the boolean masks, shape (M,), of the rows to hold out in turn.

    Whole trials where there are two or more, otherwise contiguous blocks of steps.
    """
    groups = np.asarray(groups)
    names = np.unique(groups)
    if len(names) > 1:
        shared = np.array_split(np.arange(len(names)), min(FOLDS, len(names)))
        return [np.isin(groups, names[part]) for part in shared]
    blocks = np.array_split(np.arange(len(groups)), min(BLOCKS, len(groups)))
    return [np.isin(np.arange(len(groups)), part) for part in blocks]


@one_blas_thread()
def fit_weights(
        rows: np.ndarray, target: np.ndarray, *, groups: Optional[np.ndarray] = None,
        scale: Optional[np.ndarray] = None, penalty: Optional[np.ndarray] = None,
        sign: Optional[int] = 1, strength: Optional[float] = None,
        strengths: Optional[Sequence[float]] = None, slack: Optional[tuple] = None,
        press: bool = False, anchor: Optional[Anchor] = None,
        emphasis: Optional[np.ndarray] = None) -> WeightFit:
    """
    Identify weights of one sign and a free bias.

    Parameters
    ----------
    rows : ndarray, shape (M, K)
        What every weight contributes at every step, the memory carried along each trial.
    target : ndarray, shape (M,)
        Measured output.
    groups : ndarray, shape (M,), optional
        Trial of every row, for cross-validation; default one trial.
    scale : ndarray, shape (K,), optional
        Size of every column (for a Preisach operator the area of the cell), so that weight times
        scale has the unit of the output; default 1.
    penalty : ndarray, shape (R, K), optional
        Root of the quadratic penalty on weight * scale / P; default the identity (ridge).
    sign : int or None
        1 for weights >= 0, -1 for weights <= 0, None to take what fits better.
    strength : float, optional
        Of the penalty. 0 is the paper's plain problem, solved by `scipy.optimize.nnls`. Default:
        chosen by cross-validation among `strengths`; nothing is held out for a strength given.
    strengths : sequence of float, optional
        Default `STRENGTHS`, 15 values over seven decades.
    slack : (float, float), optional
        Only strengths are tried whose RMSE over the rows of the fit is above that of the weakest
        by at most the first share of P plus the second share of that RMSE; see `SLACK`. Default:
        no such limit.
    press : bool
        Choose the strength, by default among `WEAKER_STRENGTHS`, at which a step left out is
        predicted best (PRESS: Allen, Technometrics 16 (1974) 125) instead of a trial.
    anchor : Anchor, optional
        Output to be met exactly; it takes the freedom of the bias.
    emphasis : ndarray, shape (M,), optional
        By how much the error of every row counts, its mean square 1; default 1.

    Returns
    -------
    WeightFit

    Raises
    ------
    IdentificationError
        When the data is empty, not finite, constant, or of shapes that do not fit together.
    """
    if sign is None:
        fits = [fit_weights(rows, target, groups=groups, scale=scale, penalty=penalty, sign=s,
                            strength=strength, strengths=strengths, slack=slack, press=press,
                            anchor=anchor, emphasis=emphasis)
                for s in (1, -1)]
        return min(fits, key=lambda fit: fit.rmse)
    problem = _Problem.build(rows, target, groups, scale, penalty, sign, anchor, emphasis)
    if strength == 0.0:
        return problem.plain()
    usual = WEAKER_STRENGTHS if press else STRENGTHS
    tried = np.sort(np.asarray(usual if strengths is None else strengths, dtype=float))
    if strength is not None:
        tried = np.array([float(strength)])
    if len(tried) == 0 or not np.all(np.isfinite(tried) & (tried > 0.0)):
        raise IdentificationError('least squares: every strength must be a number above 0')
    if strength is not None:
        return problem.regularised(tried[0])
    if press:
        return problem.regularised_by_press(tried)
    path = problem.path(tried, slack)
    tried = tried[:len(path)]
    errors = problem.held_out_errors(tried, path)
    validation = np.sqrt(np.mean((problem.emphasis * errors) ** 2, axis=1))
    best = int(np.argmin(validation))
    return problem.regularised(tried[best], tried, validation, errors[best], path[best])


@dataclass(frozen=True)
class _Problem:
    """The least squares problem in dimensionless form; the last column is the bias."""

    design: np.ndarray      # (M, K + 1), weight shares, and ones (zeros if anchored)
    target: np.ndarray      # (M,), shares of P
    anchor: Anchor          # what rows and target are counted from; zeros if not anchored
    free: np.ndarray        # (K + 1,), whether an unknown has no bound: the bias, if not anchored
    penalty: np.ndarray     # (R, K + 1)
    emphasis: np.ndarray    # (M,)
    folds: list
    unit: np.ndarray        # (K + 1,), weight = x * unit
    output_range: float
    sign: int

    @classmethod
    def build(cls, rows: np.ndarray, target: np.ndarray, groups: np.ndarray | None,
              scale: np.ndarray | None, penalty: np.ndarray | None, sign: int,
              anchor: Anchor | None, emphasis: np.ndarray | None) -> '_Problem':
        rows = np.asarray(rows, dtype=float)
        target = np.asarray(target, dtype=float)
        if rows.ndim != 2 or target.shape != rows.shape[:1] or 0 in rows.shape:
            raise IdentificationError(
                f'least squares: rows {rows.shape} and target {target.shape} do not fit together')
        if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(target))):
            raise IdentificationError('least squares: rows and target must be finite numbers')
        if sign not in (1, -1):
            raise IdentificationError(f'least squares: sign must be 1 or -1, not {sign!r}')
        size = rows.shape[1]
        output_range = float(np.ptp(target))
        if not output_range > 0.0:
            raise IdentificationError(
                'least squares: the measured output is constant; excite the muscle more')
        scale = np.ones(size) if scale is None else np.asarray(scale, dtype=float)
        if scale.shape != (size,) or not np.all(scale > 0.0):
            raise IdentificationError('least squares: every column needs a scale above 0')
        penalty = np.eye(size) if penalty is None else np.asarray(penalty, dtype=float)
        if penalty.ndim != 2 or penalty.shape[1] != size:
            raise IdentificationError(
                f'least squares: penalty {penalty.shape} needs {size} columns')
        groups = np.zeros(len(target)) if groups is None else np.asarray(groups)
        if groups.shape != target.shape:
            raise IdentificationError('least squares: every row needs its trial')
        unit = np.append(sign * output_range / scale, output_range)
        bias = np.ones(len(target)) if anchor is None else np.zeros(len(target))
        free = np.append(np.zeros(size, dtype=bool), anchor is None)
        anchor = anchor or Anchor(np.zeros(size), 0.0)
        shares = (rows - anchor.row) * (unit[:-1] / output_range)
        return cls(
            design=np.column_stack([shares, bias]),
            target=(target - anchor.value) / output_range, anchor=anchor, free=free,
            penalty=np.column_stack([penalty, np.zeros(len(penalty))]),
            emphasis=np.ones(len(target)) if emphasis is None else emphasis,
            folds=folds_of(groups), unit=unit, output_range=output_range, sign=sign)

    @functools.cached_property
    def _reduced(self) -> tuple:
        """Mean square problem with no more rows than unknowns, by one QR: (design, target)."""
        root = self.emphasis / np.sqrt(len(self.target))
        design, target = root[:, None] * self.design, root * self.target
        if len(target) <= design.shape[1]:
            return design, target
        orthogonal, triangle = linalg.qr(design, mode='economic')
        return triangle, orthogonal.T @ target

    def plain(self) -> WeightFit:
        """Solve the paper's problem: no penalty, bias as the difference of two columns."""
        from scipy import optimize     # a third of a second that only the plain problem needs
        design, target = self._reduced
        design = np.column_stack([design, -design[:, -1]])
        try:
            x, _ = optimize.nnls(design, target, maxiter=30 * design.shape[1])
        except RuntimeError:
            raise IdentificationError(
                'least squares: nnls did not converge; use a strength above 0') from None
        x = np.append(x[:-2], x[-2] - x[-1])
        passive = (x > 0.0) | self.free
        block = self.design[:, passive]
        covariance = np.linalg.pinv(block.T @ block, hermitian=True)
        leverage = np.sum((block @ covariance) * block, axis=1)
        errors = self.design @ x - self.target
        freedom = max(1, len(errors) - int(np.count_nonzero(passive)))
        noise = float(np.sqrt(np.sum(errors ** 2) / freedom))
        return self._result(x, passive, covariance, leverage, noise, 0.0, np.zeros(0), np.zeros(0))

    @functools.cached_property
    def _curvature(self) -> np.ndarray:
        """Square of the penalty, whose root is mostly zeros."""
        root = sparse.csr_matrix(self.penalty)
        return (root.T @ root).toarray()

    def path(self, strengths: np.ndarray,
             slack: Optional[tuple] = None) -> list[tuple[np.ndarray, np.ndarray]]:
        """
        Return the fit to all rows for each of ascending strengths, up to the end of the slack.

        The RMSE rises with the strength, so that no stronger one is allowed where one is not.
        """
        gram, moment = self._moments(np.ones(len(self.target), dtype=bool))
        found: list[tuple[np.ndarray, np.ndarray]] = []
        limit = np.inf
        for strength in strengths:
            x, passive = solve_nonnegative(gram + strength * self._curvature, moment, self.free,
                                           found[-1][1] if found else None)
            rmse = np.sqrt(np.mean((self.emphasis * (self.design @ x - self.target)) ** 2))
            if rmse > limit:
                break
            if not found and slack is not None:
                limit = rmse + slack[0] + slack[1] * rmse
            found.append((x, passive))
        return found

    def regularised_by_press(self, strengths: np.ndarray) -> WeightFit:
        """Return the fit to all rows with the strength at which a row left out is off least."""
        gram, moment = self._moments(np.ones(len(self.target), dtype=bool))
        found: list[tuple[np.ndarray, np.ndarray]] = []
        for strength in strengths[::-1]:
            try:
                found.append(solve_nonnegative(gram + strength * self._curvature, moment,
                                               self.free, found[-1][1] if found else None))
            except IdentificationError:
                # Too weak for the numbers of this machine, as are those that follow.
                if not found:
                    raise
                break
        strengths = strengths[::-1][:len(found)]
        errors = np.array([self._left_out_error(*one, strength)
                           for one, strength in zip(found, strengths)])
        best = int(np.argmin(errors))
        held_out = self.held_out_errors(strengths[best:best + 1], found[best:best + 1])[0]
        fit = self.regularised(strengths[best], held_out=held_out, solved=found[best])
        return replace(fit, strengths=strengths[::-1], validation=self.output_range * errors[::-1])

    def _left_out_error(self, x: np.ndarray, passive: np.ndarray, strength: float) -> float:
        """
        Return the RMSE of rows left out one by one.

        By what each pulls the fit to itself; weights at their bound stay there.
        """
        block = self.emphasis[:, None] * self.design[:, passive]
        pull = np.linalg.solve(block.T @ block + len(block) * strength
                               * self._curvature[np.ix_(passive, passive)], block.T)
        leverage = np.minimum(np.sum(block * pull.T, axis=1), 1.0 - LEAST_LEFT)
        return float(np.sqrt(np.mean(np.square(
            self.emphasis * (self.design @ x - self.target) / (1.0 - leverage)))))

    def held_out_errors(self, strengths: np.ndarray, path: list) -> np.ndarray:
        """
        Return the error of every row, held out with its fold, for given strengths (S, M).

        `path` is that of the fit to all rows, near which those of the folds are.
        """
        errors = np.empty((len(strengths), len(self.target)))
        for held in self.folds:
            gram, moment = self._moments(~held)
            curvature = self._curvature + np.diag(
                extrapolated(self.design, ~held) * np.diag(self._curvature))
            for k, strength in enumerate(strengths):
                x, _ = solve_nonnegative(
                    gram + strength * curvature, moment, self.free, path[k][1])
                errors[k, held] = self.design[held] @ x - self.target[held]
        return errors

    def _moments(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean Gram matrix and the mean of design times target."""
        weights = self.emphasis[rows]
        design, target = weights[:, None] * self.design[rows], weights * self.target[rows]
        return design.T @ design / len(target), design.T @ target / len(target)

    def regularised(self, strength: float, strengths: Sequence[float] | np.ndarray = (),
                    validation: Sequence[float] | np.ndarray = (),
                    held_out: np.ndarray | None = None,
                    solved: tuple[np.ndarray, np.ndarray] | None = None) -> WeightFit:
        """
        Fit all rows.

        `held_out` (M,) are errors of held-out rows and `solved` is the entry of the path, if there
        are any.
        """
        x, passive = solved or self.path(np.array([strength]))[0]
        x = self._polish(x, passive, strength)
        block = self.emphasis[:, None] * self.design[:, passive]
        covariance = linalg.inv(block.T @ block + len(self.target) * strength
                                * self._curvature[np.ix_(passive, passive)])
        leverage = np.sum((block @ covariance) * block, axis=1)
        if held_out is not None:
            noise = float(np.sqrt(np.mean(held_out ** 2 / (1.0 + leverage))))
        else:
            freedom = max(1.0, len(self.target) - float(np.sum(leverage)))
            noise = float(np.sqrt(np.sum((self.design @ x - self.target) ** 2) / freedom))
        return self._result(x, passive, covariance, leverage, noise, float(strength),
                            np.array(strengths), np.array(validation) * self.output_range, held_out)

    def _polish(self, x: np.ndarray, passive: np.ndarray, strength: float) -> np.ndarray:
        """Solve again for the unknowns off their bound, without squaring the condition."""
        triangle, rotated = self._reduced
        design = np.vstack([triangle, np.sqrt(strength) * self.penalty])[:, passive]
        target = np.append(rotated, np.zeros(len(self.penalty)))
        polished = np.zeros_like(x)
        polished[passive] = linalg.lstsq(design, target, lapack_driver='gelsy')[0]
        return np.where(self.free, polished, np.maximum(polished, 0.0))

    def _result(self, x: np.ndarray, passive: np.ndarray, covariance: np.ndarray,
                leverage: np.ndarray, noise: float, strength: float, strengths: np.ndarray,
                validation: np.ndarray, held_out: np.ndarray | None = None) -> WeightFit:
        weights = x[:-1] * self.unit[:-1]
        bias = float(x[-1] * self.unit[-1] + self.anchor.value - self.anchor.row @ weights)
        triangle = self._reduced[0]
        singular = np.linalg.svd(triangle, compute_uv=False)
        rank = int(np.count_nonzero(
            singular > singular[0] * max(self.design.shape) * np.finfo(float).eps))
        still = np.ptp(self.design[:, :-1], axis=0) <= 1e-12
        fitted = (self.design @ x) * self.output_range + self.anchor.value
        target = self.target * self.output_range + self.anchor.value
        scaled = np.outer(self.unit[passive], self.unit[passive]) / self.output_range ** 2
        return WeightFit(
            weights=weights, bias=bias, sign=self.sign, strength=strength,
            strengths=strengths, validation=validation, fitted=fitted, residual=fitted - target,
            output_range=self.output_range, rank=rank,
            condition=float(singular[0] / singular[rank - 1]),
            never_excited=tuple(int(k) for k in np.flatnonzero(still)),
            noise_std=noise * self.output_range, active=np.flatnonzero(passive),
            covariance=covariance * scaled, origin=self.anchor.row,
            held_out=(np.full(len(target), np.nan) if held_out is None
                      else held_out * self.output_range), leverage=leverage)
