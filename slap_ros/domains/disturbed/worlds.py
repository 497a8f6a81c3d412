# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A world that is disturbed, and the world as its planner knows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Action, ActionSpace, World
from slap_ros.domains.disturbed.disturbances import Disturbances
from slap_ros.domains.disturbed.generator import GENERATOR, GeneratorIndex
from slap_ros.relational import Layout, State
from slap_ros.worlds.bodies import Material

MakeWorld = Callable[[State], World]
SIZES = ("half_x", "half_y", "half_z")
HELD = "held"  # a feature of whatever can be grasped

Indices = NDArray[np.intp]


@lru_cache(maxsize=1024)
def _columns(layout: Layout, *features: str) -> Indices:
    """Where features of the things that can be grasped are, one thing after the other."""
    wanted = {*features, HELD}
    things = [obj for obj in layout.objects if wanted <= set(obj.type.column)]
    columns = [layout.column(obj, name) for obj in things for name in features]
    return np.array(columns, dtype=np.intp)


class ResizedWorld:
    """A world that is made again where things have other sizes: no engine changes those."""

    def __init__(self, make_world: MakeWorld, state: State) -> None:
        """Begin in ``state``.

        Args:
            make_world: Makes a world in a state, with things of the sizes that the state has.
            state: State to begin in.
        """
        self._make_world = make_world
        self._world, self._sizes = make_world(state), _sizes(state)

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidStateError: See the world that is made; this one stays as it is.
        """
        sizes = _sizes(state)
        if sizes == self._sizes:
            self._world.reset(state)
        else:
            self._world, self._sizes = self._make_world(state), sizes

    def step(self, action: Action) -> State:
        """Act for one control period."""
        return self._world.step(action)


def _sizes(state: State) -> bytes:
    return state.data[_columns(state.layout, *SIZES)].tobytes()


class DisturbedWorld:
    """A world in which actions are disturbed; see ``slap_ros.core.World``."""

    def __init__(
        self,
        make_world: MakeWorld,
        state: State,
        actions: ActionSpace,
        disturbances: Disturbances,
    ) -> None:
        """Begin in ``state``.

        Args:
            make_world: Makes the world without disturbances.
            state: State to begin in; one of its objects is the generator.
            actions: Actions of the robot.
            disturbances: What disturbs them.

        Raises:
            InvalidStateError: The state has no generator, or cannot be.
        """
        self._actions, self._disturbances = actions, disturbances
        self._generator = _generator_of(state)
        self._world, self._state = ResizedWorld(make_world, state), state

    @property
    def state(self) -> State:
        """The current state, with the generator of what disturbs the next step."""
        return self._state

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidStateError: The state has no generator, or cannot be; the world stays as it is.
        """
        generator = _generator_of(state)
        self._world.reset(state)
        self._generator, self._state = generator, state

    def step(self, action: Action) -> State:
        """Act for one control period, not quite as commanded.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        self._actions.check(action)
        now = self._state
        holds = bool((now.data[_columns(now.layout, HELD)] > 0.5).any())
        random = self._generator.random(now)
        acted = self._disturbances.disturbed(action, self._actions, holds, random)
        data = self._world.step(acted).data.copy()
        data[self._generator.step] = now.data[self._generator.step] + 1.0
        self._state = State(now.layout, data)
        return self._state


def _generator_of(state: State) -> GeneratorIndex:
    index = GeneratorIndex.of(state.layout)
    index.require_valid(state)
    return index


@dataclass(frozen=True)
class Belief:
    """What a planner takes a state for.

    Args:
        material: Material of everything that can be grasped, as nobody can see it.
    """

    material: Material

    def of(self, state: State) -> State:
        """The state as the planner knows it."""
        data = state.data.copy()
        columns = _columns(state.layout, "mass", "friction")
        data[columns] = np.tile(self.material, len(columns) // 2)
        return State(state.layout, data)


class NominalWorld:
    """The world as its planner knows it: no noise, no drops, everything of the same material.

    What a state says of materials and of the generator it keeps, so that whoever goes on from there
    in the world has the true ones. Nothing that it does depends on them.
    """

    def __init__(self, make_world: MakeWorld, state: State, belief: Belief) -> None:
        """Begin in ``state``.

        Args:
            make_world: Makes the world without disturbances.
            state: State to begin in.
            belief: What is known of states.

        Raises:
            InvalidStateError: The state cannot be.
        """
        self._belief = belief
        self._world, self._state = ResizedWorld(make_world, belief.of(state)), state

    @property
    def state(self) -> State:
        """The current state."""
        return self._state

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidStateError: The state cannot be; the world stays as it is.
        """
        self._world.reset(self._belief.of(state))
        self._state = state

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        now = self._state
        data = self._world.step(action).data.copy()
        materials = _columns(now.layout, "mass", "friction")
        data[materials] = now.data[materials]
        for generator in now.layout.of_type(GENERATOR):  # what is perceived may lack it
            at = now.layout.column(generator, "step")
            data[at] = now.data[at] + 1.0
        self._state = State(now.layout, data)
        return self._state
