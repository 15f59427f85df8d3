# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The full heat and cool cycle that wipes the muscle's hysteresis memory, by voltage alone.

Heated beyond every temperature that it has seen and cooled to ambient, the wire is at negative
saturation: the cold state from which every model starts. The time constant of the wire is "close
to 5 s" (Sec. III), so 30 s of heating and 60 s of cooling are six and twelve of them.
"""

from typing import NamedTuple

from hysteresis_ros.errors import BoardError, ParameterError

STILL_FOR = 5.0         # s without motion that end the cycle
STILL_WITHIN = 0.005    # rad, about six counts of the AMT103
PATIENCE = 3.0          # times the planned duration after which a phase is given up


class Phase(NamedTuple):
    """
    One phase of the cycle: the voltage to apply now, and how far it is.

    Attributes
    ----------
    voltage : float
        Voltage in V to apply.
    done : bool
        Whether the cycle is complete.
    progress : str
        For people.

    """

    voltage: float
    done: bool
    progress: str


class HeatAndCool:
    """
    Heat, cool, and wait until the arm is still. Time comes from the caller.

    Parameters
    ----------
    voltage : float
        Heating voltage in V.
    heat_time, cool_time : float
        How long in s each phase has to be really applied.

    Raises
    ------
    ParameterError
        If a value is not positive.

    """

    def __init__(self, voltage: float, heat_time: float, cool_time: float) -> None:
        if not (voltage > 0.0 and heat_time > 0.0 and cool_time > 0.0):
            raise ParameterError('heat and cool cycle: voltage and both times have to be positive')
        self._voltage = voltage
        self._times = {'heating': heat_time, 'cooling': cool_time}
        self._phase = 'heating'
        self._begun: float | None = None    # time at which the phase began
        self._applied = 0.0         # how long the phase's voltage was really applied
        self._last = 0.0
        self._still_since = (0.0, 0.0)      # (time, angle)

    def update(self, time: float, angle: float, applied: float) -> Phase:
        """
        Take one sample of telemetry.

        Parameters
        ----------
        time : float
            Board time in s.
        angle : float
            Measured angle in rad.
        applied : float
            Voltage in V that the board says it applies.

        Returns
        -------
        Phase

        Raises
        ------
        BoardError
            If the board does not apply the voltage, or the arm does not stop moving.

        """
        if self._begun is None:
            self._begun = self._last = time
            self._still_since = (time, angle)
        wanted = self._voltage if self._phase == 'heating' else 0.0
        if abs(applied - wanted) <= 0.05 * self._voltage:
            self._applied += time - self._last
        self._last = time
        if abs(angle - self._still_since[1]) > STILL_WITHIN:
            self._still_since = (time, angle)
        planned = self._times[self._phase]
        enough = self._applied >= planned
        still = time - self._still_since[0] >= STILL_FOR
        if enough and self._phase == 'heating':
            self._phase, self._begun, self._applied = 'cooling', time, 0.0
        elif enough and still:
            return Phase(0.0, True, 'heated and cooled')
        elif time - self._begun > PATIENCE * planned:
            raise BoardError(
                f'heat and cool cycle: the arm still moves {planned * PATIENCE:g} s after heating '
                'ended; its memory may not be wiped' if enough else
                f'heat and cool cycle: {wanted:g} V asked for, {applied:.3g} V applied while '
                f'{self._phase}; check the supply')
        wanted = self._voltage if self._phase == 'heating' else 0.0
        return Phase(wanted, False, f'{self._phase}, {self._applied:.0f} of '
                     f'{self._times[self._phase]:.0f} s')
