# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the robot does while it explores: random actions, or straight pushes at something.

Random actions hardly ever bring a hand to an object and past it. A straight push does: towards an
object as directly as the robot's own axes allow, and on in the same direction once it is there.
Which direction that is, is measured in the model, axis by axis: no domain says how its hand moves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from slap_ros.core import Domain, VectorWorld
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import Column, Object, State
from slap_ros.relational.state import Array

KEEPS = 3  # times that a gripper stays as it is, for each that it closes and each that it opens
PROBE_STEPS = 2  # environment steps for which an axis is moved to see where it takes the hand
TILT = 0.15  # standard deviation of a push's direction, along each axis, of -1 to 1
RANDOM, PUSH = "random actions", "straight pushes"


class ExplorationPolicy(Protocol):
    """Gives the actions of many worlds, step by step."""

    @property
    def name(self) -> str:
        """The name of the policy in the records of what it found."""
        ...

    def actions(self, step: int) -> Array:
        """The robot's actions in a step, counted from 0, shape (worlds, axes)."""
        ...


class RandomExploration:
    """Random actions, each of them repeated; in every second world the gripper acts too."""

    name = RANDOM

    def __init__(self, domain: Domain, worlds: int, repeat: int, rng: np.random.Generator) -> None:
        """Draw nothing yet.

        Args:
            domain: Domain of the worlds.
            worlds: Number of worlds.
            repeat: Environment steps for which an action is repeated.
            rng: Generator that draws the actions.
        """
        self._space, self._repeat, self._rng = domain.learned_actions, repeat, rng
        self._to_action = ActionMap(domain, gripper=True)
        self._grips = np.arange(worlds) % 2 == 1  # whether the gripper acts in a world
        self._drawn = np.zeros((worlds, len(self._space.axes)))

    def actions(self, step: int) -> Array:
        """See :class:`ExplorationPolicy`."""
        if step % self._repeat == 0:
            self._drawn = self._draw()
        return self._drawn

    def _draw(self) -> Array:
        worlds = len(self._grips)
        actions = self._to_action(self._rng.uniform(-1.0, 1.0, (worlds, self._to_action.size)))
        gripper = self._space.gripper
        if gripper is not None:
            choices = np.array([*(0.0,) * KEEPS, gripper.closes, gripper.opens])
            commands = self._rng.choice(choices, worlds)
            actions[:, self._space.gripper_index] = np.where(self._grips, commands, 0.0)
        return actions


@dataclass(frozen=True)
class StraightPushes:
    """Pushes in straight lines, one in each world; the gripper stays as it is.

    Args:
        directions: Action of each world, which is the same in every step, shape (worlds, axes).
        name: Name in the records of what they found.
    """

    directions: Array
    name: str = PUSH

    def actions(self, step: int) -> Array:
        """See :class:`ExplorationPolicy`."""
        del step
        return self.directions


def within_reach(domain: Domain, state: State) -> list[Object]:
    """The objects that there is a point in going to, which are those that pushes go to.

    Args:
        domain: Domain of the state.
        state: State in which the pushes would begin.
    """
    interface, batch = learner_interface(domain), state.alone()
    hand = interface.hand(batch)
    distances = {
        obj: interface.distance(batch, hand, Column.of(obj))[0, 0] for obj in state.layout.objects
    }
    return [obj for obj, distance in distances.items() if np.isfinite(distance)]


class PushAim:
    """Finds the directions of pushes, by trying every axis in the model."""

    def __init__(
        self, domain: Domain, worlds: VectorWorld, count: int, rng: np.random.Generator
    ) -> None:
        """Take worlds to try axes in.

        Args:
            domain: Domain of the worlds.
            worlds: Worlds that are reset before anything is tried in them.
            count: Number of the worlds.
            rng: Generator that draws how much pushes are tilted.
        """
        self._domain, self._interface = domain, learner_interface(domain)
        self._worlds, self._count, self._rng = worlds, count, rng
        self._to_action = ActionMap(domain, gripper=False)
        self.steps = 0  # environment steps so far

    def pushes(self, state: State) -> Iterator[StraightPushes]:
        """Yield pushes at each object that there is a point in going to.

        The first world's push goes straight at the object; those of the others are tilted.

        Args:
            state: State in which the pushes begin.
        """
        objects = within_reach(self._domain, state)
        gradients = self._gradients(state, objects)
        for gradient in gradients.T:
            steepest = float(np.abs(gradient).max())
            if steepest > 0.0:
                yield self.along(-gradient / steepest)

    def along(self, direction: Array, name: str = PUSH) -> StraightPushes:
        """Pushes in a direction and others near it.

        Args:
            direction: Action of a policy, shape (k,).
            name: Name in the records of what they found.
        """
        return StraightPushes(self._to_action(tilted(direction, self._count, self._rng)), name)

    def _gradients(self, state: State, objects: list[Object]) -> Array:
        """How distances grow with each axis, shape (axes, objects)."""
        size = self._to_action.size
        probes = np.concatenate([np.eye(size), -np.eye(size)])
        distances = np.concatenate(
            [
                self._after(state, probes[first : first + self._count], objects)
                for first in range(0, len(probes), self._count)
            ]
        )
        gradients: Array = distances[:size] - distances[size:]
        return gradients

    def _after(self, state: State, probes: Array, objects: list[Object]) -> Array:
        """The distances to objects after some probes, at most one per world."""
        for world in range(self._count):
            self._worlds.reset(world, state)
        actions = np.zeros((self._count, self._to_action.size))
        actions[: len(probes)] = probes
        for _ in range(PROBE_STEPS):
            states = self._worlds.step(self._to_action(actions))
        self.steps += PROBE_STEPS * len(probes)
        reached = State(states.layout, states.data[: len(probes)])
        hand = self._interface.hand(reached)
        columns = [self._interface.distance(reached, hand, Column.of(obj)) for obj in objects]
        return np.concatenate(columns, axis=-1)


def tilted(direction: Array, count: int, rng: np.random.Generator) -> Array:
    """A direction and others near it, along one axis at full speed each.

    Args:
        direction: Action of a policy, shape (k,); the first one is as it is.
        count: Number of directions.
        rng: Generator that draws how much they are tilted.

    Returns:
        Shape (count, k).
    """
    noise = TILT * rng.standard_normal((count, len(direction)))
    noise[0] = 0.0
    directions = direction + noise
    fastest: Array = np.abs(directions).max(axis=-1, keepdims=True)
    return directions / fastest
