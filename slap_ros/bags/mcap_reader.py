# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading MCAP files from beginning to end, up to the first damage.

The index at a file's end is not used: a file whose writer was killed has none. A chunk in which one
bit was flipped is read as it was written, and reported when there is nothing more to read.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import lz4.frame  # type: ignore[import-untyped]
from backports import zstd

from slap_ros.bags.bit_correction import flipped_bit, with_flipped_bit
from slap_ros.bags.compression import SUFFIX, open_data
from slap_ros.bags.compression import UNREADABLE as UNPACKABLE
from slap_ros.bags.mcap_records import (
    CHUNK,
    FIRST_PRIVATE_OPCODE,
    LIBRARY,
    MAGIC,
    MESSAGE,
    RECORD,
    SEQUENCE_MASK,
    MalformedRecordError,
    Opcode,
    RecordFields,
)
from slap_ros.bags.raw import Channel, MessageDefinition, RawMessage, one_line
from slap_ros.bags.reading_budget import MAX_RECORD_BYTES, ReadingBudget
from slap_ros.errors import DamagedBagError
from slap_ros.files import open_regular

UNREADABLE = (MalformedRecordError, UnicodeDecodeError, OSError)
MOST_CORRECTIONS = 100  # of chunks in a file; each takes some ten milliseconds
IGNORED = (Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA)  # outside of chunks


class _EndOfFileError(Exception):
    """The file ends within a record; carries what there is of it."""

    def __init__(self, opcode: int, content: bytes) -> None:
        super().__init__()
        self.opcode = opcode
        self.content = content


def read_mcap(
    path: Path, shown: Path | None = None, budget: ReadingBudget | None = None
) -> Iterator[RawMessage]:
    """The messages, in the order in which they were written.

    Args:
        path: File to read.
        shown: Name of the file for people, where it is another.
        budget: Budget of the bag for its chunks; None for that of a bag of this file alone.

    Raises:
        DamagedBagError: After the last message that precedes the damage; after the last one of all
            where every damage was corrected.
    """
    try:
        with open_regular(path) as file:
            size = path.stat().st_size
            scan = _McapScan(file, size, budget or ReadingBudget(path, size))
            yield from scan.messages()
    except UNREADABLE as error:
        raise DamagedBagError(f"{shown or path} {_complaint(error)}") from error


def read_mcap_metadata(path: Path, name: str) -> dict[str, str]:
    """A metadata record from before the first message; empty where there is none to be read."""
    try:
        with open_data(path) as file:
            size = MAX_RECORD_BYTES if path.suffix == SUFFIX else path.stat().st_size
            return _McapScan(file, size, ReadingBudget(path, size)).metadata(name)
    except (*UNREADABLE, *UNPACKABLE):
        return {}  # reading the messages tells what is wrong


class _McapScan:
    """One pass through a file."""

    def __init__(self, file: BinaryIO, size: int, budget: ReadingBudget) -> None:
        self._file = file
        self._size = size
        self._budget = budget
        self._position = 0
        self._schemas: dict[int, tuple[str, MessageDefinition]] = {}
        self._channels: dict[int, Channel] = {}
        self._count = 0  # messages so far
        self._numbered = False  # whether the file's messages are numbered throughout
        self._corrected: list[int] = []  # offsets of chunks in which a bit was flipped

    def messages(self) -> Iterator[RawMessage]:
        complaints = []
        try:
            yield from self._stored()
        except (MalformedRecordError, UnicodeDecodeError) as error:
            complaints.append(str(error))
        complaints.extend(self._corrections())
        if complaints:
            raise MalformedRecordError("; ".join(complaints))

    def _stored(self) -> Iterator[RawMessage]:
        """The messages up to the first damage that cannot be corrected."""
        self._check_magic("is not an MCAP file" if self._size else "is empty")
        while True:
            start = self._position
            try:
                opcode, content = self._next_record()
            except _EndOfFileError as end:
                if end.opcode == Opcode.CHUNK:
                    yield from self._truncated_chunk(end.content)
                raise MalformedRecordError(
                    f"ends early, at byte {self._size}: its recorder was killed or it was cut off"
                ) from None
            try:
                if opcode == Opcode.DATA_END:
                    return self._check_ending(content)
                if opcode == Opcode.CHUNK:
                    yield from self._records(self._chunk(start, content))
                else:
                    yield from self._top_level(opcode, content)
            except (MalformedRecordError, UnicodeDecodeError) as error:
                raise MalformedRecordError(
                    f"is damaged in the record at byte {start}: {error}"
                ) from None

    def metadata(self, name: str) -> dict[str, str]:
        self._check_magic("is not an MCAP file")
        while True:
            try:
                opcode, content = self._next_record()
            except _EndOfFileError:
                return {}
            if opcode == Opcode.METADATA:
                with suppress(MalformedRecordError, UnicodeDecodeError):  # the next one may do
                    fields = RecordFields(content)
                    if fields.string() == name:
                        return fields.string_map()
            elif opcode != Opcode.HEADER:
                return {}

    def _check_magic(self, complaint: str) -> None:
        if self._read(len(MAGIC)) != MAGIC:
            raise MalformedRecordError(complaint)

    def _read(self, size: int) -> bytes:
        """At most so many bytes; never more than the file has, whatever a record claims."""
        data = self._file.read(min(size, self._size - self._position))
        self._position += len(data)
        return data

    def _skip(self, size: int) -> bytes:
        """Go on behind so many bytes; returns none."""
        if size > self._size - self._position:
            raise _EndOfFileError(Opcode.ATTACHMENT, b"")
        self._file.seek(size, os.SEEK_CUR)
        self._position += size
        return b""

    def _next_record(self) -> tuple[int, bytes]:
        head = self._read(RECORD.size)
        if len(head) < RECORD.size:
            raise _EndOfFileError(0, b"")
        opcode, length = RECORD.unpack(head)
        if opcode == Opcode.ATTACHMENT:  # of any size, and nothing to us
            return opcode, self._skip(length)
        content = self._read(min(length, MAX_RECORD_BYTES))
        if len(content) < length:
            if self._position < self._size:
                raise MalformedRecordError(_too_large("has a record", length))
            raise _EndOfFileError(opcode, content)
        return opcode, content

    def _top_level(self, opcode: int, content: bytes) -> Iterator[RawMessage]:
        if opcode == Opcode.HEADER:
            fields = RecordFields(content)
            fields.string()  # profile
            self._numbered = fields.string().startswith(LIBRARY)
        elif opcode not in IGNORED and opcode < FIRST_PRIVATE_OPCODE:
            yield from self._record(opcode, memoryview(content))

    def _chunk(self, start: int, content: bytes) -> memoryview:
        """The records of a complete chunk at an offset of the file, checked and uncompressed."""
        fields = RecordFields(content)
        _, _, size, crc = CHUNK.unpack(fields.take(CHUNK.size))
        compression = fields.string()
        if fields.u64() != fields.left:
            raise MalformedRecordError("a chunk's length contradicts itself")
        if size > MAX_RECORD_BYTES:
            raise MalformedRecordError(_too_large("a chunk", size))
        if compression:
            self._budget.spend(size)
        data = _decompress(compression, fields.rest(), size)
        if len(data) != size:
            raise MalformedRecordError(f"a chunk of {size} bytes has {len(data)}")
        if crc and zlib.crc32(data) != crc:
            # A flipped bit in compressed data is many in what it unpacks to.
            place = None if compression else flipped_bit(data, crc)
            if place is None or len(self._corrected) >= MOST_CORRECTIONS:
                raise MalformedRecordError("a chunk's checksum is wrong")
            self._corrected.append(start)
            return with_flipped_bit(data, place)
        return data

    def _corrections(self) -> Iterator[str]:
        """What was corrected, in words; none where nothing was."""
        match self._corrected:
            case [start]:
                yield f"has a flipped bit in the chunk at byte {start}, which was corrected"
            case [start, *more]:
                yield (
                    f"has a flipped bit in each of {1 + len(more)} chunks, the first at byte "
                    f"{start}, which were corrected"
                )

    def _truncated_chunk(self, content: bytes) -> Iterator[RawMessage]:
        """What can be read of a chunk that the file breaks off in."""
        try:
            fields = RecordFields(content)
            fields.take(CHUNK.size)
            compression, _ = fields.string(), fields.u64()
            if not compression:
                yield from self._records(fields.rest())
        except (MalformedRecordError, UnicodeDecodeError):
            return  # here the file ends, as the caller reports

    def _records(self, data: memoryview) -> Iterator[RawMessage]:
        fields = RecordFields(data)
        while fields.left:
            opcode, length = RECORD.unpack(fields.take(RECORD.size))
            yield from self._record(opcode, fields.take(length))

    def _record(self, opcode: int, content: memoryview) -> Iterator[RawMessage]:
        if opcode == Opcode.MESSAGE:
            yield self._message(content)
        elif opcode == Opcode.SCHEMA:
            fields = RecordFields(content)
            number, name = fields.u16(), fields.string()
            self._schemas[number] = (name, MessageDefinition(fields.string(), fields.string()))
        elif opcode == Opcode.CHANNEL:
            fields = RecordFields(content)
            number, schema = fields.u16(), fields.u16()
            type_name, definition = self._schemas.get(schema, ("", MessageDefinition()))
            self._channels[number] = Channel(
                fields.string(), type_name, fields.string(), definition
            )
        else:
            raise MalformedRecordError(f"there is no record of kind {opcode:#04x}")

    def _message(self, content: memoryview) -> RawMessage:
        fields = RecordFields(content)
        number, sequence, log_time, _ = MESSAGE.unpack(fields.take(MESSAGE.size))
        if number not in self._channels:
            raise MalformedRecordError(f"a message of the unknown channel {number}")
        if self._numbered and sequence != self._count & SEQUENCE_MASK:
            raise MalformedRecordError(f"messages from number {self._count} on are missing")
        self._count += 1
        return RawMessage(self._channels[number], log_time, fields.rest())

    def _check_ending(self, data_end: bytes) -> None:
        """Read the summary: it tells whether messages are missing."""
        if len(data_end) < 4:
            raise MalformedRecordError("the end of the data is no such record")
        while True:
            try:
                opcode, content = self._next_record()
            except _EndOfFileError:
                raise MalformedRecordError("the index is incomplete") from None
            if opcode == Opcode.STATISTICS and (told := RecordFields(content).u64()) != self._count:
                raise MalformedRecordError(f"has {self._count} messages and claims {told}")
            if opcode == Opcode.FOOTER:
                return self._check_magic("the index is damaged")


def _complaint(error: Exception) -> str:
    return f"cannot be read: {error.strerror}" if isinstance(error, OSError) else str(error)


def _too_large(what: str, size: int) -> str:
    return f"{what} of {size} bytes; at most {MAX_RECORD_BYTES // 2**20} MiB are read at once"


def _decompress(compression: str, data: memoryview, size: int) -> memoryview:
    """At most ``size`` bytes, whatever the compressed data claims."""
    try:
        match compression:
            case "":
                return data
            case "zstd":
                return memoryview(zstd.ZstdDecompressor().decompress(data, max_length=size))
            case "lz4":
                frame = lz4.frame.LZ4FrameDecompressor()
                return memoryview(frame.decompress(data, max_length=size))
    except (zstd.ZstdError, RuntimeError, EOFError, OverflowError, MemoryError) as error:
        raise MalformedRecordError(f"a chunk cannot be uncompressed: {one_line(error)}") from error
    raise MalformedRecordError(f"the compression {compression!r} is not known")
