# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability

from slap_ros.bags import BagWriter, bag_info, read_bag
from slap_ros.bags.bit_correction import CORRECTABLE_BYTES
from slap_ros.errors import BagExistsError, ErrorCode, InvalidParameterError, StorageFullError
from support.counting_writer import STATE, cdr
from support.programs import environment, program
from support.truthful_run import METADATA, Script


def steps(path: Path) -> list[int]:
    return [item.message.step for item in read_bag(path)]  # type: ignore[attr-defined]


def test_what_is_written_is_read(script: Script, honest_bag: Path) -> None:
    bag = read_bag(honest_bag)
    read = [(item.topic, item.type_name, item.stamp_ns) for item in bag]
    assert read == [(m.topic, m.type_name, m.stamp_ns) for m in script.messages]
    assert bag.damage is None
    assert bag.metadata == METADATA


def test_rosbags_opens_it_without_types(script: Script, honest_bag: Path) -> None:
    with AnyReader([honest_bag]) as reader:
        messages = [
            (connection.topic, stamp, reader.deserialize(data, connection.msgtype))
            for connection, stamp, data in reader.messages()
        ]
        qos = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}  # type: ignore[union-attr]
    assert [m[:2] for m in messages] == [(m.topic, m.stamp_ns) for m in script.messages]
    latched = {t for t, q in qos.items() if q.durability is QosDurability.TRANSIENT_LOCAL}
    assert latched >= {"/slap/domain", "/slap/task", "/slap/state"}
    assert "/diagnostics" not in latched


def test_the_reference_reader_finds_index_and_checksums_right(
    script: Script, honest_bag: Path
) -> None:
    mcap = pytest.importorskip("mcap.reader")
    with (honest_bag / "honest_0.mcap").open("rb") as file:
        reader = mcap.make_reader(file, validate_crcs=True)
        stamps = [message.log_time for _, _, message in reader.iter_messages()]
        schemas = {schema.encoding for schema in reader.get_summary().schemas.values()}
    assert stamps == [m.stamp_ns for m in script.messages]
    assert schemas == {"ros2msg"}


def test_no_chunk_is_too_long_for_a_flipped_bit_to_be_corrected(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", {}) as writer:
        for number in range(2000):
            writer.write("/slap/state", STATE, number, cdr(number))
    mcap = pytest.importorskip("mcap.reader")
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        chunks = mcap.make_reader(file).get_summary().chunk_indexes
    sizes = [chunk.uncompressed_size for chunk in chunks]
    assert len(sizes) > 5
    assert max(sizes) <= CORRECTABLE_BYTES < max(sizes) + len(cdr(0)) + 100


def test_messages_out_of_time_order_reach_other_readers(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", {}) as writer:
        for number in (5, 3, 9, 1):
            writer.write("/slap/state", STATE, number, cdr(number))
    with AnyReader([tmp_path / "bag"]) as reader:
        assert [stamp for _, stamp, _ in reader.messages()] == [1, 3, 5, 9]
    assert steps(tmp_path / "bag") == [5, 3, 9, 1]


def test_metadata_yaml_is_rosbag2s(honest_bag: Path, script: Script) -> None:
    content = yaml.safe_load((honest_bag / "metadata.yaml").read_text())
    information = content["rosbag2_bagfile_information"]
    assert information["custom_data"] == METADATA
    assert information["message_count"] == len(script.messages)
    assert information["relative_file_paths"] == ["honest_0.mcap"]
    assert [p.name for p in sorted(honest_bag.iterdir())] == ["honest_0.mcap", "metadata.yaml"]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "precious").write_text("data")
    (tmp_path / "file").write_text("data")
    for name in ("bag", "file"):
        with pytest.raises(BagExistsError, match=name):
            BagWriter(tmp_path / name, {})
    assert [p.name for p in (tmp_path / "bag").iterdir()] == ["precious"]
    assert (tmp_path / "file").read_text() == "data"


def test_a_type_without_definition_is_refused(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", {}) as writer:
        with pytest.raises(InvalidParameterError, match="/odd"):
            writer.write("/odd", "nowhere/msg/Odd", 0, b"\0\1\0\0")
        writer.write("/slap/state", STATE, 1, cdr(1))
    assert steps(tmp_path / "bag") == [1]


def test_a_writer_that_is_not_closed_leaves_everything(script: Script, tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", METADATA)
    for number, item in enumerate(script.messages, start=1):
        writer.write(item.topic, item.type_name, item.stamp_ns, item.cdr)
        assert bag_info(tmp_path / "bag").message_count == number
    bag = read_bag(tmp_path / "bag")
    assert sum(1 for _ in bag) == len(script.messages)
    assert bag.damage is not None and "killed" in bag.damage
    assert bag.metadata == METADATA
    writer.close()
    writer.close()
    assert read_bag(tmp_path / "bag").damage is None
    with pytest.raises(ValueError, match="closed"):
        writer.write("/slap/state", STATE, 1, cdr(1))


@pytest.mark.parametrize("seed", range(8))
def test_a_killed_recording_has_all_that_was_acknowledged(tmp_path: Path, seed: int) -> None:
    process = subprocess.Popen(
        [*program("counting_writer"), str(tmp_path / "bag")],
        stdout=subprocess.PIPE,
        env=environment(),
    )
    assert process.stdout is not None
    first = process.stdout.readline()
    time.sleep(random.Random(seed).uniform(0.0, 0.1))
    process.send_signal(signal.SIGKILL)
    acknowledged = int((process.stdout.read().split(b"\n")[:-1] or [first])[-1])
    process.wait()
    read = steps(tmp_path / "bag")
    assert len(read) in (acknowledged, acknowledged + 1)  # it may be killed before it says so
    assert read == list(range(len(read)))
    assert read_bag(tmp_path / "bag").metadata == {"seed": "3"}


@pytest.mark.parametrize("limit", [20_000, 70_001, 150_000])
def test_a_full_disk_is_named_and_leaves_a_readable_bag(tmp_path: Path, limit: int) -> None:
    result = subprocess.run(
        [*program("counting_writer"), str(tmp_path / "bag"), str(limit)],
        capture_output=True,
        text=True,
        env=environment(),
    )
    assert result.returncode == ErrorCode.STORAGE_FULL, result.stderr
    assert "no room left" in result.stderr
    assert steps(tmp_path / "bag") == list(range(len(result.stdout.split())))


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_recording_goes_on_once_there_is_room_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    """The disk fills up just when a chunk is to be completed."""

    def full(*_: Any) -> int:
        raise OSError(code, os.strerror(code))

    writer = BagWriter(tmp_path / "bag", {})
    written: list[int] = []
    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", full)
        while not written or written[-1] < 10_000:
            try:
                writer.write("/slap/state", STATE, len(written), cdr(len(written)))
            except StorageFullError:
                break
            written.append(len(written))
    assert steps(tmp_path / "bag") == written
    for number in range(len(written), len(written) + 10):
        writer.write("/slap/state", STATE, number, cdr(number))
        written.append(number)
    writer.close()
    assert steps(tmp_path / "bag") == written
    assert read_bag(tmp_path / "bag").damage is None
    with AnyReader([tmp_path / "bag"]) as reader:
        assert reader.message_count == len(written)


def test_no_room_for_the_index_costs_no_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    writer = BagWriter(tmp_path / "bag", {})
    for number in range(3):
        writer.write("/slap/state", STATE, number, cdr(number))
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StorageFullError):
        writer.close()
    assert steps(tmp_path / "bag") == [0, 1, 2]
    assert [p.name for p in sorted((tmp_path / "bag").iterdir())] == ["bag_0.mcap", "metadata.yaml"]
