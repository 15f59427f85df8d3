# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The second stage of a wire whose minor loops are scaled from the major one (`Kinetics`)."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.model.places import contracting, load_along
from hysteresis_ros.operators import HysteresisOperator, Kinetic
from hysteresis_ros.operators.preisach import Preisach

if TYPE_CHECKING:
    from hysteresis_ros.model.chain import Chain
    from hysteresis_ros.model.muscle import MuscleModel

# Operators that are remembered: where a search moves other parameters they come again.
MOST_STAGES = 64


def with_kinetics(model: MuscleModel, chain: Chain, stage: HysteresisOperator
                  ) -> HysteresisOperator:
    """
    Return H2 with the kinetics that the effects of a model give it, with any memory.

    All has transformed where the wire is cold, under the load of the cold arm or, without an arm,
    under the mean load of the bench: the major loop begins there.

    Parameters
    ----------
    model : MuscleModel
        First stage and arm.
    chain : Chain
        Its effects.
    stage : HysteresisOperator
        H2 without; it is returned where the effects leave it so.

    Raises
    ------
    ParameterError
        If no kinetics of this operator are known.
    """
    share = chain.kinetics
    return stage if share == 0.0 else kinetic_stage(model, chain, stage, share)


def kinetic_stage(model: MuscleModel, chain: Chain, stage: HysteresisOperator, share: float
                  ) -> Kinetic:
    """
    Return H2 with kinetics of a share, whatever that of the effects is; see `with_kinetics`.

    Parameters
    ----------
    model : MuscleModel
    chain : Chain
    stage : HysteresisOperator
    share : float
        From 0 to 1.

    Raises
    ------
    ParameterError
        If no kinetics of this operator are known.
    """
    stage = contracting(
        model, stage, 'a wire whose minor loops follow its kinetics (effect kinetics)')
    return _kinetic(stage, share, cold_input(model, chain, stage.lower, stage.upper))


def cold_input(model: MuscleModel, chain: Chain, lower: float, upper: float) -> float:
    """
    Return the input of H2 at which all has transformed; see `with_kinetics`.

    Parameters
    ----------
    model : MuscleModel
    chain : Chain
    lower, upper : float
        Range of H2; what is not inside it begins at its upper end.
    """
    first = model.first_stage(chain)
    first.reset()
    cold = load_along(model, chain, 1.0) - first.step(chain.to_drive_squared(model.cold_drive))
    return float(cold) if lower < cold < upper else upper


def output_along(stage: HysteresisOperator, inputs: np.ndarray, oriented: np.ndarray
                 ) -> np.ndarray:
    """
    Return what H2 gives from the cold state on.

    Parameters
    ----------
    stage : HysteresisOperator
        H2, whose memory is wiped first.
    inputs : ndarray, shape (rows,)
    oriented : ndarray, shape (rows,)
        `Chain.oriented` of the load of each.

    Returns
    -------
    ndarray, shape (rows,)
    """
    stage.reset()
    if isinstance(stage, Kinetic):
        return stage.simulate_under(inputs, oriented)
    return stage.simulate(inputs)


@functools.lru_cache(maxsize=MOST_STAGES)
def _kinetic(stage: Preisach, share: float, top: float) -> Kinetic:
    return Kinetic(stage, share, top)
