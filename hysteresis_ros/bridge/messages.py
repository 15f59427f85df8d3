# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What host and board say to each other: the kinds of frames and their fields.

The host asks with ``hello``, ``config``, ``enable``, ``disable``, ``zero`` and ``set``; the board
answers ``board``, ``ok`` or ``no`` and sends ``tele`` on its own. `docs/protocol.md` explains
each; here they are read and written.
"""

from typing import NamedTuple

from hysteresis_ros.bridge.protocol import decimal, Frame, integer, write_number
from hysteresis_ros.errors import ProtocolError

HELLO = 'hello'
CONFIG = 'config'
ENABLE = 'enable'
DISABLE = 'disable'
ZERO = 'zero'
SET = 'set'

BOARD = 'board'
OK = 'ok'
NO = 'no'
TELEMETRY = 'tele'

TIME_LIMIT = 1 << 32
NO_FAULTS = 'none'

FAULTS = {
    'watchdog': 'no setpoint came in time, the output is off until the next one',
    'supply': 'the supply voltage is too low, the output is off',
    'current': 'the current is too high, the output is off',
    'encoder': 'the encoder is not connected',
    'stop': 'the emergency stop was pressed, the board has switched off',
    'power': 'the RMS of the voltage was above what the board allows, it has switched off',
    'counts_lost': 'the encoder turned faster than the board can count, the angle may be off; '
                   'check it and set the counter to zero',
}

# With these the board is disabled, and stays so until `disable` has come and their reason is gone.
LATCHED = ('stop', 'power')


class Identity(NamedTuple):
    """
    A board's answer to ``hello``.

    Attributes
    ----------
    protocol : int
        Version of the protocol that it speaks.
    name, firmware : str
        What it is.
    boot : int
        A number that is another one each time the board starts.
    time : int
        Its clock, ms since it started, modulo 2**32.
    counter_bits : int
        Width of its encoder counter, 16 or 32.
    speed : float
        How fast its clock runs against the wall's: 1 for a real board.

    """

    protocol: int
    name: str
    firmware: str
    boot: int
    time: int
    counter_bits: int
    speed: float

    def fields(self) -> dict[str, str | int | float]:
        """
        Return the fields of the frame.

        Returns
        -------
        dict of str to str or int or float

        """
        fields = self._asdict()
        fields['bits'] = fields.pop('counter_bits')
        return fields

    @classmethod
    def from_frame(cls, frame: Frame) -> 'Identity':
        """
        Read a ``board`` frame.

        Parameters
        ----------
        frame : Frame
            As decoded.

        Returns
        -------
        Identity

        Raises
        ------
        ProtocolError
            If a field is missing or makes no sense.

        """
        identity = cls(integer(frame, 'protocol'), frame.fields.get('name', 'unnamed'),
                       frame.fields.get('firmware', 'unknown'), integer(frame, 'boot'),
                       integer(frame, 'time'),
                       integer(frame, 'bits', 32), decimal(frame, 'speed', 1.0))
        if identity.counter_bits not in (16, 32) or identity.speed <= 0:
            raise ProtocolError('the board says that its counter has '
                                f'{identity.counter_bits} bits and its clock runs at '
                                f'{identity.speed} times real time: 16 or 32 bits and a '
                                'positive speed are possible')
        return identity


class Telemetry(NamedTuple):
    """
    What the board measures and does, sent once a period.

    Attributes
    ----------
    time : int
        The board's clock, ms since it started, modulo 2**32.
    counts : int
        Its quadrature counter.
    supply : float
        Measured supply voltage in V.
    duty : float
        Duty that it applies now, 0 to 1.
    enabled : bool
        Whether it accepts setpoints.
    faults : tuple of str
        Names, see `FAULTS`; other names are passed on.
    index : int
        How many index pulses it has seen, modulo 65536.
    latch : int or None
        The counter at the latest index pulse; None before the first.
    ambient : float or None
        Ambient temperature in degC, in the frames in which it is sent.
    accepted : int or None
        Sequence number of the latest setpoint that it obeyed.
    obeyed : int or None
        How many setpoints it has obeyed since it started, modulo 65536.

    """

    time: int
    counts: int
    supply: float
    duty: float
    enabled: bool
    faults: tuple = ()
    index: int = 0      # type: ignore[assignment]  # a tuple's method that nobody calls here
    latch: 'int | None' = None
    ambient: 'float | None' = None
    accepted: 'int | None' = None
    obeyed: 'int | None' = None

    def fields(self) -> dict[str, str | int | float]:
        """
        Return the fields of the frame.

        Returns
        -------
        dict of str to str or int or float

        """
        fields: dict[str, str | int | float] = {
            'time': self.time, 'counts': self.counts, 'index': self.index}
        if self.latch is not None:
            fields['latch'] = self.latch
        fields.update(supply=write_number(self.supply, 3), duty=self.duty, on=self.enabled)
        if self.accepted is not None:
            fields['accepted'] = self.accepted
        if self.obeyed is not None:
            fields['obeyed'] = self.obeyed
        fields['faults'] = ','.join(self.faults) or NO_FAULTS
        if self.ambient is not None:
            fields['ambient'] = write_number(self.ambient, 2)
        return fields

    @classmethod
    def from_frame(cls, frame: Frame) -> 'Telemetry':
        """
        Read a ``tele`` frame.

        Parameters
        ----------
        frame : Frame
            As decoded.

        Returns
        -------
        Telemetry

        Raises
        ------
        ProtocolError
            If a field is missing or makes no sense.

        """
        faults = frame.fields.get('faults', NO_FAULTS)
        has = frame.fields.__contains__
        supply, duty = decimal(frame, 'supply'), decimal(frame, 'duty')
        if supply < 0.0 or not 0.0 <= duty <= 1.0:
            raise ProtocolError(f'the board says that its supply is {supply:g} V and its duty '
                                f'{duty:g}: no board can')
        return cls(
            time=integer(frame, 'time'), counts=integer(frame, 'counts'), supply=supply, duty=duty,
            enabled=integer(frame, 'on') != 0,
            faults=() if faults == NO_FAULTS else tuple(faults.split(',')),
            index=integer(frame, 'index', 0),
            latch=integer(frame, 'latch') if has('latch') else None,
            ambient=decimal(frame, 'ambient') if has('ambient') else None,
            accepted=integer(frame, 'accepted') if has('accepted') else None,
            obeyed=integer(frame, 'obeyed') if has('obeyed') else None)
