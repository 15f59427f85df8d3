# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The share of martensite that is the same as the one it causes, within one sample."""

from collections.abc import Callable

from hysteresis_ros.false_position import false_position

# Shares that agree to this are the same.
TOLERANCE = 1e-8


def agree(caused: Callable[[float], float], start: float) -> float:
    """
    Return the share of martensite that an effect has to take so that the muscle has it, too.

    Parameters
    ----------
    caused : callable
        Gives the share, 0 to 1, that the muscle has where the effects take a share. The share
        returned is the last one that it was called with.
    start : float
        Where to begin: the share of the sample before.

    Returns
    -------
    float
        The root of ``caused(share) - share``; it always exists, because what is caused lies between
        0 and 1. Where the muscle jumps, it is the place of the jump.
    """
    near, here = start, caused(start) - start
    if abs(here) <= TOLERANCE:
        return near
    # The share that is caused is the first guess; if it falls short, the end is beyond the root.
    far = near + here
    there = caused(far) - far
    if here * there > 0.0:
        near, here = far, there
        far = 1.0 if here > 0.0 else 0.0
        there = caused(far) - far
    return false_position(lambda share: caused(share) - share, (near, here), (far, there),
                          TOLERANCE, TOLERANCE)
