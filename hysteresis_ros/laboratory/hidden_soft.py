# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Physical effects of muscles that are no wires, each as a change of constants.

Strengths are as in `hidden_physics`: 1 is strong, 0.4 weak, within 15 % for each specimen.
"""

from collections.abc import Callable, Mapping
import dataclasses
import math
from typing import NamedTuple

import numpy as np

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.hidden_physics import SPREAD
from hysteresis_ros.laboratory.muscles import MUSCLES
from hysteresis_ros.laboratory.soft_muscle import SoftMaterial
from hysteresis_ros.laboratory.tendon import Tendon


class SoftEffect(NamedTuple):
    """
    What it is, and by muscle that can have it the constants that a size of it has.

    They are those of the muscle or, where `of_tendon`, those of the cord that weights hang on.
    """

    sentence: str
    constants: dict[str, Callable[[float], dict[str, float]]]
    of_tendon: bool = False


SOFT_EFFECTS = {
    'valve_lag': SoftEffect(
        'A narrow valve: filling takes a second, venting more than two.', {
            'mckibben': lambda size: {'filling_time': 1.2 * size, 'venting_time': 2.5 * size}}),
    'viscoelastic_creep': SoftEffect(
        'The weight hangs on a cord of nylon, which goes on stretching.', {
            'mckibben': lambda size: {'compliance': 1.2e-4 * size},
            'scp': lambda size: {'compliance': 2.5e-4 * size}}, of_tendon=True),
}


def soft_effects(muscle: str) -> tuple[str, ...]:
    """Return the names of the effects that a muscle can have."""
    return tuple(name for name, effect in SOFT_EFFECTS.items() if muscle in effect.constants)


def with_effects(material: SoftMaterial, effects: Mapping[str, float], seed: int
                 ) -> tuple[SoftMaterial, Tendon]:
    """
    Return a batch of muscles with effects, and the cord that its weights hang on.

    Parameters
    ----------
    material : SoftMaterial
        Without them.
    effects : mapping of str to float
        Strength of each, from 0 to 2.
    seed : int
        Of the specimen, for the exact sizes.

    Raises
    ------
    ParameterError
        For an effect that the muscle cannot have, or a strength that makes no sense.
    """
    possible, tendon = soft_effects(material.name), Tendon()
    for name, strength in effects.items():
        if name not in possible:
            known = f'it can have {", ".join(possible)}; ' if possible else ''
            raise ParameterError(
                f'laboratory: a {material.name} muscle cannot have {name}: {known}most effects '
                f'are those of shape memory wires; choose one of {", ".join(MUSCLES)}')
        if not (math.isfinite(strength) and 0.0 <= strength <= 2.0):
            raise ParameterError(f'laboratory: the strength of {name} has to be from 0 to 2, not '
                                 f'{strength!r}')
        if strength > 0.0:
            rng = np.random.default_rng([seed, 31, list(SOFT_EFFECTS).index(name)])
            size = strength * (1.0 + SPREAD * rng.uniform(-1.0, 1.0))
            constants = SOFT_EFFECTS[name].constants[material.name](size)
            if SOFT_EFFECTS[name].of_tendon:
                tendon = dataclasses.replace(tendon, **constants)
            else:
                material = dataclasses.replace(material, **constants)
    return material, tendon
