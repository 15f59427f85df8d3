# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the nodes of a Preisach grid lie."""

import numpy as np

from hysteresis_ros.kernels.way import risen
from hysteresis_ros.measurements.way import way_below

# The grid reaches at least this far beyond the inputs, as a share of their range.
MARGIN = 1e-6
# Share of the nodes that follow the response of a muscle that transforms.
FOLLOWING = 0.5


def nodes_along(low: float, high: float, inputs: np.ndarray, response: np.ndarray,
                trial: np.ndarray, levels: int, following: float = FOLLOWING) -> np.ndarray:
    """
    Return nodes that are dense where the response varies most.

    Half of them divide the inputs evenly, half the total variation of the response over its
    inputs. The weight jumps at nodes only: a wire that transforms within a tenth of its inputs has,
    of as many intervals, five times as many there as on an even grid. What goes against the input
    is noise, and does not count.

    Parameters
    ----------
    low, high : float
        Least and largest input of all.
    inputs, response : ndarray, shape (n,)
        Inputs, and the responses to them, in the order of time.
    trial : ndarray of int, shape (n,)
        Trial of each of them.
    levels : int
        Number N of intervals.
    following : float
        Share of the nodes that follow the response; with 0 all intervals are equal.

    Returns
    -------
    ndarray, shape (N + 1,)
        Ascending.
    """
    margin = MARGIN * max(high - low, 1e-12)
    low, high = low - margin, high + margin
    order = np.argsort(inputs, kind='stable')
    places = np.concatenate(([low], inputs[order], [high]))
    way = np.concatenate(([0.0], way_below(inputs, risen(inputs, response, trial))[order], [1.0]))
    even = (places - low) / (high - low)
    return np.interp(np.linspace(0.0, 1.0, levels + 1),
                     following * way + (1.0 - following) * even, places)
