# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The board's side of the protocol, on an arm that exists only in the virtual laboratory.

This is what a microcontroller's program has to do, written in Python: `docs/protocol.md` refers to
it as the reference. Bytes go in by `receive` and come out by `transmit`; time passes by `advance`
and by nothing else, in whole ticks, so that the same bytes at the same ticks always give the same
answer.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import TYPE_CHECKING

from hysteresis_ros.bridge.messages import (
    BOARD, CONFIG, DISABLE, ENABLE, HELLO, Identity, NO, OK, SET, Telemetry, TELEMETRY, TIME_LIMIT,
    ZERO)
from hysteresis_ros.bridge.protocol import (
    BadLine, decimal, Decoder, encode, Fields, Frame, integer, SEQUENCE_LIMIT, VERSION)
from hysteresis_ros.errors import ProtocolError
from hysteresis_ros.laboratory.board.encoder_troubles import (
    COUNTS_PER_REVOLUTION, EncoderTroubles, INDEX_COUNTS)
from hysteresis_ros.laboratory.board.power import PowerLimit, WINDOW

if TYPE_CHECKING:
    from hysteresis_ros.laboratory.arm import Arm

TICK = 20                   # ms; dt of the arm and of the firmware's loop
PERIOD = 100                # ms between two frames of telemetry, until `config` says otherwise
WATCHDOG = 1000             # ms without a setpoint that switch the output off, likewise
AMBIENT_PERIOD = 1000       # ms between two measurements of the ambient temperature
REMARK_PERIOD = 200         # ms between two explanations for people
LOWEST_SUPPLY = 4.0         # V below which the output is off
PWM_STEPS = 65535
SUPPLY_NOISE = 0.01         # V, standard deviation of the supply's measurement

CLOCK_JUMP = 60000          # ms by which a clock jumps back
# Share of the nominal supply in each trouble of it.
SUPPLY_TROUBLES = {'supply_low': 0.6, 'supply_off': 0.0, 'supply_double': 2.0}

BROWNOUT_TIME = 300         # ms that a brownout takes; then the board starts anew
BROWNOUT_SUPPLY = 0.2       # share of the nominal supply during it


class SimulatedBoard:
    """
    Firmware, output stage and encoder counter of a board with an arm on it.

    Parameters
    ----------
    arm : object
        The physics: ``advance(dt, voltage)`` with dt in s and the heating (RMS) voltage in V;
        attributes ``encoder_counts`` and ``ambient_temperature`` in degC.
    supply : float
        Supply voltage in V.
    seed : int
        Of the noise of the supply's measurement.
    speed : float
        How much faster than the wall's clock somebody lets time pass here; only told to the host.
    brownout : float, optional
        Time in s at which the supply breaks down for a moment and the board starts anew.
    clock_back : float, optional
        Time in s at which the board's clock jumps back by `CLOCK_JUMP`.
    encoder_jump : float, optional
        Time in s at which the encoder jumps by two turns and a half.
    battery : callable
        Returns the share of the supply voltage that there is now.

    Attributes
    ----------
    arm : object
        The arm.
    troubled : callable
        Whether a trouble is there now, by its name; see `hysteresis_ros.laboratory.board.url`.
    duty, enabled, faults
        As in the telemetry.
    time : int
        The board's clock in ms since it last started, not wrapped.
    next_telemetry : int
        When, by that clock, the next telemetry is sent.

    """

    def __init__(self, arm: Arm, supply: float = 12.0, seed: int = 0, speed: float = 1.0,
                 brownout: float = math.inf, clock_back: float = math.inf,
                 encoder_jump: float = math.inf, battery: Callable[[], float] = lambda: 1.0
                 ) -> None:
        self.arm = arm
        self.troubled: Callable[[str], bool] = lambda name: False
        self._clock_back = 1000.0 * clock_back
        self._encoder = EncoderTroubles(encoder_jump)
        self._nominal_supply, self._battery = supply, battery
        self._random = random.Random(seed)
        self._speed = speed
        self._brownout = 1000.0 * brownout
        self._world_time = 0        # ms since the simulation began
        self._boot = 0
        self._outgoing = bytearray()
        self._handlers = {HELLO: self._on_hello, CONFIG: self._on_config, SET: self._on_set,
                          ENABLE: self._on_enable, DISABLE: self._on_disable, ZERO: self._on_zero}
        self.start()

    def start(self) -> None:
        """Start the firmware anew, as after a loss of power."""
        self._boot += 1
        self.time = 0
        self.duty = 0.0
        self.enabled = False
        self.faults: set[str] = set()
        self._power = PowerLimit()
        self._decoder = Decoder()
        self._sequence = 0
        self._period = PERIOD
        self._watchdog = WATCHDOG
        self.next_telemetry = PERIOD
        self._next_ambient = 0
        self._next_remark = 0
        self._last_set = 0
        self._accepted: int | None = None
        self._obeyed = 0
        self._counter_zero = self._last_counts = self._encoder_counts()
        if self._boot == 1:
            self._counter_zero = 0      # the encoder was set to zero when the arm was built
        self._index = 0
        self._latch: int | None = None
        self._last_telemetry: Fields | None = None
        self._remark(f'simulated PWM board, protocol {VERSION}; say "hello 1*'
                     + encode(HELLO, 1).decode('ascii').strip().partition('*')[2] + '"')

    @property
    def supply(self) -> float:
        """Supply voltage in V now."""
        low = 0.0 <= self._world_time - self._brownout < BROWNOUT_TIME
        share = BROWNOUT_SUPPLY if low else 1.0
        for trouble, its_share in SUPPLY_TROUBLES.items():
            share *= its_share if self.troubled(trouble) else 1.0
        return self._nominal_supply * self._battery() * share

    def receive(self, data: bytes) -> None:
        """
        Take bytes from the host.

        Parameters
        ----------
        data : bytes
            Any bytes at all.

        """
        for line in self._decoder.feed(data):
            if isinstance(line, Frame):
                self._obey(line)
            elif isinstance(line, BadLine):
                self._explain(line)

    def transmit(self) -> bytes:
        """
        Give the bytes that go to the host.

        Returns
        -------
        bytes
            All that was written since the last call.

        """
        data = bytes(self._outgoing)
        self._outgoing.clear()
        return data

    def advance(self, ticks: int = 1) -> None:
        """
        Let time pass.

        Parameters
        ----------
        ticks : int
            How many times `TICK` ms pass.

        """
        for _ in range(ticks):
            self._look_at_stop()
            self._look_at_supply()
            duty = 1.0 if self.troubled('mosfet_stuck') else self.duty
            self.arm.advance(TICK / 1000.0, self.supply * math.sqrt(duty))
            self._world_time += TICK
            self.time += TICK
            if 0.0 <= self._world_time - self._clock_back < TICK:
                self._jump_back()
            self._count()
            self._look_at_power()
            if 0.0 <= self._world_time - self._brownout - BROWNOUT_TIME < TICK:
                self.start()
            if self.time - self._last_set > self._watchdog and self.enabled:
                self.duty = 0.0
                self.faults.add('watchdog')
            if self.time >= self.next_telemetry:
                self.next_telemetry += self._period
                self._send_telemetry()

    def idle(self, ticks: int) -> None:
        """
        Let time pass for the arm while the board has no power.

        Parameters
        ----------
        ticks : int
            How many times `TICK` ms pass.

        """
        for _ in range(ticks):
            self.arm.advance(TICK / 1000.0, 0.0)
            self._world_time += TICK

    def _jump_back(self) -> None:
        """Set the clock back; what the firmware measures by differences of it goes on."""
        self.time -= CLOCK_JUMP
        self.next_telemetry -= CLOCK_JUMP
        self._next_ambient -= CLOCK_JUMP
        self._next_remark -= CLOCK_JUMP
        self._last_set -= CLOCK_JUMP

    def _encoder_counts(self) -> int:
        """Return the counts of the encoder with its troubles."""
        return self._encoder.counts(self.arm.encoder_counts, self._world_time / 1000.0,
                                    self.troubled)

    def _look_at_stop(self) -> None:
        if self.troubled('stop'):
            self._shut_down('stop')

    def _look_at_power(self) -> None:
        self._power.add(self.duty, self.supply, TICK)
        if self._power.exceeded:
            self._shut_down('power')

    def _shut_down(self, fault: str) -> None:
        """Switch off; nothing is enabled before somebody disables, and the reason is gone."""
        self.duty = 0.0
        self.enabled = False
        self.faults.add(fault)

    def _look_at_supply(self) -> None:
        if self.supply < LOWEST_SUPPLY:
            self.duty = 0.0
            self.faults.add('supply')
        else:
            self.faults.discard('supply')

    def _count(self) -> None:
        """Watch the encoder for its index pulse, as the counter's hardware does."""
        counts = self._encoder_counts()
        before = (self._last_counts - INDEX_COUNTS) // COUNTS_PER_REVOLUTION
        now = (counts - INDEX_COUNTS) // COUNTS_PER_REVOLUTION
        self._last_counts = counts
        if now != before and not self.troubled('index_missing'):
            self._index = (self._index + 1) % SEQUENCE_LIMIT
            self._latch = (max(now, before) * COUNTS_PER_REVOLUTION + INDEX_COUNTS
                           - self._counter_zero)

    def _send_telemetry(self) -> None:
        if self._last_telemetry is not None and self.troubled('frozen'):
            self._send(TELEMETRY, self._last_telemetry)
            return
        ambient = None
        if self.time >= self._next_ambient:
            self._next_ambient = self.time + AMBIENT_PERIOD
            ambient = self.arm.ambient_temperature
        self._last_telemetry = Telemetry(
            time=self.time % TIME_LIMIT, counts=self._encoder_counts() - self._counter_zero,
            supply=max(self.supply + self._random.gauss(0.0, SUPPLY_NOISE), 0.0), duty=self.duty,
            enabled=self.enabled, faults=tuple(sorted(self.faults)), index=self._index,
            latch=self._latch, ambient=ambient, accepted=self._accepted,
            obeyed=self._obeyed).fields()
        self._send(TELEMETRY, self._last_telemetry)

    def _send(self, kind: str, fields: Fields) -> None:
        self._outgoing += encode(kind, self._sequence, fields)
        self._sequence = (self._sequence + 1) % SEQUENCE_LIMIT

    def _remark(self, text: str) -> None:
        self._outgoing += f'# {text}\n'.encode('ascii', 'backslashreplace')

    def _explain(self, line: BadLine) -> None:
        """Tell a person what was wrong with a line; a broken cable must not flood the host."""
        if self.time < self._next_remark:
            return
        self._next_remark = self.time + REMARK_PERIOD
        hint = f'; its CRC would be *{line.checksum}' if line.checksum else ''
        self._remark(f'nothing done, {line.reason}{hint}: {line.text}')

    def _obey(self, frame: Frame) -> None:
        handler = self._handlers.get(frame.kind)
        try:
            refusal = handler(frame) if handler else 'unknown_command'
        except ProtocolError:
            refusal = 'field_missing_or_no_number'
        if refusal:
            self._send(NO, {'re': frame.sequence, 'reason': refusal})
        elif frame.kind not in (HELLO, SET):
            self._send(OK, {'re': frame.sequence})

    def _on_hello(self, frame: Frame) -> None:
        self._send(BOARD, Identity(VERSION, 'simulated', '1', self._boot,
                                   self.time % TIME_LIMIT, 32, self._speed).fields())

    def _on_config(self, frame: Frame) -> str | None:
        period, watchdog = integer(frame, 'period'), integer(frame, 'watchdog')
        rms = decimal(frame, 'rms', math.inf)
        window = integer(frame, 'rms_window', WINDOW)
        if period < 1 or watchdog < 1 or rms <= 0.0 or window < 1:
            return 'out_of_range'
        self._power.set(rms, window)
        before, self._period = self._period, -(-period // TICK) * TICK
        self._watchdog = watchdog
        if self._period != before:      # a host that says it again keeps nothing from coming
            self.next_telemetry = self.time + self._period
        return None

    def _on_enable(self, frame: Frame) -> str | None:
        for fault in ('stop', 'power'):
            if fault in self.faults:
                return fault
        if not self.enabled:
            self.duty = 0.0
            self.enabled = True
            self._last_set = self.time
        return None

    def _on_disable(self, frame: Frame) -> None:
        self.duty = 0.0
        self.enabled = False
        self.faults.discard('watchdog')
        if not self.troubled('stop'):
            self.faults.discard('stop')
        if not self._power.exceeded:
            self.faults.discard('power')

    def _on_zero(self, frame: Frame) -> None:
        self._counter_zero = self._encoder_counts()
        self._index = 0
        self._latch = None

    def _on_set(self, frame: Frame) -> str | None:
        duty = decimal(frame, 'duty')
        if not 0.0 <= duty <= 1.0:
            return 'out_of_range'
        if not self.enabled:
            return 'disabled'
        if 'supply' in self.faults:
            return 'supply'
        self.duty = round(duty * PWM_STEPS) / PWM_STEPS
        self.faults.discard('watchdog')
        self._last_set = self.time
        self._accepted = frame.sequence
        self._obeyed = (self._obeyed + 1) % SEQUENCE_LIMIT
        return None
