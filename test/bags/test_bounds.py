# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a bag claims to hold: reading it ends, and takes no more memory than is stated."""

from __future__ import annotations

import os
import sqlite3
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import lz4.frame
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from truthful_run import Script

from slap_ros.bags import read_bag
from slap_ros.bags.definitions import MAX_DEFINITION_FIELDS, store_for
from slap_ros.bags.mcap_reader import MAX_RECORD_BYTES, read_mcap
from slap_ros.bags.mcap_records import CHUNK, MAGIC, RECORD, Opcode, prefixed, record
from slap_ros.bags.raw import Channel, MessageDefinition
from slap_ros.bags.sqlite_reader import read_sqlite
from slap_ros.errors import DamagedBagError
from slap_ros.messages.interfaces import definition, typestore

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
