# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recordings that were cut off, as by a power failure, read up to their last whole chunk.

An mcap file ends with an index and a mark; without them its records are read from the beginning
(https://mcap.dev/spec). A sqlite3 file may have a journal beside it, by which sqlite rolls the
last transaction back or forward; that is done in a copy, as the recording is not to be changed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
import contextlib
import importlib
from pathlib import Path
import shutil
import sqlite3
import struct
import tempfile
from typing import BinaryIO
import zlib

from hysteresis_ros.errors import MeasurementError

MAGIC = b'\x89MCAP0\r\n'
SCHEMA, CHANNEL, MESSAGE, CHUNK = 3, 4, 5, 6
SIDECARS = ('-wal', '-journal')
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'

# (topic, time at which it was received [ns], bytes)
Message = tuple[str, int, bytes]


def is_cut_off(file: Path) -> bool:
    """Tell whether the recorder of an .mcap or .db3 file did not come to its end."""
    size = file.stat().st_size
    if file.suffix == '.db3':
        return size > 0 and (bool(_sidecars(file)) or size < _database_size(file))
    if file.suffix != '.mcap' or size < len(MAGIC):
        return False
    with open(file, 'rb') as stream:
        begins = stream.read(len(MAGIC)) == MAGIC
        stream.seek(-len(MAGIC), 2)
        return begins and (size < 2 * len(MAGIC) or stream.read() != MAGIC)


class CutBag:
    """
    Recording of which some files were cut off.

    Parameters
    ----------
    path : Path
        Of the recording, for messages.
    files : sequence of Path
        Its storage files, in the order of time.

    Attributes
    ----------
    topics : dict of str to str
        Type of each topic.
    lost : str
        One line that says what is lost.

    Raises
    ------
    MeasurementError
        If not even one message is whole.

    """

    def __init__(self, path: Path, files: Collection[Path]) -> None:
        self._path = path
        self._files = files
        self.topics: dict[str, str] = {}
        notes: list[str] = []
        count, first, last = 0, 0, 0
        for _, received, _ in self._read(notes):
            first, last = (received if count == 0 else first), max(last, received)
            count += 1
        if not count:
            raise MeasurementError(
                f'{path}: the bag cannot be read, it is truncated or damaged (it was cut off '
                'before the first chunk was whole). Record again and end the recorder with Ctrl-C')
        self.lost = (f'{path}: the recording was cut off: its {count} whole messages, of '
                     f'{(last - first) / 1e9:.1f} s, are read; {"; ".join(notes)}')

    def __enter__(self) -> CutBag:
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield topic, time at which it was received [ns] and bytes of each whole message."""
        for message in self._read([]):
            if message[0] in topics:
                yield message

    def _read(self, notes: list[str]) -> Iterator[Message]:
        for file in self._files:
            read = _read_database if file.suffix == '.db3' else _read_mcap
            yield from read(file, self.topics, notes)


def _read_mcap(file: Path, topics: dict[str, str], notes: list[str]) -> Iterator[Message]:
    schemas: dict[int, str] = {}
    channels: dict[int, str] = {}
    with open(file, 'rb') as stream:
        whole = stream.seek(len(MAGIC))
        for kind, content in _records(stream):
            try:
                if kind == CHUNK:
                    records = list(_records_in(_unpack_chunk(content)))
                else:
                    records = [(kind, content)]
                messages = list(_messages(records, schemas, channels, topics))
            except (struct.error, ValueError, KeyError, EOFError) as error:
                notes.append(f'{file.name} is damaged at byte {whole} ({error})')
                break
            yield from messages
            whole = stream.tell()
    lost = file.stat().st_size - whole
    if lost and is_cut_off(file):
        notes.append(f'what came after the last whole chunk is lost, of it {lost} bytes are in '
                     f'{file.name}')


def _records(stream: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield kind and content of each whole record."""
    while len(head := stream.read(9)) == 9:
        kind, length = struct.unpack('<BQ', head)
        here = stream.tell()
        if length > stream.seek(0, 2) - here:
            return
        stream.seek(here)
        yield kind, stream.read(length)


def _records_in(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        kind, length = struct.unpack_from('<BQ', data, at)
        if at + 9 + length > len(data):
            raise ValueError('a record is longer than its chunk')
        yield kind, data[at + 9:at + 9 + length]
        at += 9 + length


def _unpack_chunk(content: bytes) -> bytes:
    _, _, size, crc = struct.unpack_from('<QQQI', content)
    name, at = _text(content, 28)
    data = content[at + 8:]
    if name:
        data = _decompress(name, data)
    if len(data) != size or crc and zlib.crc32(data) != crc:
        raise ValueError('the CRC of a chunk is wrong')
    return data


def _messages(records: list[tuple[int, bytes]], schemas: dict[int, str],
              channels: dict[int, str], topics: dict[str, str]) -> Iterator[Message]:
    for kind, content in records:
        if kind == SCHEMA:
            schemas[struct.unpack_from('<H', content)[0]] = _text(content, 2)[0]
        elif kind == CHANNEL:
            number, schema = struct.unpack_from('<HH', content)
            channels[number] = _text(content, 4)[0]
            topics[channels[number]] = schemas.get(schema, '')
        elif kind == MESSAGE:
            number, _, received = struct.unpack_from('<HIQ', content)
            yield channels[number], received, content[22:]


def _text(content: bytes, at: int) -> tuple[str, int]:
    """Return a string and where it ends."""
    length, = struct.unpack_from('<I', content, at)
    return content[at + 4:at + 4 + length].decode(), at + 4 + length


def _decompress(name: str, data: bytes) -> bytes:
    """Undo the compression of a chunk, with the packages that rosbags brings along."""
    modules = {'zstd': ('compression.zstd', 'backports.zstd', 'zstandard'),
               'lz4': ('lz4.frame',)}.get(name, ())
    for module in modules:
        with contextlib.suppress(ImportError):
            try:
                return bytes(importlib.import_module(module).decompress(data))
            except ImportError:
                raise
            except Exception as error:      # each of them has errors of its own
                raise ValueError(str(error)) from None
    raise ValueError(f'reading its {name} compression needs the Python package rosbags')


def _read_database(file: Path, topics: dict[str, str], notes: list[str]) -> Iterator[Message]:
    sidecars = _sidecars(file)
    missing = max(_database_size(file) - file.stat().st_size, 0)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, 'copy.db3')
        shutil.copyfile(file, copy)
        for sidecar in sidecars:
            shutil.copyfile(file.with_name(file.name + sidecar), Path(f'{copy}{sidecar}'))
        with open(copy, 'ab') as stream:
            stream.truncate(stream.tell() + missing)    # else sqlite reads nothing at all
        try:
            with contextlib.closing(sqlite3.connect(copy)) as database:
                names = {}
                for number, name, kind in database.execute('SELECT id, name, type FROM topics'):
                    names[number] = name
                    topics[name] = kind
                for number, received, data in database.execute(
                        'SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id'):
                    yield names[number], received, (
                        _decompress('zstd', data) if data.startswith(ZSTD_MAGIC) else data)
        except (sqlite3.DatabaseError, KeyError, ValueError, AttributeError) as error:
            notes.append(f'what came after them is lost ({" ".join(str(error).split())})')
    if missing:
        notes.append(f'{missing} bytes of {file.name} are missing')
    if sidecars:
        notes.append(f'what {file.name}{sidecars[0]} does not have whole is lost')


def _sidecars(file: Path) -> list[str]:
    paths = {end: file.with_name(file.name + end) for end in SIDECARS}
    return [end for end, path in paths.items() if path.exists() and path.stat().st_size]


def _database_size(file: Path) -> int:
    """Return how many bytes sqlite's header promises; 0 if it is none."""
    with open(file, 'rb') as stream:
        header = stream.read(100)
    if len(header) < 100 or not header.startswith(b'SQLite format 3\0'):
        return 0
    page, = struct.unpack_from('>H', header, 16)
    pages, = struct.unpack_from('>I', header, 28)
    return (65536 if page == 1 else page) * pages
