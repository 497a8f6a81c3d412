# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages of an episode that wait for their counterpart: a state for its atoms, or atoms."""

from __future__ import annotations

from typing import Generic, TypeVar

from slap_msgs.msg import AbstractState, ObjectCentricState, ObjectState

from slap_ros.messages.decode import stamp_ns

Key = tuple[int, int, int]  # episode, step, stamp: the atoms' header is a copy of the state's
M = TypeVar("M", bound=ObjectCentricState | AbstractState)
NUMBERS = 1_000_000  # features that all messages of a room have together
LETTERS = 8  # that take as much room as a feature


def key_of(message: ObjectCentricState | AbstractState) -> Key:
    """What a state and its atoms have in common."""
    return message.episode, message.step, stamp_ns(message.header)


def size_of(message: ObjectCentricState | AbstractState) -> int:
    """How much there is in a message: its features, and its words at 8 letters a feature."""
    if isinstance(message, ObjectCentricState):
        return sum(map(_size_of_object, message.objects))
    letters = sum(map(len, message.missing))
    for atom in message.atoms:
        letters += len(atom.predicate) + sum(map(len, atom.objects))
    atoms = len(message.atoms) + len(message.missing) + letters // LETTERS
    return atoms + sum(map(_size_of_object, message.seen))


def _size_of_object(item: ObjectState) -> int:
    return 1 + len(item.features) + (len(item.name) + len(item.type)) // LETTERS


class WaitingRoom(Generic[M]):
    """Room for messages of one kind, of which the most urgent stay.

    Urgent is the next step: the world takes no other before. So messages of later steps, as
    strangers may send them, go first where there is no more room; then the oldest.
    """

    def __init__(self, limit: int) -> None:
        """Keep none yet.

        Args:
            limit: Number of messages.
        """
        self._limit = limit
        self._kept: dict[int, dict[Key, M]] = {}  # by step, the oldest first
        self._count = self._numbers = 0

    def __len__(self) -> int:
        """Number of messages that wait."""
        return self._count

    def add(self, message: M) -> None:
        """Let a message wait."""
        self.pop(key_of(message))
        self._kept.setdefault(message.step, {})[key_of(message)] = message
        self._count += 1
        self._numbers += size_of(message)
        while self._count > self._limit or self._numbers > NUMBERS:
            self.pop(next(iter(self._kept[max(self._kept)])))

    def pop(self, key: Key) -> M | None:
        """The message of a key, which then waits no longer."""
        of_step = self._kept.get(key[1], {})
        found = of_step.pop(key, None)
        if found is not None:
            self._count -= 1
            self._numbers -= size_of(found)
            if not of_step:
                del self._kept[key[1]]
        return found

    def drop_through(self, step: int) -> None:
        """Let nothing wait any longer that is of this step or of one before."""
        for earlier in [kept for kept in self._kept if kept <= step]:
            for key in list(self._kept[earlier]):
                self.pop(key)
