# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shortcut MDP (SLAP §4.2) as a vectorised environment.

Initial states come from the graphs of the training tasks; a step costs 1; reaching the target
ends the episode. Beyond the paper, as settings: a reward for success, shaping by a potential made
of the change's own atoms, and an end where the target cannot be reached any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.learning.shares import proportional_shares
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.relational import State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import Start


class ShortcutVecEnv:
    """Episodes of one shortcut; those that share objects and change are stepped together."""

    def __init__(
        self,
        domain: Domain,
        signature: Signature,
        starts: Sequence[Start],
        num_envs: int,
        horizon: int,
        rewards: Rewards,
        rng: np.random.Generator,
    ) -> None:
        """Begin an episode in each environment.

        Args:
            domain: Domain of the worlds.
            signature: Signature of the shortcut.
            starts: Starts, of which every episode draws one.
            num_envs: Number of environments.
            horizon: Environment steps after which an episode is truncated.
            rewards: Reward function.
            rng: Generator that draws the starts.
        """
        self.horizon, self._rewards = horizon, rewards
        pools = _pools(starts)
        shares = proportional_shares([len(pool) for pool in pools], num_envs)
        self._groups = [
            _Group(domain, signature, pool, share, rng)
            for pool, share in zip(pools, shares, strict=True)
            if share
        ]
        self.num_envs = sum(group.size for group in self._groups)
        self.action_map = self._groups[0].encoder.action_map
        self._lengths = np.zeros(self.num_envs, dtype=np.intp)
        self.observations = np.concatenate([group.observations for group in self._groups])

    @property
    def transitions(self) -> list[GroupTransitions]:
        """What happened in the newest step, group after group in the order of environments."""
        return [group.transitions for group in self._groups]

    def begin(self, start: Start) -> None:
        """Begin every episode in a start, over the same objects and for the same change as before.

        Args:
            start: Start of this and all later episodes.
        """
        for group in self._groups:
            group.begin(start)
        self._lengths[:] = 0
        self.observations = np.concatenate([group.observations for group in self._groups])

    def step(self, actions: Array) -> VecEnvStep:
        """See :meth:`slap_ros.learning.vec_env.VecEnv.step`."""
        self._lengths += 1
        truncated = self._lengths >= self.horizon
        commands = self.action_map(actions)
        bounds = np.cumsum([group.size for group in self._groups])[:-1]
        parts = [
            group.step(command, timed_out)
            for group, command, timed_out in zip(
                self._groups, np.split(commands, bounds), np.split(truncated, bounds), strict=True
            )
        ]
        whole = _GroupStep(*(np.concatenate(values) for values in zip(*parts, strict=True)))
        success, failure = whole.success, whole.failure & ~whole.success
        gain = np.where(success, 0.0, whole.potential_after) - whole.potential_before
        lengths = self._lengths.copy()
        self._lengths[success | failure | truncated] = 0
        return VecEnvStep(
            whole.observations,
            self._rewards.of(gain, success, failure),
            success,
            failure,
            truncated & ~success & ~failure,
            lengths,
            whole.final_observations,
        )


class GroupTransitions(NamedTuple):
    """What happened in the newest step of n environments with the same objects and change.

    Attributes:
        starts: Starts of the episodes, n of them.
        before: States before the step, a batch.
        after: States after the step and before resets, a batch.
    """

    starts: Sequence[Start]
    before: State
    after: State


class _GroupStep(NamedTuple):
    """The outcome of one step of a group; arrays of shape (n,) or (n, size)."""

    success: Bools
    failure: Bools
    potential_before: Array
    potential_after: Array
    final_observations: NDArray[np.float32]
    observations: NDArray[np.float32]


class _Group:
    """Environments with the same objects and the same change."""

    def __init__(
        self,
        domain: Domain,
        signature: Signature,
        pool: Sequence[Start],
        size: int,
        rng: np.random.Generator,
    ) -> None:
        self.size, self._pool, self._rng = size, pool, rng
        self.encoder = ObservationEncoder(domain, pool[0].space, signature, pool[0].change)
        self._drawn = [self._draw() for _ in range(size)]
        self._targets = [start.target for start in self._drawn]
        self._worlds = domain.make_vector_world([start.state for start in self._drawn])
        states = self._worlds.states
        self.transitions = GroupTransitions(tuple(self._drawn), states, states)
        encoding = self.encoder.encode(self._worlds.states)
        self.observations, self._potential = encoding.observations, encoding.potential

    def _draw(self) -> Start:
        return self._pool[int(self._rng.integers(len(self._pool)))]

    def begin(self, start: Start) -> None:
        """Begin every episode in one start, and all later ones."""
        self._pool = [start]
        self._reset(np.arange(self.size))

    def step(self, commands: Array, truncated: Bools) -> _GroupStep:
        """Step with commands, shape (size, axes), and reset where an episode ended."""
        before, begun = self._potential, _copied(self._worlds.states)
        state = self._worlds.step(commands)
        self.transitions = GroupTransitions(tuple(self._drawn), begun, _copied(state))
        encoding = self.encoder.encode(state)
        success = self.encoder.success(state, encoding, self._targets)
        self.observations = encoding.observations.copy()
        self._potential = encoding.potential.copy()
        self._reset(np.flatnonzero(success | encoding.failure | truncated))
        return _GroupStep(
            success,
            encoding.failure,
            before,
            encoding.potential,
            encoding.observations,
            self.observations,
        )

    def _reset(self, ended: NDArray[np.intp]) -> None:
        if not ended.size:
            return
        starts = [self._draw() for _ in ended]
        for i, start in zip(ended, starts, strict=True):
            self._drawn[i], self._targets[i] = start, start.target
            self._worlds.reset(int(i), start.state)
        encoding = self.encoder.encode(State.batch([start.state for start in starts]))
        self.observations[ended] = encoding.observations
        self._potential[ended] = encoding.potential


def _copied(states: State) -> State:
    """The states, whatever becomes of the worlds that they are of."""
    return State(states.layout, states.data.copy())


def _pools(starts: Sequence[Start]) -> list[list[Start]]:
    """Starts grouped by objects and change."""
    pools: dict[object, list[Start]] = {}
    for start in starts:
        pools.setdefault((start.space.layout.objects, start.change), []).append(start)
    return list(pools.values())
