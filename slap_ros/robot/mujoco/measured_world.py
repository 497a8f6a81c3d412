# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What worlds whose states are measured have in common."""

from __future__ import annotations

from slap_ros.errors import InvalidStateError
from slap_ros.relational import State


class MeasuredWorld:
    """A world whose states are measured on a plant of its own."""

    _state: State  # measured last

    @property
    def state(self) -> State:
        """The state that was measured last."""
        return self._state

    def reset(self, state: State) -> None:  # noqa: ARG002
        """Refuse: objects of a robot are arranged by hand.

        Raises:
            InvalidStateError: Always.
        """
        raise InvalidStateError("a robot cannot be put into a state")
