# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What simulated worlds have in common: a scene, a state, and when they are closed."""

from __future__ import annotations

from typing import Generic, Self, TypeVar

from slap_ros.errors import InvalidStateError
from slap_ros.relational import Layout, State

SceneType = TypeVar("SceneType")


class SimulatedWorld(Generic[SceneType]):
    """A world of a scene, whose simulation it shares with other worlds of that scene."""

    _state: State  # set by the world that this is a part of

    def __init__(self, scene: SceneType, layout: Layout) -> None:
        """Begin without a state.

        Args:
            scene: Bodies of this world.
            layout: Objects of all its states.
        """
        self._scene = scene
        self._layout = layout
        self._is_open = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """The world cannot be stepped any more."""
        self._is_open = False

    @property
    def scene(self) -> SceneType:
        """The bodies of this world."""
        return self._scene

    @property
    def state(self) -> State:
        """The current state, all that the next step depends on."""
        return self._state

    def _require_own_objects(self, state: State) -> None:
        if state.layout is not self._layout and state.layout != self._layout:
            raise InvalidStateError("a world is reset to states of its own objects only")

    def _require_open(self) -> None:
        if not self._is_open:
            raise ValueError("this world is closed")
