# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that came before the task of their episode was opened."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from ensemble.observation import Episode
from slap_ros.messages.protocols import StateMessage

M = TypeVar("M")


class EarlyMessages(Generic[M]):
    """Keeps messages until the episode that they belong to is opened."""

    def __init__(self, limit: int, state_of: Callable[[M], StateMessage]) -> None:
        """Keep none yet.

        Args:
            limit: How many are kept: the newest.
            state_of: The state that a message is, or has.
        """
        self._kept: deque[M] = deque(maxlen=limit)
        self._state_of = state_of

    def __len__(self) -> int:
        """How many are kept."""
        return len(self._kept)

    def add(self, message: M) -> None:
        """Keep a message."""
        self._kept.append(message)

    def take(self, episode: Episode) -> list[M]:
        """An episode's messages, in the order in which they came; they are kept no longer.

        The others are: the world may have been reset again before this episode was opened.
        """
        messages, self._kept = self._kept, deque(maxlen=self._kept.maxlen)
        taken = []
        for message in messages:
            kept = taken if episode.has(self._state_of(message)) else self._kept
            kept.append(message)
        return taken
