# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a muscle that creeps remembers, over a whole trial."""

import math

import numpy as np

from .jit import jit


@jit
def relax(targets: np.ndarray, dt: np.ndarray, times: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """
    Return the sum of relaxations towards a target that changes.

    Parameters
    ----------
    targets, dt : ndarray, shape (rows,)
        Target, NaN where nothing relaxes, and time since the row before [s].
    times : ndarray, shape (modes,)
        Time constant of each relaxation [s].
    modes : ndarray, shape (modes,)
        Where each is before the first row; afterwards where it is after the last one.

    Returns
    -------
    ndarray, shape (rows,)

    """
    total = np.empty(len(targets))
    for n in range(len(targets)):
        total[n] = 0.0
        for k in range(len(modes)):
            if not math.isnan(targets[n]):
                decay = math.exp(-dt[n] / times[k])
                modes[k] = targets[n] + (modes[k] - targets[n]) * decay
            total[n] += modes[k]
    return total


@jit
def fade(strain: np.ndarray, turned: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """
    Return the strain of earlier runs of the drive that has not faded yet.

    Parameters
    ----------
    strain : ndarray, shape (rows,)
        Strain of the present run.
    turned : ndarray of bool, shape (rows,)
        Whether a run begins, as soon as the row before has ended.
    clock : ndarray, shape (rows,)
        Time over the time in which it falls by a factor e.

    Returns
    -------
    ndarray, shape (rows,)

    """
    course = np.zeros(len(strain))
    carried, begun = 0.0, 0
    for n in range(len(strain)):
        if turned[n] and n > 0:
            carried = course[n - 1] + strain[n - 1]
            begun = n - 1
        course[n] = carried * math.exp(clock[begun] - clock[n])
    return course
