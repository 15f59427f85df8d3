# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Units that a column may be written in, and how each becomes the unit of files."""

import math
from typing import NamedTuple

import numpy as np

from hysteresis_ros.measurements.quantities import QUANTITIES


class Unit(NamedTuple):
    """A unit of a quantity: value in the unit of files = factor * value + offset."""

    factor: float
    offset: float = 0.0

    def convert(self, values: np.ndarray) -> np.ndarray:
        """Return values (rows,) in the unit of files."""
        if self == SAME:
            return values
        return self.factor * values + self.offset


SAME = Unit(1.0)
VOLTAGES = {'V': SAME, 'mV': Unit(1e-3), 'kV': Unit(1e3)}
TEMPERATURES = {'degC': SAME, '°C': SAME, 'C': SAME, 'K': Unit(1.0, -273.15),
                'degF': Unit(5 / 9, -160 / 9), '°F': Unit(5 / 9, -160 / 9)}
PRESSURES = {'Pa': SAME, 'kPa': Unit(1e3), 'bar': Unit(1e5), 'MPa': Unit(1e6), 'hPa': Unit(1e2),
             'mbar': Unit(1e2), 'psi': Unit(6894.757293168)}
STRESSES = {'Pa': SAME, 'MPa': Unit(1e6), 'kPa': Unit(1e3), 'GPa': Unit(1e9)}
RATIOS = {'1': SAME, '-': SAME, '': SAME}
UNITS: dict[str, dict[str, Unit]] = {
    'voltage': VOLTAGES,
    'supply_voltage': VOLTAGES,
    'temperature': TEMPERATURES,
    'ambient_temperature': TEMPERATURES,
    'pressure': PRESSURES,
    'current': {'A': SAME, 'mA': Unit(1e-3), 'uA': Unit(1e-6)},
    'power': {'W': SAME, 'mW': Unit(1e-3), 'kW': Unit(1e3)},
    'force': {'N': SAME, 'mN': Unit(1e-3), 'kN': Unit(1e3), 'gf': Unit(9.80665e-3),
              'kgf': Unit(9.80665)},
    'stress': STRESSES,
    'length': {'m': SAME, 'mm': Unit(1e-3), 'cm': Unit(1e-2), 'um': Unit(1e-6),
               'µm': Unit(1e-6), 'nm': Unit(1e-9)},
    'strain': {**RATIOS, '%': Unit(1e-2), 'percent': Unit(1e-2)},
    'angle': {'rad': SAME, 'deg': Unit(math.pi / 180), '°': Unit(math.pi / 180),
              'degrees': Unit(math.pi / 180), 'mrad': Unit(1e-3)},
    'time': {'s': SAME, 'ms': Unit(1e-3), 'us': Unit(1e-6), 'ns': Unit(1e-9),
             'min': Unit(60.0), 'h': Unit(3600.0)},
    'trial': RATIOS,
    'step': RATIOS,
}
"""By quantity the units that are understood: that of files first, then the likeliest."""


def unit_names(name: str) -> str:
    """Return the units of a quantity for a message."""
    return ', '.join(unit for unit in UNITS[name] if unit)


def likely_unit(name: str, largest: float) -> str:
    """
    Return the unit that makes the largest value of a column a usual one, '' if none does.

    Parameters
    ----------
    name : str
        A quantity.
    largest : float
        Largest absolute value as it stands in the file.

    """
    quantity = QUANTITIES[name]
    for unit, conversion in UNITS[name].items():
        value = abs(conversion.factor * largest + conversion.offset)
        if conversion != SAME and quantity.least <= value <= quantity.most:
            return unit
    return ''
