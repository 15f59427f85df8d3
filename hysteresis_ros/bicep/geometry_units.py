# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Units of an arm's geometry: values written with a unit, and values impossible without one."""

from collections.abc import Mapping
import re
from typing import Any, NamedTuple

from hysteresis_ros.errors import ParameterError

LENGTHS = {'m': 1.0, 'mm': 1e-3, 'cm': 1e-2}
MASSES = {'kg': 1.0, 'g': 1e-3}
ACCELERATIONS = {'m/s^2': 1.0, 'mm/s^2': 1e-3, 'cm/s^2': 1e-2}
WITH_UNIT = re.compile(r'\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([a-z^/2]+)\s*')


class Limits(NamedTuple):
    """Units of a value, that of files first, and between which values an arm can have it."""

    units: dict[str, float]
    least: float
    most: float


LIMITS = {
    'clamp_distance': Limits(LENGTHS, 5e-4, 1.0), 'clamp_height': Limits(LENGTHS, 1e-4, 1.0),
    'anchor_height': Limits(LENGTHS, 5e-3, 5.0), 'forearm_length': Limits(LENGTHS, 5e-3, 5.0),
    'resting_length': Limits(LENGTHS, 5e-3, 5.0), 'payload_mass': Limits(MASSES, 1e-3, 15.0),
    'forearm_mass': Limits(MASSES, 5e-4, 15.0), 'gravity': Limits(ACCELERATIONS, 0.1, 100.0)}
"""Wide: they catch units, not unusual arms. 0 is allowed where the geometry allows it."""


def in_si(mapping: Mapping[str, Any]) -> dict[str, Any]:
    """
    Convert what is written with a unit, such as `17 mm`, and refuse what another unit explains.

    Parameters
    ----------
    mapping : mapping of str to number or str
        Values by their names; what is no number is left to other checks.

    Returns
    -------
    dict
        In m, kg and m/s^2.

    Raises
    ------
    ParameterError
        If a unit is not known, or values are impossible in theirs; the message names the unit
        that is probably meant and how to write it. A unit that is written confirms a value.

    """
    converted, problems = dict(mapping), []
    for name, limits in LIMITS.items():
        value = mapping.get(name)
        written = WITH_UNIT.fullmatch(value) if isinstance(value, str) else None
        if written and written[2] in limits.units:
            converted[name] = float(written[1]) * limits.units[written[2]]
        elif written:
            problems.append(f'{name}: {written[2]!r} is none of {", ".join(limits.units)}')
        elif isinstance(value, (int, float)) and value > 0 and not (
                limits.least <= value <= limits.most):
            problems.append(impossible(name, value, limits))
    if problems:
        raise ParameterError('geometry: ' + '; '.join(problems))
    return converted


def impossible(name: str, value: float, limits: Limits) -> str:
    """Say which unit explains a value, and how to write it."""
    own = next(iter(limits.units))
    likely = [unit for unit, factor in limits.units.items()
              if limits.least <= factor * value <= limits.most]
    if likely:
        return (f'{name} is {value:g} {own}, which is impossible; is it in {likely[0]}? Write '
                f'"{name}: {value:g} {likely[0]}"')
    return (f'{name} is {value:g} {own}, which is impossible; is it in another unit? An arm has '
            f'{limits.least:g} to {limits.most:g} {own}; "{name}: {value:g} {own}" confirms it')
