# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner sees of a domain, and where it may practise: many states at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.relational import Column, GroundAtom, Object, Predicate, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array


class Worlds(Protocol):
    """Worlds of the same objects, stepped together."""

    @property
    def states(self) -> State:
        """Their current states, a batch of shape (worlds, layout.size)."""
        ...

    def reset(self, world: int, state: State) -> None:
        """Let one of them continue from this state."""
        ...

    def step(self, actions: Array) -> State:
        """Act in each of them for one control period; ``actions``: shape (worlds, axes)."""
        ...


MakeWorlds = Callable[[Sequence[State]], Worlds]  # one in each of these states


def _never(state: State) -> Bools:
    return np.zeros(state.data.shape[:-1], dtype=bool)


def _none(state: State) -> Array:
    return np.zeros(state.data.shape[:-1])


def _always(state: State) -> Bools:
    return np.ones(state.data.shape[:-1], dtype=bool)


def _exactly(_: GroundAtom) -> float:
    return 0.0


@dataclass(frozen=True)
class View:
    """Numbers about batches of states, of magnitude 1 or so where features are concerned.

    Args:
        hand: Where the robot acts from, in whatever form the next three want it; computed once.
        robot: (state, hand) to the robot's features, shape (n, k).
        things: (state, hand, objects of one kind) to their features as seen from the hand, shape
            (n, objects, f).
        distance: (state, hand, objects) to how far the hand, or what it holds, is from each, m,
            shape (n, objects); infinite for what there is no point in going to.
        apart: (state, object, objects) to how far each is from the first, m, shape (n, objects).
        settled: Whether nothing would move by itself any more, shape (n,).
        lost: Whether something happened that cannot be undone, shape (n,).
        strain: How close the robot is to where it cannot move on, shape (n,): 1 for each of its
            axes that is at its limit, 0 well before.
        slack: By how much an atom's margin must pass its threshold before a shortcut counts as
            done, in the margin's unit. Room for the gripper beside what a shortcut left lying
            about, for instance.
        grasping: Predicates about what is held. Only shortcuts that change one of their atoms
            have the gripper among their actions.
        length_m: What is far and what is near: the scale of distances and margins.
    """

    hand: Callable[[State], Array]
    robot: Callable[[State, Array], Array]
    things: Callable[[State, Array, Column], Array]
    distance: Callable[[State, Array, Column], Array]
    apart: Callable[[State, Object, Column], Array]
    settled: Callable[[State], Bools] = _always
    lost: Callable[[State], Bools] = _never
    strain: Callable[[State], Array] = _none
    slack: Callable[[GroundAtom], float] = _exactly
    grasping: frozenset[Predicate] = frozenset()
    length_m: float = 0.1


class OneByOne:
    """Single worlds behind the interface of many."""

    def __init__(self, make_world: Callable[[State], SingleWorld], states: Sequence[State]) -> None:
        self._worlds = [make_world(state) for state in states]

    @property
    def states(self) -> State:
        """See :class:`Worlds`."""
        return State.batch([world.state for world in self._worlds])

    def reset(self, world: int, state: State) -> None:
        """See :class:`Worlds`."""
        self._worlds[world].reset(state)

    def step(self, actions: Array) -> State:
        """See :class:`Worlds`."""
        for world, action in zip(self._worlds, actions, strict=True):
            world.step(action)
        return self.states


class SingleWorld(Protocol):
    """A world that is stepped alone; see ``slap_ros.domains.World``."""

    @property
    def state(self) -> State:
        """The current state."""
        ...

    def reset(self, state: State) -> None:
        """Continue from this state."""
        ...

    def step(self, action: NDArray[np.float64]) -> State:
        """Act for one control period."""
        ...
