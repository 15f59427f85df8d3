# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a model costs: seconds for a row of a sequence, and for a scalar inverse."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.operators import Additive, Cascade

# Rows that the inverse is timed on, after so many to warm up, and how often each time is taken.
ROWS, WARM_UP, REPEATS = 300, 20, 10


def time_per_step(operator: Additive | Cascade, inputs: np.ndarray,
                  outputs: np.ndarray) -> tuple[float, float]:
    """
    Return the seconds that a row takes: simulated in a sequence, and inverted and committed.

    Parameters
    ----------
    operator : Cascade or Additive
        Its memory is changed.
    inputs : ndarray, shape (1 + rows, S)
    outputs : ndarray, shape (rows,)
        What the operator gives for all but the first, which the inverse is asked for.

    Returns
    -------
    simulate, invert : float
        Each the least of several tries, because only other work makes a try longer.
    """
    simulated = []
    for _ in range(1 + REPEATS):
        operator.reset()
        start = time.perf_counter()
        operator.simulate(inputs)
        simulated.append(time.perf_counter() - start)
    rows = np.linspace(0, len(outputs) - 1, min(ROWS, len(outputs))).astype(int)
    requests = [(float(outputs[row]), tuple(inputs[row + 1, 1:].tolist())) for row in rows]
    inverted = []
    for number in range(1 + REPEATS):
        operator.reset()
        some = requests if number else requests[:WARM_UP]
        start = time.perf_counter()
        for output, coupled in some:
            operator.step((operator.invert(output, coupled).input, *coupled))
        inverted.append((time.perf_counter() - start) / len(some))
    return min(simulated[1:]) / len(inputs), min(inverted[1:])
