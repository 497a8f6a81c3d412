# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading rosbag2's sqlite3 files, the storage of older distributions."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from slap_ros.bags.raw import Channel, MessageDefinition, RawMessage, one_line
from slap_ros.errors import DamagedBagError
from slap_ros.files import require_regular

TABLES = ("messages", "topics", "message_definitions")
MAX_BLOB_BYTES = 256 * 2**20  # of a message


def read_sqlite(path: Path) -> Iterator[RawMessage]:
    """The messages, in the order in which they were written.

    Raises:
        DamagedBagError: After the last message that can be read.
    """
    uri = f"{path.absolute().as_uri()}?mode=ro"
    try:
        require_regular(path)
        with closing(sqlite3.connect(uri, uri=True)) as database:
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_BLOB_BYTES)
            _require_tables(database, path)
            channels = _channels(database)
            rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
            for topic, stamp, data in rows:
                if topic not in channels or type(stamp) is not int or type(data) is not bytes:
                    raise DamagedBagError(f"{path} is damaged in the table of messages")
                yield RawMessage(channels[topic], stamp, data)
    except OSError as error:
        raise DamagedBagError(f"{path} cannot be read: {error.strerror}") from error
    except (sqlite3.Error, UnicodeDecodeError, OverflowError) as error:
        raise DamagedBagError(f"{path} is damaged: {one_line(error)}") from error


def _require_tables(database: sqlite3.Connection, path: Path) -> None:
    """Refuse views and virtual tables under the names of tables: a view may have no end."""
    rows = database.execute("SELECT name, type, rootpage FROM sqlite_master")
    odd = [name for name, kind, page in rows if name in TABLES and (kind != "table" or not page)]
    if odd:
        raise DamagedBagError(f"{path} is no bag: {', '.join(map(str, odd))} is no table")


def _channels(database: sqlite3.Connection) -> dict[int, Channel]:
    definitions = _definitions(database)
    topics = database.execute("SELECT id, name, type, serialization_format FROM topics")
    return {
        number: Channel(
            str(name), str(type_name), str(form), definitions.get(type_name, MessageDefinition())
        )
        for number, name, type_name, form in topics
    }


def _definitions(database: sqlite3.Connection) -> dict[str, MessageDefinition]:
    """By type name; none in bags from before Iron."""
    table = "SELECT name FROM sqlite_master WHERE name = 'message_definitions'"
    if database.execute(table).fetchone() is None:
        return {}
    rows = database.execute(
        "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
    )
    return {name: MessageDefinition(str(encoding), str(text)) for name, encoding, text in rows}
