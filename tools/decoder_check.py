# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What has to hold for any bytes that the host's decoder gets.

No exception, the same lines however the bytes are cut, no frame whose CRC is wrong, and nothing
that telemetry or a greeting could make of a frame but numbers or a `ProtocolError`.
"""

import re

from hysteresis_ros.bridge.messages import Identity, Telemetry
from hysteresis_ros.bridge.protocol import Decoder, Frame, Line
from hysteresis_ros.errors import ProtocolError


def _remainder(byte: int) -> int:
    value = byte << 8
    for _ in range(8):
        value = (value << 1 ^ 0x1021 if value & 0x8000 else value << 1) & 0xFFFF
    return value


_TABLE = tuple(_remainder(byte) for byte in range(256))


def crc(data: bytes) -> int:
    """Return CRC-16/CCITT-FALSE, by a table and apart from the package's."""
    value = 0xFFFF
    for byte in data:
        value = (value << 8 & 0xFF00) ^ _TABLE[value >> 8 ^ byte]
    return value


def with_crc(data: bytes) -> bytes:
    """Return the bytes with each line's CRC made right."""
    bodies = [line.partition(b'*')[0] for line in data.split(b'\n')]
    return b'\n'.join(b'%s*%04X' % (body, crc(body)) if body else b'' for body in bodies) + b'\n'


def check(data: bytes, size: int = 1) -> str:
    """
    Feed bytes to the decoder, whole and in pieces.

    Parameters
    ----------
    data : bytes
        Any bytes, and a newline that ends the last line.
    size : int
        Of the pieces.

    Returns
    -------
    str
        What came of the lines, without what was in them: where this is new, so is the path.

    Raises
    ------
    AssertionError
        If something does not hold.
    """
    lines = Decoder().feed(data)
    decoder, pieces = Decoder(), []
    for start in range(0, len(data), size):
        pieces += decoder.feed(data[start:start + size])
    assert pieces == lines, f'other lines from pieces of {size} bytes'
    outcomes = [_outcome(line) for line in lines]
    if any(isinstance(line, Frame) for line in lines):
        _check_crc(data, [line for line in lines if isinstance(line, Frame)])
    return ' '.join(sorted(set(outcomes)))


def _check_crc(data: bytes, frames: list[Frame]) -> None:
    written = [line.removesuffix(b'\r') for line in data.split(b'\n')]
    right = {text[:-5] for text in written
             if len(text) >= 5 and text[-5:] == b'*%04X' % crc(text[:-5])}
    for frame in frames:
        fields = ''.join(f' {key}={value}' for key, value in frame.fields.items())
        # The number may have been written with zeros in front.
        assert any(body.startswith(f'{frame.kind} '.encode())
                   and body.endswith(f'{frame.sequence}{fields}'.encode())
                   for body in right), f'a frame with a wrong CRC: {frame}'


def _outcome(line: Line) -> str:
    """Return what a line is and what telemetry and greeting make of it, in few words."""
    if not isinstance(line, Frame):
        return getattr(line, 'reason', 'remark')
    found = ['frame']
    for read in (Telemetry.from_frame, Identity.from_frame):
        try:
            read(line)
            found.append(read.__qualname__)
        except ProtocolError as error:
            # The sentence without kind and value, which are as many as there are inputs.
            text = str(error).partition(' with')[2].partition('=')[0] or str(error)
            found.append(re.sub(r'[-0-9.]+', '', text)[-30:])
    return ','.join(found)
