# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A world whose states are measured on a robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

from slap_ros.core import Action
from slap_ros.errors import InvalidStateError
from slap_ros.relational import GroundAtom, State


class MeasuredWorld(ABC):
    """A world whose states are measured on a robot."""

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

    @abstractmethod
    def step(self, action: Action) -> State:
        """Act, and measure.

        Raises:
            SlapError: Nothing moved, or the robot holds after a fault.
        """

    @abstractmethod
    def require_seen(self, goal: Iterable[GroundAtom]) -> None:
        """Refuse a goal about what is not seen when the task begins.

        Raises:
            NoDetectionError: It is about such an object.
        """

    @abstractmethod
    def close(self) -> None:
        """Release what the world uses."""
