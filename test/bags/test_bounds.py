# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a bag claims to hold: reading it ends, and takes no more memory than is stated."""

from __future__ import annotations

import os
import re
import sqlite3
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import lz4.frame
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import TypesysError

from slap_ros.bags import definitions, evaluate_bag, read_bag
from slap_ros.bags.definitions import MAX_DEFINITION_FIELDS, decode, store_for, undecodable
from slap_ros.bags.mcap_reader import MAX_RECORD_BYTES, read_mcap
from slap_ros.bags.mcap_records import CHUNK, MAGIC, RECORD, Opcode, prefixed, record
from slap_ros.bags.raw import Channel, MessageDefinition
from slap_ros.bags.sqlite_reader import read_sqlite
from slap_ros.errors import DamagedBagError
from slap_ros.messages.interfaces import STATE
from slap_ros.messages.typestore import definition, typestore
from support.truthful_run import Script
from support.truthful_run import record as write_bag

GIGABYTES_3 = 3 * 10**9
# Peak resident memory, kB, of the command with everything that it imports, and a record.
MOST_MEMORY_KB = (400 * 2**20 + 2 * MAX_RECORD_BYTES) // 1024
# What wait4 reports is at least what the process that started the command has itself.
MEASURED = """
import atexit, re, sys
from pathlib import Path
from ensemble.cli import main

def tell():
    print(*re.findall(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text()), file=sys.stderr)

atexit.register(tell)
main()
"""


def zeros_in_zstd(size: int) -> bytes:
    """A frame (RFC 8878) of zeros, whose blocks of 128 KiB take four bytes."""
    blocks, rest = divmod(size, 2**17)
    header = b"\x28\xb5\x2f\xfd\x00\x58"  # no size, a window of 2 MiB
    run = struct.pack("<I", (2**17 << 3) | 0b010)[:3] + b"\0"
    last = struct.pack("<I", (rest << 3) | 0b011)[:3] + b"\0"
    return header + run * blocks + last


def zeros_in_lz4(size: int) -> bytes:
    """A frame of zeros: one block of 4 MiB, over and over."""
    options = {"block_size": lz4.frame.BLOCKSIZE_MAX4MB, "block_linked": False, "store_size": False}
    whole = lz4.frame.compress(bytes(2**22), **options)
    head, block, end = whole[:7], whole[7:-4], whole[-4:]
    return head + block * (size // 2**22) + end


def chunk(compression: bytes, data: bytes, claimed: int) -> bytes:
    head = CHUNK.pack(0, 0, claimed, 0) + prefixed(compression)
    return record(Opcode.CHUNK, head, struct.pack("<Q", len(data)), data)


HEADER = record(Opcode.HEADER, prefixed(b""), prefixed(b""))
SPARSE = MAGIC + HEADER + RECORD.pack(Opcode.CHUNK, 2**41)


@pytest.mark.parametrize(
    "content",
    [
        MAGIC + HEADER + chunk(b"zstd", zeros_in_zstd(GIGABYTES_3), GIGABYTES_3),
        MAGIC + HEADER + chunk(b"lz4", zeros_in_lz4(GIGABYTES_3), GIGABYTES_3),
        MAGIC + HEADER + chunk(b"zstd", zeros_in_zstd(GIGABYTES_3), 10**6),  # claims less
        SPARSE,
    ],
    ids=["zstd", "lz4", "claims less", "sparse"],
)
def test_a_bag_takes_no_more_memory_than_stated(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    if content is SPARSE:
        os.truncate(path, 2**42)
    command = [sys.executable, "-c", MEASURED, "bag", "info", str(path)]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 90, process.stderr
    assert int(process.stderr.split()[-1]) < MOST_MEMORY_KB


def test_frames_of_zeros_are_sound() -> None:
    """Else the test above would show nothing."""
    from backports import zstd

    assert zstd.decompress(zeros_in_zstd(300_000)) == bytes(300_000)
    assert lz4.frame.decompress(zeros_in_lz4(2**23)) == bytes(2**23)


def test_attachments_are_passed_over_unread(tmp_path: Path) -> None:
    """They may be of any size."""
    path = tmp_path / "run.mcap"
    end = record(Opcode.DATA_END, bytes(4)) + record(Opcode.FOOTER, bytes(20)) + MAGIC
    with path.open("wb") as file:
        file.write(MAGIC + HEADER + RECORD.pack(Opcode.ATTACHMENT, 2**40))
        file.seek(2**40, os.SEEK_CUR)
        file.write(end)
    assert list(read_mcap(path)) == []


def long_definition(fields: int) -> str:
    return "".join(f"int32 a{i}\n" for i in range(fields))


@pytest.mark.parametrize(
    "text",
    [
        long_definition(100_000),
        "int32 a\n" + "# " * 2**20,
        "=" * 80 + "\nIDL: odd/msg/Odd\n" + "int32 a; " * 100_000,
    ],
    ids=["fields", "comments", "idl"],
)
def test_a_definition_without_end_is_not_read(text: str) -> None:
    channel = Channel("/odd", "odd/msg/Odd", "cdr", MessageDefinition("ros2msg", text))
    with pytest.raises(Exception, match=f"at most .* and {MAX_DEFINITION_FIELDS} fields"):
        store_for(channel)


def test_a_topic_with_such_a_definition_is_left_out(tmp_path: Path, script: Script) -> None:
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        odd = writer.add_connection(
            "/odd", "odd/msg/Odd", msgdef=long_definition(10_000), rihs01="RIHS01_0"
        )
        writer.write(odd, 1, bytes(64))
        state = next(m for m in script.messages if m.topic == "/slap/state")
        ours = writer.add_connection(
            state.topic,
            state.type_name,
            msgdef=definition(state.type_name),
            rihs01=typestore().hash_rihs01(state.type_name),
        )
        writer.write(ours, 2, state.cdr)
    bag = read_bag(tmp_path / "bag")
    assert [message.topic for message in bag] == ["/slap/state"]
    assert "fields" in bag.undecoded["odd/msg/Odd"]


def _sqlite_bags() -> Iterator[str]:
    """Bags whose tables are something else: views without end, virtual tables."""
    endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS"
    topics = "CREATE TABLE topics(id, name, type, serialization_format, offered_qos_profiles);"
    yield f"{topics} CREATE VIEW messages AS {endless} id, 1 topic_id, 1 timestamp, x'' data FROM n"
    yield f"CREATE VIEW topics AS {endless} id, '' name, '' type, '' serialization_format FROM n"
    yield "CREATE VIEW message_definitions AS SELECT 1"
    yield f"{topics} CREATE VIRTUAL TABLE messages USING fts5(data)"


@pytest.mark.parametrize("script", list(_sqlite_bags()), ids=range(4))
def test_tables_of_a_bag_are_tables(tmp_path: Path, script: str) -> None:
    with closing(sqlite3.connect(tmp_path / "bag.db3")) as database:
        database.executescript(script)
    with pytest.raises(DamagedBagError):
        list(read_sqlite(tmp_path / "bag.db3"))


ODD = "=" * 80 + "\nMSG: odd/Inner\nuint8 a\n"


@pytest.mark.parametrize(
    "text",
    [
        "string[2000000000] a\n",
        "string<=5[2000000000] a\n",
        "odd/Inner[2000000000] a\n" + ODD,
        "".join(f"string[50] a{i}\n" for i in range(100)),
        "odd/Inner[10] a\n" + ODD + "odd/Inner2[6000] b\n" + ODD.replace("Inner", "Inner2"),
        "int32[0] a\n",
    ],
    ids=["texts", "bounded texts", "messages", "several", "nested", "of nothing"],
)
def test_an_array_makes_no_definition_without_end(text: str) -> None:
    """A program is generated that reads its elements one after the other."""
    channel = Channel("/odd", "odd/msg/Odd", "cdr", MessageDefinition("ros2msg", text))
    assert list(undecodable([channel])) == ["odd/msg/Odd"]
    with pytest.raises(TypesysError, match="its definition has"):
        store_for(channel)


def test_a_long_array_of_numbers_is_read_at_once() -> None:
    text = "uint8[900000] image\n"
    channel = Channel("/odd", "odd/msg/Odd", "cdr", MessageDefinition("ros2msg", text))
    message = decode(channel, b"\0\1\0\0" + bytes(900_000))
    assert message.image.nbytes == 900_000  # type: ignore[attr-defined]
    with pytest.raises(DamagedBagError):
        decode(channel, b"\0\1\0\0" + bytes(800_000))


def test_many_definitions_share_a_budget_and_ours_come_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(definitions, "MAX_BAG_FIELDS", 300)

    def channel(number: int) -> Channel:
        text = "int32 a\nstring[20] b\n" + "#" * number
        return Channel(f"/t{number}", f"odd/msg/T{number}", "cdr", MessageDefinition("", text))

    commented = MessageDefinition("ros2msg", "# ours\n" + definition(STATE))
    ours = Channel("/slap/state", STATE, "cdr", commented)
    found = undecodable([*(channel(number) for number in range(2_000)), ours])
    assert STATE not in found
    assert 1_980 < len(found) < 2_000
    assert "definitions of the bag" in found["odd/msg/T1999"]


def test_a_count_of_messages_is_a_number_that_can_be_printed(
    script: Script, tmp_path: Path
) -> None:
    """Python reads hexadecimal digits of any number, and prints no more than 4,300 decimal ones."""
    bag = tmp_path / "bag"
    write_bag(bag, script.messages)
    text = (bag / "metadata.yaml").read_text()
    count = re.search(r"message_count: \d+", text)
    assert count is not None
    for number in ("0x" + "f" * 100_000, "0b" + "1" * 100_000, "9" * 4_000, "1:" * 3_000 + "1"):
        (bag / "metadata.yaml").write_text(text.replace(count[0], f"message_count: {number}"))
        damage = evaluate_bag(bag).damage
        assert damage is not None and "metadata.yaml cannot be read" in damage
        assert len(damage) < 1_000


# What a database may have in its tables without having it in its file.
TOPICS = """CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,
 serialization_format TEXT, offered_qos_profiles TEXT);
INSERT INTO topics VALUES (1, '/slap/state', 'slap_msgs/msg/ObjectCentricState', 'cdr', '');"""
ROWS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000) SELECT"
MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER"
FILL = f"INSERT INTO messages(topic_id, timestamp) {ROWS} 1, i FROM n;"


@pytest.mark.parametrize(
    ("script", "complaint"),
    [
        (f"{TOPICS} {MESSAGES}, data AS (zeroblob(250000000))); {FILL}", "computed"),
        (f"{TOPICS} {MESSAGES}, data AS (zeroblob(9)) STORED); {FILL}", "computed"),
        (
            (
                f"{TOPICS} CREATE TABLE messages(id, timestamp, data, topic_id AS "
                f"(length(zeroblob(250000000)))); INSERT INTO messages(timestamp) {ROWS} i FROM n;"
            ),
            "computed",
        ),
        (
            (
                f"{MESSAGES}, data); CREATE TABLE topics(id, type, serialization_format, name AS "
                f"(hex(zeroblob(100000000)))); INSERT INTO topics(type) {ROWS} '' FROM n;"
            ),
            "computed",
        ),
        (
            (
                f"{TOPICS} {MESSAGES}); {FILL} "
                f"ALTER TABLE messages ADD COLUMN data BLOB DEFAULT x'{'00' * 100_000}';"
            ),
            "more in its tables",
        ),
        (f"{TOPICS} CREATE VIEW Messages AS SELECT 1 id", "no table"),
    ],
    ids=["blob", "stored", "topic", "name", "default", "capital"],
)
def test_a_database_has_no_more_than_its_file(tmp_path: Path, script: str, complaint: str) -> None:
    with closing(sqlite3.connect(tmp_path / "bag.db3")) as database:
        database.executescript(script)
        database.commit()
    with pytest.raises(DamagedBagError, match=complaint):
        list(read_sqlite(tmp_path / "bag.db3"))


def test_pages_that_several_refer_to_end_as_well(tmp_path: Path) -> None:
    """Of ten pages, each has the next one dozens of times: the rows have no end in sight."""
    path, size = tmp_path / "bag.db3", 512
    with closing(sqlite3.connect(path)) as database:
        database.executescript(f"PRAGMA page_size={size}; {TOPICS} {MESSAGES}, data BLOB);")
        database.executemany("INSERT INTO messages VALUES (?, 1, 1, x'')", zip(range(40_000)))
        database.commit()
        table = "SELECT rootpage FROM sqlite_master WHERE name = 'messages'"
        (root,) = database.execute(table).fetchone()
    pages = bytearray(path.read_bytes())

    def children(page: int) -> list[int]:
        """Where an inner page has the numbers of those below it."""
        start = (page - 1) * size
        (cells,) = struct.unpack_from(">H", pages, start + 3)
        places = struct.unpack_from(f">{cells}H", pages, start + 12)
        return [start + 8, *(start + place for place in places)]

    kinds = {page: pages[(page - 1) * size] for page in range(root, len(pages) // size + 1)}
    inner = [page for page, kind in kinds.items() if kind == 5]
    leaf = next(page for page, kind in kinds.items() if kind == 13)
    for page, below in pairwise([*inner[:10], leaf]):
        for place in children(page):
            struct.pack_into(">I", pages, place, below)
    path.write_bytes(pages)
    with pytest.raises(DamagedBagError, match="more in its tables"):
        for count, _ in enumerate(read_sqlite(path)):
            assert count < len(pages)
