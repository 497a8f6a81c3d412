# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A condition triggered by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ._entity import Entity, Work

if TYPE_CHECKING:
    from .callback_groups import CallbackGroup


class GuardCondition(Entity):
    """Runs its callback on the node's executor whenever it was triggered."""

    def __init__(self, callback: Callable[[], Any] | None, callback_group: CallbackGroup) -> None:
        super().__init__(callback_group)
        self.callback = callback
        self._triggered = False

    def trigger(self) -> None:
        """Trigger it; from any thread."""
        self._triggered = True
        self.wake_executor()

    @property
    def is_ready(self) -> bool:
        """Whether it was triggered since its callback last ran."""
        return self._triggered

    def take(self) -> Work | None:
        """The callback, where it was triggered."""
        if not self._triggered:
            return None
        self._triggered = False
        return Work(self.callback or _nothing)

    def destroy(self) -> None:
        """Detach it from its node."""
        self.leave_node()


def _nothing() -> None:
    pass
