# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Lines of ASCII between host and board: pure bytes, no input or output.

A frame is one line, ``kind sequence key=value ...*CRC`` and a newline::

    set 17 duty=0.23450*3B00

The CRC is CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF, nothing reflected, no final
inversion; "123456789" gives 29B1) of every byte before the asterisk, as four upper-case
hexadecimal digits. A line that begins with ``#`` is a remark for people and carries no CRC.
Everything else is a bad line: counted, never acted on. `docs/protocol.md` is the whole page.
"""

import binascii
from collections.abc import Callable
import math
import numbers
import re
from typing import Mapping, NamedTuple, TypeVar, Union

from hysteresis_ros.errors import ProtocolError

VERSION = 1
MAX_LINE = 192
SEQUENCE_LIMIT = 1 << 16

Number = TypeVar('Number', int, float)
# What a frame can carry: text without spaces, and numbers.
Fields = Mapping[str, Union[str, int, float]]

_BODY = re.compile(rb'([a-z]+) ([0-9]{1,5})((?: [a-z_]+=[!-)+-~]+)*)')
_WORD = re.compile(r'[a-z]+')
_KEY = re.compile(r'[a-z_]+')
_VALUE = re.compile(r'[!-)+-~]+')
_CHECKSUM = re.compile(rb'[0-9A-F]{4}')
_INTEGER = re.compile(r'-?[0-9]{1,10}')
_DECIMAL = re.compile(r'-?[0-9]{1,10}(?:\.[0-9]{1,10})?')


class Frame(NamedTuple):
    """
    One line whose CRC is right.

    Attributes
    ----------
    kind : str
        What it is: ``set``, ``tele``, ... (lower-case letters).
    sequence : int
        The sender's running number, 0 to 65535, then 0 again.
    fields : Mapping[str, str]
        Values as they stand in the line; `integer` and `decimal` read them.

    """

    kind: str
    sequence: int
    fields: Mapping[str, str]


class Remark(NamedTuple):
    """A line for people (it began with ``#``)."""

    text: str


class BadLine(NamedTuple):
    """
    A line that is no frame.

    Attributes
    ----------
    reason : str
        What is wrong with it, for a person.
    text : str
        The line's first 60 characters, printable.
    checksum : str
        The CRC that would have made the line right, or '' where no CRC could.

    """

    reason: str
    text: str
    checksum: str


Line = Union[Frame, Remark, BadLine]


def crc16(data: bytes) -> int:
    """
    CRC-16/CCITT-FALSE of some bytes.

    Parameters
    ----------
    data : bytes
        What to protect.

    Returns
    -------
    int
        0 to 65535. Any single, double or odd number of wrong bits in a line changes it.

    """
    return binascii.crc_hqx(data, 0xFFFF)


def encode(kind: str, sequence: int, fields: Fields | None = None) -> bytes:
    """
    Write a frame as the bytes that go over the wire.

    Parameters
    ----------
    kind : str
        Lower-case letters.
    sequence : int
        0 to 65535.
    fields : Mapping[str, str or int or bool or float], optional
        Numbers are written as `write_number` does.

    Returns
    -------
    bytes
        The line with its CRC and newline, at most `MAX_LINE` bytes.

    Raises
    ------
    ProtocolError
        If a name or value cannot be written (NaN, a space, an asterisk, ...), or if the line
        would be too long.

    """
    if not _WORD.fullmatch(kind):
        raise ProtocolError(f'kind of frame {kind!r}: use lower-case letters only')
    if not 0 <= sequence < SEQUENCE_LIMIT:
        raise ProtocolError(f'sequence number {sequence}: 0 to {SEQUENCE_LIMIT - 1} are possible')
    words = [kind, str(int(sequence))]
    for key, value in (fields or {}).items():
        text = value if isinstance(value, str) else write_number(value)
        if not _KEY.fullmatch(key) or not _VALUE.fullmatch(text):
            raise ProtocolError(f'field {key!r}={text!r} of a {kind!r} frame: lower-case key, '
                                'value of printable ASCII without blanks and asterisks')
        words.append(f'{key}={text}')
    body = ' '.join(words).encode('ascii')
    line = body + b'*%04X\n' % crc16(body)
    if len(line) > MAX_LINE:
        raise ProtocolError(f'{kind!r} frame of {len(line)} bytes: {MAX_LINE} are the most')
    return line


def write_number(value: float, decimals: int = 5) -> str:
    """
    Write a number so that a microcontroller without printf or scanf can read it.

    Parameters
    ----------
    value : int or bool or float
        Booleans become 1 and 0; no exponents are ever written.
    decimals : int
        Digits after the point of a float.

    Returns
    -------
    str

    Raises
    ------
    ProtocolError
        If the value is not finite or has more than 10 digits before the point.

    """
    whole = isinstance(value, numbers.Integral)
    if not whole and not math.isfinite(value):
        raise ProtocolError(f'number {value}: only finite numbers can be sent')
    text = str(int(value)) if whole else f'{value:.{decimals}f}'
    if not _DECIMAL.fullmatch(text):
        raise ProtocolError(f'number {value}: at most 10 digits can be sent')
    return text


def integer(frame: Frame, key: str, default: int | None = None) -> int:
    """
    Read a whole number from a frame.

    Parameters
    ----------
    frame : Frame
        Where to look.
    key : str
        Name of the field.
    default : int, optional
        What to return where the field is missing; without it, a missing field is an error.

    Returns
    -------
    int

    Raises
    ------
    ProtocolError
        If the field is missing or no whole number.

    """
    return _number(frame, key, default, _INTEGER, int, 'a whole number')


def decimal(frame: Frame, key: str, default: float | None = None) -> float:
    """
    Read a decimal number from a frame.

    Parameters
    ----------
    frame : Frame
        Where to look.
    key : str
        Name of the field.
    default : float, optional
        What to return where the field is missing; without it, a missing field is an error.

    Returns
    -------
    float
        Always finite: neither NaN nor an exponent can be written.

    Raises
    ------
    ProtocolError
        If the field is missing or no decimal number.

    """
    return _number(frame, key, default, _DECIMAL, float, 'a decimal number')


def _number(frame: Frame, key: str, default: Number | None, form: re.Pattern[str],
            convert: Callable[[str], Number], wanted: str) -> Number:
    text = frame.fields.get(key)
    if text is None:
        if default is None:
            raise ProtocolError(f'{frame.kind!r} frame without {key!r}')
        return default
    if not form.fullmatch(text):
        raise ProtocolError(f'{frame.kind!r} frame with {key}={text}: needs {wanted}')
    return convert(text)


def parse_line(line: bytes) -> Line | None:
    """
    Read one line, without its newline.

    Parameters
    ----------
    line : bytes
        Any bytes at all. A carriage return at the end is ignored.

    Returns
    -------
    Frame or Remark or BadLine or None
        None for an empty line, which only ends whatever garbage came before it.

    """
    if line.endswith(b'\r'):
        line = line[:-1]
    if not line:
        return None
    if line.startswith(b'#'):
        return Remark(_printable(line[1:].strip(), MAX_LINE))
    body, star, checksum = line.partition(b'*')
    match = _BODY.fullmatch(body)
    right = f'{crc16(body):04X}' if match else ''
    if not star:
        return BadLine('no CRC at its end', _printable(line), right)
    if not _CHECKSUM.fullmatch(checksum) or int(checksum, 16) != crc16(body):
        return BadLine('its CRC is wrong', _printable(line), right)
    if not match:
        return BadLine('not of the form "kind sequence key=value"', _printable(line), '')
    kind, sequence, pairs = match.groups()
    pairs = [item.split('=', 1) for item in pairs.decode('ascii').split()]
    fields = dict(pairs)
    if len(fields) < len(pairs) or int(sequence) >= SEQUENCE_LIMIT:
        return BadLine('a key twice, or a sequence number above 65535', _printable(line), '')
    return Frame(kind.decode('ascii'), int(sequence), fields)


def _printable(data: bytes, length: int = 60) -> str:
    text = data[:length].decode('ascii', 'backslashreplace')
    if text.isprintable():
        return text[:length]
    return ''.join(c if c.isprintable() else f'\\x{ord(c):02x}' for c in text)[:length]


class Decoder:
    """
    Frames out of a stream of bytes, whatever the stream holds.

    Bytes may come in any pieces. After garbage the next newline brings the decoder back into
    step. It never holds more than `MAX_LINE` bytes and never raises.

    Attributes
    ----------
    frames, remarks, bad_lines : int
        How many of each have come so far.
    last_bad : BadLine or None
        The latest bad line.

    """

    def __init__(self) -> None:
        self.frames = 0
        self.remarks = 0
        self.bad_lines = 0
        self.last_bad: BadLine | None = None
        self._line = bytearray()
        self._cut = False       # the line under way may lack its beginning

    def begin(self) -> None:
        """
        Begin anew on a stream that may be in the middle of a line.

        The rest of a line that began before anybody listened is dropped, not counted as bad.
        """
        self._line.clear()
        self._cut = True

    def feed(self, data: bytes) -> list[Line]:
        """
        Take bytes as they come from the port.

        Parameters
        ----------
        data : bytes
            Any number of bytes.

        Returns
        -------
        list of Frame, Remark and BadLine
            What these bytes completed, in order.

        """
        found: list[Line] = []
        *ends, tail = data.split(b'\n')
        for piece in ends:
            self._append(piece)
            line = self._take()
            if line is not None:
                found.append(line)
        self._append(tail)
        return found

    def _append(self, piece: bytes) -> None:
        self._line += piece[:MAX_LINE - len(self._line)]

    def _take(self) -> Line | None:
        line: Line | None
        if len(self._line) >= MAX_LINE:
            line = BadLine(f'longer than {MAX_LINE} bytes', _printable(bytes(self._line)), '')
        else:
            line = parse_line(bytes(self._line))
        self._line.clear()
        cut, self._cut = self._cut, False
        if isinstance(line, Frame):
            self.frames += 1
        elif isinstance(line, Remark):
            self.remarks += 1
        elif line is not None:
            self.last_bad = line
            if cut:
                return None
            self.bad_lines += 1
        return line
