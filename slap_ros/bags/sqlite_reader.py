# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading rosbag2's sqlite3 files, the storage of older distributions.

A database may have more than its file: columns and defaults that are computed, pages that several
others refer to. So no more is read of it than a file of its size can hold.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from slap_ros.bags.raw import Channel, MessageDefinition, RawMessage, one_line
from slap_ros.bags.reading_budget import MAX_RECORD_BYTES
from slap_ros.errors import DamagedBagError
from slap_ros.files import require_regular

TABLES = ("messages", "topics", "message_definitions")
ROW_BYTES = 4  # the least that a row takes in a file, beside its texts and blobs
# Instructions of SQLite's virtual machine: a row takes ten, and ten bytes or more. Sorting rows,
# where their number is not their key, takes as many again.
INSTRUCTIONS_PER_BYTE = 10
FREE_INSTRUCTIONS = 10**6
CHECKED_INSTRUCTIONS = 10**4  # between two looks at how many there were


def read_sqlite(path: Path, shown: Path | None = None) -> Iterator[RawMessage]:
    """The messages, in the order in which they were written.

    Args:
        path: File to read.
        shown: Name of the file for people, where it is another.

    Raises:
        DamagedBagError: After the last message that can be read.
    """
    shown = shown or path
    uri = f"{path.absolute().as_uri()}?mode=ro"
    try:
        require_regular(path)
        with closing(sqlite3.connect(uri, uri=True)) as connection:
            yield from _Database(connection, path, shown).messages()
    except OSError as error:
        raise DamagedBagError(f"{shown} cannot be read: {error.strerror}") from error
    except (sqlite3.Error, UnicodeDecodeError, OverflowError) as error:
        raise DamagedBagError(f"{shown} is damaged: {one_line(error)}") from error


class _Database:
    """One pass through a database."""

    def __init__(self, connection: sqlite3.Connection, path: Path, shown: Path) -> None:
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD_BYTES)
        self._connection, self._shown = connection, shown
        self._left = self._size = _size(path)
        self._instructions = FREE_INSTRUCTIONS + INSTRUCTIONS_PER_BYTE * self._size
        connection.set_progress_handler(self._count_instructions, CHECKED_INSTRUCTIONS)

    def messages(self) -> Iterator[RawMessage]:
        self._require_tables()
        channels = self._channels()
        for topic, stamp, data in self._rows(
            "SELECT topic_id, timestamp, data FROM messages ORDER BY id"
        ):
            if topic not in channels or type(stamp) is not int or type(data) is not bytes:
                raise DamagedBagError(f"{self._shown} is damaged in the table of messages")
            yield RawMessage(channels[topic], stamp, data)

    def _require_tables(self) -> None:
        """Refuse what only looks like a table with columns.

        A view may have no end, and neither may a virtual table; a generated column may have a
        blob of any size in each row.
        """
        rows = self._connection.execute("SELECT name, type, rootpage FROM sqlite_master")
        for name, kind, page in rows:  # names are the same in capital letters
            if str(name).lower() in TABLES and (kind != "table" or not page):
                raise DamagedBagError(f"{self._shown} is no bag: {name} is no table")
        for table in TABLES:
            columns = self._connection.execute(f"PRAGMA table_xinfo({table})")
            if any(hidden for *_, hidden in columns):
                raise DamagedBagError(
                    f"{self._shown} is no bag: {table} has columns that are computed"
                )

    def _channels(self) -> dict[int, Channel]:
        definitions = self._definitions()
        topics = self._rows("SELECT id, name, type, serialization_format FROM topics")
        return {
            number: Channel(
                str(name),
                str(type_name),
                str(form),
                definitions.get(type_name, MessageDefinition()),
            )
            for number, name, type_name, form in topics
        }

    def _definitions(self) -> dict[str, MessageDefinition]:
        """By type name; none in bags from before Iron."""
        table = "SELECT name FROM sqlite_master WHERE name = 'message_definitions'"
        if self._connection.execute(table).fetchone() is None:
            return {}
        rows = self._rows(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        return {name: MessageDefinition(str(encoding), str(text)) for name, encoding, text in rows}

    def _rows(self, query: str) -> Iterator[tuple[Any, ...]]:
        """The rows of a query, as many as the file can hold.

        Raises:
            DamagedBagError: There are more.
        """
        for row in self._connection.execute(query):
            self._left -= ROW_BYTES
            self._left -= sum(len(value) for value in row if isinstance(value, str | bytes))
            if self._left < 0:
                raise DamagedBagError(
                    f"{self._shown} is no bag: it has more in its tables than its {self._size} "
                    "bytes can hold"
                )
            yield row

    def _count_instructions(self) -> bool:
        """Count instructions of a query; whether it has to end."""
        self._instructions -= CHECKED_INSTRUCTIONS
        return self._instructions < 0


def _size(path: Path) -> int:
    """The size of a database with what was not yet moved into it, bytes."""
    log = path.with_name(f"{path.name}-wal")
    return path.stat().st_size + (log.stat().st_size if log.exists() else 0)
