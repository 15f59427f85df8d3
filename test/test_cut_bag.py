# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that a power failure has cut off are read as far as they are whole."""

import importlib
import shutil
import sqlite3
import struct
import zlib

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import read_measurement
from hysteresis_ros.measurements.table import MeasurementWarning
import numpy as np
import pytest
from test_bag import run, START, STORE, write_bag    # skips this, too, without rosbags

ROWS = 90


def text(value):
    return struct.pack('<I', len(value)) + value.encode()


def record(kind, content):
    return struct.pack('<BQ', kind, len(content)) + content


def joint_states(count):
    """Return how many of the first messages of `run` make a row."""
    return sum(topic == '/joint_states' for _, topic, _ in run()[:count])


def compressor(name):
    """Return what rosbags compresses with, whichever version it is."""
    for module in {'zstd': ('compression.zstd', 'backports.zstd', 'zstandard'),
                   'lz4': ('lz4.frame',)}[name]:
        try:
            return importlib.import_module(module).compress
        except ImportError:
            pass
    return pytest.skip(f'{name} is not installed')


def mcap(messages, size, compress=None):
    """Write what a recorder has written before its end: header, then chunks of `size` messages."""
    data = b'\x89MCAP0\r\n' + record(1, text('ros2') + text('test'))
    numbers, records, ends = {}, b'', []
    name, pack = compress or ('', lambda chunk: chunk)
    for k, (wall, topic, (kind, message)) in enumerate(messages):
        if topic not in numbers:
            numbers[topic] = len(numbers) + 1
            records += record(3, struct.pack('<H', numbers[topic]) + text(kind) + text('ros2msg')
                              + text(''))
            records += record(4, struct.pack('<HH', numbers[topic], numbers[topic]) + text(topic)
                              + text('cdr') + text(''))
        received = START + round(wall * 1e9)
        records += record(5, struct.pack('<HIQQ', numbers[topic], k, received, received)
                          + bytes(STORE.serialize_cdr(message, kind)))
        if k % size == size - 1:
            chunk = pack(records)
            data += record(6, struct.pack('<QQQI', 0, 0, len(records), zlib.crc32(records))
                           + text(name) + struct.pack('<Q', len(chunk)) + chunk)
            records = b''
            ends.append((len(data), k + 1))
    return data, ends


@pytest.mark.parametrize('compression', [None, 'zstd', 'lz4'])
def test_mcap_without_its_end_is_read_to_the_last_whole_chunk(tmp_path, compression):
    """Wherever it was cut, with one line that says what is lost."""
    data, ends = mcap(run(), 10, compression and (compression, compressor(compression)))
    for cut, (end, count) in [(ends[k][0] + more, ends[k]) for k in (3, 6) for more in (0, 40)]:
        file = tmp_path / 'run.mcap'
        file.write_bytes(data[:cut])
        with pytest.warns(MeasurementWarning, match='was cut off') as told:
            table = read_measurement(file)
        assert table.rows == joint_states(count)
        np.testing.assert_allclose(table.column('angle'), 2.0 - 0.1 * table.column('voltage'))
        note, = (str(one.message) for one in told if 'was cut off' in str(one.message))
        assert f'its {count} whole messages' in note and '\n' not in note
        assert (f'{cut - end} bytes are in run.mcap' in note) == (cut > end)


def test_mcap_with_a_wrong_byte_is_read_up_to_it(tmp_path):
    data, ends = mcap(run(), 10)
    spoiled = bytearray(data)
    spoiled[ends[4][0] + 300] ^= 1
    (tmp_path / 'run.mcap').write_bytes(spoiled)
    with pytest.warns(MeasurementWarning, match='the CRC of a chunk is wrong'):
        assert read_measurement(tmp_path / 'run.mcap').rows == joint_states(
            ends[4][1])


def test_mcap_without_a_whole_chunk_is_refused(tmp_path):
    data, ends = mcap(run(), 10)
    (tmp_path / 'run.mcap').write_bytes(data[:ends[0][0] - 1])
    with pytest.raises(MeasurementError, match='truncated or damaged') as refused:
        read_measurement(tmp_path / 'run.mcap')
    assert '\n' not in str(refused.value)


def test_a_folder_is_read_over_all_of_its_files(tmp_path):
    """The second after the first, where only the last one was cut."""
    messages = run()
    bag = write_bag(tmp_path / 'bag', messages[:31])
    next(bag.glob('*.mcap')).rename(bag / 'bag_2.mcap')
    data, ends = mcap(messages[:1] + messages[31:], 10)
    (bag / 'bag_10.mcap').write_bytes(data[:ends[2][0] + 9])
    with pytest.warns(MeasurementWarning, match='its 61 whole messages.*bag_10.mcap'):
        table = read_measurement(bag)
    assert table.rows == 30 + 28 and np.all(np.diff(table.time) > 0.0)


def cut_transaction(bag, mode, keep):
    """Spoil a database as a power failure does: in a transaction that nobody will end."""
    file = next(bag.glob('*.db3'))
    shutil.move(file, bag / 'whole')
    copy = sqlite3.connect(bag / 'whole', isolation_level=None)
    copy.execute(f'PRAGMA journal_mode={mode}')
    copy.execute('PRAGMA cache_size=2')
    copy.execute('PRAGMA wal_autocheckpoint=0')
    copy.execute('BEGIN')
    copy.execute('DELETE FROM messages WHERE id > ?', (keep,))
    copy.execute('UPDATE messages SET data = zeroblob(4000)')
    if mode == 'WAL':
        copy.execute('ROLLBACK')
        copy.execute('BEGIN')
        copy.execute('DELETE FROM messages WHERE id > ?', (keep,))
        copy.execute('COMMIT')
    for end in ('', '-wal', '-journal'):
        if (bag / f'whole{end}').exists():
            shutil.copyfile(bag / f'whole{end}', f'{file}{end}')
    copy.close()
    for left in bag.glob('whole*'):
        left.unlink()
    (bag / 'metadata.yaml').unlink()
    return file


@pytest.mark.parametrize('mode, kept', [('DELETE', ROWS + 3), ('WAL', 50)])
def test_sqlite_with_its_journal_is_as_the_journal_says(tmp_path, mode, kept):
    """Rolled back to before the transaction that was cut, or forward to the last whole one."""
    bag = write_bag(tmp_path / 'bag', run(), 'SQLITE3')
    file = cut_transaction(bag, mode, 50)
    before = {path.name: path.read_bytes() for path in bag.iterdir()}
    assert len(before) == 2
    with pytest.warns(MeasurementWarning, match=f'its {kept} whole messages.*{file.name}'):
        table = read_measurement(bag)
    assert table.rows == joint_states(kept)
    np.testing.assert_allclose(table.column('angle'), 2.0 - 0.1 * table.column('voltage'))
    assert before == {path.name: path.read_bytes() for path in bag.iterdir()}


def test_sqlite_whose_last_pages_are_missing_is_read_before_them(tmp_path):
    bag = write_bag(tmp_path / 'bag', run(hold=300.0), 'SQLITE3')
    file = next(bag.glob('*.db3'))
    data = file.read_bytes()
    file.write_bytes(data[:int(0.6 * len(data))])
    missing = len(data) - int(0.6 * len(data))
    with pytest.warns(MeasurementWarning, match=f'{missing} bytes of {file.name} are missing'):
        table = read_measurement(bag)
    assert 300 < table.rows < 900
    whole = np.repeat([1.0, 2.0, 0.5], 300)[:table.rows]
    np.testing.assert_array_equal(table.column('voltage'), whole)
