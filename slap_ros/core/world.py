# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds: what can be reset to a state and stepped, alone or several at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from slap_ros.core.action_space import Action
from slap_ros.relational import State
from slap_ros.relational.state import Array


class World(Protocol):
    """Something that can be reset to a state and stepped: a simulator or a robot bridge."""

    @property
    def state(self) -> State:
        """The current state."""
        ...

    def reset(self, state: State) -> None:
        """Continue from this state."""
        ...

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidCommandError: The action is not in the domain's action space; nothing moved.
        """
        ...


class VectorWorld(Protocol):
    """Several worlds with the same objects, stepped together."""

    @property
    def states(self) -> State:
        """Their current states, a batch of shape (worlds, layout.size)."""
        ...

    def reset(self, world: int, state: State) -> None:
        """Let the one with index ``world`` continue from this state."""
        ...

    def step(self, actions: Array) -> State:
        """Act in each of the worlds for one control period.

        Args:
            actions: Action of each world, shape (worlds, axes).

        Returns:
            Their states, a batch of shape (worlds, layout.size).
        """
        ...


MakeVectorWorld = Callable[[Sequence[State]], VectorWorld]  # one in each of these states


class SyncVectorWorld:
    """Single worlds, stepped one after the other, behind the interface of :class:`VectorWorld`."""

    def __init__(self, make_world: Callable[[State], World], states: Sequence[State]) -> None:
        self._worlds = [make_world(state) for state in states]

    @property
    def states(self) -> State:
        """See :class:`VectorWorld`."""
        return State.batch([world.state for world in self._worlds])

    def reset(self, world: int, state: State) -> None:
        """See :class:`VectorWorld`."""
        self._worlds[world].reset(state)

    def step(self, actions: Array) -> State:
        """See :class:`VectorWorld`."""
        for world, action in zip(self._worlds, actions, strict=True):
            world.step(action)
        return self.states
