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
from slap_ros.core.acquisition import no_sides
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import Object, State
from slap_ros.relational.state import Array
from slap_ros.shortcuts.exploration_policies import tilted, within_reach

APPROACHED = "pushes after an approach"  # in the records of what they found
MOST_STEPS = 60  # environment steps after which an approach is given up
USUAL_STEPS = 20  # environment steps that an approach usually takes
TRIED_SIDES = 2  # of an object, usually, until an approach with a push reaches the target
PUSHES = 4  # in different directions, after each approach of a demonstration


@dataclass(frozen=True)
class Approached:
    """Where an approach has led.

    Args:
        state: State in which it has ended.
        commands: Robot's actions until then, shape (steps, axes).
        onwards: Policy's action that moves the hand on towards the object, from -1 to 1.
        side: Name of the side that the hand is at.
    """

    state: State
    commands: Array
    onwards: Array
    side: str


def require_sides(domain: Domain) -> None:
    """Refuse a domain without approaches, in which next to nothing would be explored.

    Raises:
        InvalidParameterError: It has none.
    """
    if domain.acquisition is None or domain.acquisition.sides is no_sides:
        raise InvalidParameterError(
            f"{domain.name} does not say from which sides an object can be approached "
            "(Acquisition.sides), so there are no approaches to explore; train with other settings"
        )


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
                yield Approached(self._world.state, np.array(commands), onwards, side.side)

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
    ) -> Iterator[tuple[str, Array]]:
        """Yield approaches of objects, each with pushes that follow it.

        Args:
            state: State in which each begins.
            objects: Objects that are approached.
            steps: Environment steps of a push.
            rng: Generator that draws how much pushes are tilted.

        Yields:
            Name of the approach, and the robot's actions, shape (steps, axes).
        """
        for obj in objects:
            for approached in self.approach(state, obj):
                name = approach_name(obj, approached.side)
                for push in self._to_action(tilted(approached.onwards, PUSHES, rng)):
                    pushed = np.tile(push, (steps, 1))
                    yield name, np.concatenate([approached.commands, pushed])


def approach_name(obj: Object, side: str) -> str:
    """The name of an approach in records, which is the same for all objects of a type.

    Args:
        obj: Object that is approached.
        side: Name of the side from which it is; empty for none.
    """
    return f"{obj.type.name} from {side}" if side else obj.type.name


def usual_steps_of_pushes(push: int) -> int:
    """Estimate the environment steps of trying approaches with pushes until one gets there.

    Args:
        push: Environment steps of a push.
    """
    return TRIED_SIDES * (USUAL_STEPS + PUSHES * (USUAL_STEPS + push // 2))


def most_steps_of_pushes(domain: Domain, objects: int, push: int) -> int:
    """Count the environment steps of trying all approaches, each with all pushes that follow it.

    Args:
        domain: Domain of the objects.
        objects: Number of objects that are approached.
        push: Environment steps of a push.

    Returns:
        Environment steps where each approach takes as many as it may.
    """
    state = domain.task(0).initial_state
    each = [len(sides_of(domain, state, obj)) for obj in within_reach(domain, state)]
    sides = max(each, default=0)
    return objects * sides * (MOST_STEPS + PUSHES * (MOST_STEPS + push))
