# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Raw messages of a recording through ROS 2's own `rosbag2_py`.

The only module outside the nodes that imports a part of ROS; it is imported when a bag is read
and the package `rosbags` is not installed.
"""

from collections.abc import Collection, Iterator

from pathlib import Path

from hysteresis_ros.measurements.bag_storage import damaged
import rosbag2_py


class Rosbag2Storage:
    """A recording read by ROS 2's own reader."""

    lost = ''

    def __init__(self, path: Path) -> None:
        self.path = path
        compressed = self.compressed()
        self.reader = (rosbag2_py.SequentialCompressionReader() if compressed
                       else rosbag2_py.SequentialReader())
        try:
            self.reader.open(
                rosbag2_py.StorageOptions(uri=str(path), storage_id=self.storage_id()),
                rosbag2_py.ConverterOptions('cdr', 'cdr'))
            self.topics = {t.name: t.type for t in self.reader.get_all_topics_and_types()}
        except Exception as error:
            # The C++ reader throws RuntimeError, and other types from version to version.
            raise damaged(path, error) from None

    def __enter__(self) -> 'Rosbag2Storage':
        return self

    def __exit__(self, *exception: object) -> None:
        self.reader = None

    def files(self) -> list[str]:
        """Return the names of the storage files."""
        return [self.path.name] if self.path.is_file() else [p.name for p in self.path.iterdir()]

    def compressed(self) -> bool:
        """Tell whether the files or messages are compressed by rosbag2 (mcap does it itself)."""
        metadata = self.path / 'metadata.yaml'
        text = metadata.read_text('utf-8') if metadata.is_file() else ''
        return any(n.endswith('.zstd') for n in self.files()) or 'compression_format: zstd' in text

    def storage_id(self) -> str:
        """Return the name of the storage plugin."""
        return 'sqlite3' if any('.db3' in name for name in self.files()) else 'mcap'

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, received in ns, bytes); as `RosbagsStorage.messages`."""
        self.reader.set_filter(rosbag2_py.StorageFilter(topics=list(topics)))
        try:
            while self.reader.has_next():
                topic, data, received = self.reader.read_next()
                yield topic, received, data
        except RuntimeError as error:
            raise damaged(self.path, error) from None
