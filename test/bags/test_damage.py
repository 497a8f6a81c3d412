# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cut and corrupted bags: whatever is read is the beginning of the truth, and nothing hangs."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest

from slap_ros.bags import (
    bag_digest,
    bag_info,
    evaluate_bag,
    mcap_reader,
    mcap_writer,
    read_bag,
    replay_bag,
)
from slap_ros.bags.mcap_records import CHUNK, MAGIC, RECORD, U32, U64, Opcode
from slap_ros.errors import DamagedBagError, SlapError
from slap_ros.messages.typestore import typestore
from support.truthful_run import Script, record

Truth = list[tuple[str, int, bytes]]
CHUNK_HEAD = RECORD.size + CHUNK.size + U32.size + U64.size  # bytes before its records


def content(path: Path) -> tuple[Truth, str | None]:
    """What can be read of a bag, and its damage."""
    bag = read_bag(path)
    read = [
        (m.topic, m.stamp_ns, bytes(typestore().serialize_cdr(m.message, m.type_name))) for m in bag
    ]
    return read, bag.damage


@pytest.fixture(scope="module")
def many_chunks(script: Script, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run in a bag of many small chunks, so that damage strikes every kind of record."""
    path = tmp_path_factory.mktemp("bags") / "chunks"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mcap_writer, "CHUNK_SIZE", 3000)
        record(path, script.messages)
    return path


@pytest.fixture(scope="module")
def truth(many_chunks: Path) -> Truth:
    return content(many_chunks)[0]


@pytest.fixture
def damaged(many_chunks: Path, tmp_path: Path) -> Callable[[bytes], Path]:
    """Makes a copy of the bag with another data file."""
    path = tmp_path / "bag"
    path.mkdir()
    (path / "metadata.yaml").write_bytes((many_chunks / "metadata.yaml").read_bytes())

    def make(data: bytes) -> Path:
        (path / "chunks_0.mcap").write_bytes(data)
        return path

    return make


def original(many_chunks: Path) -> bytes:
    return (many_chunks / "chunks_0.mcap").read_bytes()


def test_the_undamaged_bag_is_whole(many_chunks: Path, truth: Truth, script: Script) -> None:
    assert content(many_chunks)[1] is None
    assert [m[2] for m in truth] == [m.cdr for m in script.messages]


def test_a_cut_bag_yields_what_precedes_the_cut(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path]
) -> None:
    data = original(many_chunks)
    rng = random.Random(1)
    lengths = sorted({*range(60), *rng.sample(range(len(data)), 250), len(data) - 1})
    counts = []
    for length in lengths:
        path = damaged(data[:length])
        try:
            read, damage = content(path)
        except DamagedBagError:
            read, damage = [], "nothing readable"
        assert damage is not None, length
        assert read == truth[: len(read)], length
        counts.append(len(read))
    assert counts == sorted(counts)  # the later the cut, the more is read
    assert counts[-1] == len(truth)


@pytest.mark.slow
def test_a_corrupted_bag_yields_what_precedes_the_damage(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path]
) -> None:
    data = original(many_chunks)
    rng = random.Random(2)
    for case in range(150):
        position = rng.randrange(len(data))
        garbage = rng.randbytes(rng.choice((1, 1, 4, 20)))
        path = damaged(data[:position] + garbage + data[position + len(garbage) :])
        try:
            read, _ = content(path)
        except SlapError as error:
            assert "\n" not in str(error), case
            continue
        assert read == truth[: len(read)], (case, position)


def chunks_of(data: bytes) -> list[tuple[int, int]]:
    """Where each chunk begins and ends in a file."""
    chunks = []
    start = len(MAGIC)
    while start < len(data) - len(MAGIC):
        opcode, length = RECORD.unpack_from(data, start)
        end = start + RECORD.size + length
        if opcode == Opcode.CHUNK:
            chunks.append((start, end))
        start = end
    return chunks


def test_a_flipped_bit_in_any_chunk_costs_nothing_and_is_told(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path]
) -> None:
    data = original(many_chunks)
    rng = random.Random(4)
    for start, end in chunks_of(data):
        flipped = bytearray(data)
        flipped[rng.randrange(start + CHUNK_HEAD, end)] ^= 1 << rng.randrange(8)
        read, damage = content(damaged(bytes(flipped)))
        assert read == truth
        assert damage is not None
        assert damage.endswith(
            f"has a flipped bit in the chunk at byte {start}, which was corrected"
        )


def test_flipped_bits_before_other_damage_are_told_with_it(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path]
) -> None:
    data = bytearray(original(many_chunks))
    chunks = chunks_of(bytes(data))
    for _, end in chunks[:3]:
        data[end - 1] ^= 0x40
    read, damage = content(damaged(bytes(data[: chunks[-1][0]])))
    assert damage is not None and "ends early" in damage
    assert damage.endswith(
        f"has a flipped bit in each of 3 chunks, the first at byte {chunks[0][0]}, which were "
        "corrected"
    )
    assert 0 < len(read) < len(truth) and read == truth[: len(read)]


def test_only_so_many_chunks_are_corrected(
    many_chunks: Path,
    truth: Truth,
    damaged: Callable[[bytes], Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mcap_reader, "MOST_CORRECTIONS", 2)
    data = bytearray(original(many_chunks))
    for _, end in chunks_of(bytes(data)):
        data[end - 1] ^= 0x40
    read, damage = content(damaged(bytes(data)))
    assert damage is not None and "checksum is wrong; has a flipped bit in each of 2" in damage
    assert 0 < len(read) < len(truth) and read == truth[: len(read)]


def test_every_damage_to_a_message_is_noticed(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path]
) -> None:
    data = original(many_chunks)
    needle = truth[80][2]
    start = data.index(needle)
    for offset in range(0, len(needle), 7):
        flipped = bytearray(data)
        flipped[start + offset] ^= 0x30
        read, damage = content(damaged(bytes(flipped)))
        assert damage is not None and "checksum" in damage
        assert len(read) <= 80 and read == truth[: len(read)]


def test_a_lost_stretch_in_the_middle_is_noticed(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path]
) -> None:
    """A whole chunk is gone, so that no checksum is wrong."""
    data = original(many_chunks)
    chunks = chunks_of(data)
    assert len(chunks) > 10
    for start, end in chunks[1:]:
        read, damage = content(damaged(data[:start] + data[end:]))
        assert damage is not None
        assert 0 < len(read) < len(truth)
        assert read == truth[: len(read)]


@pytest.mark.parametrize("tool", [evaluate_bag, replay_bag, bag_info, bag_digest, read_bag])
def test_every_tool_takes_damage(
    many_chunks: Path, damaged: Callable[[bytes], Path], tool: Callable[[Path], object]
) -> None:
    data = original(many_chunks)
    rng = random.Random(3)
    for _ in range(40):
        path = damaged(data[: rng.randrange(len(data))])
        try:
            result = tool(path)
        except SlapError:
            continue
        assert result.damage is not None  # type: ignore[attr-defined]


def test_a_digest_of_half_a_bag_is_refused(
    many_chunks: Path, damaged: Callable[[bytes], Path]
) -> None:
    with pytest.raises(DamagedBagError, match="no digest"):
        bag_digest(damaged(original(many_chunks)[:-5000]))


@pytest.mark.parametrize("text", [None, "", "rosbag2_bagfile_information: [", "\0\1", "a: {b: 1}"])
def test_damaged_metadata_costs_no_message(
    many_chunks: Path, truth: Truth, damaged: Callable[[bytes], Path], text: str | None
) -> None:
    path = damaged(original(many_chunks))
    (path / "metadata.yaml").unlink()
    if text is not None:
        (path / "metadata.yaml").write_text(text)
    read, damage = content(path)
    assert read == truth
    assert damage is not None and "metadata.yaml" in damage


def test_no_bag_at_all(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mcap").write_text("hello world, this is certainly no bag")
    (tmp_path / "nothing.mcap").write_bytes(b"")
    (tmp_path / "text.db3").write_text("hello world, this is certainly no database")
    (tmp_path / "notes.txt").write_text("hello")
    for name in ("missing", "empty", "text.mcap", "nothing.mcap", "text.db3", "notes.txt"):
        for tool in (read_bag, bag_info):
            with pytest.raises(DamagedBagError, match=name) as caught:
                tool(tmp_path / name)
            assert "\n" not in str(caught.value)
