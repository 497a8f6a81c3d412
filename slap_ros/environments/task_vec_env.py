# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many episodes of a domain's tasks, stepped by one computation where the worlds can be.

Observations, actions and rewards are those of :class:`~slap_ros.environments.task_env.TaskEnv` with
joints and the sparse reward, to the bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Task, VectorWorld
from slap_ros.environments.task_env import TaskEnv
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import AtomSpace, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array


class TaskVecEnv:
    """Episodes side by side, each of the next task of its stream; see the module."""

    def __init__(self, env: TaskEnv, streams: Sequence[Iterator[Task]]) -> None:
        """Begin the first task of each stream.

        Args:
            env: Environment of these tasks, with joints and the sparse reward.
            streams: Tasks of each episode after the other, without end.
        """
        self._env, self._streams = env, streams
        self.num_envs, self.horizon = len(streams), env.domain.step_limit
        self.action_map = ActionMap(env.domain, gripper=True)
        self._groups: dict[object, _SharedWorlds] = {}
        self._at: list[_SharedWorlds] = [self._begin(slot) for slot in range(self.num_envs)]
        self._lengths = np.zeros(self.num_envs, dtype=np.intp)
        self.observations = np.zeros((self.num_envs, env.observed_features), np.float32)
        self._observe(range(self.num_envs))

    def step(self, actions: Array) -> VecEnvStep:
        """See :meth:`slap_ros.learning.vec_env.VecEnv.step`."""
        self._lengths += 1
        commands = self.action_map(np.asarray(actions, dtype=np.float64))
        success = np.zeros(self.num_envs, dtype=bool)
        for group in self._groups.values():
            slots = [i for i, at in enumerate(self._at) if at is group]
            if slots:
                states = group.step(slots, commands)
                self.observations[slots] = self._env.encode(states, group.space)
                success[slots] = group.solved(slots, states)
        limits = np.array([group.limits[i] for i, group in enumerate(self._at)])
        truncated = (self._lengths >= limits) & ~success
        final, lengths = self.observations.copy(), self._lengths.copy()
        self._reset(np.flatnonzero(success | truncated))
        return VecEnvStep(
            self.observations.copy(),
            np.where(success, 0.0, -1.0),
            success,
            np.zeros(self.num_envs, dtype=bool),
            truncated,
            lengths,
            final,
        )

    def _reset(self, ended: NDArray[np.intp]) -> None:
        """Begin the next task in each of some slots."""
        for slot in map(int, ended):
            self._at[slot] = self._begin(slot)
            self._lengths[slot] = 0
        self._observe(list(map(int, ended)))

    def _begin(self, slot: int) -> _SharedWorlds:
        """Begin the next task of a slot, among the tasks with the same objects."""
        task = next(self._streams[slot])
        space = self._env.domain.atom_space(task.initial_state)
        key = (space.layout.objects, space.static_truth)
        if key not in self._groups:
            worlds = self._env.domain.make_vector_world([task.initial_state] * self.num_envs)
            self._groups[key] = _SharedWorlds(space, worlds)
        self._groups[key].begin(slot, task)
        return self._groups[key]

    def _observe(self, slots: Sequence[int]) -> None:
        """Observe the states in which episodes begin."""
        for slot in slots:
            group = self._at[slot]
            state = State(group.space.layout, group.worlds.states.data[slot][None])
            self.observations[slot] = self._env.encode(state, group.space)[0]


class _SharedWorlds:
    """Tasks with the same objects: a world for each slot, whether it is used now or not."""

    def __init__(self, space: AtomSpace, worlds: VectorWorld) -> None:
        self.space, self.worlds = space, worlds
        self.goals: dict[int, int] = {}  # masks, by slot
        self.limits: dict[int, int] = {}  # environment steps, by slot

    def begin(self, slot: int, task: Task) -> None:
        """Begin a task."""
        self.worlds.reset(slot, task.initial_state)
        self.goals[slot], self.limits[slot] = self.space.mask(task.goal), task.step_limit

    def step(self, slots: Sequence[int], commands: Array) -> State:
        """Step all worlds; the states of those that are used."""
        states = self.worlds.step(commands)
        return State(states.layout, states.data[list(slots)])

    def solved(self, slots: Sequence[int], states: State) -> Bools:
        """Whether the goal of each slot holds in its state, shape (slots,)."""
        abstract = self.space.abstract_each(states)
        return np.array(
            [self.goals[slot] & ~now == 0 for slot, now in zip(slots, abstract, strict=True)]
        )
