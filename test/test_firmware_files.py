# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The firmware's files: style, static checks, the bound of its stack, and a README that is true."""

from pathlib import Path
import re
import shutil
import subprocess
import sys

from firmware_support import build_library, FIRMWARE, HostBoard, make
from hysteresis_ros.bridge.messages import FAULTS
import pytest
from tools import firmware_stack


HEADER = ('// Copyright 2026 hysteresis_ros contributors\n'
          '// SPDX-License-Identifier: Apache-2.0\n//\n')
SOURCES = sorted(path for path in FIRMWARE.rglob('*.[ch]') if 'build' not in path.parts)
SOURCES.append(Path(__file__).with_name('simavr_board.c'))


def needs(tool, packages):
    return pytest.mark.skipif(shutil.which(tool) is None,
                              reason=f'{tool} is missing: sudo apt install {packages}')


@pytest.mark.parametrize('path', SOURCES, ids=lambda path: path.name)
def test_c_files_are_in_style(path):
    """Header, what the file is for, 100 columns, no tabs, one newline at the end."""
    text = path.read_text(encoding='ascii')
    assert text.startswith(HEADER) or path.suffix == '.c' and text.startswith(HEADER[:-3])
    assert '\t' not in text and '\r' not in text
    assert text.endswith('\n') and not text.endswith('\n\n')
    for number, line in enumerate(text.splitlines(), 1):
        assert len(line) <= 100 and line == line.rstrip(), f'{path.name}:{number}'


def test_only_the_hardware_knows_the_chip():
    """What is compiled for both must not ask for which; flash.h alone tells two memories apart."""
    for path in SOURCES:
        if path.parent == FIRMWARE and path.name != 'flash.h':
            text = path.read_text(encoding='ascii')
            assert '<avr/' not in text and '__AVR__' not in text, path.name


@needs('cppcheck', 'cppcheck')
def test_cppcheck_finds_nothing():
    """Neither for the chip nor for the computer."""
    make('check')


@needs('avr-gcc', 'gcc-avr avr-libc')
def test_the_machine_code_fits(tmp_path):
    """Size and stack are printed, with room for a person to add something."""
    report = make('all', f'BUILD={tmp_path}', f'PYTHON={sys.executable}')
    assert int(re.search(r'Program: +(\d+) bytes', report).group(1)) < 16384
    assert int(re.search(r'(\d+) of 2048 bytes', report).group(1)) < 1536
    assert (tmp_path / 'firmware.hex').read_text().startswith(':')


LISTING = """
00000000 <main>:
   0:\tff 93       \tpush\tr31
   2:\t0e 94 00 00 \tcall\t0x10\t; 0x10 <one>
   6:\tfd cf       \trjmp\t.-6      \t; 0x2 <main+0x2>
00000010 <one>:
  10:\t0c 94 00 00 \tjmp\t0x20\t; 0x20 <two>
00000020 <two>:
  20:\t{instruction}
"""


def depth_of(instruction):
    functions = firmware_stack.read_functions(LISTING.format(instruction=instruction))
    return firmware_stack.deepest('main', functions, {'one': 7})


def test_the_stack_is_that_of_the_deepest_path():
    """Frames that the compiler knows, else pushes and the return address."""
    assert depth_of('08 95       \tret') == (3 + 7 + 2, ('main', 'one', 'two'))


@pytest.mark.parametrize('instruction, reason', [
    ('0e 94 00 00 \tcall\t0x10\t; 0x10 <one>', 'recursion'),
    ('0e 94 00 00 \tcall\t0x20\t; 0x20 <two>', 'recursion'),
    ('09 95       \ticall', 'pointer')])
def test_a_stack_without_bound_is_refused(instruction, reason):
    """A program that could use any amount of memory must not be flashed."""
    with pytest.raises(ValueError, match=reason):
        depth_of(instruction)


def test_the_readme_shows_what_the_board_says(tmp_path):
    """A person who types what it says sees what it says."""
    library = build_library(tmp_path)
    shown = re.findall(r'^    ([<>]) (.+)$', (FIRMWARE / 'README.md').read_text('utf-8'), re.M)
    assert len(shown) > 8
    board = HostBoard(library)
    said = []
    for direction, line in shown:
        if direction == '>':
            board.receive(line.encode('ascii') + b'\n')
            said.append(('>', line))
        said += [('<', answer) for answer in board.transmit().decode('ascii').splitlines()]
        board.advance(0)
    assert said == shown


def test_every_fault_and_refusal_is_documented(root):
    """What the board says, the page of the protocol and the host's messages know."""
    page = (root / 'docs' / 'protocol.md').read_text('utf-8')
    telemetry = (FIRMWARE / 'telemetry.c').read_text('ascii')
    names = re.search(r'names\[\]\[\d+\] = \{(.+?)\}', telemetry).group(1)
    faults = re.findall(r'"(\w+)"', names) + ['counts_lost']
    reasons = re.findall(r'= "(\w+)",', (FIRMWARE / 'commands.c').read_text('ascii'))
    assert len(faults) == 5 and len(reasons) == 7
    for name in faults + reasons:
        assert f'`{name}`' in page, name
    assert set(faults) <= FAULTS.keys()


def test_flashing_names_the_file_that_is_built():
    """The README's avrdude is the Makefile's."""
    done = subprocess.run(['make', '-n', '-o', 'build/firmware.hex', '-C', str(FIRMWARE), 'flash'],
                          capture_output=True, text=True, check=True)
    command = next(line for line in done.stdout.splitlines() if line.startswith('avrdude'))
    assert command in (FIRMWARE / 'README.md').read_text('utf-8')
