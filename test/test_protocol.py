# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The wire protocol: whatever the bytes, frames come through whole or not at all."""

import math

from hypothesis import example, given, settings, strategies as st
from hysteresis_ros.bridge.messages import Identity, Telemetry
from hysteresis_ros.bridge.protocol import (
    BadLine, crc16, decimal, Decoder, encode, Frame, integer, MAX_LINE, parse_line, Remark,
    write_number)
from hysteresis_ros.errors import ProtocolError
import pytest

WORDS = st.text('abcdefghijklmnopqrstuvwxyz', min_size=1, max_size=8)
VALUES = st.text([chr(c) for c in range(33, 127) if chr(c) != '*'], min_size=1, max_size=10)
FRAMES = st.builds(Frame, WORDS, st.integers(0, 65535),
                   st.dictionaries(WORDS, VALUES, max_size=6))


def frames_of(lines):
    return [line for line in lines if isinstance(line, Frame)]


def decode(data):
    return Decoder().feed(data)


def test_crc_is_ccitt_false():
    assert crc16(b'123456789') == 0x29B1
    assert crc16(b'') == 0xFFFF


def test_frame_looks_like_the_documentation():
    assert encode('set', 17, {'duty': 0.2345}) == b'set 17 duty=0.23450*3B00\n'


@given(FRAMES)
def test_round_trip(frame):
    assert decode(encode(*frame)) == [frame]


@given(st.lists(FRAMES, max_size=5), st.data())
def test_pieces_do_not_matter(frames, data):
    stream = b''.join(encode(*frame) for frame in frames)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    decoder = Decoder()
    found = []
    for start, end in zip([0, *cuts], [*cuts, len(stream)]):
        found += decoder.feed(stream[start:end])
    assert found == frames
    assert decoder.frames == len(frames)


@given(st.lists(st.binary(max_size=600), max_size=5))
@example([b'*\n', b'* *0000\n', b'\r\n', b'#\n', b'a 0*\n'])
def test_any_bytes_never_raise_and_never_pile_up(chunks):
    decoder = Decoder()
    lines = []
    for chunk in chunks:
        lines += decoder.feed(chunk)
        assert len(decoder._line) <= MAX_LINE
    assert len(lines) == decoder.frames + decoder.remarks + decoder.bad_lines
    assert all(isinstance(line, (Frame, BadLine, Remark)) for line in lines)


@given(st.binary(max_size=400), FRAMES)
def test_next_newline_brings_it_back_into_step(garbage, frame):
    assert decode(garbage + b'\n' + encode(*frame))[-1] == frame


@given(FRAMES, st.data())
def test_a_flipped_bit_is_always_noticed(frame, data):
    line = bytearray(encode(*frame))
    bit = data.draw(st.integers(0, 8 * len(line) - 1))
    line[bit // 8] ^= 1 << bit % 8
    assert frames_of(decode(bytes(line) + b'\n')) == []


def test_every_flipped_bit_of_a_setpoint_is_noticed():
    line = encode('set', 65535, {'duty': 1.0})
    for bit in range(8 * len(line)):
        wrong = bytearray(line)
        wrong[bit // 8] ^= 1 << bit % 8
        assert frames_of(decode(bytes(wrong) + b'\n')) == []


@given(FRAMES, st.data())
def test_a_lost_byte_is_noticed(frame, data):
    line = encode(*frame)
    lost = data.draw(st.integers(0, len(line) - 1))
    found = frames_of(decode(line[:lost] + line[lost + 1:] + b'\n'))
    assert found in ([], [frame])  # without its newline the frame is still whole
    assert found == [] or lost == len(line) - 1


def test_lines_for_people():
    assert parse_line(b'# hello\r') == Remark('hello')
    assert parse_line(b'') is None
    assert parse_line(b'\r') is None


def test_line_typed_by_hand_gets_the_checksum_it_lacks():
    body = b'enable 4'
    line = parse_line(body)
    assert isinstance(line, BadLine) and line.reason == 'no CRC at its end'
    assert parse_line(body + b'*' + line.checksum.encode()) == Frame('enable', 4, {})


@pytest.mark.parametrize('line, reason', [
    (b'set 1 duty=0.5*0000', 'CRC is wrong'),
    (b'set 1 duty=0.5*', 'CRC is wrong'),
    (b'set 1 duty=0.5*00000', 'CRC is wrong'),
    (b'\xff\x00\x1b[2J', 'no CRC'),
])
def test_bad_lines_say_why(line, reason):
    bad = parse_line(line)
    assert isinstance(bad, BadLine) and reason in bad.reason
    assert bad.text.isprintable()


@pytest.mark.parametrize('body', [
    b'SET 1', b'set', b'set x', b'set 123456', b'set 65536', b'set 1 duty', b'set 1  duty=1',
    b'set 1 duty=1 duty=2', b'set -1', b'set 1 duty=', b'set 1 d\xfcty=1'])
def test_right_crc_does_not_excuse_a_wrong_form(body):
    assert isinstance(parse_line(body + b'*%04X' % crc16(body)), BadLine)


def test_lower_case_checksum_is_refused():
    line = encode('set', 17, {'duty': 0.3}).strip()
    assert any(c in b'ABCDEF' for c in line[-4:])
    assert isinstance(parse_line(line[:-4] + line[-4:].lower()), BadLine)


def test_long_line_counts_once():
    decoder = Decoder()
    lines = decoder.feed(b'x' * 100_000 + b'\n' + encode('hello', 1))
    assert [type(line) for line in lines] == [BadLine, Frame]
    assert 'longer' in lines[0].reason
    assert decoder.bad_lines == 1 and decoder.last_bad is lines[0]


def test_the_rest_of_a_line_that_began_before_anybody_listened_is_no_bad_line():
    telemetry = encode('telemetry', 0, {'counts': 7})
    decoder = Decoder()
    decoder.begin()
    assert [frame.sequence for frame in decoder.feed(telemetry[1:] + encode('ok', 1))] == [1]
    assert decoder.bad_lines == 0
    assert isinstance(decoder.feed(telemetry[1:])[0], BadLine) and decoder.bad_lines == 1
    decoder.begin()
    assert [frame.sequence for frame in decoder.feed(telemetry)] == [0]


def test_a_line_that_was_under_way_does_not_spoil_the_next():
    """A port that is opened anew begins anew."""
    decoder = Decoder()
    assert decoder.feed(b'tele 1 ti') == []
    decoder.begin()
    frame = Frame('ok', 7, {'re': '4'})
    assert decoder.feed(encode('ok', 7, {'re': '4'})) == [frame]
    assert decoder.bad_lines == 0


def test_longest_line_that_can_be_written_can_be_read():
    room = MAX_LINE - len(encode('x', 1, {'k': ''.ljust(1, 'v')})) + 1
    frame = Frame('x', 1, {'k': 'v' * room})
    assert len(encode(*frame)) == MAX_LINE
    assert decode(encode(*frame)) == [frame]
    with pytest.raises(ProtocolError, match='most'):
        encode('x', 1, {'k': 'v' * (room + 1)})


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, 1e300, 10 ** 11, 10 ** 400])
def test_numbers_that_cannot_be_sent(value):
    with pytest.raises(ProtocolError, match='number'):
        encode('set', 1, {'duty': value})


@pytest.mark.parametrize('kind, sequence, fields', [
    ('Set', 1, {}), ('', 1, {}), ('set', -1, {}), ('set', 65536, {}), ('set', 1, {'a b': 1}),
    ('set', 1, {'a': 'x y'}), ('set', 1, {'a': '*'}), ('set', 1, {'a': ''}),
    ('set', 1, {'a': '\n'})])
def test_frames_that_cannot_be_written(kind, sequence, fields):
    with pytest.raises(ProtocolError):
        encode(kind, sequence, fields)


@given(st.floats(-1e9, 1e9))
def test_numbers_need_no_exponent(value):
    text = write_number(value)
    assert 'e' not in text and abs(float(text) - value) <= 0.5e-5 + 1e-15 * abs(value)


@pytest.mark.parametrize('text', ['nan', 'inf', '1e3', '0x10', '', '--1', '1.', '.5', '1_0'])
def test_only_plain_numbers_are_read(text):
    frame = Frame('set', 1, {'duty': text})
    with pytest.raises(ProtocolError, match='duty'):
        decimal(frame, 'duty')
    with pytest.raises(ProtocolError, match='duty'):
        integer(frame, 'duty')


def test_missing_fields():
    frame = Frame('set', 1, {})
    with pytest.raises(ProtocolError, match='without'):
        decimal(frame, 'duty')
    assert decimal(frame, 'duty', 0.5) == 0.5
    assert integer(frame, 'period', 7) == 7


@given(st.builds(
    Telemetry, time=st.integers(0, 2 ** 32 - 1), counts=st.integers(-2 ** 31, 2 ** 31 - 1),
    supply=st.integers(0, 48_000).map(lambda mv: mv / 1000),
    duty=st.integers(0, 10 ** 5).map(lambda d: d / 10 ** 5), enabled=st.booleans(),
    faults=st.lists(st.sampled_from(['watchdog', 'supply', 'current', 'encoder']),
                    max_size=4, unique=True).map(tuple),
    index=st.integers(0, 65535), latch=st.none() | st.integers(-2 ** 31, 2 ** 31 - 1),
    ambient=st.none() | st.integers(-4000, 9000).map(lambda c: c / 100),
    accepted=st.none() | st.integers(0, 65535), obeyed=st.none() | st.integers(0, 65535)))
@settings(max_examples=200)
def test_telemetry_round_trip(telemetry):
    frame, = decode(encode('tele', 65535, telemetry.fields()))
    assert Telemetry.from_frame(frame) == telemetry


def test_identity_round_trip():
    identity = Identity(1, 'bicep', '1.0', 7, 4_000_000_000, 16, 60.0)
    frame, = decode(encode('board', 3, identity.fields()))
    assert Identity.from_frame(frame) == identity


@pytest.mark.parametrize('fields', [
    {'protocol': 1, 'boot': 1, 'time': 0, 'bits': 8},
    {'protocol': 1, 'boot': 1, 'time': 0, 'speed': 0},
    {'protocol': 1, 'boot': 1}, {'protocol': 1, 'time': 0}, {'boot': 1, 'time': 0}])
def test_identities_that_make_no_sense(fields):
    with pytest.raises(ProtocolError):
        Identity.from_frame(decode(encode('board', 1, fields))[0])
