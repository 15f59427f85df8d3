# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The staircase of reversals that a Preisach operator remembers.

It is a list ``[upper, lower, maximum, minimum, maximum, ...]`` that narrows from both sides; even
places are maxima. A minimum on top means that the input is rising. An input that passes a corner
wipes out that corner and the one above it.
"""

from ..errors import ParameterError

# More nested loops than this never occur in practice; see `kernels.preisach.thin`.
MOST_CORNERS = 65536


def check_corners(entries: list[float], present: float, lower: float, upper: float,
                  where: str) -> list[float]:
    """
    Return the whole staircase made of saved reversals; ParameterError if it is none.

    Parameters
    ----------
    entries : list of float
        Maximum, minimum, maximum, ... outside in.
    present : float
        The present input.
    lower, upper : float
        Input range.
    where : str
        What the message names.

    """
    if len(entries) > MOST_CORNERS:
        raise ParameterError(f'{where}: {len(entries)} corners, at most {MOST_CORNERS} are kept')
    corners = [upper, lower]
    for value in [*entries, present]:
        low, high = sorted(corners[-2:])
        if not low <= value <= high:
            raise ParameterError(
                f'{where}: {value} is not between {low} and {high}; the memory is damaged or '
                'belongs to another input range')
        corners.append(value)
    return corners[:-1]
