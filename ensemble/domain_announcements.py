# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains that were announced, until a task asks for one of them.

Strangers may announce anything, thousands of times a second. So announcements wait in a bounded
room, one at a time is imported, and one that belongs to a task is known by its stamp: a world
stamps both alike.
"""

from __future__ import annotations

from collections import OrderedDict, deque

from slap_ros.skills.domain_choice import DomainChoice

STAMPS = 4  # of one domain: the newest
TRIED = 4  # domains that are tried for a task, besides the one with its stamp


class DomainAnnouncements:
    """What was announced, by domain, preset and skills."""

    def __init__(self, limit: int = 64) -> None:
        """Know of none yet.

        Args:
            limit: Number of domains that are kept: those announced last, and those in use.
        """
        self._stamps: OrderedDict[DomainChoice, deque[int]] = OrderedDict()
        self._limit = limit

    def add(self, choice: DomainChoice, stamp_ns: int) -> bool:
        """Take note of an announcement.

        Args:
            choice: Domain that is announced.
            stamp_ns: Stamp of the message, ns.

        Returns:
            Whether it is new: what is latched is sent again.
        """
        stamps = self._stamps.setdefault(choice, deque(maxlen=STAMPS))
        if stamp_ns in stamps:
            return False
        stamps.append(stamp_ns)
        self._stamps.move_to_end(choice)
        return True

    def trim(self, used: DomainChoice | None) -> None:
        """Forget those that were announced first, beyond the limit.

        Args:
            used: Domain of the current episode, which is kept.
        """
        while len(self._stamps) > self._limit:
            oldest = next(choice for choice in self._stamps if choice != used)
            del self._stamps[oldest]

    @property
    def newest(self) -> DomainChoice | None:
        """The domain that was announced last."""
        return next(reversed(self._stamps), None)

    def with_stamp(self, name: str, stamp_ns: int) -> list[DomainChoice]:
        """Domains of a name that were announced with a stamp, the newest first."""
        return [
            choice
            for choice in reversed(self._stamps)
            if choice.name == name and stamp_ns in self._stamps[choice]
        ]

    def candidates(self, name: str, stamp_ns: int) -> list[DomainChoice]:
        """Which domains a task may be of, the likeliest first.

        Args:
            name: Name of the domain, as the task has it.
            stamp_ns: Stamp of the task, ns. A domain that was announced with it is the one.
        """
        named = [choice for choice in reversed(self._stamps) if choice.name == name]
        return self.with_stamp(name, stamp_ns) or named[:TRIED]
