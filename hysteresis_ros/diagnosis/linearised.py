# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Evidence of sets of effects in closed form, from responses that are linearised at every start.

About a start the response is f + J (x - x0), and the prior of x is Gaussian, so that the evidence
of an effect, and of two whose responses add up, is a small linear algebra problem under each
covariance at hand (MacKay, Information Theory, ch. 28). It says which sets are worth a full fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import dataclasses
import itertools
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.observable import present
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of
from hysteresis_ros.effects import catalogue, Effect

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit, Fitter
    from hysteresis_ros.diagnosis.covariance import Point

# Starts of an effect from which it is fitted, and pairs are made.
BEST_STARTS = 3


@dataclasses.dataclass
class Start:
    """
    One effect at one start.

    Attributes
    ----------
    effect : Effect
        With the values of the start.
    change : ndarray, shape (n,)
        What the effect changes in the response if its parameters are at their prior mean, as the
        linearisation says.
    columns : ndarray, shape (n, k)
        Derivatives in units of the prior's standard deviation.
    """

    effect: Effect
    change: np.ndarray
    columns: np.ndarray

    @property
    def id(self) -> str:
        """The effect's identifier."""
        return self.effect.id


def linearised_starts(fitter: Fitter, fit: Fit, names: Sequence[str],
                      earlier: Sequence[Start] = (), point: Point | None = None) -> list[Start]:
    """
    Linearise effects at their starts, with the effects of a fit fixed.

    Parameters
    ----------
    fitter : Fitter
    fit : Fit
        Its effects keep their values.
    names : sequence of str
        Effects to linearise.
    earlier : sequence of Start, optional
        Starts linearised together with other effects. Of the usual ones of an effect only that
        is linearised anew which scores best with the derivatives that it had there.
    point : Point, optional
        Covariance of the residual; needed with `earlier`.

    Returns
    -------
    list of Start
        Those whose simulation is finite.
    """
    problem, found = fitter.problem, []
    # What is moved a little takes up the phase of where it is moved from.
    walks, responses = _started(fitter, fit, names)
    if point is not None:
        # What the response or the residual suggests is always looked at.
        usual = {_key(start) for name in names for start in starts_of(
            present(problem.model, catalogue()[name], problem.settled), problem.kind)}
        known = {_key(start.effect): start.columns for start in earlier
                 if _key(start.effect) in usual}
        kept = _promising(walks, responses - fit.predicted, problem.measured - fit.predicted,
                          known, point)
        # Those that did nothing alone are not known, and left out here, too.
        kept = [index for index in kept if _key(walks[index].start) not in usual - known.keys()]
        walks, responses = [walks[index] for index in kept], responses[kept]
    moved = iter(fitter.simulate([effects for walk in walks for effects in walk.moved]))
    for walk, response in zip(walks, responses):
        given = np.reshape([next(moved) for _ in walk.moved], (-1, len(response)))
        if not (np.all(np.isfinite(response)) and np.all(np.isfinite(given))):
            continue
        jacobian = (given - response).T / np.array(walk.steps)
        mean, spread = walk.parameters.prior()
        found.append(Start(walk.start, response - fit.predicted + jacobian @ (
            mean - walk.vector), jacobian * spread))
    return _alive(found, problem.noise)


def _alive(starts: Sequence[Start], least: float) -> list[Start]:
    """
    Return the starts that a fit can get away from, of effects that have one.

    Where nothing changes, however the parameters move, no derivative says where to go: a stop far
    from all angles of the arm.
    """
    alive = [max(np.max(np.abs(start.change)), np.max(np.abs(start.columns), initial=0.0)) > least
             for start in starts]
    names = {start.id for start, own in zip(starts, alive) if own}
    return [start for start, own in zip(starts, alive) if own or start.id not in names]


def singles_as_started(fitter: Fitter, fit: Fit, names: Sequence[str]
                       ) -> dict[tuple[str, ...], tuple[float, list[Effect]]]:
    """
    Score effects by the errors that they leave with the values of their starts, as they are.

    What changes much may bend the response so that no linearisation comes near it, and leaves a
    residual of which no covariance knows.

    Parameters
    ----------
    fitter : Fitter
    fit : Fit
        Its effects keep their values.
    names : sequence of str
        Effects to score.

    Returns
    -------
    dict of tuple of str to (float, list of Effect)
        By the name of the effect minus its least RMSE, in the unit of the response, and the start
        that reaches it, of those whose simulation is finite.
    """
    walks, responses = _started(fitter, fit, names)
    finite = [index for index, own in enumerate(responses) if np.all(np.isfinite(own))]
    return _largest([walks[index].start for index in finite],
                    np.array([-fitter.error(responses[index]) for index in finite]))


def _started(fitter: Fitter, fit: Fit, names: Sequence[str]
             ) -> tuple[list[_Moves], np.ndarray]:
    """Return all starts of effects together with those of a fit, and the responses there."""
    problem = fitter.problem
    own = {effect.id: effect for effect in fitter.fixed}
    starts: list[Effect] = []
    for name in names:
        starts += starts_of(present(problem.model, catalogue()[name], problem.settled),
                            problem.kind, problem.measured,
                            residual=problem.measured - fit.predicted, clock=problem.own_clock)
        if name in own:
            # What the bench says of it is as good a start as any.
            starts.append(own[name].in_settled_rows() if problem.settled else own[name])
    walks = [_Moves(start, fit.effects, problem.kind) for start in starts]
    return walks, fitter.simulate([walk.at for walk in walks])


def _largest(starts: Sequence[Effect], values: np.ndarray
             ) -> dict[tuple[str, ...], tuple[float, list[Effect]]]:
    """Return the largest value of each effect by its name, with the start that has it."""
    found: dict[tuple[str, ...], tuple[float, list[Effect]]] = {}
    for start, value in zip(starts, values):
        if (start.id,) not in found or value > found[start.id,][0]:
            found[start.id,] = (float(value), [start])
    return found


def _promising(walks: Sequence[_Moves], changes: np.ndarray, residual: np.ndarray,
               known: Mapping[tuple, np.ndarray], point: Point) -> list[int]:
    """
    Return the indices of the best known start of each effect, and of all others.

    Parameters
    ----------
    walks : sequence of _Moves
        One for each start.
    changes : ndarray, shape (len(walks), n)
        What each changes in the response.
    residual : ndarray, shape (n,)
    known : mapping of tuple to ndarray of shape (n, k)
        Derivatives at some starts by their `_key`, in units of the prior's standard deviation.
    point : Point
        Covariance of the residual.

    Returns
    -------
    list of int
        In ascending order.
    """
    places, starts, others = [], [], []
    for index, (walk, change) in enumerate(zip(walks, changes)):
        columns = known.get(_key(walk.start))
        if columns is None:
            others.append(index)
        elif np.all(np.isfinite(change)):
            mean, spread = walk.parameters.prior()
            places.append(index)
            starts.append(Start(
                walk.start, change + columns @ ((mean - walk.vector) / spread), columns))
    best = Linearised([point], residual, starts).indices_of_best()
    return sorted([*others, *(places[own[0]] for own in best.values())])


def _key(effect: Effect) -> tuple:
    return (effect.id, *effect.values.values())


class _Moves:
    """The sets to simulate for the derivatives of one effect at a start."""

    def __init__(self, start: Effect, others: Sequence[Effect], kind: str) -> None:
        others = [effect for effect in others if effect.id not in start.replaces]
        self.start = start
        self.parameters = ParameterVector([start], kind)
        self.vector = self.parameters.vector()
        self.at: list[Effect] = [*others, start]
        self.moved: list[list[Effect]] = []
        self.steps: list[float] = []
        for index, value in enumerate(self.vector):
            step = 0.02 if value + 0.02 < self.parameters.upper[index] else -0.02
            moved = self.vector.copy()
            moved[index] += step
            self.moved.append([*others, *self.parameters.with_vector(moved)])
            self.steps.append(step)


class Linearised:
    """
    Evidences of single effects and pairs, in addition to the effects of a fit.

    Parameters
    ----------
    points : list of Point
        Covariances to try.
    residual : ndarray, shape (n,)
        Of the fit.
    starts : list of Start
    nuisance : ndarray, shape (n, m)
        Derivatives by the parameters of the fit, in units of their prior's spread; they are
        estimated anew with whatever is added.
    """

    def __init__(self, points: Sequence[Point], residual: np.ndarray, starts: Sequence[Start],
                 nuisance: np.ndarray | None = None) -> None:
        self.starts = starts
        count = len(residual)
        nuisance = np.zeros((count, 0)) if nuisance is None else nuisance
        self._fixed = nuisance.shape[1]
        self._width = max([start.columns.shape[1] for start in starts], default=0)
        blocks = [np.pad(start.columns, ((0, 0), (0, self._width - start.columns.shape[1])))
                  for start in starts]
        self._columns = np.column_stack([
            residual, *(start.change for start in starts), nuisance, *blocks])
        self._points = points
        self._grams = []
        for point in self._points:
            whitened = point.whiten(self._columns)
            self._grams.append(whitened.T @ whitened)

    def _places(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the columns' places of `chosen` (m, s) starts: derivatives (m, k), changes."""
        chosen = np.asarray(chosen)
        first = 1 + len(self.starts)
        derivatives = (first + self._fixed + chosen[:, :, None] * self._width
                       + np.arange(self._width)).reshape(len(chosen), -1)
        fixed = np.broadcast_to(first + np.arange(self._fixed), (len(chosen), self._fixed))
        changes = np.concatenate([np.zeros((len(chosen), 1), dtype=int), 1 + chosen], axis=1)
        return np.concatenate([fixed, derivatives], axis=1), changes

    def evidences(self, chosen: np.ndarray) -> np.ndarray:
        """
        Return the log evidences of sets of starts, the largest over the covariances.

        Parameters
        ----------
        chosen : ndarray of int, shape (m, s)
            Indices of the starts of each set, all sets of one size.

        Returns
        -------
        ndarray, shape (m,)
        """
        if not len(chosen):
            return np.zeros(0)
        derivatives, changes = self._places(chosen)
        sign = np.concatenate([[1.0], -np.ones(changes.shape[1] - 1)])
        best = np.full(len(derivatives), -np.inf)
        for point, gram in zip(self._points, self._grams):
            squares = np.einsum('i,mij,j->m', sign,
                                gram[changes[:, :, None], changes[:, None, :]], sign)
            evidence = point.constant - 0.5 * squares
            if derivatives.shape[1]:
                matrix = (gram[derivatives[:, :, None], derivatives[:, None, :]]
                          + np.eye(derivatives.shape[1]))
                slope = gram[derivatives[:, :, None], changes[:, None, :]] @ sign
                factor = np.linalg.cholesky(matrix)
                solved = np.linalg.solve(factor, slope[:, :, None])[:, :, 0]
                evidence = (evidence + 0.5 * np.sum(solved ** 2, axis=1) - np.sum(
                    np.log(np.diagonal(factor, axis1=1, axis2=2)), axis=1))
            best = np.maximum(best, evidence)
        return best

    def singles(self) -> dict[tuple[str, ...], tuple[float, list[Effect]]]:
        """
        Score single effects.

        Returns
        -------
        dict of tuple of str to (float, list of Effect)
            By the name of the effect its largest log evidence, and the start that reaches it.
        """
        return _largest([start.effect for start in self.starts],
                        self.evidences(np.arange(len(self.starts))[:, None]))

    def indices_of_best(self) -> dict[str, list[int]]:
        """Return the indices of the best few starts of each effect, the best first."""
        alone = self.evidences(np.arange(len(self.starts))[:, None])
        found: dict[str, list[int]] = {}
        for index in np.argsort(-alone, kind='stable'):
            own = found.setdefault(self.starts[index].id, [])
            if len(own) < BEST_STARTS:
                own.append(int(index))
        return found

    def best_starts(self) -> list[Effect]:
        """Return the best few starts of each effect."""
        return [self.starts[index].effect for own in self.indices_of_best().values()
                for index in own]

    def pairs(self) -> dict[tuple[str, ...], tuple[float, list[Effect]]]:
        """
        Score pairs of effects, from the best few starts of each.

        Returns
        -------
        dict of tuple of str to (float, list of Effect)
            By their sorted names the largest log evidence, and the starts that reach it.
        """
        best_starts = self.indices_of_best()
        chosen: list[tuple[int, int]] = []
        for one, other in itertools.combinations(best_starts, 2):
            first, second = (self.starts[best_starts[name][0]].effect for name in (one, other))
            if other not in first.replaces and one not in second.replaces:
                chosen += itertools.product(best_starts[one], best_starts[other])
        found: dict[tuple[str, ...], tuple[float, list[Effect]]] = {}
        for indices, value in zip(chosen, self.evidences(np.array(chosen).reshape(-1, 2))):
            effects = [self.starts[index].effect for index in indices]
            names = tuple(sorted(effect.id for effect in effects))
            if names not in found or value > found[names][0]:
                found[names] = (float(value), effects)
        return found

    def p_values(self, point: Point, rng: np.random.Generator, count: int) -> dict[str, float]:
        """
        Return family-wise p values of single effects.

        How often does the best of all effects gain as much in residuals that are drawn from the
        covariance `point`, with its parameters estimated anew?

        Parameters
        ----------
        point : Point
            Covariance of the residuals where there is no effect.
        rng : numpy.random.Generator
        count : int
            Number of draws.

        Returns
        -------
        dict of str to float
            (1 + draws as good) / (1 + draws), so that 1 / (1 + count) is the smallest.
        """
        if not self.starts:
            return {}
        draws = point.factor @ rng.standard_normal((len(point.factor), count))
        alone = np.arange(len(self.starts))[:, None]
        derivatives, _ = self._places(alone)
        by_chance = np.full((len(self.starts), count), -np.inf)
        base = np.full(count, -np.inf)
        for other, gram in zip(self._points, self._grams):
            drawn = other.whiten(draws)
            columns = other.whiten(self._columns)
            cross = columns.T @ drawn
            change = np.arange(1, 1 + len(self.starts))
            squares = (np.sum(drawn ** 2, axis=0)[None, :] - 2.0 * cross[change]
                       + gram[change, change][:, None])
            evidence = other.constant - 0.5 * squares
            if derivatives.shape[1]:
                matrix = (gram[derivatives[:, :, None], derivatives[:, None, :]]
                          + np.eye(derivatives.shape[1]))
                slope = cross[derivatives] - gram[derivatives, change[:, None]][:, :, None]
                factor = np.linalg.cholesky(matrix)
                solved = np.linalg.solve(factor, slope)
                evidence = (evidence + 0.5 * np.sum(solved ** 2, axis=1) - np.sum(
                    np.log(np.diagonal(factor, axis1=1, axis2=2)), axis=1)[:, None])
            by_chance = np.maximum(by_chance, evidence)
            base = np.maximum(base, other.constant - 0.5 * np.sum(drawn ** 2, axis=0))
        best = np.max(by_chance - base, axis=0)
        present_base = max(other.constant - 0.5 * gram[0, 0]
                           for other, gram in zip(self._points, self._grams))
        return {names[0]: float((1 + np.sum(best >= value - present_base)) / (1 + count))
                for names, (value, _) in self.singles().items()}
