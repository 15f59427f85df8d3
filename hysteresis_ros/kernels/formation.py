# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What martensite keeps of the load under which it formed, or that has oriented it since.

What is added has the strain of its moment; what goes back takes the mean strain along, as in the
unified model of Lagoudas and others, Int. J. Plasticity 32-33 (2012) 155. With P the elongation of
the martensite that is there, S(F) the factor by which a load makes the strain larger, and y the
output of H2 above its least::

    dP = S(F) dy  where y grows,    dP = P dy / y  where it falls

While y grows, S is taken to change evenly with it from one sample to the next. Where a load that is
heavier than that one orients the martensite anew, P is never less than S(F) y, from the sample
after the one with that load on (detwinning: Popov and Lagoudas, Int. J. Plasticity 23 (2007) 1679;
Chemisky and others, Mech. Mater. 43 (2011) 361).
"""

import numpy as np

from .jit import jit
from .lean import lean

# What is remembered of each muscle: its load beyond x (see `bundle`); P [m]; S(F) at the last
# sample, 0 before the first, whose martensite formed under its own load; y [m]; and where kinetics
# depend on it, g of the load (see `kinetics`).
LOAD, FORMED, SCALE, OUTPUT, ORIENTED = range(5)
SIZE = 5


@lean
def parts(kept: float, muscles: np.ndarray, i: int, output: float) -> tuple[float, float]:
    """
    Return what the present load strains of an output, and what is kept whatever the load.

    The elongation is the first times S(F), plus the second.

    Parameters
    ----------
    kept : float
        Share of the strain that is kept, 0 to 1; the rest is that of the present load.
    muscles : ndarray, shape (muscles, 5)
        What is remembered.
    i : int
        Which of them.
    output : float
        y of the present sample [m].
    """
    if kept == 0.0:
        return output, 0.0
    before = muscles[i, OUTPUT]
    if output > before or before <= 0.0:
        scale = muscles[i, SCALE]
        share = 0.5 if scale > 0.0 else 1.0
        change = output - before
        return ((1.0 - kept) * output + kept * share * change,
                kept * (muscles[i, FORMED] + (1.0 - share) * scale * change))
    return (1.0 - kept) * output, kept * muscles[i, FORMED] * output / before


@lean
def keep(muscles: np.ndarray, i: int, output: float, scale: float, anew: bool) -> None:
    """
    Remember an output y [m] of a muscle, reached under a load with the factor S(F).

    With `anew`, a heavier load than that of its formation orients martensite.
    """
    strained, held = parts(1.0, muscles, i, output)
    formed = scale * strained + held
    muscles[i, FORMED] = max(formed, scale * output) if anew else formed
    muscles[i, SCALE], muscles[i, OUTPUT] = scale, output


@lean
def output_for(kept: float, muscles: np.ndarray, i: int, wanted: float, scale: float) -> float:
    """Return the output y [m] that gives an elongation [m] under a load with the factor S(F)."""
    before = muscles[i, OUTPUT]
    strained, held = parts(kept, muscles, i, before)
    here = scale * strained + held
    if wanted < here and before > 0.0:
        return before * wanted / here
    mean = 0.5 * (muscles[i, SCALE] + scale) if muscles[i, SCALE] > 0.0 else scale
    return before + (wanted - here) / ((1.0 - kept) * scale + kept * mean)


@jit
def elongations(kept: float, anew: bool, outputs: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """
    Return the elongation by the transformation, of which martensite keeps a share.

    Parameters
    ----------
    kept : float
        That share.
    anew : bool
        Whether a heavier load orients it anew.
    outputs, scales : ndarray, shape (rows,)
        Output of H2 above its least, and S(F) of each row.

    Returns
    -------
    ndarray, shape (rows,)

    """
    muscles = np.zeros((1, SIZE))
    found = np.empty(len(outputs))
    for n in range(len(outputs)):
        strained, held = parts(kept, muscles, 0, outputs[n])
        found[n] = scales[n] * strained + held
        keep(muscles, 0, outputs[n], scales[n], anew)
    return found
