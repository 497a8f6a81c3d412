# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writing bags: a rosbag2 folder with one MCAP file, readable at every moment."""

from __future__ import annotations

import errno
import json
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from rosbags.typesys import TypesysError

from slap_ros.bags.mcap_writer import McapWriter
from slap_ros.bags.rosbag2 import TopicRecord, bag_information, to_yaml, write_metadata
from slap_ros.errors import BagExistsError, InvalidParameterError, StorageFullError
from slap_ros.messages.typestore import definition, typestore

METADATA_NAME = "slap_ros"  # of the MCAP record with the run's configuration
CHECKSUM_NAME = "slap_ros.checksum"  # of the MCAP record with that record's checksum,
CHECKSUM_KEY = "crc32"  # as MCAP has checksums for everything but metadata
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def require_new(path: Path) -> None:
    """Refuse a place for a bag before anything is recorded.

    Raises:
        BagExistsError: There is something.
    """
    if path.exists():
        raise BagExistsError(f"{path} exists; choose another folder or remove it")


def metadata_checksum(metadata: Mapping[str, str]) -> str:
    """CRC-32 of the run's configuration, whatever the order of its keys: 8 hexadecimal digits."""
    text = json.dumps(dict(metadata), sort_keys=True)
    return f"{zlib.crc32(text.encode()):08x}"


class BagWriter:
    """A bag under recording. To be used by one thread at a time.

    Every message is with the operating system when :meth:`write` returns: a bag whose process
    is killed has all of them. Closing adds what other tools want: index and ``metadata.yaml``.
    """

    def __init__(self, path: Path | str, metadata: Mapping[str, str]) -> None:
        """Create the bag.

        Args:
            path: Folder of the bag. It must not exist; missing parents are made.
            metadata: What the run was made with: configuration, seed, versions, git revision.

        Raises:
            BagExistsError: There is something at ``path``; it is left alone.
            StorageFullError: No room.
        """
        self.path = Path(path)
        self._metadata = dict(metadata)
        self._file_name = f"{self.path.name}_0.mcap"
        self._channels: dict[tuple[str, str], int] = {}
        with self._storage():
            try:
                self.path.mkdir(parents=True)
            except FileExistsError:
                raise BagExistsError(
                    f"{self.path} exists and is not overwritten; choose another name or move it"
                ) from None
            checksum = {CHECKSUM_KEY: metadata_checksum(self._metadata)}
            records = {METADATA_NAME: self._metadata, CHECKSUM_NAME: checksum}
            self._file = McapWriter(self.path / self._file_name, records)
            write_metadata(self.path, self._information())

    def write(
        self, topic: str, type_name: str, stamp_ns: int, cdr: bytes | bytearray | memoryview
    ) -> None:
        """Append a message.

        Args:
            topic: Full name, such as ``/slap/state``.
            type_name: Such as ``slap_msgs/msg/ObjectCentricState``.
            stamp_ns: When it was received, ns since the epoch.
            cdr: The message, serialised.

        Raises:
            StorageFullError: No room; all that was written before stays readable, and writing
                may go on once there is room again.
            InvalidParameterError: The type has no known definition.
        """
        with self._storage():
            channel = self._channels.get((topic, type_name))
            if channel is None:
                channel = self._add_channel(topic, type_name)
            self._file.write(channel, stamp_ns, cdr)

    def close(self) -> None:
        """Complete the bag. Closing it again does nothing.

        Raises:
            StorageFullError: No room for the index; the messages are safe.
        """
        if self._file.closed:
            return
        information = self._information()
        with self._storage():
            self._file.close({"rosbag2": {"serialized_metadata": to_yaml(information).strip()}})
            write_metadata(self.path, information)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _add_channel(self, topic: str, type_name: str) -> int:
        try:
            text, type_hash = definition(type_name), typestore().hash_rihs01(type_name)
        except TypesysError as error:
            raise InvalidParameterError(f"cannot record {topic}: {error}") from error
        channel = self._file.add_channel(TopicRecord(topic, type_name, type_hash), text)
        self._channels[topic, type_name] = channel
        return channel

    def _information(self) -> dict[str, object]:
        file = self._file
        return bag_information(self._file_name, file.topics, file.extent, self._metadata)

    @contextmanager
    def _storage(self) -> Iterator[None]:
        """Names a full disk as what it is."""
        try:
            yield
        except OSError as error:
            if error.errno in NO_ROOM:
                raise StorageFullError(
                    f"no room left for {self.path} ({error.strerror}): free some space; "
                    "what was recorded so far is readable"
                ) from error
            raise
