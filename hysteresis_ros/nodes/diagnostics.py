# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A node's part of ``/diagnostics``: once a second, and at once when a condition comes or goes.

A condition has a name, a level and a sentence. The node raises and clears conditions; the status
shows the worst level and every sentence that holds. The log gets each condition when it comes and
goes, and at most every few seconds while it lasts, however often it is raised.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration

if TYPE_CHECKING:
    from rclpy.node import Node

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

PERIOD = 1.0
LOG_AGAIN_AFTER = Duration(seconds=5.0)


class Diagnostics:
    """
    Conditions and counters of one node.

    Parameters
    ----------
    node : rclpy.node.Node
        The node; its name and namespace name the status.
    hardware_id : str
        Which arm or board the status is about.
    values : callable
        Returns a mapping of names to numbers or texts, shown as key and value.
    fine : str
        The sentence when no condition holds.
    """

    def __init__(self, node: Node, hardware_id: str, values: Callable[[], Mapping],
                 fine: str = 'fine') -> None:
        self._node = node
        self._hardware_id = hardware_id
        self._values = values
        self._fine = fine
        self._conditions: dict[str, tuple[bytes, str]] = {}
        self._logged: dict[str, Any] = {}   # when, by rclpy's clock
        # Seconds of the wall: a clock that stands still is worth a diagnosis, too.
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._timer = node.create_timer(PERIOD, self.publish, clock=self._clock)

    def set(self, name: str, level: bytes, sentence: str) -> None:
        """Raise condition `name` with `level` (OK, WARN or ERROR), or renew its sentence."""
        before = self._conditions.get(name)
        self._conditions[name] = (level, sentence)
        changed = before is None or before[0] != level
        self._log(name, level, sentence, changed)
        if changed:
            self.publish()

    def clear(self, name: str, instead: str = '') -> None:
        """
        Drop condition `name`; nothing happens when it does not hold.

        Parameters
        ----------
        name : str
        instead : str
            What holds now, for the log; by default that the sentence does no longer.
        """
        condition = self._conditions.pop(name, None)
        if condition is not None:
            self._log(name, OK, instead or f'no longer: {condition[1]}', True)
            self.publish()

    def publish(self) -> None:
        """Publish the status as it is now."""
        worst = max((level for level, _ in self._conditions.values()), default=OK)
        sentences = [sentence for level, sentence in sorted(
            self._conditions.values(), key=lambda condition: condition[0], reverse=True)]
        status = DiagnosticStatus(
            level=worst, name=self._node.get_fully_qualified_name().lstrip('/'),
            message='; '.join(sentences) or self._fine, hardware_id=self._hardware_id,
            values=[KeyValue(key=key, value=_text(value))
                    for key, value in self._values().items()])
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _log(self, name: str, level: bytes, sentence: str, changed: bool) -> None:
        now = self._clock.now()
        if not changed and now - self._logged[name] < LOG_AGAIN_AFTER:
            return
        self._logged[name] = now
        logger = self._node.get_logger()
        # One call per level: rclpy forbids a call site to change its severity.
        if level == ERROR:
            logger.error(sentence)
        elif level == WARN:
            logger.warning(sentence)
        else:
            logger.info(sentence)


def _text(value: object) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)
