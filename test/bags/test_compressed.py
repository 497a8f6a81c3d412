# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags as ``ros2 bag record --compression-mode file|message`` leaves them, and bombs made of it."""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from backports import zstd
from rosbags.rosbag2 import CompressionMode, StoragePlugin, Writer

from slap_ros.bags import (
    bag_digest,
    bag_info,
    evaluate_bag,
    read_bag,
)
from slap_ros.bags.compression import MAGIC
from slap_ros.bags.reading_budget import MAX_GROWTH
from slap_ros.bags.rosbag2 import ROOT
from slap_ros.errors import DamagedBagError, SlapError
from slap_ros.messages.interfaces import STATE
from slap_ros.messages.typestore import definition, typestore
from support.marks import slow
from support.rosbags_writer import write_with_rosbags
from support.slap_command import slap
from support.truthful_run import Published, Script, make

MODES = (CompressionMode.FILE, CompressionMode.MESSAGE)
STORAGES = (StoragePlugin.MCAP, StoragePlugin.SQLITE3)
KINDS = [(mode, storage) for mode in MODES for storage in STORAGES]
SUFFIX = {StoragePlugin.MCAP: ".mcap", StoragePlugin.SQLITE3: ".db3"}


def compress_files(path: Path) -> None:
    """What the recorder does to the files that it has completed."""
    text = path / "metadata.yaml"
    information = yaml.safe_load(text.read_text())
    names = [f"{name}.zstd" for name in information[ROOT]["relative_file_paths"]]
    information[ROOT] |= {
        "relative_file_paths": names,
        "compression_format": "zstd",
        "compression_mode": "FILE",
    }
    text.write_text(yaml.safe_dump(information))
    for name in names:
        file = path / name
        file.write_bytes(zstd.compress(file.with_suffix("").read_bytes()))
        file.with_suffix("").unlink()


def compressed(
    folder: Path, script: Script, mode: CompressionMode, storage: StoragePlugin, parts: int = 1
) -> Path:
    """A run in a compressed bag of one file or several."""
    path = folder / "bag"
    path.mkdir()
    size = len(script.messages) // parts + 1
    by_the_writer = CompressionMode.NONE if mode is CompressionMode.FILE else mode
    names = []
    for number in range(parts):
        part = folder / f"part{number}"
        messages = script.messages[number * size : (number + 1) * size]
        write_with_rosbags(part, messages, storage, by_the_writer)
        names.append(f"bag_{number}{SUFFIX[storage]}")
        (part / f"part{number}{SUFFIX[storage]}").rename(path / names[-1])
    information = yaml.safe_load((folder / "part0" / "metadata.yaml").read_text())
    information[ROOT]["relative_file_paths"] = names
    if parts > 1:  # else they are those of the whole
        information[ROOT]["topics_with_message_count"] = []
    (path / "metadata.yaml").write_text(yaml.safe_dump(information))
    if mode is CompressionMode.FILE:
        compress_files(path)
    return path


@pytest.mark.parametrize(
    ("mode", "storage", "parts"), [*((*kind, 1) for kind in KINDS), (*KINDS[0], 11)]
)
def test_a_compressed_bag_is_the_same_bag(
    script: Script,
    honest_bag: Path,
    tmp_path: Path,
    mode: CompressionMode,
    storage: StoragePlugin,
    parts: int,
) -> None:
    path = compressed(tmp_path, script, mode, storage, parts)
    if parts == 1:
        (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
        plain = write_plain(tmp_path / "plain", script, storage)
        assert file.stat().st_size < plain.stat().st_size
    assert bag_digest(path) == bag_digest(honest_bag)
    assert evaluate_bag(path) == evaluate_bag(honest_bag)
    assert bag_info(path).topics == bag_info(honest_bag).topics
    assert bag_info(path).storage == storage.name.lower()


def write_plain(path: Path, script: Script, storage: StoragePlugin) -> Path:
    write_with_rosbags(path, script.messages, storage)
    return path / f"{path.name}{SUFFIX[storage]}"


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("keep", [True, False])
def test_a_file_that_was_unpacked_beside_its_metadata_is_the_same(
    script: Script, honest_bag: Path, tmp_path: Path, storage: StoragePlugin, keep: bool
) -> None:
    """``unzstd`` keeps the compressed file; ``unzstd --rm`` does not."""
    path = compressed(tmp_path, script, CompressionMode.FILE, storage, parts=2)
    for file in list(path.glob("*.zstd")):
        file.with_suffix("").write_bytes(zstd.decompress(file.read_bytes()))
        if not keep:
            file.unlink()
    assert evaluate_bag(path) == evaluate_bag(honest_bag)
    assert bag_digest(path) == bag_digest(honest_bag)


def test_some_files_compressed_and_others_not_yet(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    """As a recorder leaves them that was killed while it compressed."""
    path = compressed(tmp_path, script, CompressionMode.FILE, StoragePlugin.MCAP, parts=3)
    last = path / "bag_2.mcap.zstd"
    last.with_suffix("").write_bytes(zstd.decompress(last.read_bytes()))
    last.write_bytes(last.read_bytes()[:100])
    assert evaluate_bag(path) == evaluate_bag(honest_bag)


@pytest.mark.parametrize("storage", STORAGES)
def test_a_single_compressed_file_will_do(
    script: Script, honest_bag: Path, tmp_path: Path, storage: StoragePlugin
) -> None:
    path = compressed(tmp_path, script, CompressionMode.FILE, storage)
    (file,) = path.glob("*.zstd")
    assert bag_digest(file) == bag_digest(honest_bag)
    assert read_bag(file).damage is None


def test_a_compressed_file_that_is_cut_is_read_up_to_the_cut(
    script: Script, tmp_path: Path
) -> None:
    path = compressed(tmp_path, script, CompressionMode.FILE, StoragePlugin.MCAP)
    (file,) = path.glob("*.zstd")
    whole = zstd.decompress(file.read_bytes())
    packer = zstd.ZstdCompressor()
    half = packer.compress(whole[: len(whole) // 2], packer.FLUSH_BLOCK)
    file.write_bytes(half)
    bag = read_bag(path)
    assert 0 < sum(1 for _ in bag) < len(script.messages)
    assert bag.damage is not None
    assert "bag_0.mcap.zstd ends early" in bag.damage


def test_what_ends_after_the_last_message_is_said_as_well(script: Script, tmp_path: Path) -> None:
    path = compressed(tmp_path, script, CompressionMode.FILE, StoragePlugin.SQLITE3)
    (file,) = path.glob("*.zstd")
    packer = zstd.ZstdCompressor()
    content = zstd.decompress(file.read_bytes())
    file.write_bytes(packer.compress(content, packer.FLUSH_BLOCK))  # no last block
    damage = evaluate_bag(path).damage
    assert damage is not None and "cannot be unpacked to its end" in damage


@pytest.mark.parametrize("content", [b"", b"no zstd", MAGIC, MAGIC + bytes(40)])
@pytest.mark.parametrize("storage", STORAGES)
def test_a_file_that_only_claims_to_be_compressed(
    tmp_path: Path, content: bytes, storage: StoragePlugin
) -> None:
    file = tmp_path / f"bag{SUFFIX[storage]}.zstd"
    file.write_bytes(content)
    with pytest.raises(DamagedBagError, match=r"bag\.\w+\.zstd"):
        read_bag(file)


def test_every_command_takes_them(script: Script, tmp_path: Path) -> None:
    path = str(compressed(tmp_path, script, CompressionMode.FILE, StoragePlugin.SQLITE3))
    domain = ("obstacle2d", "--proposer", "induced")
    for command in (
        ("bag", "info", path),
        ("bag", "evaluate", path, "--json"),
        ("bag", "replay", path),
        ("bag", "render", path, "--output", str(tmp_path / "run.gif"), "--size", "64x48"),
        ("bag", "export", path, "--output", str(tmp_path / "run.npz")),
        ("report", path, "--output", str(tmp_path / "run.html")),
        ("propose", *domain, "--demonstrations", path),
    ):
        result = slap(*command)
        assert result.exit_code == 0, (command, result.stderr)


def test_a_message_that_is_no_frame_is_damage(script: Script, tmp_path: Path) -> None:
    messages = [Published(m.topic, m.type_name, m.stamp_ns, m.message) for m in script.messages]
    for what in (MAGIC, MAGIC + bytes(30), zstd.compress(messages[3].cdr)[:-3]):
        path = tmp_path / str(len(what))
        with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connection = writer.add_connection(
                messages[3].topic,
                messages[3].type_name,
                msgdef=definition(messages[3].type_name),
                rihs01=typestore().hash_rihs01(messages[3].type_name),
            )
            writer.write(connection, 1, messages[3].cdr)
            writer.write(connection, 2, what)
        bag = read_bag(path)
        assert len(list(bag)) == 1
        assert bag.damage is not None and "cannot be unpacked" in bag.damage


@pytest.mark.parametrize("storage", STORAGES)
def test_messages_that_overtook_others_while_they_were_compressed(
    script: Script, honest_bag: Path, tmp_path: Path, storage: StoragePlugin
) -> None:
    """The recorder has a thread per core, and each writes a message when it is ready."""
    rng = random.Random(6)
    places = {id(m): i + rng.random() * 12 for i, m in enumerate(script.messages)}
    mixed = sorted(script.messages, key=lambda message: places[id(message)])
    assert [m.stamp_ns for m in mixed] != sorted(m.stamp_ns for m in mixed)
    write_with_rosbags(tmp_path / "bag", mixed, storage, CompressionMode.MESSAGE)
    assert bag_digest(tmp_path / "bag") == bag_digest(honest_bag)
    assert evaluate_bag(tmp_path / "bag") == evaluate_bag(honest_bag)


def test_a_clock_that_was_set_back_is_no_overtaking(script: Script, tmp_path: Path) -> None:
    half, hour = len(script.messages) // 2, 3600 * 10**9
    messages = [
        replace(m, stamp_ns=m.stamp_ns - hour * (i >= half)) for i, m in enumerate(script.messages)
    ]
    write_with_rosbags(tmp_path / "bag", messages, StoragePlugin.MCAP, CompressionMode.MESSAGE)
    assert [m.stamp_ns for m in read_bag(tmp_path / "bag")] == [m.stamp_ns for m in messages]


def test_what_precedes_damage_is_read_though_it_waits(script: Script, tmp_path: Path) -> None:
    path = compressed(tmp_path, script, CompressionMode.MESSAGE, StoragePlugin.MCAP)
    (file,) = path.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-30_000])
    bag = read_bag(path)
    assert 0 < sum(1 for _ in bag) < len(script.messages)
    assert bag.damage is not None and "ends early" in bag.damage


# -- bombs ----------------------------------------------------------------------------------------

ZEROS = 31_000_000  # bytes of a state that a few kB hold
MOST_KB = 1_500 * 2**10  # of the command with everything that it imports
MEASURED = """
import atexit, re, sys, resource
from pathlib import Path
from ensemble.cli import main

def tell():
    high = re.findall(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())
    print(*high, file=sys.stderr)

resource.setrlimit(resource.RLIMIT_CPU, (60, 60))  # s, far more than the budget allows
atexit.register(tell)
main()
"""


def large_states(count: int) -> list[Published]:
    """States of one object with very many features, all of them 0."""

    found = []
    for step in range(count):
        thing = make(
            "slap_msgs/msg/ObjectState",
            name="thing",
            type="thing",
            features=np.zeros(ZEROS // 8),
        )
        clock = make("builtin_interfaces/msg/Time", sec=1, nanosec=step)
        header = make("std_msgs/msg/Header", stamp=clock, frame_id="world")
        state = make(STATE, header=header, episode=1, step=step, objects=[thing])
        found.append(Published("/slap/state", STATE, step, state))
    return found


def in_messages(folder: Path) -> Path:
    write_with_rosbags(
        folder / "bag", large_states(20), StoragePlugin.SQLITE3, CompressionMode.MESSAGE
    )
    return folder / "bag"


def in_chunks(folder: Path) -> Path:
    write_with_rosbags(
        folder / "bag", large_states(20), StoragePlugin.MCAP, CompressionMode.STORAGE
    )
    return folder / "bag"


def in_files(folder: Path) -> Path:
    write_with_rosbags(folder / "bag", large_states(20), StoragePlugin.SQLITE3)
    compress_files(folder / "bag")
    return folder / "bag"


@pytest.mark.parametrize("make_bomb", [in_messages, *slow(in_chunks, in_files)])
def test_a_bag_unpacks_to_no_more_than_its_budget(
    tmp_path: Path, make_bomb: Callable[[Path], Path]
) -> None:
    path = make_bomb(tmp_path)
    assert sum(file.stat().st_size for file in path.iterdir()) < 2**20
    command = [sys.executable, "-c", MEASURED, "bag", "info", str(path)]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 90, process.stderr
    assert "unpacks to more than" in process.stderr
    assert int(process.stderr.split()[-1]) < MOST_KB


def test_a_bag_may_shrink_as_real_ones_do(script: Script, tmp_path: Path) -> None:
    """The budget allows more than twice what recordings take."""
    plain = write_plain(tmp_path / "plain", script, StoragePlugin.MCAP).read_bytes()
    assert len(plain) / len(zstd.compress(plain)) < MAX_GROWTH / 2


def test_damaged_compressed_bags_raise_nothing_else(script: Script, tmp_path: Path) -> None:
    for mode, storage in KINDS:
        folder = tmp_path / f"{mode.name}{storage.name}"
        folder.mkdir()
        path = compressed(folder, script, mode, storage)
        (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
        whole, rng = file.read_bytes(), random.Random(4)
        for case in range(10):
            position = rng.randrange(len(whole))
            file.write_bytes(whole[:position])
            if case % 2:
                file.write_bytes(whole[:position] + rng.randbytes(50) + whole[position + 50 :])
            try:
                sum(1 for _ in read_bag(path))
            except SlapError as error:
                assert "\n" not in str(error)
        shutil.rmtree(folder)
