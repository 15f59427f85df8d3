# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The firmware's parser and writer, compiled for this computer, against the host's, both ways."""

import ctypes
import re

from firmware_support import (
    build_library, LINE_FRAME, LINE_NONE, LINE_REMARK, Number, ParsedFrame, REASONS, Text, written)
from hypothesis import example, given, strategies as st
from hysteresis_ros.bridge.protocol import (
    BadLine, crc16, Decoder, encode, Frame, MAX_LINE, parse_line, Remark, write_number)
import pytest

WORDS = st.text('abcdefghijklmnopqrstuvwxyz', min_size=1, max_size=8)
VALUES = st.text([chr(c) for c in range(33, 127) if chr(c) != '*'], min_size=1, max_size=10)
FIELDS = st.dictionaries(WORDS, VALUES, max_size=6)
SEQUENCES = st.integers(0, 65535)
GOOD = st.builds(encode, WORDS, SEQUENCES, FIELDS)
PIECES = st.text('abz_=. 0129#-*AF\r"~', max_size=30).map(str.encode)


def with_crc(body):
    return body + b'*%04X' % crc16(body)


def flip(line, bit):
    wrong = bytearray(line)
    wrong[bit // 8 % len(wrong)] ^= 1 << bit % 8
    return bytes(wrong)


# Lines that are good, nearly good, and anything; those with a right CRC reach the inner checks.
LINES = st.one_of(
    GOOD, st.builds(flip, GOOD, st.integers(0, 1600)), PIECES.map(with_crc), PIECES,
    st.binary(max_size=250).filter(lambda data: b'\n' not in data),
    st.builds(lambda body, pair: with_crc(body.partition(b'*')[0] + pair + pair), GOOD,
              st.sampled_from([b' a=1', b' dd_=x', b'', b' a'])),
    st.builds(lambda number: with_crc(b'set %d a=1' % number), st.integers(65000, 120000)))


@pytest.fixture(scope='module')
def firmware_library(tmp_path_factory):
    """Build the firmware for this computer."""
    return build_library(tmp_path_factory.mktemp('firmware'))


@pytest.fixture(scope='module')
def parse(firmware_library):
    """Return what decodes a stream by the firmware's code, into the host's kinds of lines."""
    def keys_of(text):
        return re.findall(r' ([a-z_]+)=', text.decode('ascii'))

    def value(frame, key):
        found = Text()
        assert firmware_library.frame_value(ctypes.byref(frame), key.encode(), ctypes.byref(found))
        return found.bytes().decode('ascii')

    def run(stream):
        firmware_library.decoder_start()
        frame = ParsedFrame()
        found = []
        for byte in stream:
            line = firmware_library.decoder_feed(byte, ctypes.byref(frame))
            if line == LINE_FRAME:
                fields = frame.fields.bytes()
                found.append(Frame(frame.kind.bytes().decode(), frame.sequence,
                                   {key: value(frame, key) for key in keys_of(fields)}))
            elif line == LINE_REMARK:
                found.append(Remark(''))
            elif line != LINE_NONE:
                found.append((REASONS[line], f'{frame.crc:04X}' if frame.has_crc else ''))
        return found
    return run


def expected(stream):
    """Return what the host's decoder makes of a stream, as `parse` puts it."""
    return [Remark('') if isinstance(line, Remark)
            else (line.reason, line.checksum) if isinstance(line, BadLine) else line
            for line in Decoder().feed(stream)]


@given(st.binary(max_size=255))
def test_crc(firmware_library, data):
    """Both ends protect a line by the same number."""
    assert firmware_library.crc16(data, len(data)) == crc16(data)


@given(st.lists(LINES, max_size=6), st.sampled_from([b'\n', b'\r\n']))
@example([b'a' * 191], b'\n')
@example([b'a' * 192], b'\n')
@example([b'', b'#', b'*', b'a 0*', b'a 1 =x', b'a  1', b'a 1 b=', b'a 1 '], b'\n')
def test_every_line_means_the_same_to_both_ends(parse, lines, end):
    """Frames, remarks and bad lines with reasons and hints: whatever the bytes."""
    stream = b''.join(line.rstrip(b'\n') + end for line in lines)
    assert parse(stream) == expected(stream)


@given(st.binary(max_size=600))
def test_any_bytes_mean_the_same_to_both_ends(parse, stream):
    """Also where no line was meant."""
    assert parse(stream + b'\n') == expected(stream + b'\n')


def test_every_flipped_bit_of_a_setpoint_is_noticed(parse):
    """No wrong duty is ever obeyed because of one wrong bit."""
    line = encode('set', 65535, {'duty': 1.0})
    for bit in range(8 * len(line)):
        assert not any(isinstance(found, Frame) for found in parse(flip(line, bit) + b'\n'))


DECIMAL = re.compile(r'(-?)([0-9]{1,10})(?:\.([0-9]{1,10}))?')


@given(st.one_of(st.text('-0123456789.', max_size=24), st.from_regex(DECIMAL, fullmatch=True),
                 st.floats(-1e9, 1e9).map(write_number), st.text(max_size=5)))
@example('4294967295')
@example('4294967296')
@example('9999999999')
@example('0.0000000001')
@example('0.00000000001')
@example('00000000001')
@example('-')
@example('1.')
def test_numbers(firmware_library, text):
    """The same texts are numbers, with the same values as far as 32 bits reach."""
    data = text.encode('ascii', 'replace')
    number = Number()
    buffer = ctypes.create_string_buffer(data, len(data) + 1)
    read = firmware_library.number_read(
        Text(ctypes.cast(buffer, ctypes.c_void_p), len(data)), ctypes.byref(number))
    match = DECIMAL.fullmatch(data.decode('ascii'))
    assert read == bool(match)
    if match:
        sign, whole, fraction = match.groups()
        assert number.negative == bool(sign)
        assert number.has_point == (fraction is not None)
        assert number.whole == min(int(whole), 2 ** 32 - 1)
        assert number.millionths == int((fraction or '').ljust(6, '0')[:6])
        assert number.has_fraction == bool((fraction or '').strip('0'))


@given(WORDS, st.lists(st.one_of(
    st.tuples(st.just('word'), VALUES), st.tuples(st.just('unsigned'), st.integers(0, 2**32 - 1)),
    st.tuples(st.just('signed'), st.integers(-2 ** 31, 2 ** 31 - 1)),
    st.tuples(st.just('decimal'), st.tuples(st.integers(0, 2 ** 32 - 1), st.integers(1, 9)))),
    max_size=5), SEQUENCES)
def test_the_host_reads_what_the_firmware_writes(
        firmware_library, kind, values, sequence):
    """Every frame arrives whole, with its CRC."""
    library = firmware_library
    library.host_start()
    library.writer_start()
    for _ in range(sequence % 300):     # running numbers come by themselves
        library.writer_begin(b'x')
    written(library)
    library.writer_begin(kind.encode())
    fields = {}
    for number, (form, value) in enumerate(values):
        key = 'abcde'[number]
        if form == 'word':
            library.writer_word(key.encode(), value.encode())
            fields[key] = value
        elif form == 'decimal':
            amount, decimals = value
            library.writer_decimal(key.encode(), ctypes.c_uint32(amount), decimals)
            digits = str(amount).rjust(decimals + 1, '0')
            fields[key] = f'{digits[:-decimals]}.{digits[-decimals:]}'
        else:
            write = library.writer_signed if form == 'signed' else library.writer_unsigned
            write(key.encode(), ctypes.c_int32(value) if form == 'signed'
                  else ctypes.c_uint32(value))
            fields[key] = str(value)
    assert library.writer_end()
    line = written(library)
    assert parse_line(line.rstrip(b'\n')) == Frame(kind, sequence % 300, fields)
    assert line == encode(kind, sequence % 300, fields)


def test_a_line_that_would_be_too_long_is_not_sent(firmware_library):
    """Rather nothing than the half of it."""
    library = firmware_library
    library.host_start()
    written(library)
    for length, fits in ((MAX_LINE - len('a 1 b=') - 6, True), (MAX_LINE, False)):
        library.writer_begin(b'a')
        library.writer_word(b'b', b'x' * length)
        assert library.writer_end() is fits
        assert len(written(library)) == (MAX_LINE if fits else 0)
