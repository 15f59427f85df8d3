# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The staircase of reversals that a Preisach operator remembers.

It is a list ``[upper, lower, maximum, minimum, maximum, ...]`` that narrows from both sides; even
places are maxima. A minimum on top means that the input is rising. An input that passes a corner
wipes out that corner and the one above it.
"""

import numpy as np

from benchmark.reference.everett import Everett

# More nested loops than this never occur in practice; see `thin`.
MOST_CORNERS = 65536
# Corners passed one by one before a search by halves takes over.
_WALK = 8


def beyond(values: list[float], depth: int, bound: float, rising: bool) -> int:
    """
    Return how many corners survive a movement up (down) to a bound.

    Parameters
    ----------
    values : list of float
        The corners, or the levels at them: maxima descend, minima ascend, towards the top.
    depth : int
        Number of corners to start from; the one on top is of the kind that the branch starts
        from (a minimum when rising). It may count one beyond the end, for a corner to come.
    bound : float
        Where the movement ends. A corner that it reaches is wiped out.
    rising : bool
        Direction of the movement.

    """
    stop = max(depth - 2 * _WALK, 2)
    if rising:
        while depth > stop and values[depth - 2] <= bound:
            depth -= 2
        if depth > 2 and values[depth - 2] <= bound:
            low, high = 0, depth // 2 - 1
            while high - low > 1:
                middle = (low + high) // 2
                if values[2 * middle] <= bound:
                    high = middle
                else:
                    low = middle
            depth = 2 * high
        return depth
    while depth > stop and values[depth - 2] >= bound:
        depth -= 2
    if depth > 3 and values[depth - 2] >= bound:
        low, high = 0, (depth - 3) // 2
        while high - low > 1:
            middle = (low + high) // 2
            if values[2 * middle + 1] >= bound:
                high = middle
            else:
                low = middle
        depth = 2 * high + 1
    return depth


def thin(corners: list[float], sums: list[float], everett: Everett) -> None:
    """
    Merge neighbouring steps of a staircase that has become too long, in place.

    Ever shrinking loops could nest without end. Two steps become one with its minimum where the
    weight below the staircase stays the same, so the present output and the level at every
    corner that is left do not change. What can change is the output inside the merged step, by
    at most the weight of the rectangle between the two. The smallest rectangles go first. With
    32768 nested loops such a rectangle holds less than 1e-9 of the weight, unless that is
    concentrated in very few cells.

    Parameters
    ----------
    corners, sums : list of float
        The staircase and the levels at its corners. About a fifth of it goes.
    everett : Everett
        The weight.

    """
    entries = np.array(corners[2:])
    count = len(entries) // 2
    maxima, minima = entries[:2 * count:2], entries[1:2 * count:2]
    # Step k reaches from maximum k down to maximum k + 1 and has minimum k.
    k = np.arange(0, count - 2, 2)
    first, second = maxima[k] - maxima[k + 1], maxima[k + 1] - maxima[k + 2]
    rectangles = first * (minima[k + 1] - minima[k])
    # Inside one cell the weight is uniform and its mean is exact: such steps come first.
    uniform = ((everett.cell(maxima[k]) == everett.cell(maxima[k + 2]))
               & (everett.cell(minima[k]) == everett.cell(minima[k + 1])))
    k = np.sort(k[np.lexsort((rectangles, ~uniform))[:len(k) * 4 // 5]])
    first, second = maxima[k] - maxima[k + 1], maxima[k + 1] - maxima[k + 2]
    share = second / (first + second)
    merged = minima[k] + share * (minima[k + 1] - minima[k])

    levels = np.array(sums[2:])
    entries[2 * k + 1] = merged
    levels[2 * k + 1] = levels[2 * k] - everett.value(maxima[k], merged)
    keep = np.ones(len(entries), dtype=bool)
    keep[2 * k + 2] = keep[2 * k + 3] = False
    corners[2:] = entries[keep].tolist()
    sums[2:] = levels[keep].tolist()
