# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether an effect explains more than chance, and more than the base model's own error could.

On an arm the bench says how wrong the model is by itself (decoys). Bench tables get weights of
their own for every set of effects, so that there only what helps on held-out trials counts.
"""

import numpy as np

from hysteresis_ros.diagnosis import significance, structure

SIGNIFICANCE = 0.05
# Smallest reduction of the RMSE that matters to a user.
PRACTICAL = 0.05
# Share of blocks in which an effect has to help.
CONSISTENT = 0.55
# The base model's error on the arm may be this many times that of the bench's verification.
STRUCTURE_MARGIN = 1.6


def mean_square(values) -> float:
    """Return the mean of the squares."""
    return float(np.mean(np.square(values)))


class Evidence:
    """
    Chance and the base model's error on one problem.

    Parameters
    ----------
    problem : Problem
        Rows.
    fixed : list of Effect
        Effects of the model.
    predicted : ndarray, shape (n,)
        Response with them.
    rng : numpy.random.Generator
        Source of randomness.

    Attributes
    ----------
    structure : float
        Root mean square error that the base model has by itself; 0 on bench tables.
    decoys : ndarray, shape (m, n), or None
        Residuals that the base model may leave by itself; None on bench tables.
    """

    def __init__(self, problem, fixed, predicted, rng):
        self.problem = problem
        self.rng = rng
        self.structure, self.decoys = 0.0, None
        if not problem.refits:
            decoys = structure.decoys(problem, fixed, predicted, rng)
            self.structure = float(np.sqrt(np.mean(decoys ** 2)))
            self.decoys = STRUCTURE_MARGIN * decoys

    @property
    def floor(self) -> float:
        """What sensor and base model leave by themselves."""
        return float(np.hypot(self.structure, self.problem.noise))

    @property
    def enough(self) -> float:
        """Error below which no further effect is looked for by means that take long."""
        return STRUCTURE_MARGIN * self.floor

    @property
    def limit(self) -> float:
        """Largest error that base model and sensor may leave by themselves."""
        if self.decoys is None:
            return self.floor
        return float(np.quantile(np.sqrt(np.mean(self.decoys ** 2, axis=1)), 0.95))

    def p_values(self, fits, current, family=()) -> np.ndarray:
        """
        Return family-wise p values of fits against the `current` one, shape (c,).

        On an arm against two kinds of chance: decoys, and residuals with random signs by block
        or shifted in time; of these two the smaller p value counts, twice (Bonferroni).

        Parameters
        ----------
        fits : list of Fit
            Cross-validated.
        current : Fit
            Without what they add.
        family : sequence of ndarray, shape (n, k)
            Derivatives of other fits that might have been the best by chance.
        """
        if not fits:
            return np.zeros(0)
        problem = self.problem
        error = problem.measured - current.held_out
        squares = [error ** 2 - (problem.measured - fit.held_out) ** 2 for fit in fits]
        if problem.refits:
            blocks = np.stack([significance.block_sums(one, problem.block) for one in squares])
            return significance.paired_p_values(blocks, self.rng)
        gains = np.array([np.mean(one) for one in squares])
        columns_of_all = [*(fit.jacobian for fit in fits), *family]

        def against(draws):
            before = significance.held_out_errors(current.jacobian, draws, problem.fold)
            return significance.family_p_values(gains, np.stack([
                before - significance.held_out_errors(columns, draws, problem.fold)
                for columns in columns_of_all]))

        by_chance = np.minimum(*(against(draw(error, problem.block, self.rng))
                                 for draw in (significance.flipped, significance.shifted)))
        return np.maximum(against(self.decoys), np.minimum(2.0 * by_chance, 1.0))

    def helps(self, fit, current) -> bool:
        """Whether a fit explains enough to matter, in most blocks."""
        measured, block = self.problem.measured, self.problem.block
        before, after = (measured - one.held_out for one in (current, fit))
        if mean_square(after) > (1.0 - PRACTICAL) ** 2 * mean_square(before):
            return False
        gains = significance.block_sums(before ** 2 - after ** 2, block)
        return bool(np.mean(gains > 0.0) >= CONSISTENT)

    def _fitted(self, fit) -> float:
        return mean_square(self.problem.measured - fit.predicted)

    def could_be(self, rival, chosen) -> bool:
        """
        Whether a rival could be the truth although the chosen fit is better.

        It could if it fits all rows as well with no more parameters. Else, if the rival were the
        truth, the data would be its response with the base model's error; how far behind would
        it then fall by chance? A test of models that do not contain each other, by simulation.
        """
        problem = self.problem
        left, best = (problem.measured - fit.held_out for fit in (rival, chosen))
        margin = mean_square(left) - mean_square(best)
        if mean_square(left) <= (1.0 + PRACTICAL) ** 2 * mean_square(best):
            return True
        if problem.refits:
            low, _ = significance.gain_interval(left, best, problem.block, self.rng)
            return low <= 0.0
        if mean_square(left) > 4.0 * max(self.floor ** 2, mean_square(best)):
            return False
        if (len(rival.vector) <= len(chosen.vector)
                and self._fitted(rival) <= self._fitted(chosen)):
            # A drift that fits all of it may foretell the last trial badly from those before.
            return True
        own = significance.held_out_errors(rival.jacobian, self.decoys, problem.fold)
        shift = rival.predicted - chosen.predicted
        other = significance.held_out_errors(chosen.jacobian, self.decoys + shift, problem.fold)
        return bool(margin <= np.quantile(own - other, 0.95))
