# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""MCAP records: how they are laid out (https://mcap.dev/spec)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from enum import IntEnum

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "slap_ros"  # how the header of our own files begins to name the software


class Opcode(IntEnum):
    """The kind of a record."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    DATA_END = 0x0F


SEQUENCE_MASK = 2**32 - 1  # messages are numbered in 32 bits
FIRST_PRIVATE_OPCODE = 0x80  # from here on applications may define their own

RECORD = struct.Struct("<BQ")  # opcode, length of the content
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time (ns), publish time (ns)
MESSAGE_RECORD = struct.Struct("<BQHIQQ")  # both in one, for speed
CHUNK = struct.Struct("<QQQI")  # first and last log time (ns), size and CRC uncompressed
INDEX_ENTRY = struct.Struct("<QQ")  # log time (ns), offset in the chunk
FOOTER = struct.Struct("<QQI")  # start of summary, start of summary offsets, CRC
U16, U32, U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")


class MalformedRecordError(ValueError):
    """Bytes that are not the record they should be."""


def record(opcode: Opcode, *content: bytes) -> bytes:
    """A record made of these parts."""
    return RECORD.pack(opcode, sum(map(len, content))) + b"".join(content)


def prefixed(data: bytes) -> bytes:
    """Bytes with their length in front."""
    return U32.pack(len(data)) + data


def string(text: str) -> bytes:
    """A string field."""
    return prefixed(text.encode())


def string_map(entries: Mapping[str, str]) -> bytes:
    """A map field from strings to strings."""
    return prefixed(b"".join(string(key) + string(value) for key, value in entries.items()))


class RecordFields:
    """Takes the fields of a record one after the other.

    Every method raises :class:`MalformedRecordError` where the record is too short, and
    ``UnicodeDecodeError`` where text is not UTF-8.
    """

    def __init__(self, content: bytes | memoryview) -> None:
        self._content = memoryview(content)
        self._position = 0

    @property
    def left(self) -> int:
        """Bytes not yet taken."""
        return len(self._content) - self._position

    def take(self, size: int) -> memoryview:
        """So many bytes."""
        if size > self.left:
            raise MalformedRecordError(f"a field of {size} bytes where {self.left} are left")
        start, self._position = self._position, self._position + size
        return self._content[start : self._position]

    def rest(self) -> memoryview:
        """All that is left."""
        return self.take(self.left)

    def u16(self) -> int:
        """An unsigned integer of 16 bits."""
        value: int = U16.unpack(self.take(2))[0]
        return value

    def u32(self) -> int:
        """An unsigned integer of 32 bits."""
        value: int = U32.unpack(self.take(4))[0]
        return value

    def u64(self) -> int:
        """An unsigned integer of 64 bits."""
        value: int = U64.unpack(self.take(8))[0]
        return value

    def prefixed(self) -> memoryview:
        """Bytes with their length in front."""
        return self.take(self.u32())

    def string(self) -> str:
        """A string field, without its length."""
        return bytes(self.prefixed()).decode()

    def string_map(self) -> dict[str, str]:
        """A map from strings to strings."""
        entries, found = RecordFields(self.prefixed()), {}
        while entries.left:
            key = entries.string()
            found[key] = entries.string()
        return found
