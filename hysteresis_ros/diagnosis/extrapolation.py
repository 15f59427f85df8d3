# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Straight extrapolations, which say what to fit first.

They never decide: what they put first is fitted and judged like anything else.
"""

import itertools

import numpy as np

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.diagnosis.candidates import present
from hysteresis_ros.diagnosis.fit import beside
from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.effects import catalogue

# Starts of an effect that are worth following.
MOST_STARTS = 3


class Extrapolation:
    """
    From effects by themselves to sets of them.

    Parameters
    ----------
    problem : Problem
        Rows and model.
    base : Fit
        Without any further effect.
    candidates : list of Candidate
        Every effect by itself.
    """

    def __init__(self, problem, base, candidates):
        self._problem = problem
        self._base = base
        self._candidates = candidates
        self._changes: dict[str, np.ndarray] = {}

    def in_order(self, sets) -> list:
        """
        Return sets of effects, the most promising first.

        In turn from two extrapolations, from what each effect is by itself with its starts, and
        without them: neither is right for every effect.
        """
        left = self._problem.measured - self._base.predicted
        near = {candidate.id: np.column_stack([candidate.signature, candidate.fit.jacobian])
                for candidate in self._candidates}
        wide = {candidate.id: self._change_of(candidate) for candidate in self._candidates}
        orders = []
        for columns in (wide, near):
            worth = [significance.held_out_errors(
                np.column_stack([columns[effect.id] for effect in one]), left[None, :],
                self._problem.fold)[0] for one in sets]
            orders.append(sorted(range(len(sets)), key=worth.__getitem__))
        order = dict.fromkeys(itertools.chain.from_iterable(zip(*orders)))
        return [sets[index] for index in order]

    def _change_of(self, candidate) -> np.ndarray:
        """
        Return what an effect can change, shape (n, k).

        As it was fitted by itself and nearby, and at its starts: fitted by itself it may be far
        from what it is beside another.
        """
        if candidate.id not in self._changes:
            model = self._problem.model
            effect = present(model, catalogue()[candidate.id])
            starts = starts_of(effect, self._problem.kind, self._problem.measured)
            changes = [self._problem.simulate([*beside(model.effects, [start]), start])
                       - self._base.predicted for start in starts]
            columns = np.column_stack([candidate.signature, candidate.fit.jacobian, *changes])
            self._changes[candidate.id] = np.where(
                np.all(np.isfinite(columns), axis=0), columns, 0.0)
        return self._changes[candidate.id]


def promising(changes, jacobian, left, limit) -> list:
    """
    Return the starts of effects that have anything to say about what is left, the best first.

    Parameters
    ----------
    changes : list of list of (Effect, ndarray of shape (n,))
        For each effect its starts with what they change.
    jacobian : ndarray, shape (n, k)
        Derivatives of what is known already.
    left : ndarray, shape (n,)
        What that leaves.
    limit : float
        Mean square below which an effect has something to say.

    Returns
    -------
    list of list of Effect
        Each at its most promising starts.
    """
    looks = []
    for starts in changes:
        # A single column more cannot explain much by chance, and a drift that is foretold for a
        # trial would count against whatever stands beside it.
        worth = [float(np.mean(significance.residualise(
            np.column_stack([jacobian, change]), left) ** 2)) for _, change in starts]
        order = np.argsort(worth, kind='stable')[:MOST_STARTS]
        looks.append((worth[order[0]], [starts[index][0] for index in order]))
    looks.sort(key=lambda look: look[0])
    return [starts for worth, starts in looks if worth < limit]
