# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What ``sim://bicep?key=value&...`` asks for: speed, seed, faults, and physical effects of the arm.

``avr://bicep?...``, the firmware in simavr on the same arm, takes all but another supply voltage.
There the board has a supply of its own: it goes on while the cable is pulled, and starts anew when
the cable is put back, as an Arduino does.

=============== ===================================================================================
key             meaning
=============== ===================================================================================
speed           how much faster than the wall's clock the arm lives (0.01 to 1000; 1)
seed            which specimen of arm and wire, and all that is random (0)
muscle          constitutive model of the wires: grains, brinson, lagoudas or tanaka (grains)
recording       which recording on that specimen: another one has other noise (0)
recording_time  how long it takes, about, in s, for effects that are slow or rare (900)
effects_after   time in s at which the effects begin (0: from the start)
time_constant   of the wires' heating and cooling in s (0.05 to 100; 5 as in the paper)
supply          supply voltage in V (1 to 60; 12)
drop            share of bytes lost in each direction (0 to 0.5; 0)
garbage         share of bursts of bytes that come with random bytes before them (0 to 1; 0)
flip            share of bytes with one bit wrong in each direction (0 to 0.5; 0)
double          share of bytes that come twice in each direction (0 to 0.5; 0)
brownout        time in s at which the supply breaks down for a moment and the board starts anew
clock_back      time in s at which the board's clock jumps back by a minute
encoder_jump    time in s at which the encoder jumps by two turns and a half
NAME_after      time in s at which a trouble begins
NAME_for        time in s until it ends (never)
=============== ===================================================================================

Troubles, by NAME:

================= =================================================================================
unplug            the cable is pulled, the board's power with it
silent            the board does not send
deaf              the board does not hear
late              bytes come half a second late, in both directions
mad               floods of random bytes, in both directions, instead of what was said
frozen            the board sends its last telemetry again and again
encoder_still     the encoder's counts stand still
encoder_reversed  they run the other way
index_missing     its index pulse does not come
supply_low        the supply has 0.6 of its voltage
supply_off        the supply has none
supply_double     the supply has twice its voltage
stop              the emergency stop is pressed
mosfet_stuck      a MOSFET conducts all the time, whatever its gate gets
================= =================================================================================

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
CHIP = 'avr'                # the firmware in simavr on the same arm
ARM = 'bicep'

TROUBLES = ('unplug', 'silent', 'deaf', 'late', 'mad', 'frozen', 'encoder_still',
            'encoder_reversed', 'index_missing', 'supply_low', 'supply_off', 'supply_double',
            'stop', 'mosfet_stuck')

_RANGES = {
    'speed': (0.01, 1000.0), 'seed': (0, 2 ** 31 - 1), 'recording': (0, 2 ** 31 - 1),
    'recording_time': (1.0, 1e7), 'effects_after': (0.0, math.inf),
    'time_constant': (0.05, 100.0), 'supply': (1.0, 60.0),
    'drop': (0.0, 0.5), 'flip': (0.0, 0.5), 'double': (0.0, 0.5), 'garbage': (0.0, 1.0),
    **dict.fromkeys(('brownout', 'clock_back', 'encoder_jump'), (0.0, math.inf))}
_TIMES = (0.0, math.inf)
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
    flip: float = 0.0
    double: float = 0.0
    garbage: float = 0.0
    brownout: float = math.inf
    clock_back: float = math.inf
    encoder_jump: float = math.inf
    # (time in s at which it begins, time in s until it ends), by the trouble's name.
    troubles: dict = dataclasses.field(default_factory=dict)
    effects: dict = dataclasses.field(default_factory=dict)
    muscle: str = 'grains'
    effects_after: float = 0.0

    def lasts(self, trouble: str, time: float) -> bool:
        """Return whether a trouble is there at a time in s."""
        begin, duration = self.troubles.get(trouble, (math.inf, 0.0))
        return bool(0.0 <= time - begin < duration)


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
    chip = parts.scheme.lower() == CHIP
    if (parts.scheme.lower() not in (SCHEME, CHIP) or parts.netloc.lower() != ARM
            or parts.path not in ('', '/')):
        raise ParameterError(
            f'port {url}: the simulated board is {CHIP if chip else SCHEME}://{ARM}')
    values: dict[str, Any] = {}
    effects: dict[str, float] = {}
    troubles: dict[str, tuple[float, float]] = {}
    given = set()
    for key, text in parse_qsl(parts.query, keep_blank_values=True):
        if key in given:
            raise ParameterError(f'port {url}: {key} is given twice')
        given.add(key)
        if chip and key == 'supply':
            raise ParameterError(f'port {url}: {CHIP}:// has a supply of 12 V')
        trouble, _, end = key.rpartition('_')
        if trouble in TROUBLES and end in ('after', 'for'):
            begin, duration = troubles.get(trouble, (math.inf, math.inf))
            time = _number(url, key, text, _TIMES)
            troubles[trouble] = (time, duration) if end == 'after' else (begin, time)
        elif key == 'muscle':
            values[key] = text
        elif key in _RANGES:
            values[key] = _number(url, key, text, _RANGES[key])
        elif key in EFFECTS:
            effects[key] = _number(url, key, text, _STRENGTHS)
        else:
            raise ParameterError(
                f'port {url}: there is no {key!r}; keys are {", ".join(_RANGES)}, muscle, '
                f'NAME_after and NAME_for with a NAME of {", ".join(TROUBLES)}, '
                'and the effects that `hysteresis effects` lists')
    return Simulation(**values, effects=effects, troubles=troubles)


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
