# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit the parameters of effects to measured rows, and test the fit on rows that were held out."""

import dataclasses

import numpy as np
from scipy import optimize, special    # its stats take a second to import

from hysteresis_ros.diagnosis.derivatives import Derivatives, differences
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of

# Starts that are followed for a few steps after all were tried once, if their mean square error is
# not larger than the best's by this factor; the best goes on.
FOLLOWED_STARTS = 2
WORTH_FOLLOWING = 2.0
FIRST_EVALUATIONS = 4
# Decimals, in parts of the response's variance, to which errors of starts without effect agree.
SAME = 9
# By whether weights are fitted again for every one, which takes much longer.
MOST_EVALUATIONS = {True: 8, False: 20}
# What has not taken this share off the error by then is not followed any further.
PROMISING = 0.02
HELD_OUT_EVALUATIONS = 3
MOST_HALVINGS = 4
# The base model's own error bends an estimate by up to about this share.
ESTIMATE_SLACK = 0.15


@dataclasses.dataclass
class Fit:
    """
    Effects fitted to some rows.

    Attributes
    ----------
    effects : list of Effect
        The fitted ones, with values; those that stayed fixed are not among them.
    vector : ndarray, shape (k,)
        Their free parameters in the units of `ParameterVector`.
    predicted : ndarray, shape (n,)
        Response of all rows with them.
    jacobian : ndarray, shape (n, k)
        Derivatives of `predicted`.
    held_out : ndarray, shape (n,)
        Response of every row as predicted by a fit to the other folds; see `cross_validate`.
    converged : bool
        Whether the fit ended by itself.
    rough : bool
        Whether the derivatives are those that sufficed for the fit; see `Derivatives`.
    """

    effects: list
    vector: np.ndarray
    predicted: np.ndarray
    jacobian: np.ndarray
    held_out: np.ndarray | None = None
    converged: bool = True
    rough: bool = False

    def implausible(self) -> list:
        """Names of parameters whose estimate is outside their physical range."""
        return [f'{effect.id}.{name}' for effect in self.effects
                for name in effect.implausible(ESTIMATE_SLACK)]


def beside(fixed, effects) -> list:
    """
    Return the fixed effects of a model that stay beside fitted ones.

    An effect of the wire that the bench has shown may be fitted anew to the wires of an arm.
    """
    fitted = {effect.id for effect in effects}
    return [effect for effect in fixed if effect.id not in fitted]


class Fitter:
    """
    Fits effects on one problem.

    Parameters
    ----------
    problem : Problem
        Rows and model.
    """

    def __init__(self, problem):
        self.problem = problem

    def _respond(self, fixed, parameters, train):
        kept = beside(fixed, parameters.effects)

        def respond(vector):
            return self.problem.simulate(kept + parameters.with_vector(vector), train)
        return respond

    def fit(self, fixed, effects, rows=None, evaluations=None, begun: Fit | None = None) -> Fit:
        """
        Fit from the present values of `effects`.

        Parameters
        ----------
        fixed : sequence of Effect
            Effects of the model; those that are among the fitted ones are left out.
        effects : sequence of Effect
            Effects to fit; their values are the start.
        rows : ndarray of bool, shape (n,), optional
            Rows to fit; all by default.
        evaluations : int, optional
            Steps of the optimiser at most; by default enough to converge.
        begun : Fit, optional
            A fit of the same effects to the same rows to go on from.

        Returns
        -------
        Fit
        """
        problem = self.problem
        parameters = ParameterVector(effects, problem.kind)
        respond = self._respond(fixed, parameters, rows)
        rows = np.ones(len(problem.measured), dtype=bool) if rows is None else rows
        measured = problem.measured[rows]
        scale = max(float(np.std(problem.measured)), 1e-12)
        if len(parameters) == 0:
            predicted = respond(np.zeros(0))
            return Fit(list(effects), np.zeros(0), predicted, np.zeros((len(predicted), 0)))
        inside = 1e-6 * (parameters.upper - parameters.lower)
        start = np.clip(parameters.vector(), parameters.lower + inside,
                        parameters.upper - inside)
        cache: dict[bytes, np.ndarray] = {}

        def full(vector):
            key = np.asarray(vector).tobytes()
            if key not in cache:
                cache[key] = respond(vector)
            return cache[key]

        # Weights that are fitted again bend the way too much for an update.
        derivatives = Derivatives(full, parameters.upper, updates=not problem.refits)
        if begun is not None:
            start = begun.vector
            cache[start.tobytes()] = begun.predicted
            derivatives.begin(start, begun.jacobian, begun.rough)
        found = optimize.least_squares(
            lambda vector: (full(vector)[rows] - measured) / scale, start,
            jac=lambda vector: derivatives.at(vector)[rows] / scale,
            bounds=(parameters.lower, parameters.upper), method='trf', x_scale=1.0,
            xtol=1e-3, ftol=1e-3, gtol=1e-8,
            max_nfev=evaluations or MOST_EVALUATIONS[problem.refits])
        return Fit(parameters.with_vector(found.x), found.x, full(found.x),
                   derivatives.at(found.x), converged=found.status > 0, rough=derivatives.rough)

    def search(self, fixed, known, effect) -> Fit:
        """Fit `effect` together with the `known` ones to the end; see `begin` and `finish`."""
        return self.finish(fixed, self.begin(fixed, known, self.starts(fixed, effect)))

    def starts(self, fixed, effect) -> list:
        """Return an effect at the values from which a fit may start."""
        starts = starts_of(effect, self.problem.kind, self.problem.measured)
        if len(beside(fixed, [effect])) < len(fixed):
            # What the bench says of it is as good a start as any.
            starts.append(effect)
        return starts

    def begin(self, fixed, known, starts) -> Fit:
        """
        Fit one more effect together with the `known` ones for a few steps.

        Parameters
        ----------
        fixed
            As for `fit`.
        known : sequence of Effect
            Effects found before, fitted again beside the new one.
        starts : sequence of Effect
            The new one from where it may start; the best are followed.
        """
        kept = [*beside(fixed, [*known, starts[0]]), *known]
        errors = [self.error(self.problem.simulate([*kept, start])) ** 2 for start in starts]
        # Starts without any effect, such as stops out of reach, all have the same error.
        spread = max(float(np.var(self.problem.measured)), 1e-300)
        _, order = np.unique(np.round(np.array(errors) / spread, SAME), return_index=True)
        followed = [starts[index] for index in order[:1 if known else FOLLOWED_STARTS]
                    if index == order[0] or errors[index] <= WORTH_FOLLOWING * min(errors)]
        return min((self.fit(fixed, [*known, start], evaluations=FIRST_EVALUATIONS)
                    for start in followed), key=lambda fit: self.error(fit.predicted))

    def finish(self, fixed, fit) -> Fit:
        """Follow a fit to its end, unless it has ended; see `begin`."""
        return fit if fit.converged else self.fit(fixed, fit.effects, begun=fit)

    def promises(self, fit, without: float) -> bool:
        """Whether a fit has taken off any of the error without the effect."""
        return self.error(fit.predicted) <= (1.0 - PROMISING) * without

    def error(self, predicted, rows=slice(None)) -> float:
        """Root mean square error of some rows."""
        return float(np.sqrt(np.mean((predicted[rows] - self.problem.measured[rows]) ** 2)))

    def cross_validate(self, fixed, fit: Fit, straight: bool = False) -> Fit:
        """
        Fill in `held_out`: every fold predicted by a fit to the others.

        The fit to all rows is the start; where the effects' parameters are all that is fitted, a
        Gauss-Newton step from there is as good as a new search, if it is no longer than it helps.

        Parameters
        ----------
        fixed
            As for `fit`.
        fit : Fit
            To all rows.
        straight : bool
            Take such a step along the derivatives, without a simulation: for what explains
            nothing anyhow.
        """
        problem = self.problem
        held_out = np.empty(len(problem.measured))
        parameters = ParameterVector(fit.effects, problem.kind)
        if fit.rough and not straight:
            jacobian = differences(self._respond(fixed, parameters, None), fit.vector,
                                   fit.predicted, parameters.upper)
            fit = dataclasses.replace(fit, jacobian=jacobian, rough=False)
        for fold in problem.folds:
            test = problem.fold == fold
            if problem.refits:
                predicted = self.fit(
                    fixed, fit.effects, ~test, HELD_OUT_EVALUATIONS).predicted
            elif straight:
                predicted = fit.predicted + fit.jacobian @ self._step(fit, ~test)
            else:
                predicted = self._stepped(fixed, fit, parameters, ~test)
            held_out[test] = predicted[test]
        return dataclasses.replace(fit, held_out=held_out)

    def _step(self, fit, train):
        """Return a Gauss-Newton step towards the rows to train on, shape (k,)."""
        if len(fit.vector) == 0:
            return np.zeros(0)
        jacobian, error = fit.jacobian[train], (self.problem.measured - fit.predicted)[train]
        gram = jacobian.T @ jacobian
        ridge = 1e-6 * np.trace(gram) / len(gram) + 1e-300
        return np.clip(np.linalg.solve(
            gram + ridge * np.eye(len(gram)), jacobian.T @ error), -1.0, 1.0)

    def _stepped(self, fixed, fit, parameters, train):
        """Return the response after such a step."""
        if len(fit.vector) == 0:
            return fit.predicted
        step = self._step(fit, train)
        for _ in range(MOST_HALVINGS):
            vector = np.clip(fit.vector + step, parameters.lower, parameters.upper)
            predicted = self.problem.simulate(
                [*beside(fixed, fit.effects), *parameters.with_vector(vector)])
            if self.error(predicted, train) <= self.error(fit.predicted, train):
                return predicted
            step = 0.5 * step
        return fit.predicted

    def with_intervals(self, fit: Fit, level: float = 0.95) -> list:
        """
        Return the fitted effects with intervals of their parameters.

        From the Jacobian, with the residuals summed by block (a sandwich estimate), because
        residuals of a simulated response hang together.
        """
        parameters = ParameterVector(fit.effects, self.problem.kind)
        if len(parameters) == 0:
            return fit.effects
        jacobian = fit.jacobian
        error = self.problem.measured - fit.predicted
        gram = jacobian.T @ jacobian
        inverse = np.linalg.pinv(gram, rcond=1e-10)
        scores = np.stack([jacobian[rows].T @ error[rows] for rows in (
            self.problem.block == block for block in np.unique(self.problem.block))])
        count = len(scores)
        factor = count / max(count - len(parameters), 1)
        covariance = factor * inverse @ (scores.T @ scores) @ inverse
        half = special.stdtrit(max(count - len(parameters), 1), 0.5 + level / 2.0) * np.sqrt(
            np.maximum(np.diag(covariance), 0.0))
        return parameters.with_intervals(fit.vector, half)
