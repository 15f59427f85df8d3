# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Half a minute of fuzzing for each parser, and fuzzers that find what is wrong."""

from importlib.util import find_spec
import re
import shutil
import subprocess
import sys

from firmware_support import FIRMWARE, make
from hysteresis_ros.bridge import protocol
import pytest
from tools import decoder_check, fuzz_decoder

DECODER_SECONDS = 25
BOARD_SECONDS = 5
# Each is found within seconds.
WRONG_CODE = {
    'a CRC that is not compared': ('frame.c', ' || said != frame->crc', '', 'a wrong CRC'),
    'a line that is too long': ('decoder.c', 'length < MAX_LINE', 'length <= MAX_LINE',
                                'out of bounds'),
    'a watchdog that does not bite': ('output.c', 'output_watch(uint32_t now)\n{',
                                      'output_watch(uint32_t now)\n{\n    (void)now;\n    return;',
                                      'outlives'),
}


def has_libfuzzer():
    """Whether clang is there, and its fuzzer with it."""
    if shutil.which('clang') is None:
        return False
    made = subprocess.run(
        ['clang', '-fsanitize=fuzzer', '-x', 'c', '-', '-o', '/dev/null'],
        input='int LLVMFuzzerTestOneInput(const char *d, long n) { (void)d; (void)n; return 0; }',
        text=True, capture_output=True, check=False)
    return made.returncode == 0


def inputs(report):
    """Return how many inputs each of our fuzzers had."""
    return [int(number) for number in re.findall(r'inputs: (\d+)', report)]


@pytest.mark.long
def test_the_firmware_stands_half_a_minute_of_fuzzing(tmp_path):
    """Its decoder alone, and the whole board, with any C compiler."""
    built = f'BUILD={tmp_path}'
    decoder, = inputs(make('fuzz_decoder', built, 'RUNS=1000000000', f'SECONDS={DECODER_SECONDS}'))
    board, = inputs(make('fuzz_board', built, 'BOARD_RUNS=1000000000', f'SECONDS={BOARD_SECONDS}'))
    # A hundredth of what an idle machine does.
    assert decoder > 400 * DECODER_SECONDS and board > 30 * BOARD_SECONDS


@pytest.mark.long
def test_the_decoder_stands_half_a_minute_of_fuzzing(tmp_path, capsys):
    """With nothing but Python."""
    assert fuzz_decoder.main(['--seconds', str(DECODER_SECONDS),
                              '--crash', str(tmp_path / 'crash')]) == 0
    done, = inputs(capsys.readouterr().out)
    assert done > 50 * DECODER_SECONDS and not (tmp_path / 'crash').exists()


@pytest.mark.skipif(not has_libfuzzer(), reason='our own fuzzer runs instead; libFuzzer too '
                    'after sudo apt install clang libclang-rt-dev')
def test_libfuzzer_finds_nothing_at_once(tmp_path):
    make('fuzz', f'BUILD={tmp_path}', 'ENGINE=libfuzzer', 'RUNS=5000', 'BOARD_RUNS=100')


@pytest.mark.skipif(find_spec('atheris') is None, reason='our own fuzzer runs instead; atheris '
                    'too after pip install atheris')
def test_atheris_finds_nothing_at_once(root, tmp_path):
    done = subprocess.run(
        [sys.executable, '-m', 'tools.fuzz_decoder', '--atheris', '-runs=2000', '-max_len=512',
         '-seed=1', f'-artifact_prefix={tmp_path}/'],
        cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.parametrize('wrong', WRONG_CODE)
def test_the_fuzzers_find_code_that_is_wrong(wrong, tmp_path):
    """The input is kept, and leads to the same end when it is given again."""
    name, right, changed, said = WRONG_CODE[wrong]
    shutil.copytree(FIRMWARE, tmp_path / 'firmware', ignore=shutil.ignore_patterns('build'))
    source = tmp_path / 'firmware' / name
    text = source.read_text(encoding='ascii')
    assert text.count(right) == 1
    source.write_text(text.replace(right, changed), encoding='ascii')
    target = 'fuzz_board' if name == 'output.c' else 'fuzz_decoder'
    done = subprocess.run(['make', '-s', '-C', str(source.parent), target,
                           'RUNS=5000000', 'BOARD_RUNS=200000'],
                          capture_output=True, text=True, check=False)
    assert done.returncode != 0 and said in done.stderr, done.stdout + done.stderr
    built = source.parent / 'build' / 'fuzz_own'
    again = subprocess.run([str(built / target), str(built / 'crash')], capture_output=True,
                           text=True, check=False)
    assert again.returncode != 0 and said in again.stderr, again.stderr


def parse_without_crc(line):
    """Read a line as the decoder does, but take any CRC."""
    body, star, _ = line.partition(b'*')
    return original(body + star + b'%04X' % protocol.crc16(body) if star else line)


def parse_without_limit(line):
    """Read a line as the decoder does, but fail at a sequence number of five digits."""
    found = original(line)
    if isinstance(found, protocol.Frame) and found.sequence > 9999:
        raise IndexError('list index out of range')
    return found


original = protocol.parse_line


@pytest.mark.parametrize('wrong, error', [(parse_without_crc, 'a frame with a wrong CRC'),
                                          (parse_without_limit, 'list index out of range')])
def test_the_fuzzer_finds_a_decoder_that_is_wrong(wrong, error, monkeypatch, tmp_path):
    """It keeps the input."""
    monkeypatch.setattr(protocol, 'parse_line', wrong)
    with pytest.raises((AssertionError, IndexError), match=error):
        fuzz_decoder.main(['--runs', '200000', '--crash', str(tmp_path / 'crash')])
    kept = (tmp_path / 'crash').read_bytes()
    with pytest.raises((AssertionError, IndexError), match=error):
        decoder_check.check(kept)
    monkeypatch.undo()
    assert decoder_check.check(kept)


def test_the_crc_of_the_fuzzer_is_that_of_the_page():
    """It judges the package's, so it has to be right by itself."""
    assert decoder_check.crc(b'123456789') == 0x29B1
    assert decoder_check.with_crc(b'hello 1*0\n\nok 2') == b'hello 1*DEB9\n\nok 2*7291\n'
