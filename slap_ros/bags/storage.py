# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finding a bag's files and reading them one after the other."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from slap_ros.bags.compression import SUFFIX, plain_name, unpacked_file, unpacked_message
from slap_ros.bags.mcap_reader import read_mcap, read_mcap_metadata
from slap_ros.bags.message_order import in_order_of_arrival
from slap_ros.bags.raw import Channel, RawMessage
from slap_ros.bags.reading_budget import ReadingBudget
from slap_ros.bags.rosbag2 import FILE_NAME, Extent, read_metadata
from slap_ros.bags.sqlite_reader import read_sqlite
from slap_ros.bags.writer import (
    CHECKSUM_KEY,
    CHECKSUM_NAME,
    METADATA_NAME,
    metadata_checksum,
)
from slap_ros.errors import DamagedBagError

MCAP, SQLITE = SUFFIXES = (".mcap", ".db3")
DISK_BLOCK = 512  # bytes in which stat counts
ONE_FILE = "a single .mcap or .db3 file, compressed by zstd or not"


@dataclass(frozen=True)
class Storage:
    """The files of a bag, in order of recording."""

    path: Path
    files: tuple[Path, ...]

    @property
    def suffix(self) -> str:
        """The ending of the files before any compression: ``.mcap`` or ``.db3``."""
        return _plain_suffix(self.files[0])

    @property
    def size_bytes(self) -> int:
        """Of the files together."""
        return sum(file.stat().st_size for file in self.files)

    def messages(self) -> Iterator[RawMessage]:
        """The messages, in the order in which they were received.

        Raises:
            DamagedBagError: After the last message that precedes any damage.
        """
        budget = ReadingBudget(self.path, sum(map(_bytes_on_disk, self.files)))
        for message in in_order_of_arrival(self._stored(budget)):
            yield unpacked_message(message, budget)
        self._information()

    def _stored(self, budget: ReadingBudget) -> Iterator[RawMessage]:
        """The messages as they are in the files."""
        for file in self.files:
            with unpacked_file(file, budget) as plain:
                if self.suffix == MCAP:
                    yield from read_mcap(plain.path, file, budget)
                else:
                    yield from read_sqlite(plain.path, file)
                if plain.damage is not None:
                    raise DamagedBagError(plain.damage)

    def metadata(self) -> dict[str, str]:
        """What the run was made with, as far as it can be read."""
        if self.suffix == MCAP and (found := read_mcap_metadata(self.files[0], METADATA_NAME)):
            return found
        try:
            return _texts(self._information().get("custom_data"))
        except DamagedBagError:
            return {}  # :meth:`messages` reports it

    def contradictions(self, counts: Mapping[Channel, int]) -> list[str]:
        """In what the files are not what ``metadata.yaml`` and the checksum say, in words.

        Args:
            counts: The messages that were read, by channel.

        Returns:
            One text for each; none for a bag that is as it was recorded.
        """
        information = self._information()
        found = list(_contradicted_files(information, self.files))
        found = found or list(_contradicted_counts(information, counts))
        if self.suffix == MCAP:
            inside = read_mcap_metadata(self.files[0], METADATA_NAME)
            told = read_mcap_metadata(self.files[0], CHECKSUM_NAME).get(CHECKSUM_KEY)
            outside = _texts(information.get("custom_data"))
            if told is not None and told != metadata_checksum(inside):
                found.append(f"the metadata in {self.files[0].name} do not fit their checksum")
            elif inside and outside and inside != outside:
                keys = sorted(k for k in inside | outside if inside.get(k) != outside.get(k))
                found.append(f"{', '.join(keys)} is another in {FILE_NAME} than in the data file")
        return found

    def _information(self) -> dict[str, object]:
        """The bag's ``metadata.yaml``; empty for a single file.

        Raises:
            DamagedBagError: It is missing or is no such file.
        """
        if not self.path.is_dir():
            return {}
        try:
            return read_metadata(self.path)
        except (OSError, ValueError) as error:
            raise DamagedBagError(
                f"{self.path / FILE_NAME} cannot be read: {error}; "
                "the messages can, and `ros2 bag reindex` writes it again"
            ) from error


@dataclass
class Survey:
    """What a bag holds, counted."""

    counts: dict[Channel, int] = field(default_factory=dict)
    extent: Extent = field(default_factory=Extent)
    damage: str | None = None


def open_storage(path: Path | str) -> Storage:
    """Find a bag's files.

    Args:
        path: The bag's folder, or a single ``.mcap`` or ``.db3`` file, compressed or not.

    Raises:
        DamagedBagError: There is no bag.
    """
    path = Path(path)
    if path.is_file() and _plain_suffix(path) in SUFFIXES:
        return Storage(path, (path,))
    if not path.exists():
        raise DamagedBagError(f"there is no bag at {path}; check the path")
    content = _data_files(path.iterdir() if path.is_dir() else [path])
    for suffix in SUFFIXES:
        if files := tuple(file for file in content if _plain_suffix(file) == suffix):
            return Storage(path, files)
    raise DamagedBagError(
        f"{path} is not a bag: give a folder with {' or '.join(SUFFIXES)} files, or {ONE_FILE}"
    )


def _bytes_on_disk(file: Path) -> int:
    """The size of a file without holes, which cost whoever sent it nothing."""
    found = file.stat()
    return min(found.st_size, found.st_blocks * DISK_BLOCK) if found.st_blocks else found.st_size


def _plain_suffix(file: Path) -> str:
    """The ending of a file before any compression."""
    return Path(plain_name(file.name)).suffix


def _data_files(content: Iterable[Path]) -> list[Path]:
    """The files of a folder in order of recording.

    Of a file that is there compressed and not, the latter is taken: ``unzstd`` keeps the former,
    and a recorder that is killed while it compresses leaves half of it.
    """
    by_name: dict[str, Path] = {}
    for file in sorted(content, key=lambda file: file.suffix == SUFFIX):
        by_name.setdefault(plain_name(file.name), file)
    return sorted(by_name.values(), key=_recording_order)


def survey(storage: Storage) -> Survey:
    """Go through a bag once, without deserialising."""
    result = Survey()
    try:
        for channel, stamp_ns, _ in storage.messages():
            result.counts[channel] = result.counts.get(channel, 0) + 1
            result.extent.include(stamp_ns)
        result.damage = "; ".join(storage.contradictions(result.counts)) or None
    except DamagedBagError as error:
        result.damage = str(error)
    return result


def _texts(data: object) -> dict[str, str]:
    return {str(k): str(v) for k, v in data.items()} if isinstance(data, dict) else {}


def _contradicted_files(information: Mapping[str, object], files: Sequence[Path]) -> Iterator[str]:
    listed = information.get("relative_file_paths")
    if not isinstance(listed, list):
        return  # a single file, or a metadata.yaml of other software
    names = {plain_name(Path(str(name)).name) for name in listed}
    here = {plain_name(file.name) for file in files}
    if missing := sorted(names - here):
        yield f"{', '.join(missing)} is missing, which {FILE_NAME} lists"
    if others := sorted(here - names):
        yield f"{', '.join(others)} is there, which {FILE_NAME} does not list"


def _contradicted_counts(
    information: Mapping[str, object], counts: Mapping[Channel, int]
) -> Iterator[str]:
    topics = information.get("topics_with_message_count")
    by_name: Counter[str] = Counter()
    for channel, count in counts.items():
        by_name[channel.topic] += count
    told: Counter[str] = Counter()
    for entry in topics if isinstance(topics, list) else ():
        with suppress(
            LookupError, TypeError, ValueError, OverflowError
        ):  # of other software: says nothing
            told[str(entry["topic_metadata"]["name"])] += int(entry["message_count"])
    for topic in sorted(told):
        if by_name[topic] != told[topic]:
            yield f"{topic} has {by_name[topic]} messages, {FILE_NAME} says {told[topic]}"


def _recording_order(file: Path) -> list[tuple[int, str]]:
    """Sorts ``run_10`` after ``run_9``."""
    parts = re.findall(r"(\D*)(\d*)", plain_name(file.name))
    return [(int(digits or 0), text) for text, digits in parts]
