# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rollouts of exploration, from a state and for all targets at once (SLAP §4.2, B.1)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from slap_ros.core import Domain, Task
from slap_ros.errors import InvalidStateError
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import AtomSpace, State
from slap_ros.shortcuts.approaches import APPROACHED
from slap_ros.shortcuts.exploration_policies import (
    ExplorationPolicy,
    PushAim,
    RandomExploration,
)
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.exploration_steps import exploration_worlds
from slap_ros.shortcuts.rollout_origins import RolloutOrigin


@dataclass
class RolloutHits:
    """Rollouts that reached the same abstract state.

    Args:
        shortest: State in which the shortest of them was there.
        least: Environment steps of the shortest.
        lengths: Environment steps of each rollout until it was there.
        found_by: Names of the exploration policies of the rollouts, without repetitions.
    """

    shortest: State
    least: int
    lengths: list[int] = field(default_factory=list)
    found_by: dict[str, None] = field(default_factory=dict)  # a set that keeps its order

    def add(self, steps: int, state: State, policy: str) -> None:
        """Take note of one more rollout.

        Args:
            steps: Environment steps after which it was there.
            state: State in which it was there.
            policy: Name of its exploration policy.
        """
        if steps < self.least:
            self.shortest, self.least = state, steps
        self.lengths.append(steps)
        self.found_by[policy] = None


class ExplorationRollouts:
    """Makes rollouts in worlds that are stepped together."""

    def __init__(
        self,
        domain: Domain,
        task: Task,
        space: AtomSpace,
        settings: ExplorationSettings,
        rng: np.random.Generator,
    ) -> None:
        """Make the worlds.

        Args:
            domain: Domain of the task.
            task: Task with the objects of the worlds.
            space: Atoms of the task.
            settings: Number and length of rollouts, and what the robot does in them.
            rng: Generator that draws the actions.
        """
        self._domain, self._space, self._settings, self._rng = domain, space, settings, rng
        self._count = exploration_worlds(domain, settings)
        self._worlds = domain.make_vector_world([task.initial_state] * self._count)
        self._aim = PushAim(domain, self._worlds, self._count, rng)
        self._steps = 0

    @property
    def steps(self) -> int:
        """Environment steps so far, with those that aimed pushes."""
        return self._steps + self._aim.steps

    def can_begin(self, state: State) -> bool:
        """Whether rollouts can begin in a state: skills may end where nothing can begin."""
        try:
            self._worlds.reset(0, state)
        except InvalidStateError:
            return False
        return True

    def roll_out(self, origin: RolloutOrigin) -> dict[int, RolloutHits]:
        """Make all rollouts from an origin.

        Args:
            origin: Origin whose state the rollouts can begin in.

        Returns:
            The rollouts that reached each abstract state, a mask.
        """
        hits: dict[int, RolloutHits] = {}
        for policy in self._policies(origin):
            for first in self._roll_out_batch(origin.state, policy):
                for abstract, (steps, state) in first.items():
                    found = hits.setdefault(abstract, RolloutHits(state, steps))
                    found.add(steps, state, policy.name)
        return hits

    def _policies(self, origin: RolloutOrigin) -> Iterator[ExplorationPolicy]:
        """Yield a policy for each batch of rollouts from an origin."""
        settings = self._settings
        if origin.onwards is not None:
            for _ in range(settings.approaches):
                yield self._aim.along(origin.onwards, APPROACHED)
            return
        for _ in range(0, settings.rollouts, self._count):
            for repeat in filter(None, (settings.action_repeat, settings.also_repeat)):
                yield RandomExploration(self._domain, self._count, repeat, self._rng)
        for _ in range(settings.pushes):
            yield from self._aim.pushes(origin.state)

    def _roll_out_batch(
        self, state: State, policy: ExplorationPolicy
    ) -> list[dict[int, tuple[int, State]]]:
        """When and where each abstract state was first reached, at rest, in every world."""
        learner = learner_interface(self._domain)
        for world in range(self._count):
            self._worlds.reset(world, state)
        first: list[dict[int, tuple[int, State]]] = [{} for _ in range(self._count)]
        alive = np.ones(self._count, dtype=bool)
        for step in range(self._settings.length):
            states = self._worlds.step(policy.actions(step))
            alive &= ~learner.failed(states)
            self._steps += int(alive.sum())
            at_rest = np.flatnonzero(alive & learner.at_rest(states))
            abstracts: list[int] = []
            if at_rest.size:
                abstracts = self._space.abstract_each(State(states.layout, states.data[at_rest]))
            for number, abstract in zip(at_rest.tolist(), abstracts, strict=True):
                if abstract not in first[number]:
                    there = State(states.layout, states.data[number].copy())
                    first[number][abstract] = step + 1, there
            if not alive.any():
                break
        return first
