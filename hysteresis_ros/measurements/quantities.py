# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the columns of a measurement are called, their units, and values that look wrong."""

from typing import NamedTuple

DRIVES = ('voltage', 'temperature', 'pressure', 'current', 'power')
LOADS = ('force', 'stress')
RESPONSES = ('angle', 'length', 'strain', 'force')


class Quantity(NamedTuple):
    """
    A physical quantity in SI units (temperatures in degrees Celsius).

    Attributes
    ----------
    unit : str
        Unit of the values in files.
    shown_unit, shown_scale : str, float
        Unit for people, and the factor from the file's unit to it.
    least, most : float
        The largest absolute value of a whole recording is expected between these; outside,
        another unit is likely. They are wide: they catch units, not unusual hardware.
    meaning : str
        What it is, in a few words.

    """

    unit: str
    shown_unit: str
    shown_scale: float
    least: float
    most: float
    meaning: str


QUANTITIES = {
    'voltage': Quantity('V', 'V', 1.0, 0.05, 500.0, 'applied to the muscle'),
    'supply_voltage': Quantity('V', 'V', 1.0, 0.05, 500.0, 'of the supply'),
    'temperature': Quantity('degC', '°C', 1.0, 0.5, 2000.0, 'of the muscle, as its drive'),
    'ambient_temperature': Quantity('degC', '°C', 1.0, 0.0, 150.0, 'of the air around the muscle'),
    'pressure': Quantity('Pa', 'kPa', 1e-3, 1e3, 1e8, 'in the muscle, as its drive'),
    'current': Quantity('A', 'A', 1.0, 1e-3, 500.0, 'through the muscle, as its drive'),
    'power': Quantity('W', 'W', 1.0, 1e-3, 2e4, 'into the muscle, as its drive'),
    'force': Quantity('N', 'N', 1.0, 0.05, 1000.0, 'pulling at the muscle'),
    'stress': Quantity('Pa', 'MPa', 1e-6, 5e4, 5e9, 'pull over the cross-section'),
    'length': Quantity('m', 'mm', 1e3, 1e-8, 1.0, 'less the resting length: longer is positive'),
    'strain': Quantity('', '%', 100.0, 1e-7, 1.0, 'elongation over resting length'),
    'angle': Quantity('rad', 'deg', 57.29577951308232, 1e-5, 6.6,
                      'between forearm and upward vertical'),
    'time': Quantity('s', 's', 1.0, 0.0, float('inf'), 'since the trial began'),
}


def shown(name: str) -> tuple[str, float]:
    """
    Return the unit for people and the factor to it.

    Parameters
    ----------
    name : str
        Name of a quantity; unknown ones have no unit and factor 1.

    Returns
    -------
    unit : str
    scale : float

    """
    quantity = QUANTITIES.get(name)
    return (quantity.shown_unit, quantity.shown_scale) if quantity else ('', 1.0)
