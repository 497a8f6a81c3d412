# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What simulated worlds share: a scene, a state, and a simulation that they borrow."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Generic, Self, TypeVar

from slap_ros.errors import InvalidStateError
from slap_ros.relational import Layout, State

SceneType = TypeVar("SceneType")
Borrowed = TypeVar("Borrowed")


class SimulatedWorld(Generic[SceneType]):
    """A world of a scene. Closed, or no longer referred to, it gives its simulation back."""

    _state: State  # set by the world that this is a part of
    _closing: weakref.finalize[..., SimulatedWorld[SceneType]]

    def __init__(self, scene: SceneType, layout: Layout) -> None:
        """Begin without a simulation.

        Args:
            scene: Bodies of this world.
            layout: Objects of all its states.
        """
        self._scene = scene
        self._layout = layout

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the simulation back; the world cannot be stepped any more."""
        self._closing()

    @property
    def scene(self) -> SceneType:
        """The bodies of this world."""
        return self._scene

    @property
    def state(self) -> State:
        """The current state, all that the next step depends on."""
        return self._state

    def _give_back(self, simulation: Borrowed, release: Callable[[Borrowed], None]) -> None:
        """See that a simulation is released when the world is closed or collected."""
        self._closing = weakref.finalize(self, release, simulation)

    def _require_own_objects(self, state: State) -> None:
        if state.layout is not self._layout and state.layout != self._layout:
            raise InvalidStateError("a world is reset to states of its own objects only")

    def _require_open(self) -> None:
        if not self._closing.alive:
            raise ValueError("this world is closed")
