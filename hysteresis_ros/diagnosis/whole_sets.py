# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every loaded muscle has, fitted together from many starts.

Effects of the load stand for each other. Sets that grow by one effect at a time may so end far from
the values that all of them have together, and a set that lacks one may need another form of the
rest. To fit H2's weights alone takes 3 ms where a fit of all takes 50 to 100: a grid of values is
tried, and fits begin at the best.
"""

from __future__ import annotations

from collections.abc import Collection
import itertools
import math

import numpy as np

from hysteresis_ros.diagnosis.parameters import universal, usual
from hysteresis_ros.effects import Effect, Parameter, Surroundings
from hysteresis_ros.effects.material import StressDependence, StressDependentStrain
from hysteresis_ros.effects.transformation_slopes import TransformationSlopes

# Ratio of neighbouring shifts by the load that are tried: the nearest is off by a fifth at most,
# which is less than the farthest start from which a fit begins again (see `restarts`).
SHIFT_RATIO = 1.4


def starts_together(surroundings: Surroundings, names: Collection[str]) -> list[list[list[Effect]]]:
    """
    Return values at which fits of all that a loaded muscle has may begin.

    Parameters
    ----------
    surroundings : Surroundings
        Of the bench.
    names : collection of str
        Effects that its tables can show.

    Returns
    -------
    list of list of list of Effect
        For each form of the growth with the load, and of a shift that is in proportion to the load
        or to the strain, starts: every shift by the load with every scale of the growth, and loops
        that widen, narrow, or do neither. Empty without both a shift and a growth.
    """
    if not {StressDependence.id, StressDependentStrain.id} <= set(names):
        return []
    common = [one for one in universal(surroundings, (StressDependence.id,
                                                      StressDependentStrain.id))
              if one.id in names]
    shift, = usual([StressDependence(surroundings)], 'bench')
    growth, = usual([StressDependentStrain(surroundings)], 'bench')
    slopes: list[list[Effect]] = [[]]
    if TransformationSlopes.id in names and TransformationSlopes.available(surroundings):
        wider = TransformationSlopes(surroundings)
        slopes = [[wider.with_values(g=g)] for g in (*_named(wider, 'g').starts, 0.0)]
    return [[[shift.with_values(C=C, follows=follows), growth.with_values(n=n, F0=F0), *some,
              *common]
             for C, F0, some in itertools.product(
                _shifts(shift), _named(growth, 'F0').starts, slopes)]
            for n in _named(growth, 'n').choices
            for follows in (0.0, *_named(shift, 'follows').starts)]


def subsets(effects: list[Effect]) -> list[list[Effect]]:
    """Return effects without any of those that the shift and the growth may do without."""
    kept = [one for one in effects if one.id in (StressDependence.id, StressDependentStrain.id)]
    rest = [one for one in effects if one not in kept]
    return [[*kept, *some] for count in range(len(rest), -1, -1)
            for some in itertools.combinations(rest, count)]


def _shifts(shift: Effect) -> list[float]:
    """Return values over the physical range of a shift by the load."""
    known = _named(shift, 'C')
    count = math.ceil(math.log(known.high / known.low) / math.log(SHIFT_RATIO)) + 1
    return np.geomspace(known.low, known.high, count).tolist()


def _named(effect: Effect, name: str) -> Parameter:
    return next(one for one in effect.parameters if one.name == name)
