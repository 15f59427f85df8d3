# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The second stage of a wire whose places are not equally warm: the mean of an H2 for each place.

A place with the excess g feels the drive squared g q where the wire feels q. Under a load F the
input of H2 is u = F - x(q), x the first stage, so that of the place is F - x(g q), an increasing
function of u: the mean is an operator of u again (`operators.series`). Where the load changes with
the angle, that function is taken at the load in the middle of the arm's way, because it counts only
for the places that lack much of the excess; without an arm at the mean load of the bench. Of a
first stage with hysteresis the mean of heating and cooling is taken.

Against fifty places with an operator each, on an arm whose load changes by a third, angles differ
by less than 1 % of the way where the ends take 0.15 of the wire, and by 2 % where the first stage
has hysteresis.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.model.first_stage import FirstStage
from hysteresis_ros.operators import HysteresisOperator
from hysteresis_ros.operators.preisach import Preisach
from hysteresis_ros.operators.series import mean_in_series

if TYPE_CHECKING:
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.model.chain import Chain
    from hysteresis_ros.model.muscle import MuscleModel

# Points of x over the drive squared, and of the load over the angle.
POINTS = 400
# Multiple of the full drive squared up to which x is laid out.
FARTHEST = 20.0
# The coldest places would transform at many times the full drive: relays are laid out up to twice
# the range of H2, in so many intervals, and those beyond are put into the last.
INTERVALS = 8
# Wires that are remembered: where a search moves other parameters they come again.
MOST_WIRES = 64


@dataclasses.dataclass(frozen=True)
class _Wire:
    """What the second stage of a wire depends on whose places are not equally warm."""

    second: Preisach
    first: HysteresisOperator | None
    full_drive_squared: float
    load_per_drive_squared: float
    load: float
    parts: tuple[float, ...]
    excess: tuple[float, ...]
    # The same for the same values of all others.
    chain: Chain = dataclasses.field(compare=False)


def stage_of_places(model: MuscleModel, chain: Chain, stage: HysteresisOperator
                    ) -> HysteresisOperator:
    """
    Return H2 of the whole wire, with any memory, for others to copy.

    Parameters
    ----------
    model : MuscleModel
        First stage and arm.
    chain : Chain
        Its effects.
    stage : HysteresisOperator
        H2 of a wire that is equally warm everywhere; it is returned where the effects leave it so.

    Raises
    ------
    ParameterError
        If such a mean of this operator is not known.
    """
    places = chain.places
    if places is None:
        return stage
    stage = contracting(model, stage, 'a wire with cold ends (effect cold_clamps)')
    parts, excess = (tuple(column.tolist()) for column in places)
    return _mean(_Wire(
        stage, model.force_stage, model.surroundings.full_drive_squared,
        chain.load_per_drive_squared(), load_along(model, chain, 0.5), parts, excess, chain))


def contracting(model: MuscleModel, stage: HysteresisOperator, wire: str) -> Preisach:
    """
    Return H2 if it is a Preisach operator of a muscle that contracts when driven.

    Raises
    ------
    ParameterError
        If not; it says what kind of `wire` needs one.
    """
    if not isinstance(stage, Preisach) or model.sign > 0:
        raise ParameterError(f'{wire} needs a Preisach length stage of a muscle that contracts '
                             f'when driven, not a {stage.kind} one; identify it with --operator '
                             'two-stage')
    return stage


@functools.lru_cache(maxsize=MOST_WIRES)
def _mean(wire: _Wire) -> Preisach:
    """Return H2 of the whole wire, with any memory."""
    stage = wire.second
    drives, levels = _first_stage(wire)
    cold = wire.load - levels[0]
    if not stage.lower < cold:
        return stage
    pad = stage.lower - (cold - stage.lower) * np.arange(INTERVALS, 0, -1) / INTERVALS
    nodes = np.concatenate((pad, stage.nodes))
    felt = np.interp(wire.load - nodes, levels, drives)
    inputs = wire.load - np.interp(np.array(wire.excess)[:, None] * felt, drives, levels)
    # Beyond the cold state no place is heated, and all are alike.
    inputs = np.where(nodes < cold, inputs, nodes)
    inputs[:, 0] = np.minimum(inputs[:, 0], stage.lower)
    return mean_in_series(stage, nodes, inputs, np.array(wire.parts))


def _first_stage(wire: _Wire) -> tuple[np.ndarray, np.ndarray]:
    """Return drives squared and x for each, shape (n,)."""
    first = FirstStage(wire.first, wire.chain)
    full = wire.full_drive_squared
    drives = np.linspace(0.0, full, POINTS)
    first.reset()
    x = first.simulate(np.concatenate((drives, drives[::-1])))
    levels = np.maximum.accumulate(0.5 * (x[:POINTS] + x[:POINTS - 1:-1]))
    # Beyond what the bench has seen it goes on as at the end.
    slope = (levels[-1] - levels[-20]) / (drives[-1] - drives[-20])
    far = FARTHEST * full
    return np.append(drives, far), np.append(levels, levels[-1] + slope * (far - full))


def load_along(model: MuscleModel, chain: Chain, share: float) -> float:
    """
    Return the load that the transformation feels at a share of the arm's way, 1 where it is cold.

    Without an arm that is the mean load of the bench, as everywhere.
    """
    if not model.first_stage(chain).loaded:
        return 0.0
    load = model.mean_load
    if model.geometry is not None:
        short, long = model.require_length_range()
        load = _load_at(model.geometry, short + share * (long - short))
    return float(chain.load_inside(np.float64(load)))


@functools.lru_cache(maxsize=MOST_WIRES)
def _load_at(geometry: BicepGeometry, length: float) -> float:
    """Return the load [N] of the arm at rest where its muscle has a length [m]."""
    theta = np.linspace(*geometry.angle_range, POINTS)
    return float(np.interp(length, geometry.length(theta), geometry.force(theta)))
