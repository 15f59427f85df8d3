# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The firmware built for this computer, spoken to through ctypes."""

import ctypes
from pathlib import Path
import shutil
import subprocess

from hysteresis_ros.bridge.protocol import BadLine, Decoder, encode, Frame
import pytest

FIRMWARE = Path(__file__).resolve().parents[1] / 'firmware'
PWM_STEPS = 1020
# What runs the machine code, and how to see whether it is there.
SIMAVR_TOOLS = {'gcc': 'gcc', 'make': 'make', 'avr-gcc': 'gcc-avr avr-libc', 'simavr': 'simavr'}
SIMAVR_HEADER = Path('/usr/include/simavr/sim_avr.h')
LINE_NONE, LINE_FRAME, LINE_REMARK = 0, 1, 2
REASONS = {3: 'longer than 192 bytes', 4: 'no CRC at its end', 5: 'its CRC is wrong',
           6: 'not of the form "kind sequence key=value"',
           7: 'a key twice, or a sequence number above 65535'}


class Text(ctypes.Structure):
    """struct text."""

    _fields_ = [('start', ctypes.c_void_p), ('length', ctypes.c_uint8)]

    def bytes(self):
        """Return the characters."""
        return ctypes.string_at(self.start, self.length)


class ParsedFrame(ctypes.Structure):
    """struct frame."""

    _fields_ = [('kind', Text), ('fields', Text), ('sequence', ctypes.c_uint16),
                ('crc', ctypes.c_uint16), ('has_crc', ctypes.c_bool)]


class Number(ctypes.Structure):
    """struct number."""

    _fields_ = [('negative', ctypes.c_bool), ('has_point', ctypes.c_bool),
                ('has_fraction', ctypes.c_bool), ('whole', ctypes.c_uint32),
                ('millionths', ctypes.c_uint32)]


def without_simavr():
    """Return a mark that skips where the machine code cannot run, and says what to install."""
    missing = [package for tool, package in SIMAVR_TOOLS.items() if shutil.which(tool) is None]
    missing += [] if SIMAVR_HEADER.exists() else ['libsimavr-dev']
    return pytest.mark.skipif(bool(missing), reason=f'sudo apt install {" ".join(missing)} runs '
                              'the firmware in simavr')


def make(*arguments):
    """Run the firmware's make and return what it prints; fail with it where it fails."""
    done = subprocess.run(['make', '-s', '-C', str(FIRMWARE), *arguments],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def build_library(folder, *arguments):
    """Return the firmware as a library, or skip where there is no C compiler."""
    for tool in ('make', 'cc'):
        if shutil.which(tool) is None:
            pytest.skip(f'{tool} is not installed: sudo apt install build-essential')
    make('host', f'BUILD={folder}', *arguments)
    library = ctypes.CDLL(str(folder / 'libfirmware.so'))
    library.crc16.restype = ctypes.c_uint16
    library.decoder_text.restype = Text
    library.number_read.restype = ctypes.c_bool
    library.frame_value.restype = ctypes.c_bool
    library.writer_end.restype = ctypes.c_bool
    library.host_pwm.restype = ctypes.c_uint16
    return library


def written(library):
    """Return what the firmware has written since the last call."""
    buffer = ctypes.create_string_buffer(65536)
    length = library.host_transmit(buffer, len(buffer))
    return buffer.raw[:length]


class HostBoard:
    """The firmware's board; its methods are those of the simulated one."""

    def __init__(self, library):
        self.library = library
        self.sequence = 0
        library.host_set_supply(12000)
        library.host_open_stop(False)
        library.host_jam_port(False)
        library.host_start()
        self.lines = Decoder()

    def receive(self, data):
        """Take bytes from the host, all at the present moment."""
        self.library.host_receive(data, len(data))
        for _ in range(len(data) // 32 + 1):
            self.library.host_step()

    def transmit(self):
        """Return all that was written."""
        return written(self.library)

    def advance(self, milliseconds):
        """Let time pass."""
        self.library.host_advance(milliseconds)

    def frames(self):
        """Return the frames that were written, all of them good."""
        lines = self.lines.feed(self.transmit())
        assert not any(isinstance(line, BadLine) for line in lines), lines
        return [line for line in lines if isinstance(line, Frame)]

    def ask(self, kind, **fields):
        """Send a frame and return what comes back at once, (kind, fields) or None."""
        self.transmit()
        self.sequence += 1
        self.receive(encode(kind, self.sequence, fields))
        answers = self.frames()
        return (answers[0].kind, dict(answers[0].fields)) if answers else None

    def telemetry(self):
        """Wait for the next telemetry and return its fields."""
        self.transmit()
        for _ in range(1000):
            self.advance(1)
            found = [frame for frame in self.frames() if frame.kind == 'tele']
            if found:
                return dict(found[-1].fields)
        raise AssertionError('no telemetry')

    @property
    def pwm(self):
        """Steps that the gates get."""
        return self.library.host_pwm()

    def turn(self, start, edges):
        """Move the encoder from a count by so many edges and return the count after it."""
        step = 1 if edges > 0 else -1
        for count in range(start + step, start + edges + step, step):
            phase = count % 4
            self.library.host_tracks(phase in (1, 2), phase in (2, 3))
        return start + edges
