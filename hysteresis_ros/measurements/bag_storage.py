# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Raw messages of a rosbag2 recording, through `rosbags` or, without it, ROS 2's own `rosbag2_py`.

Both give (topic, receive time, bytes); so does `CutBag`, for a recording that was cut off.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
import re
from typing import Protocol, TYPE_CHECKING

from hysteresis_ros.atomic import AnyPath
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.cut_bag import CutBag, is_cut_off
from hysteresis_ros.spelling import short_list

if TYPE_CHECKING:
    from rosbags.rosbag2 import Reader

SUFFIXES = ('.mcap', '.db3')


class Storage(Protocol):
    """A recording that is open: its topics, their messages, and what is lost of it, or ''."""

    topics: dict[str, str]
    lost: str

    def __enter__(self) -> Storage:
        ...

    def __exit__(self, *exception: object) -> None:
        ...

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, time at which it was received [ns] and bytes of each message."""
        ...


def open_bag(path: AnyPath) -> Storage:
    """
    Open a recording.

    Parameters
    ----------
    path : Path
        Folder, or one storage file.

    Returns
    -------
    RosbagsStorage, Rosbag2Storage or CutBag
        A context manager with `topics`, a dict from topic to type, and `messages(topics)`.

    Raises
    ------
    MeasurementError
        If it is no bag, is damaged or empty, or neither reader is installed.

    """
    path = storage_of(Path(path))
    files = [path] if path.is_file() else sorted(
        (file for suffix in SUFFIXES for file in path.glob(f'*{suffix}')), key=_number)
    if any(map(is_cut_off, files)):
        return CutBag(path, files)
    try:
        from rosbags.rosbag2 import Reader
        return RosbagsStorage(path, Reader)
    except ImportError:
        pass
    try:
        from hysteresis_ros.measurements.bag_rosbag2 import Rosbag2Storage
    except ImportError:
        raise MeasurementError(
            f'{path}: reading a bag needs the Python package rosbags (pip install rosbags) '
            'or a sourced ROS 2 with rosbag2') from None
    return Rosbag2Storage(path)


def storage_of(path: Path) -> Path:
    """
    Return what to open: the folder, or its only storage file if the metadata is missing.

    Raises
    ------
    MeasurementError
        If there is nothing to open.

    """
    if path.is_file():
        files, whole = [path], path
    else:
        files = sorted(p for p in path.iterdir() if p.name.removesuffix('.zstd').endswith(SUFFIXES))
        whole = path
        if not (path / 'metadata.yaml').exists() and files:
            if len(files) != 1:
                raise MeasurementError(
                    f'{path}: no metadata.yaml; the recorder did not end cleanly. Run: '
                    'ros2 bag reindex FOLDER')
            whole = files[0]
    if not files:
        raise MeasurementError(f'{path}: the folder holds no bag (*.mcap or *.db3){instead(path)}')
    if all(file.stat().st_size == 0 for file in files):
        raise MeasurementError(
            f'{path}: the bag is empty (0 bytes); its recorder was killed before it wrote. '
            'Record again and end the recorder with Ctrl-C')
    return whole


def _number(file: Path) -> list[tuple[int, str]]:
    """Return what sorts files by the numbers in their names, the tenth after the second."""
    return [(int(part or 0), '') if k % 2 else (0, part)
            for k, part in enumerate(re.split(r'(\d+)', file.name))]


def instead(path: Path) -> str:
    """Say what a folder without a bag holds, and what to give instead."""
    tables = sorted(p.name for p in path.glob('*.csv'))
    if tables:
        return f'; to read its tables, name the files, such as {path / tables[0]}'
    bags = sorted(p.parent for suffix in SUFFIXES for p in path.glob(f'*/*{suffix}*'))
    if bags:
        return f'; the bag is one folder deeper, such as {bags[0]}'
    names = sorted(p.name for p in path.iterdir())
    return f' but {short_list(names, 5)}' if names else '; it is empty'


def damaged(path: Path, error: BaseException) -> MeasurementError:
    """Return the one-line error for a bag that a reader gave up on."""
    text = ' '.join(str(error).split())[:160] or type(error).__name__
    return MeasurementError(
        f'{path}: the bag cannot be read, it is truncated or damaged ({text}). Try: '
        'ros2 bag reindex FOLDER')


class RosbagsStorage:
    """A recording read by the package rosbags, without the message definitions inside it."""

    lost = ''

    def __init__(self, path: Path, reader: type[Reader]) -> None:
        self.path = path
        try:
            self.reader = reader(path)
            self.reader.open()
        except Exception as error:
            # Whatever a damaged file provokes in the library, to the user it is one thing.
            raise damaged(path, error) from None
        self.topics = {c.topic: c.msgtype for c in self.reader.connections}

    def __enter__(self) -> 'RosbagsStorage':
        return self

    def __exit__(self, *exception: object) -> None:
        self.reader.close()

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """
        Yield the messages of some topics in the order of the recording.

        Parameters
        ----------
        topics : collection of str

        Yields
        ------
        topic : str
        received : int
            ns.
        data : bytes

        """
        wanted = [c for c in self.reader.connections if c.topic in topics]
        if not wanted:
            return
        try:
            for connection, received, data in self.reader.messages(wanted):
                yield connection.topic, received, data
        except GeneratorExit:
            raise
        except Exception as error:
            raise damaged(self.path, error) from None
