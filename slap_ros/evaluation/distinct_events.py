# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Events of a log, each once."""

from __future__ import annotations

from typing import Generic, TypeVar

from slap_ros.messages.decode import stamp_ns
from slap_ros.messages.protocols import PlanEventMessage, SkillEventMessage

Event = TypeVar("Event", PlanEventMessage, SkillEventMessage)


class DistinctEvents(Generic[Event]):
    """Events in order, each once.

    No event happens twice at one time: then it was recorded, or read, twice.
    """

    def __init__(self) -> None:
        self.messages: list[Event] = []
        self.repeated = 0
        self._seen: set[tuple[object, ...]] = set()

    def add(self, event: Event, *about: object) -> None:
        """Take an event.

        Args:
            event: Message of the event.
            about: Values that tell the event from others of its kind at the same time.
        """
        stamp = stamp_ns(event.header)
        key = (type(event), stamp, event.episode, event.step, event.kind, *about)
        if key in self._seen:
            self.repeated += 1
        else:
            self._seen.add(key)
            self.messages.append(event)
