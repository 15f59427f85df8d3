# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a bench model would be without a part of the bench: its jackknife replicates."""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses

from hysteresis_ros.effects import Effect
from hysteresis_ros.operators import HysteresisOperator


@dataclasses.dataclass(frozen=True)
class Replicate:
    """
    H2 and effects as identified without one of the bench's loads.

    Parameters
    ----------
    length_stage : HysteresisOperator
        H2.
    effects : list of Effect
        Those of the model, with the values that the other loads give them.
    """

    length_stage: HysteresisOperator
    effects: list[Effect]

    def instead_of(self, own: Sequence[Effect], effects: Sequence[Effect]) -> list[Effect]:
        """
        Return effects with the values that the bench gives them without the load.

        Parameters
        ----------
        own : sequence of Effect
            Of the model.
        effects : sequence of Effect
            What acts. One of the model as it is gets all values, one that was fitted anew to an arm
            only those that are no matter of the arm, and what the bench did not show none.
        """
        known = {effect.id: effect.values for effect in self.effects}
        unchanged = {effect.id: effect.values for effect in own}
        return [effect.with_values(**{
            parameter.name: known[effect.id][parameter.name] for parameter in effect.parameters
            if effect.values == unchanged.get(effect.id) or 'arm' not in parameter.kinds})
            if effect.id in known else effect for effect in effects]
