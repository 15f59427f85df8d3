# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The host's side of the board: volts in, angles out, whatever happens to the cable.

`Board` keeps two threads. One opens the port, greets the board, reads telemetry, and starts over
when the board is lost; the other writes setpoints, the latest one only, and repeats it so that the
board's watchdog knows that the host lives. Nobody who calls `Board` ever waits for the port.

Two watchdogs cut the muscle off. The host's: no `Board.set_voltage` within ``timeouts.setpoint``,
and 0 is sent. The board's: no setpoint within ``timeouts.watchdog``, and it stops on its own.

What must not be heated again by a program that knows nothing of it switches the output off for
good, until `Board.clear_fault` and `Board.enable`: a board that was lost or started anew, an angle
in doubt, and whatever `Protection` or the board's own duty shows. `Status.fault` says what it was.
"""

from __future__ import annotations

from collections.abc import Callable
import threading
import time
from typing import TYPE_CHECKING

from hysteresis_ros.bridge.board_clock import BoardClock
from hysteresis_ros.bridge.board_config import BoardConfig
from hysteresis_ros.bridge.board_link import BoardLink, READ_TIMEOUT, Timeouts
from hysteresis_ros.bridge.board_state import Sample, Status
from hysteresis_ros.bridge.encoder import Encoder
from hysteresis_ros.bridge.messages import (
    CONFIG, DISABLE, ENABLE, FAULTS, Identity, LATCHED, NO, OK, SET, Telemetry, TELEMETRY)
from hysteresis_ros.bridge.other_master import OtherMaster
from hysteresis_ros.bridge.protection import Protection
from hysteresis_ros.bridge.pwm import Pwm
from hysteresis_ros.errors import BoardError, HysteresisError, ProtocolError, RangeError

if TYPE_CHECKING:
    from hysteresis_ros.bridge.protocol import Fields

SUPPLY_SAMPLES = 50         # measurements of the supply over which is averaged, about
SUPPLY_JUMP = 0.03          # relative change that is taken at once
STOP_PATIENCE = 0.5         # s to wait on the way out until the board says that it is off
RAMP_DT = 0.02              # s of the wall between two setpoints of a soft start


class Board:
    """
    A PWM board with an encoder, on any port.

    Parameters
    ----------
    port : str
        Device or pyserial URL, such as ``/dev/ttyUSB0`` or ``sim://bicep``.
    baud : int
        Bits per second.
    pwm : Pwm
        Law and limits between voltage and duty.
    encoder : Encoder
        From counts to angle.
    timeouts : Timeouts
        Time limits.
    telemetry_period : float
        Time in s of the board's clock between two samples.
    supply : float
        Nominal supply voltage in V.
    supply_tolerance : float
        Share by which the measured supply may differ from it; beyond, the output is off, because
        a wrong measurement would burn the muscle.
    on_sample : callable, optional
        Called with each `Sample`, in the reading thread.
    protection : Protection, optional
        What keeps the muscle from harm; by default with all of its limits.

    Attributes
    ----------
    pwm : Pwm
        May be replaced at any time.
    protection : Protection
        As given.

    Raises
    ------
    ParameterError
        If no port can have this name, or another value makes no sense.

    Examples
    --------
    What goes wrong shows in `status`, never as an exception of the threads:

    * the port does not exist: ``problem`` says so, and opening is tried again for ever;
    * the board falls silent, repeats itself or is unplugged: likewise, after
      ``timeouts.telemetry``; nothing is heated already after ``timeouts.late``, and again only
      when it has been enabled again;
    * the board starts anew: it is greeted again and stays disabled; the encoder's fault is in the
      samples;
    * the supply is off or weak: ``limit`` says what the muscle gets instead.

    """

    def __init__(self, port: str, baud: int = 115200, pwm: Pwm = Pwm(),
                 encoder: Encoder | None = None, timeouts: Timeouts = Timeouts(),
                 telemetry_period: float = 0.1, supply: float = 12.0,
                 supply_tolerance: float = 0.25,
                 on_sample: Callable[[Sample], None] = lambda sample: None,
                 protection: Protection | None = None) -> None:
        self.pwm = pwm
        self.protection = protection or Protection()
        self._encoder = encoder or Encoder()
        self._timeouts = timeouts
        self._period = telemetry_period
        self._nominal_supply = supply
        self._supply_tolerance = supply_tolerance
        self._on_sample = on_sample
        self._link = BoardLink(port, baud, timeouts)
        self._clock = BoardClock()
        self._wake = threading.Condition()
        self._stopping = threading.Event()
        self._news = False          # something for the writer
        self._wanted = False        # whether the board shall be enabled
        self._fault = ''            # why it shall not
        self._refused_since: float | None = None    # wall time of the first refusal after it
        # (voltage, wall time at which it was set)
        self._target: tuple[float, float] | None = None
        self._online = False
        self._problem = ''
        self._write_problem: BoardError | ProtocolError | None = None
        self._supply: float | None = None   # averaged over so many samples:
        self._supply_samples = 0
        self._identity: Identity | None = None
        self._sample: Sample | None = None
        self._received = 0.0        # wall time of the latest sample
        self._limit = ''
        self._ramping = False       # a soft start is on its way up
        self._other_master = OtherMaster()
        self._refusal = ''
        self._config = BoardConfig(telemetry_period, timeouts.watchdog,
                                   (1.0 + supply_tolerance) * supply)
        self._connections = 0
        self._threads = [threading.Thread(target=target, name=name, daemon=True)
                         for target, name in ((self._run, 'board reader'),
                                              (self._write, 'board writer'))]

    def __enter__(self) -> 'Board':
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    def start(self) -> None:
        """Begin to look for the board. Returns at once."""
        for thread in self._threads:
            thread.start()

    def switch_off(self) -> bool:
        """
        Switch the output off and wait a moment until the board says so.

        Returns
        -------
        bool
            Whether it did, or is not there; else its watchdog switches off.

        """
        with self._wake:
            self._wanted = False
            self._target = None
        self._say_zero()
        deadline = time.monotonic() + STOP_PATIENCE
        with self._wake:
            while (self._online and self._sample is not None and self._sample.enabled
                   and time.monotonic() < deadline):
                self._wake.wait(deadline - time.monotonic())
            return not (self._online and self._sample is not None and self._sample.enabled)

    def stop(self) -> None:
        """
        Switch the output off, wait a moment until the board says so, and close the port.

        It may be called again; `start` may not.
        """
        self.switch_off()
        with self._wake:
            self._stopping.set()
            self._wake.notify_all()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(2.0)
        self._link.close()
        self._online = False

    def set_voltage(self, voltage: float) -> None:
        """
        Ask for a voltage. Never waits.

        Parameters
        ----------
        voltage : float
            Voltage in V; it has to be repeated within ``timeouts.setpoint``.

        Raises
        ------
        RangeError
            If it is not finite or outside the limits; the setpoint before stays for
            ``timeouts.refused``.

        """
        try:
            self.pwm.check(voltage)
        except RangeError:
            with self._wake:
                if self._refused_since is None:
                    self._refused_since = time.monotonic()
            raise
        with self._wake:
            self._target = (voltage, time.monotonic())
            self._refused_since = None
            self._tell_writer()

    def set_zero(self) -> None:
        """Ask for 0 V until the next `set_voltage`. Never waits."""
        with self._wake:
            self._target = None
            self._tell_writer()

    def enable(self, wanted: bool) -> None:
        """
        Let the board take setpoints, or switch its output off. Never waits.

        Parameters
        ----------
        wanted : bool
            What shall be; `Sample.enabled` says what is. After enabling, the output is zero until
            a new setpoint comes. Nothing is enabled before `clear_fault` where there is a fault.

        """
        with self._wake:
            self._wanted = wanted and not self._fault
            self._target = None
            self._limit = ''
            self._tell_writer()

    def clear_fault(self) -> None:
        """Clear what has switched the output off, because somebody has checked it."""
        with self._wake:
            self._encoder.clear_fault()
            self.protection.clear()
            self._other_master.clear()
            self._fault = ''

    @property
    def wanted(self) -> bool:
        """Whether the output shall be enabled."""
        return self._wanted

    @property
    def slowness(self) -> float:
        """How many seconds of the wall a second of the slower clock takes, at least 1."""
        return 1.0 / min(self.speed, 1.0)

    @property
    def speed(self) -> float:
        """How fast the board's clock runs against the wall's; 1 before the first greeting."""
        return self._identity.speed if self._identity else 1.0

    @property
    def status(self) -> Status:
        """How things are, as a `Status`."""
        with self._wake:
            sample = self._sample
            bad = self._link.decoder.last_bad
            return Status(
                self._online, self._problem,
                '; '.join(f'{name}: {FAULTS.get(name, "see the board")}'
                          for name in sample.faults) if sample else '',
                self._limit, self._target is not None and self._expired(), self._fault,
                self._refusal, sample, self._identity, self._link.decoder.frames,
                self._link.decoder.bad_lines, self._link.lost_frames, self._connections,
                f'"{bad.text}": {bad.reason}' if bad else '')

    def _tell_writer(self) -> None:
        self._news = True
        self._wake.notify_all()

    def _expired(self) -> bool:
        if self._target is None:
            return True
        now = time.monotonic()
        if (self._refused_since is not None
                and now - self._refused_since > self._timeouts.refused * self.slowness):
            return True
        return now - self._target[1] > self._timeouts.setpoint * self.slowness

    def _late(self) -> bool:
        """Whether the telemetry is so late that nothing may be heated."""
        if self.speed > 1.0:
            return False
        patience = max(self._timeouts.late, 2.5 * self._period)
        return time.monotonic() - self._received > patience * self.slowness

    def _board_time(self) -> float:
        """Return the board's time now, in s, as far as it can be told."""
        return self._clock.time + (time.monotonic() - self._received) * self.speed

    # The reading thread

    def _run(self) -> None:
        delay = self._timeouts.first_retry
        while not self._stopping.is_set():
            connections = self._connections
            try:
                self._link.open()
                while not self._stopping.is_set():
                    self._greet()
                    self._listen()
            except HysteresisError as error:
                self._lose(str(error))
            except Exception as error:     # whatever it is: the muscle off, and on with the loop
                self._lose(f'port {self._link.port}: unexpected {error!r}')
            self._link.close()
            if self._connections > connections:
                delay = self._timeouts.first_retry
            self._stopping.wait(delay)
            delay = min(2.0 * delay, self._timeouts.last_retry)

    def _greet(self) -> None:
        limits, pwm = self.protection.limits, self.pwm
        identity = self._link.greet(
            lambda identity: self._config.fields(identity, limits, pwm), self._stopping)
        with self._wake:
            if self._identity is None:
                self._encoder.counter_bits = identity.counter_bits
                self._clock.begin(identity.time)
            elif identity.boot != self._identity.boot or self._clock.back(identity.time):
                self._encoder.restart()
                self._clock.begin(
                    identity.time, (time.monotonic() - self._received) * identity.speed)
            self._identity = identity
            self._config.greeted(limits, pwm)
            self._received = time.monotonic()
            self._write_problem = None
            self._supply = None
            self._connections += 1

    def _listen(self) -> None:
        """
        Read telemetry until the board starts anew; raise when it is lost.

        Only time in which this thread listened counts: a machine that held it up may have kept the
        board's words, too.
        """
        patience = self._timeouts.telemetry * self.slowness
        silence = 0.0
        while not self._stopping.is_set():
            begin = time.monotonic()
            frames = self._link.read()
            silence += min(time.monotonic() - begin, READ_TIMEOUT)
            for frame in frames:
                if frame.kind == NO:
                    self._refusal = frame.fields.get('reason', 'no reason')
                if frame.kind in (OK, NO):
                    self._config.answered(frame.fields.get('re', ''))
                if frame.kind != TELEMETRY:
                    continue
                telemetry = Telemetry.from_frame(frame)
                if self._sample is not None and self._online and self._clock.same(telemetry.time):
                    continue    # a line that came twice tells nothing of now
                if self._clock.back(telemetry.time):
                    self._lose(f'port {self._link.port}: the board has started anew')
                    return
                self._take(telemetry)
                silence = 0.0
            if self._write_problem is not None:
                raise self._write_problem
            if silence > patience:
                raise BoardError(f'port {self._link.port}: the board is silent, no new telemetry '
                                 f'for {patience:.3g} s; the output is off')

    def _take(self, telemetry: Telemetry) -> None:
        reading = self._encoder.update(self._clock.follow(telemetry.time), telemetry.counts,
                                       telemetry.index, telemetry.latch)
        supply = self._smooth(telemetry.supply)
        sample = Sample(
            self._clock.time, reading.angle, reading.velocity, reading.fresh,
            self.pwm.voltage(telemetry.duty, supply), supply, telemetry.ambient,
            telemetry.enabled, telemetry.faults, reading.fault)
        with self._wake:
            if (not self._online or self._sample is None
                    or sample.enabled != self._sample.enabled):
                self._tell_writer()
            self._online = True
            self._problem = ''
            self._sample = sample
            self._received = time.monotonic()
            # For so long may a setpoint be on its way.
            longest = max(self._timeouts.telemetry, 3.0 * self._period) * self.slowness
            fault = (_latched(sample) or self.protection.observe(sample)
                     or self._other_master.observe(telemetry, time.monotonic() - longest))
            if fault:
                self._trip(fault)
        self._on_sample(sample)

    def _trip(self, fault: str) -> None:
        """Switch the output off until `clear_fault` and `enable`."""
        if not self._fault:
            self._fault = fault
        self._wanted = False
        self._target = None
        self._tell_writer()

    def _smooth(self, supply: float) -> float:
        """Return the supply's average, so that its noise does not move the muscle to and fro."""
        before = self._supply
        if before is None or abs(supply - before) > SUPPLY_JUMP * self._nominal_supply:
            average, self._supply_samples = supply, 1
        else:
            self._supply_samples = min(self._supply_samples + 1, SUPPLY_SAMPLES)
            average = before + (supply - before) / self._supply_samples
        self._supply = average
        return average

    def _lose(self, problem: str) -> None:
        with self._wake:
            if self._online and self._wanted:
                self._trip('the board was lost while it was enabled')
            self._online = False
            self._problem = problem
            self._target = None
            self._limit = ''
            self._other_master.clear()
        self._say_zero()

    # The writing thread

    def _write(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._news or self._stopping.is_set(),
                                    RAMP_DT if self._ramping else self._timeouts.keepalive)
                self._news = False
                if self._stopping.is_set():
                    return
            try:
                self._send_due()
            except (BoardError, ProtocolError) as error:
                self._write_problem = error
            except Exception as error:     # whatever it is: the muscle off, and on with the loop
                self._write_problem = BoardError(f'port {self._link.port}: unexpected {error!r}')

    def _send_due(self) -> None:
        with self._wake:
            commands = self._commands() if self._online else []
        for kind, fields in commands:
            sequence = self._link.send(kind, fields)
            if kind == CONFIG:
                self._config.sent(sequence)
            elif kind == SET:
                self._note_sent(sequence)

    def _commands(self) -> list[tuple[str, Fields | None]]:
        """Return what the board has to hear now: (kind, fields) each."""
        commands: list[tuple[str, Fields | None]] = []
        limits, pwm = self.protection.limits, self.pwm
        if self._identity is not None and self._config.is_due(limits, pwm):
            commands.append((CONFIG, self._config.fields(self._identity, limits, pwm)))
        if self._sample is None or self._wanted != self._sample.enabled:
            commands.append((ENABLE if self._wanted else DISABLE, None))
        elif self._wanted:
            duty = self._duty()
            self._other_master.ask(time.monotonic(), duty)
            commands.append((SET, {'duty': duty}))
        elif _latched(self._sample):
            commands.append((DISABLE, None))    # that its reason may be gone is for it to see
        return commands

    def _duty(self) -> float:
        self._limit = ''
        self._ramping = False
        supply = self._supply
        if self._target is None or supply is None or self._expired():
            self.protection.begin_softly()
            return 0.0
        if self._late():
            self.protection.begin_softly()
            self._limit = 'the telemetry is late: output off until it comes again'
            return 0.0
        off = abs(supply - self._nominal_supply)
        if off > self._supply_tolerance * self._nominal_supply:
            self._limit = (
                f'the supply measures {supply:.3g} V, {self._nominal_supply:g} V expected: '
                'output off; check the supply and the parameter supply_voltage')
            return 0.0
        pwm, asked, lowered = self.pwm, self._target[0], ''
        if asked > pwm.maximum_voltage:
            lowered = (f'{asked:g} V asked, {pwm.maximum_voltage:g} V given: maximum_voltage was '
                       'lowered since')
            asked = pwm.maximum_voltage
        voltage, protected, self._ramping = self.protection.limit(
            asked, self._board_time(), RAMP_DT * self.speed,
            2.0 * self._timeouts.keepalive * self.speed)
        # Below minimum_voltage there is nothing but off.
        drive = pwm.drive(voltage if voltage >= pwm.minimum_voltage else 0.0, supply)
        self._limit = drive.limit or protected or lowered
        return drive.duty

    def _say_zero(self) -> None:
        """Tell the board to stop, as far as it can still hear."""
        try:
            self._note_sent(self._link.send(SET, {'duty': 0.0}))
            self._link.send(DISABLE)
        except BoardError:
            pass    # the board's own watchdog does it

    def _note_sent(self, sequence: int) -> None:
        with self._wake:
            self._other_master.sent(sequence)


def _latched(sample: Sample) -> str:
    """Return why the board has disabled itself, or ''."""
    return '; '.join(FAULTS[name] for name in sample.faults if name in LATCHED)
