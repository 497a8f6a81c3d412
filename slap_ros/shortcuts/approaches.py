# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shortcut may begin with an approach: what is near is planned, what touches is learned.

From where skills end, a straight push gets to the nearest face of an object at best. A domain where
skills are acquired knows ways around it (``Acquisition.sides``): to 4 cm before it, from each side.
They are executed in the model, and pushes go on from where they end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slap_ros.core import Domain, SideApproach, World
from slap_ros.errors import InvalidStateError
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import Object, State
from slap_ros.relational.state import Array
from slap_ros.shortcuts.exploration_policies import tilted

APPROACHED = "pushes after an approach"  # in the records of what they found
MOST_STEPS = 60  # environment steps after which an approach is given up
PUSHES = 4  # in different directions, after each approach of a demonstration


@dataclass(frozen=True)
class Approached:
    """Where an approach has led.

    Args:
        state: State in which it has ended.
        commands: Robot's actions until then, shape (steps, axes).
        onwards: Policy's action that moves the hand on towards the object, from -1 to 1.
    """

    state: State
    commands: Array
    onwards: Array


def sides_of(domain: Domain, state: State, obj: Object) -> tuple[SideApproach, ...]:
    """The approaches of an object; none where the domain knows none.

    Args:
        domain: Domain of the state.
        state: State in which an approach begins.
        obj: Object that is approached.
    """
    return () if domain.acquisition is None else domain.acquisition.sides(state, obj)


class Approacher:
    """Executes approaches in the model."""

    def __init__(self, domain: Domain, start: State) -> None:
        """Nothing is executed yet, and no world made: few trainings approach anything.

        Args:
            domain: Domain of the model.
            start: State that the model's world begins in.
        """
        self._domain, self._start = domain, start
        self._to_action = ActionMap(domain, gripper=False)
        self.steps = 0  # environment steps so far

    @cached_property
    def _world(self) -> World:
        return self._domain.model_world(self._start)

    def most_steps(self, state: State, obj: Object) -> int:
        """Environment steps that all approaches of an object take at most.

        Args:
            state: State in which each approach begins.
            obj: Object that is approached.
        """
        return MOST_STEPS * len(sides_of(self._domain, state, obj))

    def approach(self, state: State, obj: Object) -> Iterator[Approached]:
        """Approach an object from each side, and yield where that has led.

        Args:
            state: State in which each approach begins.
            obj: Object that is approached.
        """
        for side in sides_of(self._domain, state, obj):
            commands = self._execute(state, side)
            if commands:
                onwards = self._to_action.inverse(side.onwards)
                yield Approached(self._world.state, np.array(commands), onwards)

    def _execute(self, state: State, side: SideApproach) -> list[Array]:
        """The actions of an approach; none where it does not arrive, or is there already."""
        try:
            self._world.reset(state)
        except InvalidStateError:  # skills may end where nothing can begin
            return []
        commands: list[Array] = []
        while (action := side.policy(self._world.state)) is not None:
            if len(commands) == MOST_STEPS:
                return []
            commands.append(np.asarray(action, dtype=np.float64))
            self._world.step(action)
            self.steps += 1
        return commands

    def pushes(
        self, state: State, objects: Sequence[Object], steps: int, rng: np.random.Generator
    ) -> Iterator[Array]:
        """Yield approaches of objects, each with pushes that follow it.

        Args:
            state: State in which each begins.
            objects: Objects that are approached.
            steps: Environment steps of a push.
            rng: Generator that draws how much pushes are tilted.

        Yields:
            Robot's actions, shape (steps, axes).
        """
        for obj in objects:
            for approached in self.approach(state, obj):
                for push in self._to_action(tilted(approached.onwards, PUSHES, rng)):
                    yield np.concatenate([approached.commands, np.tile(push, (steps, 1))])
