# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading bags, ours and those of ``ros2 bag record``, damaged ones up to the damage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from slap_ros.bags.definitions import check_versions, decode, is_ours, undecodable
from slap_ros.bags.ensembles import Ensembles
from slap_ros.bags.storage import Storage, Survey, open_storage, survey
from slap_ros.errors import DamagedBagError, ForeignBagError


class BagMessage(NamedTuple):
    """A message of a bag."""

    topic: str
    type_name: str
    stamp_ns: int  # when it was received, ns since the epoch
    message: object


class Bag:
    """The messages of a bag: iterate over it, as often as need be.

    Attributes:
        path: Where it is.
        metadata: What the run was made with, as its writer states.
        damage: Where reading has to stop and why; None for a sound bag. Deserialising may find
            damage that only shows at the end of an iteration.
        undecoded: Types that are left out, and why they cannot be deserialised.
        ensembles: Which topics belong together.
    """

    def __init__(self, storage: Storage, found: Survey) -> None:
        """Open a bag that was surveyed; for :func:`read_bag`.

        Raises:
            ForeignBagError: It has topics of slap_msgs of another version.
        """
        self.path = storage.path
        self.metadata = storage.metadata()
        self.damage = found.damage
        self.undecoded = undecodable(found.counts)
        check_versions(found.counts, self.undecoded)
        self.ensembles = Ensembles(found.counts)
        self._storage = storage

    def __iter__(self) -> Iterator[BagMessage]:
        try:
            for channel, stamp_ns, data in self._storage.messages():
                if channel.type_name not in self.undecoded:
                    message = decode(channel, data)
                    yield BagMessage(channel.topic, channel.type_name, stamp_ns, message)
        except DamagedBagError as error:
            self.damage = str(error)


def read_bag(path: Path | str) -> Bag:
    """Open a bag of an ensemble.

    Args:
        path: The bag's folder, or a single ``.mcap`` or ``.db3`` file.

    Raises:
        DamagedBagError: There is no bag, or no message in it can be read.
        ForeignBagError: It has no topic of slap_msgs, or such of another version.
    """
    storage = open_storage(path)
    found = survey(storage)
    ours = [channel for channel in found.counts if is_ours(channel.type_name)]
    if not ours and found.damage is not None:
        raise DamagedBagError(
            f"no message of an ensemble can be read: {found.damage}; record it again"
        )
    if not ours:
        topics = ", ".join(sorted(f"{c.topic} ({c.type_name})" for c in found.counts))
        raise ForeignBagError(
            f"{path} was not recorded from an ensemble: it has no topic of slap_msgs, "
            f"only {topics or 'nothing at all'}"
        )
    return Bag(storage, found)
