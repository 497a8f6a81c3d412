# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds, at a glance."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from slap_ros.bags.definitions import is_ours
from slap_ros.bags.ensembles import Ensembles
from slap_ros.bags.evaluate import read_contents
from slap_ros.bags.reader import Bag
from slap_ros.bags.storage import MCAP, Storage, Survey, open_storage, survey
from slap_ros.errors import DamagedBagError, ForeignBagError


@dataclass(frozen=True)
class TopicCount:
    """A topic and its messages of one type."""

    name: str
    type_name: str
    message_count: int


@dataclass(frozen=True)
class BagInfo:
    """What a bag holds."""

    path: str
    storage: str  # mcap or sqlite3
    size_bytes: int  # of the data files
    start_ns: int  # when the first message was received, ns since the epoch
    duration_ns: int  # from the first message to the last
    message_count: int
    topics: tuple[TopicCount, ...]  # by name; those without messages are not listed
    metadata: dict[str, str]  # what the run was made with
    damage: str | None  # where reading had to stop and why
    ensembles: tuple[str, ...] = ()  # namespaces of those that were recorded; ``/``: without one

    @property
    def duration_s(self) -> float:
        """From the first message to the last, in s."""
        return self.duration_ns / 1e9


def bag_info(path: Path | str) -> BagInfo:
    """Look at a bag, also one that no ensemble recorded.

    Args:
        path: The bag's folder, or a single ``.mcap`` or ``.db3`` file.

    Raises:
        DamagedBagError: There is no bag, or no message in it can be read.
    """
    storage = open_storage(path)
    found = survey(storage)
    if found.damage is None:
        found.damage = _gaps(storage, found)
    if not found.counts and found.damage is not None:
        raise DamagedBagError(f"no message can be read: {found.damage}; record it again")
    return BagInfo(
        path=str(path),
        storage="mcap" if storage.suffix == MCAP else "sqlite3",
        size_bytes=storage.size_bytes,
        start_ns=found.extent.start_ns if found.counts else 0,
        duration_ns=found.extent.duration_ns,
        message_count=found.extent.message_count,
        topics=tuple(
            sorted(
                (TopicCount(c.topic, c.type_name, count) for c, count in found.counts.items()),
                key=lambda topic: (topic.name, topic.type_name),
            )
        ),
        metadata=storage.metadata(),
        damage=found.damage,
        ensembles=_ensembles(found),
    )


def _ensembles(found: Survey) -> tuple[str, ...]:
    ours = [channel for channel in found.counts if is_ours(channel.type_name)]
    return Ensembles(found.counts).namespaces if ours else ()


def _gaps(storage: Storage, found: Survey) -> str | None:
    """What is missing of an ensemble's runs; None for other bags, which promise nothing."""
    if not any(is_ours(channel.type_name) for channel in found.counts):
        return None
    try:
        return read_contents(Bag(storage, found)).damage
    except ForeignBagError:
        return None
