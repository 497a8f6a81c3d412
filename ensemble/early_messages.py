# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that came before the task of their episode was opened."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from ensemble.observation import Episode
from ensemble.waiting_room import NUMBERS, size_of
from slap_ros.messages.protocols import StateMessage

M = TypeVar("M")


class Room(Generic[M]):
    """The newest messages, no more than there is room for."""

    def __init__(self, limit: int, state_of: Callable[[M], StateMessage]) -> None:
        """Keep none yet.

        Args:
            limit: Number of messages.
            state_of: The state that a message is, or has.
        """
        self._kept: deque[M] = deque()
        self._limit, self._state_of = limit, state_of
        self._numbers = 0

    def __len__(self) -> int:
        """Number of messages that are kept."""
        return len(self._kept)

    def __iter__(self) -> Iterator[M]:
        """The messages, the oldest first."""
        return iter(self._kept)

    def add(self, message: M) -> None:
        """Keep a message, in place of the oldest where there is no more room."""
        self._kept.append(message)
        self._numbers += self._size(message)
        while len(self._kept) > self._limit or self._numbers > NUMBERS:
            self._numbers -= self._size(self._kept.popleft())

    def _size(self, message: M) -> int:
        return size_of(self._state_of(message))


class EarlyMessages(Generic[M]):
    """Keeps messages until the episode that they belong to is opened.

    Those of an episode whose task is here have a room of their own, which messages of episodes that
    nobody opens, as strangers may send them, cannot fill.
    """

    def __init__(
        self,
        limit: int,
        state_of: Callable[[M], StateMessage],
        is_expected: Callable[[StateMessage], bool],
    ) -> None:
        """Keep none yet.

        Args:
            limit: Number of messages that are kept in each room: the newest.
            state_of: The state that a message is, or has.
            is_expected: Whether a state is of an episode whose task is here, but not opened yet.
        """
        self._limit, self._state_of, self._is_expected = limit, state_of, is_expected
        self._clear()

    def _clear(self) -> None:
        self._expected = Room[M](self._limit, self._state_of)
        self._others = Room[M](self._limit, self._state_of)

    def __len__(self) -> int:
        """Number of messages that are kept."""
        return len(self._expected) + len(self._others)

    def add(self, message: M) -> None:
        """Keep a message."""
        expected = self._is_expected(self._state_of(message))
        (self._expected if expected else self._others).add(message)

    def take(self, episode: Episode) -> list[M]:
        """An episode's messages, in the order in which they came; they are kept no longer.

        The others are: the world may have been reset again before this episode was opened.
        """
        messages = [*self._others, *self._expected]
        self._clear()
        taken = []
        for message in messages:
            if episode.has(self._state_of(message)):
                taken.append(message)
            else:
                self.add(message)
        return taken
