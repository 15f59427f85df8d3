# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of docs/safety.md: measured, written, and read back."""

from __future__ import annotations

import dataclasses
import math
import re

from hysteresis_ros.bridge.messages import FAULTS as NAMES
from tools.faults.catalogue import FAULTS
from tools.faults.fault import LIMIT
from tools.faults.processes import HOSTS, kill_node, NODES, silence_host
from tools.faults.run import Outcome, run_all

BEGIN_MARK, END_MARK = '<!-- faults -->', '<!-- end of faults -->'
TRIES = 3
BOARDS = {'sim': 'simulated board', 'avr': 'machine code'}


@dataclasses.dataclass
class Row:
    """
    A fault and what was measured of it.

    Attributes
    ----------
    name, how : str
        What it is, and how it is injected.
    said : str
        What the user reads, by the simulated board.
    counted_from : str
        From when the times count; '' for the fault itself.
    times : dict of str to float
        Until zero duty [s of the arm], by board; NaN where the run goes on, inf for never.
    """

    name: str
    how: str
    said: str
    counted_from: str
    times: dict[str, float]

    @property
    def late(self) -> bool:
        """Whether one of the times is too long."""
        return any(seconds > LIMIT for seconds in self.times.values())


def measure() -> list[Row]:
    """Inject every fault on both boards."""
    rows = []
    for number, what in HOSTS.items():
        rows.append(Row(what, f'`{number.name}`', NAMES['watchdog'], '',
                        {board: silence_host(number, board) for board in BOARDS}))
    for node, what in NODES.items():
        found = {board: _kill(node, board) for board in BOARDS}
        rows.append(Row(what, '`SIGKILL`', found['sim'][1], '',
                        {board: seconds for board, (seconds, _) in found.items()}))
    return rows + rows_of({board: run_all(FAULTS, board) for board in BOARDS})


def _kill(node: str, board: str) -> tuple[float, str]:
    """Kill a node; where a busy machine kept the others waiting, up to twice more."""
    for _ in range(TRIES):
        seconds, said = kill_node(node, board)
        if seconds <= LIMIT:
            break
    return seconds, said


def rows_of(outcomes: dict[str, dict[str, Outcome]]) -> list[Row]:
    """Return the rows of the faults that came to boards, by board and name of the fault."""
    rows = []
    for fault in FAULTS:
        said = next((text for text in outcomes['sim'][fault.name].said if fault.words in text),
                    'nothing')
        rows.append(Row(fault.name, fault.how, said, fault.counted_from,
                        {board: outcomes[board][fault.name].zero_after for board in BOARDS}))
    return rows


def table(rows: list[Row]) -> str:
    """Return the rows as Markdown; times in seconds, rounded up."""
    lines = ['| fault | how it is injected | zero duty after [s]: '
             + ' | '.join(BOARDS.values()) + ' | what the user reads |', '|---|---|---|---|---|']
    for row in rows:
        times = [_written(row.times[board], row.counted_from) for board in BOARDS]
        said = re.sub(r'sim://bicep[^\s:]*', '/dev/ttyUSB0', row.said).replace('|', ' ')
        lines.append(f'| {row.name} | {row.how} | {" | ".join(times)} | {said} |')
    return '\n'.join(lines) + '\n'


def _written(seconds: float, counted_from: str) -> str:
    if math.isnan(seconds):
        return 'goes on'
    if math.isinf(seconds):
        return 'never'
    since = f', from {counted_from}' if counted_from else ''
    return f'{math.ceil(50.0 * seconds - 1e-6) / 50.0:.2f}{since}'


def committed(page: str) -> list[list[str]]:
    """Return the cells of the table in a page, row by row."""
    content = page.partition(BEGIN_MARK)[2].partition(END_MARK)[0]
    return [[cell.strip() for cell in line.strip('|').split('|')]
            for line in content.splitlines() if line.startswith('| ')][1:]
