# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Duty of the pulse width modulation that stands for a voltage, and back.

A wire is heated by the mean of the voltage squared (Eq. 1 of the paper: d2 V^2). Pulses of the
supply voltage Vs with duty D have the mean square D Vs^2, so the constant voltage V that heats as
much is V = Vs sqrt(D), and

    D = (V / Vs)^2                                  law 'rms', the default

A load that follows the mean of the voltage, or a board that smooths its output with a filter,
needs D = V / Vs instead: law 'mean'.
"""

import dataclasses
import math
from typing import NamedTuple

from hysteresis_ros.errors import ParameterError, RangeError

LAWS = ('rms', 'mean')


class Drive(NamedTuple):
    """
    What to command for a voltage.

    Attributes
    ----------
    duty : float
        0 to 1, always finite.
    voltage : float
        Voltage in V that this duty stands for.
    limit : str
        Why `voltage` is less than what was asked, or ''.

    """

    duty: float
    voltage: float
    limit: str


@dataclasses.dataclass(frozen=True)
class Pwm:
    """
    Law and limits between voltage and duty.

    Parameters
    ----------
    law : str
        'rms' or 'mean'.
    minimum_voltage, maximum_voltage : float
        Voltages in V that may be asked for. Off, which is duty 0, is always possible.
    maximum_duty : float
        Largest duty, above 0 and at most 1.

    Raises
    ------
    ParameterError
        If a value makes no sense.

    """

    law: str = 'rms'
    minimum_voltage: float = 0.0
    maximum_voltage: float = 6.0
    maximum_duty: float = 1.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.law not in LAWS:
            raise ParameterError(f'pwm_law {self.law!r}: use one of {", ".join(LAWS)}')
        if not 0.0 <= self.minimum_voltage < self.maximum_voltage < math.inf:
            raise ParameterError(
                f'voltage limits {self.minimum_voltage:g} to {self.maximum_voltage:g} V: the '
                'smaller has to be at least 0 and below the larger')
        if not 0.0 < self.maximum_duty <= 1.0:
            raise ParameterError(f'maximum_duty {self.maximum_duty:g}: above 0 and at most 1')

    def check(self, voltage: float) -> None:
        """
        Refuse a voltage that must never reach the board.

        Parameters
        ----------
        voltage : float
            Voltage in V that somebody asks for.

        Raises
        ------
        RangeError
            If it is not finite or outside the limits.

        """
        if not math.isfinite(voltage):
            raise RangeError(f'voltage setpoint is {voltage}: refused, it has to be a number')
        if not self.minimum_voltage - 1e-9 <= voltage <= self.maximum_voltage + 1e-9:
            raise RangeError(f'voltage setpoint {voltage:g} V refused: the limits are '
                             f'{self.minimum_voltage:g} to {self.maximum_voltage:g} V')

    def drive(self, voltage: float, supply: float) -> Drive:
        """
        Find the duty for a voltage.

        Parameters
        ----------
        voltage : float
            Voltage in V within the limits, or 0 for off.
        supply : float
            Measured supply voltage in V.

        Returns
        -------
        Drive
            Duty 0 with the reason if there is no usable supply; the largest duty with the reason
            if the supply is too low for the voltage.

        Raises
        ------
        RangeError
            As `check`.

        """
        if voltage == 0.0:
            return Drive(0.0, 0.0, '')
        self.check(voltage)
        if not (math.isfinite(supply) and supply > 0.0):
            return Drive(0.0, 0.0, f'there is no supply voltage (measured: {supply:g} V)')
        ratio = max(voltage, 0.0) / supply
        duty = ratio * ratio if self.law == 'rms' else ratio
        if duty <= self.maximum_duty:
            return Drive(duty, max(voltage, 0.0), '')
        reachable = self.voltage(self.maximum_duty, supply)
        return Drive(self.maximum_duty, reachable,
                     f'{voltage:g} V asked, but a supply of {supply:.3g} V with duty '
                     f'{self.maximum_duty:g} gives {reachable:.3g} V')

    def rms(self, voltage: float, supply: float) -> float:
        """
        Find the RMS over the wires of pulses that stand for a voltage.

        Parameters
        ----------
        voltage : float
            Voltage in V; or the RMS of one that changes, and then this is the largest possible.
        supply : float
            Supply voltage in V.

        Returns
        -------
        float
            RMS in V.

        """
        return voltage if self.law == 'rms' else math.sqrt(voltage * supply)

    def voltage(self, duty: float, supply: float) -> float:
        """
        Find the voltage that a duty stands for.

        Parameters
        ----------
        duty : float
            0 to 1.
        supply : float
            Supply voltage in V, at least 0.

        Returns
        -------
        float
            Voltage in V.

        """
        return supply * (math.sqrt(duty) if self.law == 'rms' else duty)
