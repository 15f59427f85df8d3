# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How the constants of one batch of wire differ from those of the next."""

import numpy as np


def vary(rng: np.random.Generator, value: float, share: float) -> float:
    """
    Return a value that differs from the usual one by up to a share of it.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random generator of the batch.
    value : float
        Usual value.
    share : float
        Largest difference over the usual value.
    """
    return value * (1.0 + share * rng.uniform(-1.0, 1.0))
