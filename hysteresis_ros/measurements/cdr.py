# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The four ROS messages that a measurement needs, decoded from their bytes.

ROS 2's own `rosbag2_py` gives bytes and no messages, and turning them into messages would take
rclpy; so these few lines are needed wherever the package `rosbags` is not installed. Where it is,
its type store decodes joint states about ten times slower than `JointReader`, which makes reading a
bag of 100,000 of them more than twice as slow. Layout: OMG CDR version 1 as DDS uses it, 4 bytes of
encapsulation, then every number aligned to its size.
"""

from collections.abc import Callable
import struct
from typing import Any

from hysteresis_ros.errors import MeasurementError

MOST_ELEMENTS = 100_000

LITTLE_ENDIAN = b'\x00\x01'
FLOAT64 = struct.Struct('<d')
STAMP = struct.Struct('<iI')


class CdrReader:
    """
    Reads numbers and strings one after the other.

    Parameters
    ----------
    data : bytes
        One serialised message.

    Raises
    ------
    MeasurementError
        If the message is cut off or in an encoding other than plain CDR; every method does.

    """

    def __init__(self, data: bytes) -> None:
        if len(data) < 4 or data[0] != 0 or data[1] > 1:
            raise MeasurementError('a message that is not in plain CDR')
        self.data = data
        self.order = '<' if data[1] == 1 else '>'
        self.position = 4

    def number(self, code: str, size: int) -> Any:
        """Return the next number of a struct code and its size in bytes."""
        position = self.position + (4 - self.position) % size
        try:
            value, = struct.unpack_from(self.order + code, self.data, position)
        except struct.error:
            raise MeasurementError('a message that is cut off') from None
        self.position = position + size
        return value

    def float64(self) -> float:
        """Return the next number of 8 bytes."""
        return self.number('d', 8)

    def count(self) -> int:
        """Return the length of the next sequence or string."""
        value = self.number('I', 4)
        if value > MOST_ELEMENTS:
            raise MeasurementError('a message with an absurd length')
        return value

    def string(self) -> str:
        """Return the next string."""
        length = self.count()
        text = bytes(self.data[self.position:self.position + length])
        if len(text) < length:
            raise MeasurementError('a message that is cut off')
        self.position += length
        return text.rstrip(b'\0').decode('utf-8', 'replace')

    def strings(self) -> list[str]:
        """Return the next sequence of strings."""
        return [self.string() for _ in range(self.count())]

    def stamp(self) -> float:
        """Return the stamp of the header that comes next, in s, and skip its frame."""
        seconds, nanoseconds = self.number('i', 4), self.number('I', 4)
        self.string()
        return seconds + 1e-9 * nanoseconds


def decode_float64(data: bytes) -> float:
    """Return the value of a std_msgs/msg/Float64."""
    return CdrReader(data).float64()


def decode_temperature(data: bytes) -> float:
    """Return the temperature [degC] of a sensor_msgs/msg/Temperature."""
    reader = CdrReader(data)
    reader.stamp()
    return reader.float64()


def decode_joint_state(data: bytes) -> tuple[float, list[str], list[float]]:
    """Return stamp [s], names and positions [rad] of a sensor_msgs/msg/JointState."""
    reader = CdrReader(data)
    return reader.stamp(), reader.strings(), [reader.float64() for _ in range(reader.count())]


def decode_diagnostics(data: bytes) -> list[tuple[str, dict[str, str]]]:
    """Return name and values of each status of a diagnostic_msgs/msg/DiagnosticArray."""
    reader = CdrReader(data)
    reader.stamp()
    found = []
    for _ in range(reader.count()):
        reader.number('B', 1)
        name, _, _ = reader.string(), reader.string(), reader.string()
        values = dict((reader.string(), reader.string()) for _ in range(reader.count()))
        found.append((name, values))
    return found


class JointReader:
    """
    Reads one joint's angle from many messages of one publisher.

    Such messages differ in nothing but their stamp and their numbers, so the place of the angle
    is looked for once and then only checked.

    Parameters
    ----------
    choose : callable
        Given the names of the first message's joints, returns the one to read.

    """

    def __init__(self, choose: Callable[[list[str]], str]) -> None:
        self.choose = choose
        self.joint: str | None = None
        self.length = self.place = 0
        self.between = b''

    def read(self, data: bytes) -> tuple[float, float | None]:
        """Return stamp [s] and angle [rad]; None if the message does not have the joint."""
        if (len(data) == self.length and data[:2] == LITTLE_ENDIAN
                and data[12:12 + len(self.between)] == self.between):
            seconds, nanoseconds = STAMP.unpack_from(data, 4)
            return seconds + 1e-9 * nanoseconds, FLOAT64.unpack_from(data, self.place)[0]
        stamp, names, positions = decode_joint_state(data)
        if self.joint is None:
            self.joint = self.choose(names)
        if self.joint not in names or names.index(self.joint) >= len(positions):
            return stamp, None
        self.remember(data, names.index(self.joint))
        return stamp, positions[names.index(self.joint)]

    def remember(self, data: bytes, index: int) -> None:
        """Note where the angle lies in messages like this one."""
        reader = CdrReader(data)
        reader.stamp()
        reader.strings()
        reader.count()
        self.between = bytes(data[12:reader.position])
        self.place = reader.position + (4 - reader.position) % 8 + 8 * index
        self.length = len(data)
