# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Callback groups: which callbacks may run at the same time."""

from __future__ import annotations

import threading
from typing import Any


class CallbackGroup:
    """Base of the callback groups."""

    def __init__(self) -> None:
        self.entities: set[Any] = set()

    def add_entity(self, entity: Any) -> None:
        """Enter an entity whose callbacks this group governs."""
        self.entities.add(entity)

    def remove_entity(self, entity: Any) -> None:
        """Drop an entity."""
        self.entities.discard(entity)

    def has_entity(self, entity: Any) -> bool:
        """Whether an entity is in the group."""
        return entity in self.entities

    def can_execute(self, entity: Any) -> bool:
        """Whether an entity's callback may run now."""
        raise NotImplementedError

    def beginning_execution(self, entity: Any) -> bool:
        """Claim the right to run; returns whether it was granted."""
        raise NotImplementedError

    def ending_execution(self, entity: Any) -> None:
        """Give the right back."""
        raise NotImplementedError


class ReentrantCallbackGroup(CallbackGroup):
    """All callbacks may run at the same time, each any number of times."""

    def can_execute(self, entity: Any) -> bool:
        """Whether an entity's callback may run now: always."""
        return True

    def beginning_execution(self, entity: Any) -> bool:
        """Claim the right to run: always granted."""
        return True

    def ending_execution(self, entity: Any) -> None:
        """Give the right back."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """One callback at a time; a coroutine holds its turn until it is finished."""

    def __init__(self) -> None:
        super().__init__()
        self._active: Any = None
        self._lock = threading.Lock()

    def can_execute(self, entity: Any) -> bool:
        """Whether an entity's callback may run now: where no other does."""
        return self._active is None

    def beginning_execution(self, entity: Any) -> bool:
        """Claim the right to run; returns whether it was granted."""
        with self._lock:
            if self._active is not None:
                return False
            self._active = entity
            return True

    def ending_execution(self, entity: Any) -> None:
        """Give the right back."""
        with self._lock:
            self._active = None
