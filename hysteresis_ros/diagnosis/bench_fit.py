# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit the parameters of effects to bench tables, and test the fit on rows that were held out."""

import dataclasses
import functools

import numpy as np
from scipy import optimize, special    # its stats take a second to import

from hysteresis_ros.diagnosis.arm_fit import DIFFERENCE, Fit
from hysteresis_ros.diagnosis.observable import unaffected
from hysteresis_ros.diagnosis.parameters import ParameterVector, starts_of

# Starts that are followed for a few steps after all were tried once, if their mean square error is
# not larger than the best's by this factor; the best goes on.
FOLLOWED_STARTS, WORTH_FOLLOWING, FIRST_EVALUATIONS = 2, 2.0, 4
# Decimals, in parts of the response's variance, to which errors of starts without effect agree.
SAME = 9
MOST_EVALUATIONS, HELD_OUT_EVALUATIONS = 8, 3
TOLERANCE = 1e-3


class BenchFitter:
    """
    Fits effects on bench tables, with H2's weights refitted for every value of their parameters.

    Parameters
    ----------
    problem : BenchProblem
        Rows.
    """

    def __init__(self, problem):
        self.problem = problem
        self.fixed = list(problem.model.effects)

    def fit(self, effects, rows=None, evaluations: int = MOST_EVALUATIONS,
            tolerance: float = TOLERANCE) -> Fit:
        """
        Fit from the present values of `effects`, by least squares within their bounds.

        Parameters
        ----------
        effects : sequence of Effect
            Effects to fit; their values are the start.
        rows : ndarray of bool, shape (n,), optional
            Rows to fit; all by default.
        evaluations : int
            Steps of the optimiser at most.
        tolerance : float
            A step that lowers the sum of squares by a smaller share is the last.
        """
        problem, parameters = self.problem, ParameterVector(effects, self.problem.kind)
        kept = unaffected(self.fixed, effects)
        chosen = np.ones(len(problem.measured), dtype=bool) if rows is None else rows

        @functools.cache
        def solved(key):
            vector = np.frombuffer(key)
            return problem.solve(kept + parameters.with_vector(vector), rows)

        def response(vector):
            return solved(np.asarray(vector).tobytes()).predicted

        if len(parameters) == 0:
            predicted = response(np.zeros(0))
            return Fit(list(effects), np.zeros(0), predicted, np.zeros((len(predicted), 0)))

        @functools.cache
        def derivatives(key):
            vector, columns = np.frombuffer(key), []
            for index, value in enumerate(vector):
                step = DIFFERENCE if value + DIFFERENCE < parameters.upper[index] else -DIFFERENCE
                moved = np.array(vector)
                moved[index] += step
                near = problem.near(solved(key), kept + parameters.with_vector(moved), rows)
                columns.append((near - solved(key).predicted) / step)
            return np.column_stack(columns)

        scale = max(float(np.std(problem.measured)), 1e-12)
        inside = 1e-6 * (parameters.upper - parameters.lower)
        found = optimize.least_squares(
            lambda vector: (response(vector) - problem.measured)[chosen] / scale,
            np.clip(parameters.vector(), parameters.lower + inside, parameters.upper - inside),
            jac=lambda vector: derivatives(vector.tobytes())[chosen] / scale,
            bounds=(parameters.lower, parameters.upper), method='trf', x_scale=1.0,
            xtol=1e-3, ftol=tolerance, gtol=1e-8, max_nfev=evaluations)
        return Fit(parameters.with_vector(found.x), found.x, response(found.x),
                   derivatives(found.x.tobytes()))

    def search(self, known, effect) -> Fit:
        """
        Fit one more effect together with the `known` ones, from its best starts.

        Parameters
        ----------
        known : sequence of Effect
            Effects found before, fitted again beside the new one.
        effect : Effect
            The new one.
        """
        starts = starts_of(effect, self.problem.kind, self.problem.measured)
        kept = [*unaffected(self.fixed, [*known, starts[0]]), *known]
        errors = [self.error(self.problem.simulate([*kept, start])) ** 2 for start in starts]
        # Starts without any effect, such as stops out of reach, all have the same error.
        spread = max(float(np.var(self.problem.measured)), 1e-300)
        _, order = np.unique(np.round(np.array(errors) / spread, SAME), return_index=True)
        followed = [starts[index] for index in order[:1 if known else FOLLOWED_STARTS]
                    if index == order[0] or errors[index] <= WORTH_FOLLOWING * min(errors)]
        begun = min((self.fit([*known, start], evaluations=FIRST_EVALUATIONS)
                     for start in followed), key=lambda fit: self.error(fit.predicted))
        return self.fit(begun.effects)

    def error(self, predicted) -> float:
        """Return the root mean square error of a response."""
        return float(np.sqrt(np.mean((self.problem.measured - predicted) ** 2)))

    def cross_validate(self, fit: Fit) -> Fit:
        """Return a fit with the response of every row as predicted by a fit to the other folds."""
        held_out = np.empty(len(self.problem.measured))
        for fold in self.problem.folds:
            test = self.problem.fold == fold
            held_out[test] = self.fit(fit.effects, ~test, HELD_OUT_EVALUATIONS).predicted[test]
        return dataclasses.replace(fit, held_out=held_out)

    def with_intervals(self, fit: Fit, level: float = 0.95) -> list:
        """
        Return the fitted effects with intervals of their parameters.

        From the Jacobian, with the residuals summed by block (a sandwich estimate), because
        residuals of a simulated response are correlated.
        """
        parameters = ParameterVector(fit.effects, self.problem.kind)
        if len(parameters) == 0:
            return fit.effects
        jacobian = fit.jacobian
        error = self.problem.measured - fit.predicted
        inverse = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-10)
        scores = np.stack([jacobian[rows].T @ error[rows] for rows in (
            self.problem.block == block for block in np.unique(self.problem.block))])
        count = len(scores)
        freedom = max(count - len(parameters), 1)
        covariance = count / freedom * inverse @ (scores.T @ scores) @ inverse
        half = special.stdtrit(freedom, 0.5 + level / 2.0) * np.sqrt(
            np.maximum(np.diag(covariance), 0.0))
        return parameters.with_intervals(fit.vector, half)
