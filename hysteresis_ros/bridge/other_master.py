# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a board obeys somebody else as well: another program on its line."""

from __future__ import annotations

import collections
from typing import TYPE_CHECKING

from hysteresis_ros.bridge.protocol import SEQUENCE_LIMIT

if TYPE_CHECKING:
    from hysteresis_ros.bridge.messages import Telemetry

SAME_DUTY = 0.004           # a step of a board with 255 of them
FOREIGN_LIMIT = 2.0         # setpoints, or samples of a duty, that nobody here asked for
FOREIGN_DECAY = 0.25        # of such a sample that a good one makes up for: one may be on its way
REMEMBERED = 256            # setpoints; more are never between a board and its telemetry


class OtherMaster:
    """
    Count the setpoints that a board obeyed, and nobody here sent.

    A board says how many setpoints it has obeyed, and which one last. Between two samples that end
    with one of ours, it cannot have obeyed more than were sent from here in between; each one more
    is somebody else's, however short its duty stood. Boards that do not say so, and lines where
    the other's setpoint is always the last one, are found by the duty of their samples.
    """

    def __init__(self) -> None:
        # How many setpoints had been sent with the one of this sequence number.
        self._sent: dict[int, int] = {}
        self._count = 0
        # (wall time in s, duty) of what was asked for of late.
        self._duties: collections.deque[tuple[float, float]] = collections.deque()
        self._surplus: int | None = None    # obeyed beyond sent, as the latest sample had it
        self._setpoints = 0                 # of somebody else since `clear`
        self._samples = 0.0                 # with somebody else's duty, less what decayed

    def clear(self) -> None:
        """Begin anew: with a board that starts anew, or when somebody has checked it."""
        self._duties.clear()
        self._surplus = None
        self._setpoints = 0
        self._samples = 0.0

    def ask(self, now: float, duty: float) -> None:
        """Note a duty, 0 to 1, that is about to be sent at ``now`` [s of the wall]."""
        self._duties.append((now, duty))

    def sent(self, sequence: int) -> None:
        """Note the sequence number of a setpoint that was sent."""
        self._count += 1
        self._sent.pop(sequence, None)
        self._sent[sequence] = self._count
        if len(self._sent) > REMEMBERED:
            del self._sent[next(iter(self._sent))]

    def observe(self, telemetry: Telemetry, oldest: float) -> str:
        """
        Compare a sample with what was sent.

        Parameters
        ----------
        telemetry : Telemetry
        oldest : float
            Wall time in s; no setpoint from before may still be on its way.

        Returns
        -------
        str
            What is wrong, or ''.

        """
        self._compare_counts(telemetry)
        self._compare_duty(telemetry.duty, oldest)
        if max(self._setpoints, self._samples) < FOREIGN_LIMIT:
            return ''
        return (f'the board obeys setpoints (its duty is {telemetry.duty:.3f}) for which this '
                'program did not ask: another one talks to it, or the line delays its words; end '
                'the other one')

    def _compare_counts(self, telemetry: Telemetry) -> None:
        if telemetry.obeyed is None or telemetry.accepted not in self._sent:
            return
        surplus = telemetry.obeyed - self._sent[telemetry.accepted]
        if self._surplus is not None:
            more = (surplus - self._surplus) % SEQUENCE_LIMIT
            if more < SEQUENCE_LIMIT // 2:      # else some of ours were lost
                self._setpoints += more
        self._surplus = surplus

    def _compare_duty(self, duty: float, oldest: float) -> None:
        # One stands until the next was sent, however long that took.
        while len(self._duties) > 1 and self._duties[1][0] < oldest:
            self._duties.popleft()
        if duty <= SAME_DUTY or any(abs(duty - one) <= SAME_DUTY for _, one in self._duties):
            self._samples = max(self._samples - FOREIGN_DECAY, 0.0)
        else:
            self._samples += 1.0
