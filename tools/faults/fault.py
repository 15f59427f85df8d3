# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a fault is, how it is injected, and from when on the time to zero duty counts."""

from __future__ import annotations

from collections.abc import Callable
import dataclasses
import math
from typing import TYPE_CHECKING

from hysteresis_ros.bridge.protection import Limits, RunningMean
from hysteresis_ros.laboratory.board.encoder_troubles import INDEX_COUNTS
from hysteresis_ros.laboratory.board.simulated_board import TICK

if TYPE_CHECKING:
    from tools.faults.run import Run

LIMIT = 0.6             # s of the arm's time from a fault to zero duty
VOLTAGE = 5.5           # V, of the run that the faults meet
BEGIN = 2.0             # s of the arm's life at which they come
AFTER = 1.6             # s for which is watched then

# Time of the arm in s, voltage that the board applies in V, counts of the arm.
Trace = list[tuple[float, float, int]]


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
        Of the board's URL.
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


def first_motion(trace: Trace) -> float:
    """Return when the arm has turned by 13 counts."""
    start = trace[0][2]
    return next((when for when, _, counts in trace if abs(counts - start) > 13), math.inf)


def motion_due(trace: Trace) -> float:
    """Return when the wire, by its estimate, is so warm that the arm must have moved."""
    limits = Limits()
    heat = RunningMean(limits.thermal_time_constant)
    for when, voltage, _ in trace:
        heat.advance(TICK / 1000.0, voltage ** 2)
        if limits.thermal_gain * heat.value > limits.motion_temperature_rise:
            return when
    return math.inf


def index_passed(trace: Trace) -> float:
    """Return when the arm last passed the place of the index pulse, heated."""
    return max((when for (when, voltage, counts), (_, _, before) in zip(trace[1:], trace)
                if counts <= INDEX_COUNTS < before), default=math.inf)


COUNTED_FROM: dict[str, Callable[[Trace], float]] = {
    '': lambda trace: BEGIN,
    "the arm's first motion": first_motion,
    'when motion is due (60 K above ambient)': motion_due,
    'the place of the index': index_passed,
    'zero duty, until the alarm': lambda trace: BEGIN,
}
