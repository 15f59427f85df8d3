# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What ``sim://bicep?key=value&...`` asks for: speed, seed, faults, and physical effects of the arm.

=============== ===================================================================================
key             meaning
=============== ===================================================================================
speed           how much faster than the wall's clock the arm lives (0.01 to 1000; 1)
seed            which specimen of arm and wire, and all that is random (0)
muscle          constitutive model of the wires: grains, brinson or lagoudas (grains)
recording       which recording on that specimen: another one has other noise (0)
recording_time  how long it takes, about, in s, for effects that are slow or rare (900)
effects_after   time in s at which the effects begin (0: from the start)
time_constant   of the wires' heating and cooling in s (0.05 to 100; 5 as in the paper)
supply          supply voltage in V (1 to 60; 12)
drop            share of bytes lost in each direction (0 to 0.5; 0)
garbage         share of bursts of bytes that come with random bytes before them (0 to 1; 0)
brownout        time in s at which the supply breaks down for a moment and the board starts anew
unplug_after    time in s at which the cable is pulled, the board's power with it
unplug_for      time in s until it is put back (never)
silent_after    time in s at which the board stops sending
silent_for      time in s until it sends again (never)
deaf_after      time in s at which the board stops hearing
deaf_for        time in s until it hears again (never)
=============== ===================================================================================

All times are seconds of the arm's life. Every other key is the name of an effect of the virtual
laboratory with its strength, such as ``supply_sag=0.4``.
"""

import dataclasses
import math
from urllib.parse import parse_qsl, urlsplit
from typing import Any

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.hidden_physics import EFFECTS
from hysteresis_ros.laboratory.plant import Plant

SCHEME = 'sim'
ARM = 'bicep'

_RANGES = {
    'speed': (0.01, 1000.0), 'seed': (0, 2 ** 31 - 1), 'recording': (0, 2 ** 31 - 1),
    'recording_time': (1.0, 1e7), 'effects_after': (0.0, math.inf),
    'time_constant': (0.05, 100.0), 'supply': (1.0, 60.0),
    'drop': (0.0, 0.5), 'garbage': (0.0, 1.0), 'brownout': (0.0, math.inf),
    'unplug_after': (0.0, math.inf), 'unplug_for': (0.0, math.inf),
    'silent_after': (0.0, math.inf), 'silent_for': (0.0, math.inf),
    'deaf_after': (0.0, math.inf), 'deaf_for': (0.0, math.inf)}
_STRENGTHS = (-100.0, 100.0)


@dataclasses.dataclass(frozen=True)
class Simulation:
    """What a URL asks for; the module's table says what each means."""

    speed: float = 1.0
    seed: int = 0
    recording: int = 0
    recording_time: float = 900.0
    time_constant: float = 5.0
    supply: float = 12.0
    drop: float = 0.0
    garbage: float = 0.0
    brownout: float = math.inf
    unplug_after: float = math.inf
    unplug_for: float = math.inf
    silent_after: float = math.inf
    silent_for: float = math.inf
    deaf_after: float = math.inf
    deaf_for: float = math.inf
    effects: dict = dataclasses.field(default_factory=dict)
    muscle: str = 'grains'
    effects_after: float = 0.0


def parse_url(url: str) -> Simulation:
    """
    Read a ``sim://`` URL.

    Parameters
    ----------
    url : str
        As given for the parameter ``port``.

    Returns
    -------
    Simulation

    Raises
    ------
    ParameterError
        If the arm, a key or a value is not known.

    """
    parts = urlsplit(url)
    if parts.scheme.lower() != SCHEME or parts.netloc.lower() != ARM or parts.path not in ('', '/'):
        raise ParameterError(f'port {url}: the simulated board is {SCHEME}://{ARM}')
    values: dict[str, Any] = {}
    effects: dict[str, float] = {}
    for key, text in parse_qsl(parts.query, keep_blank_values=True):
        if key in values or key in effects:
            raise ParameterError(f'port {url}: {key} is given twice')
        if key == 'muscle':
            values[key] = text
        elif key in _RANGES:
            values[key] = _number(url, key, text, _RANGES[key])
        elif key in EFFECTS:
            effects[key] = _number(url, key, text, _STRENGTHS)
        else:
            raise ParameterError(
                f'port {url}: there is no {key!r}; keys are {", ".join(_RANGES)}, muscle, '
                'and the effects that `hysteresis effects` lists')
    return Simulation(**values, effects=effects)


def make_plant(simulation: Simulation) -> Plant:
    """
    Build the specimen of the virtual laboratory that a URL asks for.

    Parameters
    ----------
    simulation : Simulation
        As read from the URL.

    Returns
    -------
    Plant

    Raises
    ------
    ParameterError
        If an effect cannot have this strength, or there is no such muscle, or it cannot have the
        effect.

    """
    return Plant(simulation.seed, simulation.effects, simulation.time_constant,
                 simulation.recording, simulation.recording_time, simulation.muscle,
                 simulation.effects_after)


def check_url(url: str) -> None:
    """
    Refuse a URL that makes no sense, before anybody opens it.

    Parameters
    ----------
    url : str
        As given for the parameter ``port``.

    Raises
    ------
    ParameterError
        If the arm, a key, a value, an effect's strength or the muscle is not known.

    """
    make_plant(parse_url(url))


def _number(url: str, key: str, text: str, limits: tuple) -> float:
    low, high = limits
    convert = int if isinstance(low, int) else float
    try:
        value = convert(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise ParameterError(f'port {url}: {key}={text} has to be '
                             f'{"a whole number" if convert is int else "a number"} '
                             f'from {low:g} to {high:g}')
    return value
