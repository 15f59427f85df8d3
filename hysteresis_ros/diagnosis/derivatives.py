# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Derivatives of a simulated response, in as few simulations as the way to a minimum allows."""

import numpy as np

# Simulated responses are smooth only on this scale of the parameters' units.
DIFFERENCE = 0.02
# A step of which the derivatives miss at most this share has shown that they still hold.
FORETOLD = 0.3


class Derivatives:
    """
    Derivatives along the way of a fit: by differences, or by Broyden's update.

    The update makes them right for the step that was taken, without a simulation. It is used only
    where they had foretold most of what that step did.

    Parameters
    ----------
    response : callable
        Gives the simulated rows, shape (n,), for a vector of parameters, shape (k,).
    upper : ndarray, shape (k,)
        Upper bounds of the parameters.
    updates : bool
        Whether there is an update at all.

    Attributes
    ----------
    rough : bool
        Whether the last ones were updated, not taken by differences.
    """

    def __init__(self, response, upper, updates: bool = True):
        self._response = response
        self._upper = upper
        self._updates = updates
        self._point: np.ndarray | None = None
        self._matrix = np.zeros((0, 0))
        self.rough = False

    def begin(self, point: np.ndarray, matrix: np.ndarray, rough: bool) -> None:
        """Take up derivatives that are known at a point, shape (n, k)."""
        self._point, self._matrix, self.rough = np.array(point), matrix, rough

    def at(self, vector: np.ndarray) -> np.ndarray:
        """Return the derivatives at a point of the way, shape (n, k)."""
        if self._point is None or np.any(vector != self._point):
            matrix = self._followed(vector) if self._updates else None
            if matrix is None:
                centre = self._response(vector)
                self.begin(vector, differences(self._response, vector, centre, self._upper), False)
            else:
                self.begin(vector, matrix, True)
        return self._matrix

    def _followed(self, vector):
        """Return the derivatives after a step, or None where they have not foretold it."""
        if self._point is None:
            return None
        step = vector - self._point
        change = self._response(vector) - self._response(self._point)
        missed = change - self._matrix @ step
        if not np.linalg.norm(missed) <= FORETOLD * np.linalg.norm(change):
            return None
        return self._matrix + np.outer(missed, step) / (step @ step)


def differences(response, vector, centre, upper) -> np.ndarray:
    """
    Return derivatives by one-sided differences, shape (n, k).

    Parameters
    ----------
    response : callable
        Gives the simulated rows, shape (n,), for a vector of parameters, shape (k,).
    vector, upper : ndarray, shape (k,)
        Where, and the upper bounds.
    centre : ndarray, shape (n,)
        The response there.
    """
    columns = []
    for k, value in enumerate(vector):
        step = DIFFERENCE if value + DIFFERENCE < upper[k] else -DIFFERENCE
        moved = np.array(vector)
        moved[k] += step
        columns.append((response(moved) - centre) / step)
    return np.column_stack(columns)
