# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Coverage-guided fuzzing of the host's decoder with atheris (`pip install atheris`).

    python tools/fuzz_decoder.py [-runs=1000000]

Any bytes, in any pieces: no exception, the same lines however they are cut, no frame whose CRC is
wrong, and nothing that telemetry or a greeting could make of it but numbers or a `ProtocolError`.
"""

from pathlib import Path
import sys

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

try:
    import atheris
except ImportError:
    sys.exit('fuzz_decoder: atheris is missing: pip install atheris')

with atheris.instrument_imports():
    from hysteresis_ros.bridge import messages, protocol

from hysteresis_ros.errors import ProtocolError     # noqa: E402, I100

MOST = 512      # bytes


def crc(data: bytes) -> int:
    """Return CRC-16/CCITT-FALSE, bit by bit and apart from the package's."""
    value = 0xFFFF
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ 0x1021 if value & 0x8000 else value << 1) & 0xFFFF
    return value


def with_crc(data: bytes) -> bytes:
    """Return the bytes with each line's CRC made right."""
    return b'\n'.join(line.partition(b'*')[0] + b'*%04X' % crc(line.partition(b'*')[0])
                      for line in data.split(b'\n')) + b'\n'


def check(data: bytes) -> None:
    """Feed bytes to the decoder, whole and in pieces; the first tells how."""
    how, data = data[:1], data[1:MOST]
    if how >= b'\x40':      # most changes spoil a CRC, behind which the interesting code begins
        data = with_crc(data)
    data += b'\n'
    lines = protocol.Decoder().feed(data)
    size = 1 + (how[0] if how else 0) % 32
    pieces, decoder = [], protocol.Decoder()
    for start in range(0, len(data), size):
        pieces += decoder.feed(data[start:start + size])
    assert pieces == lines
    written = [line.rstrip(b'\r') for line in data.split(b'\n')]
    for line in lines:
        if not isinstance(line, protocol.Frame):
            continue
        body = f'{line.kind} '.encode()
        assert any(text.startswith(body) and text[-4:] == b'%04X' % crc(text[:-5])
                   for text in written), line
        for read in (messages.Telemetry.from_frame, messages.Identity.from_frame):
            try:
                read(line)
            except ProtocolError:
                pass


def mutate(data: bytes, most: int, seed: int) -> bytes:
    """Change an input; often into one that begins as a real frame does."""
    if seed % 64 == 0:
        data = b'\x80' + protocol.encode('tele', 3, {
            'time': 100, 'counts': -3214, 'index': 0, 'supply': 12.009, 'duty': 0.2345, 'on': 1,
            'faults': 'none', 'ambient': 22.0})
    return atheris.Mutate(data, most)


if __name__ == '__main__':
    atheris.Setup(sys.argv, check, custom_mutator=lambda *arguments: mutate(*arguments))
    atheris.Fuzz()
