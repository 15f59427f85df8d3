# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Injects every fault into a heated arm, and measures how long the muscle is heated after it.

    python tools/faults.py docs/safety.md

The simulated board runs at real time behind the host's `Board`; the voltage is what the board
applies, every 20 ms. Host, compensator and geometry node are killed as processes. The table goes
between the page's two marks.
"""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import dataclasses
import math
import os
from pathlib import Path
import re
import select
import signal
import subprocess
import sys
import threading
import time
import tty

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from hysteresis_ros.bridge.board import Board                               # noqa: E402
from hysteresis_ros.bridge.encoder import Encoder                           # noqa: E402
from hysteresis_ros.bridge.messages import FAULTS                         # noqa: E402
from hysteresis_ros.bridge.protocol import encode                           # noqa: E402
from hysteresis_ros.errors import RangeError                                # noqa: E402
from hysteresis_ros.bridge.protection import Limits, RunningMean            # noqa: E402
from hysteresis_ros.laboratory.board.port import PortClosed, SimulatedPort  # noqa: E402
from hysteresis_ros.laboratory.board.simulated_board import (               # noqa: E402
    INDEX_COUNTS, SimulatedBoard, TICK)

LIMIT = 0.6             # s of the arm's time from a fault to zero duty
VOLTAGE = 5.5           # V, of the run that the faults meet
BEGIN = 2.0             # s of the arm's life at which they come
AFTER = 1.6             # s for which is watched then
PERIOD = 0.1            # s between two setpoints
STARTUP = 300.0         # s of the wall in which nodes must have started; they compile at first
BEGIN_MARK, END_MARK = '<!-- faults -->', '<!-- end of faults -->'


@dataclasses.dataclass(frozen=True)
class Fault:
    """
    One fault, how it is made, and what has to come of it.

    Attributes
    ----------
    name, how : str
        For the table.
    words : str
        What the user reads in diagnostics, in part.
    query : str
        Of the simulated board's URL.
    voltage : callable
        What is asked for [V] at a time [s of the arm].
    counted_from : str
        From when on is counted, where that is not `BEGIN`; a key of `COUNTED_FROM`.
    stays : bool
        Whether the output stays off; else it is zero for a moment.
    goes_on : bool
        Whether the run goes on, with never more than the voltage asked for.
    meddle : callable, optional
        Does the harm itself; gets the `Run`.
    until : float
        When the run ends [s of the arm].
    """

    name: str
    how: str
    words: str
    query: str = ''
    voltage: Callable[[float], float] = lambda time: VOLTAGE
    counted_from: str = ''
    stays: bool = True
    goes_on: bool = False
    meddle: Callable[[Run], object] | None = None
    until: float = BEGIN + AFTER


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

    trace: list[tuple[float, float, int]]
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
    A heated arm behind the simulated board, in which a fault comes.

    Parameters
    ----------
    fault : Fault

    Attributes
    ----------
    port : SimulatedPort
        The simulated board's port.
    """

    def __init__(self, fault: Fault) -> None:
        self._fault = fault
        self._trace: list[tuple[float, float, int]] = []
        self._said: dict[str, float] = {}
        self._next = 0.0        # when a setpoint is due
        self._board = Board(f'sim://bicep?{fault.query}', encoder=Encoder(index='check'))
        made = self._board._link._serial
        made.simulation = self.port = LatePort(made.port)
        self._listen(self.port.cable.board)

    @property
    def time(self) -> float:
        """Time of the arm [s]."""
        return self.port.cable.time

    def wait(self, time_of_arm: float) -> None:
        """Sleep until the arm is so old."""
        while self.time < time_of_arm:
            time.sleep(0.005)

    def run(self) -> Outcome:
        """Do it, and return what came of it."""
        with self._board as board:
            board.enable(True)
            if self._fault.meddle is not None:
                threading.Thread(target=self._fault.meddle, args=(self,), daemon=True).start()
            while self.time < self._fault.until:
                self._step(board)
                time.sleep(0.02)
        begun = self._begun()
        return Outcome(self._trace, begun, self._zero_after(begun), list(self._said))

    def _listen(self, board: SimulatedBoard) -> None:
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


def first_motion(trace: list[tuple[float, float, int]]) -> float:
    """Return when the arm has turned by 13 counts."""
    start = trace[0][2]
    return next((when for when, _, counts in trace if abs(counts - start) > 13), math.inf)


def motion_due(trace: list[tuple[float, float, int]]) -> float:
    """Return when the wire, by its estimate, is so warm that the arm must have moved."""
    limits = Limits()
    heat = RunningMean(limits.thermal_time_constant)
    for when, voltage, _ in trace:
        heat.advance(TICK / 1000.0, voltage ** 2)
        if limits.thermal_gain * heat.value > limits.motion_temperature_rise:
            return when
    return math.inf


def index_passed(trace: list[tuple[float, float, int]]) -> float:
    """Return when the arm last passed the place of the index pulse, heated."""
    return max((when for (when, voltage, counts), (_, _, before) in zip(trace[1:], trace)
                if counts <= INDEX_COUNTS < before), default=math.inf)


COUNTED_FROM: dict[str, Callable[[list[tuple[float, float, int]]], float]] = {
    '': lambda trace: BEGIN,
    "the arm's first motion": first_motion,
    'when motion is due (60 K above ambient)': motion_due,
    'the place of the index': index_passed,
    'zero duty, until the alarm': lambda trace: BEGIN,
}


def another_master(run: Run) -> None:
    """Write setpoints of another program to the board, past the port's lock."""
    run.wait(BEGIN)
    with contextlib.suppress(PortClosed):       # the end of the run
        for number in range(int(AFTER / 0.05)):
            run.port.write(encode('set', 40000 + number, {'duty': 0.9}))
            time.sleep(0.05)


def then(voltage: float) -> Callable[[float], float]:
    """Return the run's voltage until `BEGIN`, and another one [V] from then on."""
    return lambda time_of_arm: VOLTAGE if time_of_arm < BEGIN else voltage


def heat_cool_heat(time_of_arm: float) -> float:
    """Return a voltage [V] under which the arm passes the index three times."""
    return 0.0 if 5.0 < time_of_arm < 18.0 else VOLTAGE


SIMULATED = (
    Fault('board reset by a brown-out, in a frame', '`brownout`', 'has started anew',
          f'brownout={BEGIN}'),
    Fault('cable pulled, put back after 0.5 s', '`unplug_after`, `unplug_for`',
          'lost while it was enabled', f'unplug_after={BEGIN}&unplug_for=0.5'),
    Fault('board no longer hears', '`deaf_after`', 'no setpoint came in time',
          f'deaf_after={BEGIN}'),
    Fault('board no longer answers', '`silent_after`', 'the board is silent',
          f'silent_after={BEGIN}'),
    Fault('some bytes dropped', '`drop=0.002`', 'bad lines', 'drop=0.002', goes_on=True),
    Fault('some bytes flipped', '`flip=0.002`', 'bad lines', 'flip=0.002', goes_on=True),
    Fault('some bytes doubled', '`double=0.002`', 'bad lines', 'double=0.002', goes_on=True),
    Fault('bytes delayed by 0.5 s', '`late_after`', 'telemetry is late', f'late_after={BEGIN}',
          stays=False),
    Fault('flood of garbage, both ways', '`mad_after`', 'bad lines', f'mad_after={BEGIN}'),
    Fault('telemetry frozen', '`frozen_after`', 'no new telemetry', f'frozen_after={BEGIN}'),
    Fault('encoder counts the wrong way', '`encoder_reversed_after`', 'counts the wrong way',
          'encoder_reversed_after=0', counted_from="the arm's first motion", until=5.0),
    Fault('encoder stands still while heated', '`encoder_still_after`', 'the angle stands still',
          'encoder_still_after=0', counted_from='when motion is due (60 K above ambient)',
          until=8.5),
    Fault('encoder jumps', '`encoder_jump`', 'jumped by', f'encoder_jump={BEGIN}'),
    Fault('index pulse missing', '`index_missing_after`, `encoder_index: check`', 'none came',
          'index_missing_after=17&speed=2', heat_cool_heat, counted_from='the place of the index',
          until=23.0),
    Fault('supply sags to 0.6 of it', '`supply_low_after`', 'the supply measures 7.2 V',
          f'supply_low_after={BEGIN}'),
    Fault('supply vanishes', '`supply_off_after`', 'supply voltage is too low',
          f'supply_off_after={BEGIN}'),
    Fault('supply doubles', '`supply_double_after`', 'the supply measures 24 V',
          f'supply_double_after={BEGIN}'),
    Fault('MOSFET stuck on while the duty is 0', '`mosfet_stuck_after`', 'MOSFET may be stuck',
          f'mosfet_stuck_after={BEGIN}', then(0.0), counted_from='zero duty, until the alarm',
          until=BEGIN + 3.0),
    Fault('every setpoint NaN', 'asked for', 'it has to be a number', '', then(math.nan)),
    Fault('every setpoint negative', 'asked for', 'the limits are 0 to 6 V', '', then(-1.0)),
    Fault('every setpoint above the limit', 'asked for', 'the limits are 0 to 6 V', '',
          then(6.5)),
    Fault('two masters on one port', 'another program writes `set duty=0.9`',
          'another one talks to it', meddle=another_master),
    Fault("board's clock jumps back by a minute", '`clock_back`', 'has started anew',
          f'clock_back={BEGIN}'),
)


def run_simulated(faults: tuple[Fault, ...] = SIMULATED) -> dict[str, Outcome]:
    """
    Run the faults side by side, as they spend their time waiting.

    Parameters
    ----------
    faults : tuple of Fault

    Returns
    -------
    dict of str to Outcome
        By the fault's name.
    """
    runs = [Run(fault) for fault in faults]
    with ThreadPoolExecutor(len(faults)) as pool:
        return dict(zip((fault.name for fault in faults), pool.map(Run.run, runs)))


# A host that heats until it dies.
HOST = """
import sys, time
from hysteresis_ros.bridge.board import Board
board = Board(sys.argv[1])
board.start()
board.enable(True)
while True:
    board.set_voltage(5.5)
    time.sleep(0.05)
"""


class OnTerminal:
    """
    The simulated board behind a pseudo-terminal, for a host in another process.

    Attributes
    ----------
    simulated : SimulatedPort
        The board.
    name : str
        Of the device.
    """

    def __init__(self) -> None:
        self.simulated = LatePort('sim://bicep')
        self._far, near = os.openpty()
        tty.setraw(near)
        self.name = os.ttyname(near)
        self._near = near       # stays open here, so that hosts may come and go
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def _serve(self) -> None:
        while not self._ended.is_set():
            if select.select([self._far], [], [], 0.0)[0]:
                self.simulated.write(os.read(self._far, 4096))
            data = self.simulated.read(4096, 0.01)
            if data and select.select([], [self._far], [], 0.0)[1]:
                os.write(self._far, data)

    def __enter__(self) -> OnTerminal:
        self.simulated.open()
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._thread.join()
        self.simulated.close()
        os.close(self._far)
        os.close(self._near)


def silence_host(number: signal.Signals) -> float:
    """Stop a host that heats by a signal; return the time until zero duty [s of the arm]."""
    with OnTerminal() as terminal:
        board, begun = terminal.simulated.cable.board, math.inf
        child = subprocess.Popen([sys.executable, '-c', HOST, terminal.name],
                                 env={**os.environ, 'PYTHONPATH': str(ROOT)})
        try:
            _wait(lambda: board.duty > 0.2, 'heating')
            begun = terminal.simulated.cable.time
            child.send_signal(number)
            _wait(lambda: board.duty == 0.0, 'zero duty')
            return terminal.simulated.cable.time - begun
        finally:
            child.kill()
            child.wait()


def kill_node(name: str) -> tuple[float, str]:
    """
    Kill one of the three nodes in the middle of a run at real time.

    Parameters
    ----------
    name : str
        ``compensator_node`` or ``geometry_node``.

    Returns
    -------
    float
        Time from then until zero volts [s of the arm, which is that of the wall].
    str
        What the diagnostics said.
    """
    sys.path.insert(0, str(ROOT / 'test'))
    from node_support import Graph, process
    from std_msgs.msg import Float64

    with contextlib.ExitStack() as stack:
        # The nodes are children, who take it from there.
        domain = int(os.environ.setdefault('ROS_DOMAIN_ID', '87'))
        graph = stack.enter_context(Graph(domain))
        voltages: list[tuple[float, float]] = []
        graph.probe.create_subscription(
            Float64, 'applied_voltage',
            lambda message: voltages.append((time.monotonic(), message.data)), 100)
        statuses = graph.status()
        children = {one: stack.enter_context(process(
            one, '--ros-args', '-p', 'telemetry_rate:=50.0'))
            for one in ('bridge_node', 'geometry_node', 'compensator_node')}
        targets = graph.probe.create_publisher(Float64, 'target_angle', 1)
        graph.until(lambda: targets.get_subscription_count() and voltages
                    and graph.probe.count_subscribers('muscle_reference')
                    and graph.probe.count_publishers('muscle_reference'), 'nodes', STARTUP)
        graph.spin(1.0)
        targets.publish(Float64(data=1.9))
        graph.until(lambda: voltages[-1][1] > 1.0, 'heating')
        graph.spin(1.5)
        begun = time.monotonic()
        children[name].kill()
        graph.until(lambda: voltages[-1][1] == 0.0, 'zero volts')
        zero = next(when for when, volts in voltages if when > begun and volts == 0.0)
        graph.spin(1.0)
        assert all(volts == 0.0 for when, volts in voltages if when > zero)
        said = [status.message for status in statuses if 'has died' in status.message]
        return zero - begun, said[-1] if said else ''


def others(nodes: bool) -> list[tuple[str, str, float, str]]:
    """Return the rows of faults that need processes: name, how, time, what the user sees."""
    watchdog = FAULTS['watchdog']
    rows = [(f'host {what} while hot', f'`{number.name}`', silence_host(number), watchdog)
            for number, what in ((signal.SIGKILL, 'killed'), (signal.SIGSTOP, 'stopped'))]
    if nodes:
        for one, what in (('compensator_node', 'compensator'), ('geometry_node', 'geometry')):
            seconds, said = kill_node(one)
            rows.append((f'{what} node dies in mid-run', '`SIGKILL`', seconds, said))
    return rows


def rows_of(outcomes: dict[str, Outcome]) -> list[tuple[str, str, float, str, str]]:
    """Return the rows of simulated faults: name, how, time, what the user sees, counted from."""
    rows = []
    for fault in SIMULATED:
        said = next((text for text in outcomes[fault.name].said if fault.words in text), 'nothing')
        rows.append((fault.name, fault.how, outcomes[fault.name].zero_after, said,
                     fault.counted_from))
    return rows


def table(rows: list[tuple[str, str, float, str, str]]) -> str:
    """Return the rows as Markdown; times in seconds, rounded up."""
    lines = ['| fault | how it is injected | zero duty after [s] | what the user reads |',
             '|---|---|---|---|']
    for name, how, seconds, said, counted in rows:
        when = 'goes on'
        if not math.isnan(seconds):
            when = 'never'
        if math.isfinite(seconds):
            when = f'{math.ceil(50.0 * seconds - 1e-6) / 50.0:.2f}'
            when += f', from {counted}' if counted else ''
        said = re.sub(r'sim://bicep[^\s:]*', '/dev/ttyUSB0', said).replace('|', ' ')
        lines.append(f'| {name} | {how} | {when} | {said} |')
    return '\n'.join(lines) + '\n'


def committed(page: str) -> list[list[str]]:
    """Return the cells of the table in a page, row by row."""
    content = page.partition(BEGIN_MARK)[2].partition(END_MARK)[0]
    return [[cell.strip() for cell in line.strip('|').split('|')]
            for line in content.splitlines() if line.startswith('| ')][1:]


def _wait(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + 20.0
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f'waited for {what}')
        time.sleep(0.002)


def main() -> int:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('page', type=Path, help='whose table is made anew')
    arguments = parser.parse_args()
    rows = [(*row, '') for row in others(True)] + rows_of(run_simulated())
    page = arguments.page.read_text(encoding='utf-8')
    start, _, rest = page.partition(BEGIN_MARK)
    text = f'{start}{BEGIN_MARK}\n{table(rows)}{END_MARK}{rest.partition(END_MARK)[2]}'
    arguments.page.write_text(text, encoding='utf-8')
    print(table(rows))
    late = [name for name, _, seconds, _, _ in rows if seconds > LIMIT]
    return f'later than {LIMIT} s: {late}' if late else 0


if __name__ == '__main__':
    sys.exit(main())
