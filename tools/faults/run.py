# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A heated arm behind a board, in which a fault comes, and what comes of it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
import dataclasses
import math
import threading
import time

from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.encoder import Encoder
from hysteresis_ros.errors import RangeError
from hysteresis_ros.laboratory.board.chip import Chip
from hysteresis_ros.laboratory.board.chip_board import ChipBoard
from hysteresis_ros.laboratory.board.port import SimulatedPort
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard, TICK
from tools.faults.fault import COUNTED_FROM, Fault, Trace

PERIOD = 0.1            # s of the arm between two setpoints
# Runs at a time, which spend theirs waiting, and speed of the arm's clock against the wall's: every
# machine can compute the machine code at half of it.
BOARDS = {'sim': (30, 1.0), 'avr': (2, 0.5)}


def url_of(scheme: str, query: str = '', speed: float | None = None) -> str:
    """Return a board's URL, ``sim`` or ``avr``, with these keys, at its usual speed or that."""
    speed = BOARDS[scheme][1] if speed is None else speed
    return '&'.join(filter(None, (f'{scheme}://bicep?speed={speed:g}', query)))


@dataclasses.dataclass(frozen=True)
class Outcome:
    """
    What came of a fault.

    Attributes
    ----------
    trace : list of (float, float, int)
        Time of the arm in s, voltage that the board applies in V, counts of the arm; every 20 ms.
    begun : float
        When the fault came or showed [s of the arm].
    zero_after : float
        Time from then until the voltage is zero, and stays so if it has to [s of the arm]; inf for
        never, NaN where the run goes on.
    said : list of str
        What the user could read.
    """

    trace: Trace
    begun: float
    zero_after: float
    said: list[str]


class LatePort(SimulatedPort):
    """A simulated port whose arm begins to live when it is first opened, however late."""

    def open(self) -> None:
        """Open the port."""
        if self._ticks == 0:
            self._origin = time.monotonic()
        super().open()


class Run:
    """
    A heated arm behind one of the boards, in which a fault comes.

    Parameters
    ----------
    fault : Fault
    scheme : str
        ``sim`` for the simulated board, ``avr`` for the machine code.
    speed : float, optional
        Of the arm's clock against the wall's; None for that of `BOARDS`.

    Attributes
    ----------
    board : Board
        The host's side.
    rig : SimulatedPort or Chip
        The board with arm and cable.
    """

    def __init__(self, fault: Fault, scheme: str, speed: float | None = None) -> None:
        self._fault = fault
        self._trace: Trace = []
        self._said: dict[str, float] = {}
        self._next = 0.0        # when a setpoint is due
        self.board = Board(url_of(scheme, fault.query, speed), encoder=Encoder(index='check'))
        made = self.board._link._serial
        self.rig: LatePort | Chip
        if scheme == 'sim':
            made.simulation = self.rig = LatePort(made.port)
        else:
            made.chip = self.rig = Chip(made.port)
        self._listen()

    @property
    def time(self) -> float:
        """Time of the arm [s]."""
        return self.rig.cable.time

    def wait(self, time_of_arm: float) -> None:
        """Sleep until the arm is so old."""
        while self.time < time_of_arm:
            time.sleep(0.005)

    def run(self) -> Outcome:
        """Do it, and return what came of it."""
        with self.board as board:
            board.enable(True)
            if self._fault.meddle is not None:
                threading.Thread(target=self._fault.meddle, args=(self,), daemon=True).start()
            while self.time < self._fault.until:
                self._step(board)
                time.sleep(0.02)
        if isinstance(self.rig, Chip):
            self.rig.close()
        begun = self._begun()
        return Outcome(self._trace, begun, self._zero_after(begun), list(self._said))

    def _listen(self) -> None:
        board: SimulatedBoard | ChipBoard = self.rig.cable.board
        advance = board.arm.advance

        def advance_and_write(dt: float, voltage: float) -> None:
            applied = board.supply * math.sqrt(board.duty) if voltage else 0.0
            self._trace.append((self.time, applied, board.arm.encoder_counts))
            advance(dt, voltage)

        board.arm.advance = advance_and_write   # type: ignore[method-assign]

    def _step(self, board: Board) -> None:
        if self.time >= self._next:
            self._next = self.time + PERIOD
            try:
                board.set_voltage(self._fault.voltage(self.time))
            except RangeError as error:
                self._say(str(error))
        status = board.status
        for text in (status.problem, status.faults, status.limit, status.fault,
                     'bad lines so far, skipped' if status.bad_lines else ''):
            self._say(text)
        if status.sample is not None:
            self._say(status.sample.encoder_fault)

    def _say(self, text: str) -> None:
        if text:
            self._said.setdefault(text, self.time)

    def _begun(self) -> float:
        begun = COUNTED_FROM[self._fault.counted_from](self._trace)
        # By its estimate, which telemetry feeds, the host may switch off just before that.
        return begun if begun < math.inf else self._told()

    def _told(self) -> float:
        return next((when for text, when in self._said.items() if self._fault.words in text),
                    math.inf)

    def _zero_after(self, begun: float) -> float:
        if self._fault.goes_on:
            return math.nan
        if self._fault.counted_from == 'zero duty, until the alarm':
            return self._told() - begun
        if begun == math.inf:
            return math.inf
        after = [(when, voltage) for when, voltage, _ in self._trace if when >= begun]
        if not self._fault.stays:
            return next((when for when, voltage in after if voltage == 0.0), math.inf) - begun
        last = max((when for when, voltage in after if voltage > 0.0), default=begun)
        return last + TICK / 1000.0 - begun if last < after[-1][0] else math.inf


def run_all(faults: Sequence[Fault], scheme: str = 'sim', speed: float | None = None
            ) -> dict[str, Outcome]:
    """
    Run faults on one of the boards, side by side.

    Parameters
    ----------
    faults : sequence of Fault
    scheme : str
        ``sim`` or ``avr``.
    speed : float, optional
        As of `Run`. Times are those of the arm's clock, so that a machine that is held up now and
        then spoils less of a slower run.

    Returns
    -------
    dict of str to Outcome
        By the fault's name.
    """
    with ThreadPoolExecutor(BOARDS[scheme][0]) as pool:
        return dict(zip((fault.name for fault in faults),
                        pool.map(lambda fault: Run(fault, scheme, speed).run(), faults)))
