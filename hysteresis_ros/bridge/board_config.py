# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The periods and limits that a board enforces itself, told again until it has answered."""

from __future__ import annotations

import collections
from typing import TYPE_CHECKING

from hysteresis_ros.bridge.protocol import write_number

if TYPE_CHECKING:
    from hysteresis_ros.bridge.messages import Identity
    from hysteresis_ros.bridge.protection import Limits
    from hysteresis_ros.bridge.protocol import Fields
    from hysteresis_ros.bridge.pwm import Pwm

# Of the board's limit of the RMS duty over the host's, which counts by its samples alone.
RMS_MARGIN = 1.1
# Answers that are remembered until the writer looks.
ANSWERS = 20


class BoardConfig:
    """
    What a board is to be told, and whether it has been.

    Parameters
    ----------
    period : float
        Time of the board's clock between two samples [s].
    watchdog : float
        Without a frame from the host for so long, the board switches off [s].
    highest_supply : float
        Supply at which the board's limits have to suffice [V].
    """

    def __init__(self, period: float, watchdog: float, highest_supply: float) -> None:
        self._period, self._watchdog = period, watchdog
        self._highest_supply = highest_supply
        self._made_from: tuple[Limits, Pwm] | None = None
        # Sequence number with which it was sent last; whether nobody has answered to any.
        self._asked: str | None = None
        self._open = False
        self._answered: collections.deque[str] = collections.deque(maxlen=ANSWERS)

    def fields(self, identity: Identity, limits: Limits, pwm: Pwm) -> Fields:
        """Return the fields of ``config`` for a board."""
        fields: dict[str, str | int | float] = {
            'period': round(1000.0 * self._period),
            'watchdog': round(1000.0 * self._watchdog * max(identity.speed, 1.0))}
        if limits.rms_voltage:
            rms = RMS_MARGIN * pwm.rms(limits.rms_voltage, self._highest_supply)
            fields.update(rms=write_number(rms, 3), rms_window=round(1000.0 * limits.rms_window))
        return fields

    def greeted(self, limits: Limits, pwm: Pwm) -> None:
        """Take note that a board was told of these in its greeting, and has answered."""
        self._made_from, self._open = (limits, pwm), False

    def sent(self, sequence: int) -> None:
        """Take note of the sequence number of a frame ``config``."""
        self._asked = str(sequence)

    def answered(self, sequence: str) -> None:
        """Take note of the sequence number that a board's answer is to; any thread may call."""
        self._answered.append(sequence)

    def is_due(self, limits: Limits, pwm: Pwm) -> bool:
        """Whether the limits have changed, and the board has not answered since."""
        if (limits, pwm) != self._made_from:
            self._made_from = limits, pwm
            self._asked, self._open = None, True
        if self._asked in self._answered:
            self._open = False
        return self._open
