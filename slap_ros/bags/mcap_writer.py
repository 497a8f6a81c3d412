# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An MCAP writer that a killed process cannot leave unreadable.

rosbags' and mcap's writers hold chunks of a megabyte in memory: killed, they lose them. Here
every message goes to the operating system at once, and the file is a valid sequence of records
at every moment. A chunk begins as the header of an empty one; the records that follow stand
beside it until it is complete, and then one write of its header takes them in, with their
checksum. A closed file is thus an ordinary chunked and indexed one, and a file whose writer was
killed has some last records outside of chunks, no index and no footer.

A write that does not fit the disk is taken back, so that it happens wholly or not at all.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import slap_ros
from slap_ros.bags.bit_correction import CORRECTABLE_BYTES
from slap_ros.bags.mcap_records import (
    CHUNK,
    FOOTER,
    INDEX_ENTRY,
    LIBRARY,
    MAGIC,
    MESSAGE,
    MESSAGE_RECORD,
    RECORD,
    SEQUENCE_MASK,
    U16,
    U32,
    U64,
    Opcode,
    prefixed,
    record,
    string,
    string_map,
)
from slap_ros.bags.rosbag2 import Extent, TopicRecord

CHUNK_SIZE = CORRECTABLE_BYTES  # at most, but for a longer message: a flipped bit costs nothing


@dataclass
class _Chunk:
    """A chunk under construction."""

    start: int  # offset of its header in the file
    extent: Extent = field(default_factory=Extent)
    crc: int = 0
    index: dict[int, bytearray] = field(default_factory=dict)  # by channel

    @property
    def data_start(self) -> int:
        return self.start + len(self.header(0))

    def header(self, size: int) -> bytes:
        """Everything that comes before its ``size`` bytes of records."""
        start, end = (self.extent.start_ns, self.extent.end_ns) if size else (0, 0)
        head = CHUNK.pack(start, end, size, self.crc if size else 0) + string("")
        return RECORD.pack(Opcode.CHUNK, len(head) + 8 + size) + head + U64.pack(size)


class McapWriter:
    """One MCAP file of ROS 2 messages. To be used by one thread at a time."""

    def __init__(self, path: Path, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Create the file.

        Args:
            path: Must not exist.
            metadata: Metadata records, by name.

        Raises:
            OSError: It exists or cannot be written.
        """
        self.topics: list[TopicRecord] = []  # channel i is topic i - 1
        self.extent = Extent()
        self._schemas: dict[str, bytes] = {}  # by type name; schema i is the i-th
        self._channels: list[bytes] = []
        self._metadata_index: list[bytes] = []
        self._chunk_index: list[bytes] = []
        self._chunk: _Chunk | None = None
        self._size = 0  # of the file
        self._file = path.open("xb", buffering=0)  # unbuffered: straight to the operating system
        try:
            self._start(metadata)
        except OSError:
            self._file.close()
            raise

    def _start(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        library = f"{LIBRARY} {slap_ros.__version__}"
        self._append(MAGIC + record(Opcode.HEADER, string("ros2"), string(library)))
        for name, entries in metadata.items():
            self._append_metadata(name, entries)

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return self._file.closed

    def add_channel(self, topic: TopicRecord, definition: str) -> int:
        """Announce a topic.

        Returns:
            The channel to write its messages to.

        Raises:
            OSError: There is no room; nothing was written.
        """
        if topic.type_name not in self._schemas:
            schema = record(
                Opcode.SCHEMA,
                U16.pack(len(self._schemas) + 1),
                string(topic.type_name),
                string("ros2msg"),
                string(definition),
            )
            self._append_to_chunk(schema)
            self._schemas[topic.type_name] = schema
        number = len(self._channels) + 1
        channel = record(
            Opcode.CHANNEL,
            U16.pack(number),
            U16.pack(1 + list(self._schemas).index(topic.type_name)),
            string(topic.name),
            string("cdr"),
            string_map(
                {"offered_qos_profiles": topic.qos_yaml, "topic_type_hash": topic.type_hash}
            ),
        )
        self._append_to_chunk(channel)
        self._channels.append(channel)
        self.topics.append(topic)
        return number

    def write(self, channel: int, stamp_ns: int, data: bytes | bytearray | memoryview) -> None:
        """Append a message.

        Args:
            channel: Number of the message's channel, from :meth:`add_channel`.
            stamp_ns: When it was received, ns since the epoch.
            data: The message, serialised.

        Raises:
            OSError: There is no room; nothing was written.
        """
        # Messages are numbered through the whole bag, so that a reader sees where some are lost.
        sequence = self.extent.message_count & SEQUENCE_MASK
        head = MESSAGE_RECORD.pack(
            Opcode.MESSAGE, MESSAGE.size + len(data), channel, sequence, stamp_ns, stamp_ns
        )
        chunk, offset = self._append_to_chunk(head + data)
        chunk.index.setdefault(channel, bytearray()).extend(INDEX_ENTRY.pack(stamp_ns, offset))
        chunk.extent.include(stamp_ns)
        self.extent.include(stamp_ns)
        self.topics[channel - 1].message_count += 1

    def close(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Complete the file with more metadata, index and footer.

        Raises:
            OSError: There is no room for them; the messages are safe.
        """
        try:
            self._finish_chunk()
            for name, entries in metadata.items():
                self._append_metadata(name, entries)
            self._append(self._ending())
            os.fsync(self._file.fileno())
        finally:
            self._file.close()

    def _append(self, data: bytes) -> None:
        """Write at the end of the file, all or nothing."""
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) :]
        except OSError:
            self._cut(self._size)
            raise
        self._size += len(data)

    def _cut(self, size: int) -> None:
        """Take back what was written beyond ``size``."""
        self._file.truncate(size)
        self._file.seek(size)
        self._size = size

    def _append_to_chunk(self, data: bytes) -> tuple[_Chunk, int]:
        """Append a record to the current chunk or to a new one, where it has the given offset."""
        chunk = self._chunk_with_room(len(data))
        offset = self._size - chunk.data_start
        self._append(data)
        chunk.crc = zlib.crc32(data, chunk.crc)
        return chunk, offset

    def _append_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        start = self._size
        self._append(record(Opcode.METADATA, string(name), string_map(entries)))
        where = U64.pack(start) + U64.pack(self._size - start)
        self._metadata_index.append(record(Opcode.METADATA_INDEX, where, string(name)))

    def _chunk_with_room(self, size: int) -> _Chunk:
        """The current chunk, or a new one where that would become too long.

        A chunk with no message takes one of any length: what it has would otherwise be in none.
        """
        chunk = self._chunk
        if chunk and chunk.index and self._size + size - chunk.data_start > CHUNK_SIZE:
            self._finish_chunk()
        if self._chunk is None:
            chunk = _Chunk(self._size)
            self._append(chunk.header(0))
            self._chunk = chunk
        return self._chunk

    def _finish_chunk(self) -> None:
        """Append the message index, then let the chunk's header take its records in."""
        chunk = self._chunk
        if chunk is None or not chunk.index:
            self._chunk = None  # schemas without messages may stay outside
            return
        index_start = self._size
        size = index_start - chunk.data_start
        indices, offsets = b"", b""
        for channel, entries in chunk.index.items():
            offsets += U16.pack(channel) + U64.pack(index_start + len(indices))
            indices += record(Opcode.MESSAGE_INDEX, U16.pack(channel), prefixed(bytes(entries)))
        self._append(indices)
        try:
            os.pwrite(self._file.fileno(), chunk.header(size), chunk.start)
        except OSError:
            self._cut(index_start)
            raise
        self._chunk_index.append(
            record(
                Opcode.CHUNK_INDEX,
                U64.pack(chunk.extent.start_ns),
                U64.pack(chunk.extent.end_ns),
                U64.pack(chunk.start),
                U64.pack(index_start - chunk.start),
                prefixed(offsets),
                U64.pack(len(indices)),
                string(""),
                U64.pack(size),
                U64.pack(size),
            )
        )
        self._chunk = None

    def _ending(self) -> bytes:
        """Everything from the end of the data on."""
        data_end = record(Opcode.DATA_END, U32.pack(0))  # 0: chunks have checksums of their own
        summary = b"".join(
            [
                *self._schemas.values(),
                *self._channels,
                *self._chunk_index,
                *self._metadata_index,
                self._statistics(),
            ]
        )
        start = self._size + len(data_end)
        footer = record(Opcode.FOOTER, FOOTER.pack(start, 0, 0))[: -U32.size]
        crc = zlib.crc32(summary + footer)
        return data_end + summary + footer + U32.pack(crc) + MAGIC

    def _statistics(self) -> bytes:
        extent = self.extent
        counts = b"".join(
            U16.pack(number) + U64.pack(topic.message_count)
            for number, topic in enumerate(self.topics, start=1)
        )
        return record(
            Opcode.STATISTICS,
            U64.pack(extent.message_count),
            U16.pack(len(self._schemas)),
            U32.pack(len(self._channels)),
            U32.pack(0),  # attachments
            U32.pack(len(self._metadata_index)),
            U32.pack(len(self._chunk_index)),
            U64.pack(extent.start_ns if extent.message_count else 0),
            U64.pack(extent.end_ns),
            prefixed(counts),
        )
