# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States of an episode in the order of their steps, whatever else claims to be one."""

from __future__ import annotations

from slap_ros.messages.protocols import StateMessage

AHEAD = 100  # states that wait for those before them: the nearest


class NextStates:
    """Puts an episode's states in order.

    The world takes a step only when the state before was perceived, so the next state is always the
    one of the next step. One of a later step waits: if it is the world's, those before it come.
    """

    def __init__(self, step: int) -> None:
        """Begin an episode.

        Args:
            step: The first step that is wanted.
        """
        self.step = step  # the next that is wanted
        self._ahead: dict[int, StateMessage] = {}

    def add(self, message: StateMessage) -> None:
        """Take a state, to be given by :meth:`pop` in its turn."""
        step = message.step
        if step < self.step:
            return
        self._ahead[step] = (
            message  # the newest: what cannot be perceived does not stand in the way
        )
        if len(self._ahead) > AHEAD:
            del self._ahead[max(self._ahead)]

    def pop(self) -> StateMessage | None:
        """The state of the next step, if it is here."""
        return self._ahead.pop(self.step, None)
