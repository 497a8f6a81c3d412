# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that ``ros2 bag record`` and others have written."""

from __future__ import annotations

import random
import shutil
import sqlite3
from collections.abc import Iterable
from pathlib import Path

import pytest
import yaml
from rosbags.rosbag2 import CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from slap_ros.bags import bag_digest, bag_info, evaluate_bag, read_bag, replay_bag
from slap_ros.bags.mcap_records import CHUNK
from slap_ros.bags.rosbag2 import ROOT
from slap_ros.errors import DamagedBagError, ForeignBagError, SlapError
from slap_ros.messages.interfaces import PLAN, TASK
from slap_ros.messages.typestore import definition, message_texts
from support.rosbags_writer import write_with_rosbags
from support.truthful_run import Published, Script, make, record, under

SEPARATOR = "=" * 80


def commented(type_name: str) -> str:
    """A definition as rosbag2 stores it: the files themselves, comments and all."""
    texts = message_texts()
    parts = definition(type_name).split(SEPARATOR + "\n")
    whole = [texts.get(type_name, parts[0])]
    for part in parts[1:]:
        name, _, text = part.removeprefix("MSG: ").partition("\n")
        full_name = name.replace("/", "/msg/", 1)
        whole.append(f"{SEPARATOR}\nMSG: {name}\n{texts.get(full_name, text)}")
    return "\n".join(whole)


def record_with_rosbags(
    path: Path,
    messages: Iterable[Published],
    storage: StoragePlugin,
    compression: CompressionMode = CompressionMode.NONE,
) -> None:
    write_with_rosbags(path, messages, storage, compression, commented)


@pytest.mark.parametrize(
    ("storage", "compression"),
    [
        (StoragePlugin.SQLITE3, CompressionMode.NONE),
        (StoragePlugin.MCAP, CompressionMode.NONE),
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
    ],
)
def test_stock_bags_tell_the_same(
    script: Script,
    honest_bag: Path,
    tmp_path: Path,
    storage: StoragePlugin,
    compression: CompressionMode,
) -> None:
    path = tmp_path / "bag"
    record_with_rosbags(path, script.messages, storage, compression)
    assert bag_digest(path) == bag_digest(honest_bag)
    assert evaluate_bag(path) == evaluate_bag(honest_bag)
    assert replay_bag(path) == replay_bag(honest_bag)
    assert bag_info(path).topics == bag_info(honest_bag).topics
    assert bag_info(path).storage == storage.name.lower()


def test_a_compressed_chunk_of_absurd_size_is_damage(script: Script, tmp_path: Path) -> None:
    path = tmp_path / "bag"
    record_with_rosbags(path, script.messages, StoragePlugin.MCAP, CompressionMode.STORAGE)
    file = path / "bag.mcap"
    data = bytearray(file.read_bytes())
    chunk = data.index(b"zstd") - 4 - CHUNK.size
    for size in (2**64 - 1, 2**62, 0):
        data[chunk + 16 : chunk + 24] = size.to_bytes(8, "little")
        file.write_bytes(data)
        with pytest.raises(DamagedBagError, match="chunk"):
            read_bag(path)


def test_sqlite_bags_without_definitions(script: Script, honest_bag: Path, tmp_path: Path) -> None:
    path = tmp_path / "bag"
    record_with_rosbags(path, script.messages, StoragePlugin.SQLITE3)
    with sqlite3.connect(path / "bag.db3") as database:
        database.execute("DROP TABLE message_definitions")
    assert bag_digest(path) == bag_digest(honest_bag)


def test_damaged_sqlite_bags_raise_nothing_else(script: Script, tmp_path: Path) -> None:
    path = tmp_path / "bag"
    record_with_rosbags(path, script.messages, StoragePlugin.SQLITE3)
    file = path / "bag.db3"
    data, rng = file.read_bytes(), random.Random(4)
    for case in range(100):
        position = rng.randrange(len(data))
        file.write_bytes(data[:position])
        if case % 2:
            file.write_bytes(data[:position] + rng.randbytes(50) + data[position + 50 :])
        try:
            sum(1 for _ in read_bag(path))
        except SlapError as error:
            assert "\n" not in str(error)


def test_a_split_bag_is_read_in_order(script: Script, honest_bag: Path, tmp_path: Path) -> None:
    path = tmp_path / "bag"
    path.mkdir()
    parts = 12  # bag_10 comes after bag_9
    size = len(script.messages) // parts + 1
    for number in range(parts):
        record(tmp_path / "part", script.messages[number * size : (number + 1) * size])
        (tmp_path / "part" / "part_0.mcap").rename(path / f"bag_{number}.mcap")
        shutil.rmtree(tmp_path / "part")
    split = yaml.safe_load((honest_bag / "metadata.yaml").read_text())
    split[ROOT]["relative_file_paths"] = [f"bag_{number}.mcap" for number in range(parts)]
    (path / "metadata.yaml").write_text(yaml.safe_dump(split))
    assert bag_digest(path) == bag_digest(honest_bag)


def test_names_do_not_matter(script: Script, honest_bag: Path, tmp_path: Path) -> None:
    record(tmp_path / "bag", under("robot1", script.messages))
    assert evaluate_bag(tmp_path / "bag").runs == evaluate_bag(honest_bag).runs
    assert replay_bag(tmp_path / "bag") == replay_bag(honest_bag)


def test_a_single_file_will_do(honest_bag: Path) -> None:
    assert bag_digest(honest_bag / "honest_0.mcap") == bag_digest(honest_bag)
    assert read_bag(honest_bag / "honest_0.mcap").damage is None


def test_a_foreign_bag_is_told_apart(tmp_path: Path) -> None:
    message = make("std_msgs/msg/String", data="hello")
    record(tmp_path / "bag", [Published("/chatter", "std_msgs/msg/String", 5, message)])
    with pytest.raises(ForeignBagError, match=r"/chatter \(std_msgs/msg/String\)"):
        read_bag(tmp_path / "bag")
    assert bag_info(tmp_path / "bag").message_count == 1


@pytest.mark.parametrize(
    ("type_name", "old", "new", "named"),
    [
        (TASK, "int64 seed", "int64 sead", "seed"),
        (TASK, "uint32 index", "string index", "index"),
        (PLAN, "uint32 samples", "uint32 tries", "samples"),
        (PLAN, "float64 bound", "string bound", "bound"),  # it may be missing, and nothing else
    ],
)
def test_another_version_is_told_apart(
    script: Script, tmp_path: Path, type_name: str, old: str, new: str, named: str
) -> None:
    item = next(m for m in script.messages if m.type_name == type_name)
    text = definition(type_name).replace(old, new)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, type_name))
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(item.topic, type_name, typestore=store)
        writer.write(connection, 1, item.cdr)
    with pytest.raises(ForeignBagError, match=f"version mismatch.*{named}"):
        read_bag(tmp_path / "bag")


def test_a_newer_version_with_more_fields_is_read(script: Script, tmp_path: Path) -> None:
    task = next(m for m in script.messages if m.type_name == TASK)
    store = get_typestore(Stores.EMPTY)
    store.register(
        get_types_from_msg(definition(TASK).replace("int64 seed", "int64 seed\nint64 more"), TASK)
    )
    values = {name: getattr(task.message, name) for name in task.message.__dataclass_fields__}
    message = store.types[TASK](**values, more=3)
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/slap/task", TASK, typestore=store)
        writer.write(connection, 1, store.serialize_cdr(message, TASK))
    (item,) = read_bag(tmp_path / "bag")
    assert item.message.seed == script.seed  # type: ignore[attr-defined]


def test_types_that_nobody_defines_are_named(script: Script, tmp_path: Path) -> None:
    path = tmp_path / "bag"
    record_with_rosbags(path, script.messages, StoragePlugin.SQLITE3)
    with sqlite3.connect(path / "bag.db3") as database:
        database.execute("UPDATE topics SET type = 'odd/msg/Odd' WHERE name = '/diagnostics'")
    bag = read_bag(path)
    assert list(bag.undecoded) == ["odd/msg/Odd"]
    assert "/diagnostics" not in {item.topic for item in bag}
