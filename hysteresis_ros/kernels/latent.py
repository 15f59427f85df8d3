# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The phase of a trial whose latent heat works against what causes it."""

import numpy as np

from .jit import jit


@jit
def phase_along_branches(q: np.ndarray, caused: np.ndarray, phase: np.ndarray, decay: np.ndarray,
                         released: np.ndarray) -> np.ndarray:
    """
    Return the phase that agrees with the heat it releases, on the branches that a run has shown.

    A run in which the effects took one phase and the muscle had another says how the phase follows
    q on each branch, from one turn of q to the next. If the branches stayed where they are, the
    phase of each row would be where its branch meets the line

        q[n] = decay[n] q[n - 1] + given[n] + released[n] (phase[n] - phase[n - 1]),

    with the heat `given` that of the run. Beyond its ends a branch is level.

    Parameters
    ----------
    q : ndarray, shape (rows,)
        Drive squared that the muscle felt.
    caused, phase : ndarray, shape (rows,)
        Phase that the muscle had, and that its effects took.
    decay : ndarray, shape (rows,)
        Share of q that stays from the row before.
    released : ndarray, shape (rows,)
        What is added to q where the phase changes by one within a row.

    Returns
    -------
    ndarray, shape (rows,)

    """
    rows = len(q)
    found = caused.copy()
    first = 0
    last_q = q[0]
    while first < rows - 1:
        rising = q[first + 1] >= q[first]
        last = first + 1
        while last < rows - 1 and (q[last + 1] >= q[last]) == rising:
            last += 1
        sign = 1.0 if rising else -1.0
        for n in range(first + 1, last + 1):
            heat = released[n]
            # q less the heat of the phase: it rises along a rising branch, as the phase falls.
            apart = (q[n] - heat * phase[n] + decay[n] * (last_q - q[n - 1])
                     - heat * (found[n - 1] - phase[n - 1]))
            low, high = first, last
            if sign * apart <= sign * (q[low] - heat * caused[low]):
                found[n] = caused[low]
            elif sign * apart >= sign * (q[high] - heat * caused[high]):
                found[n] = caused[high]
            else:
                while high - low > 1:
                    middle = (low + high) // 2
                    if sign * (q[middle] - heat * caused[middle]) <= sign * apart:
                        low = middle
                    else:
                        high = middle
                start = q[low] - heat * caused[low]
                way = q[high] - heat * caused[high] - start
                share = (apart - start) / way if way != 0.0 else 1.0
                found[n] = caused[low] + share * (caused[high] - caused[low])
            last_q = apart + heat * found[n]
        first = last
    return found
