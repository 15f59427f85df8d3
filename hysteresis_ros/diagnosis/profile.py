# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Interval of the size of an effect by the profile of the least squares.

Two parameters of one equation may be one number, as the size and the scale of a growth of which a
single load tells. Squares then lie in a bent valley: derivatives at its floor say that the size may
be anything, where a size too small to matter would leave far more unexplained, whatever the other
one is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.bench_fit import Response

# Bisections of the way to an end that is refused: the interval is off by a sixteenth of it.
BISECTIONS = 3
# As a fit of all parameters has them.
EVALUATIONS, TOLERANCE = 8, 1e-3


def profile_interval(response: Response, vector: np.ndarray, index: int, most: float
                     ) -> tuple[float, float]:
    """
    Return the likelihood interval of one parameter, the others fitted at each of its values.

    Where the sum of squares, at its least over the others, is `most` times the least of all at most
    (Venzon and Moolgavkar, J. R. Stat. Soc. C 37 (1988) 87).

    Parameters
    ----------
    response : Response
        Of the effects.
    vector : ndarray, shape (k,)
        Where the squares are least.
    index : int
        Which parameter.
    most : float
        Sum of squares over the least one that is allowed.

    Returns
    -------
    low, high : float
        In units of `ParameterVector`. Where the end of the plausible range is not refused, it is
        the bound: nothing is known to that side.
    """
    allowed = most * response.squares(vector)

    def allows(value: float) -> bool:
        found = response.minimise(vector, EVALUATIONS, TOLERANCE, (index, value))
        return response.squares(found) <= allowed

    parameters = response.parameters
    low, high = (
        float(bound) if allows(end) else _end(allows, float(vector[index]), end)
        for end, bound in zip(parameters.plausible(index), (
            parameters.lower[index], parameters.upper[index])))
    return low, high


def _end(allows: Callable[[float], bool], inside: float, outside: float) -> float:
    """Return the end of the interval between a value inside and one outside, by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if allows(middle) else (inside, middle)
    return 0.5 * (inside + outside)
