# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""All effects that are known: the package's own and those that users have installed."""

import functools
import inspect
from importlib import metadata

from hysteresis_ros.effects import (
    ambient, cable_friction, cold_clamps, creep, electrical, encoder_eccentricity, encoder_scale,
    fatigue, formation_memory, heat_loss, kinetics, material, measured_supply, mechanism, overload,
    phase_modulus, sensor, thermal, thermal_expansion, transformation_slopes, valve_lag,
    viscoelastic_creep, wire_break)
from hysteresis_ros.effects.base import Effect, STAGES
from hysteresis_ros.effects.stages import (
    DriveEffect, MaterialEffect, MechanismEffect, SensorEffect)
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.spelling import unknown

ENTRY_POINT_GROUP = 'hysteresis_ros.effects'

BASES = {'electrical': DriveEffect, 'thermal': DriveEffect, 'material': MaterialEffect,
         'mechanism': MechanismEffect, 'sensor': SensorEffect}
DESCRIPTION = ('id', 'stage', 'sentence', 'equation', 'source', 'shows_in', 'experiment')


def _own() -> list[type[Effect]]:
    found = []
    for module in (electrical, measured_supply, thermal, heat_loss, valve_lag, ambient, material,
                   fatigue, creep, viscoelastic_creep, transformation_slopes, phase_modulus,
                   thermal_expansion, formation_memory, kinetics, overload, cold_clamps, mechanism,
                   cable_friction, wire_break, sensor, encoder_eccentricity,
                   encoder_scale):
        found += [member for member in vars(module).values()
                  if inspect.isclass(member) and issubclass(member, Effect)
                  and member.__module__ == module.__name__ and 'id' in vars(member)]
    return found


def _installed() -> list[type[Effect]]:
    found = []
    for entry in metadata.entry_points(group=ENTRY_POINT_GROUP):
        try:
            effect = entry.load()
        except Exception as error:
            raise ParameterError(
                f'effect {entry.name!r} of entry point {entry.value!r} cannot be loaded: {error}; '
                'mend or uninstall that package') from None
        if not (inspect.isclass(effect) and issubclass(effect, Effect)):
            raise ParameterError(
                f'entry point {entry.value!r} is no subclass of hysteresis_ros.effects.Effect')
        _check(effect)
        found.append(effect)
    return found


def _check(effect: type[Effect]) -> None:
    """Refuse a user's effect that would be without effect."""
    name = getattr(effect, 'id', effect.__name__)
    missing = [part for part in DESCRIPTION if not isinstance(getattr(effect, part, None), str)]
    if missing:
        raise ParameterError(f'effect {name} lacks {", ".join(missing)}; give them as text')
    if effect.stage not in STAGES:
        raise ParameterError(
            f'effect {name}: stage {effect.stage!r} is none of {", ".join(STAGES)}')
    base = BASES[effect.stage]
    if not issubclass(effect, base):
        raise ParameterError(
            f'effect {name}: one of stage {effect.stage} has to be a {base.__name__}')
    if (issubclass(effect, DriveEffect) and effect.forward is DriveEffect.forward
            and effect.step is DriveEffect.step):
        raise ParameterError(f'effect {name} defines neither forward nor step')


@functools.cache
def catalogue() -> dict[str, type[Effect]]:
    """
    Return the classes of all effects by identifier, in the order of the stages.

    Raises
    ------
    ParameterError
        If an installed effect cannot be loaded, does not say what it is, does not fit its stage,
        or takes a name that is already there.
    """
    effects: dict[str, type[Effect]] = {}
    for effect in _own() + _installed():
        if effect.id in effects:
            raise ParameterError(f'two effects are called {effect.id!r}; rename one')
        effects[effect.id] = effect
    return dict(sorted(effects.items(), key=lambda item: STAGES.index(item[1].stage)))


def effect_class(name: str) -> type[Effect]:
    """
    Return the class of the effect called `name`.

    Raises
    ------
    ParameterError
        If there is none; the message names the one that is probably meant, or all.
    """
    effects = catalogue()
    if name not in effects:
        raise ParameterError(unknown('effect', name, effects))
    return effects[name]


def package_of(effect: type[Effect]) -> str:
    """Return the Python package that an effect was installed with, '' for our own effects."""
    if effect.__module__.split('.')[0] == __name__.split('.')[0]:
        return ''
    for entry in metadata.entry_points(group=ENTRY_POINT_GROUP):
        if entry.value == f'{effect.__module__}:{effect.__qualname__}' and entry.dist:
            return entry.dist.name
    return effect.__module__.split('.')[0]
