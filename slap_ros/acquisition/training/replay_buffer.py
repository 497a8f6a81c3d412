# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The replay buffer of a lifted operator: transitions of all its groundings. Needs torch.

Whole episodes are kept as states. What was observed and paid in them is computed from the states,
for all episodes of a segment at once: so the numbers are the same, to the bit, whether episodes
were just run or come from disk, and new ones wherever the reward has changed meanwhile.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from slap_ros.acquisition.training.episodes import Episodes
from slap_ros.acquisition.training.skill_env import SkillMdp
from slap_ros.policies.mlp_policy import ObservationNormalisation


class SkillReplayBuffer(ReplayBuffer):
    """Stable-baselines3's buffer, filled with episodes, with a generator of its own."""

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        mdp: SkillMdp,
        normalisation: ObservationNormalisation,
        seed: int,
        **others: Any,
    ) -> None:
        """Make an empty buffer.

        Args:
            buffer_size: Number of transitions that are kept at most.
            observation_space: Observation space of the policy.
            action_space: Action space of the policy.
            mdp: MDP that gives observations and rewards.
            normalisation: Normalisation of observations.
            seed: Seed of the generator that draws batches.
            others: Other arguments that stable-baselines3 gives to a buffer.
        """
        others["n_envs"] = 1  # transitions side by side are rows like any others
        super().__init__(buffer_size, observation_space, action_space, **others)
        self._mdp, self._normalisation = mdp, normalisation
        self.generator = np.random.default_rng(seed)
        self._whole = 0  # transitions of whole episodes; those after them are of the present ones

    def add(
        self,
        obs: Any,
        next_obs: Any,
        action: Any,
        reward: Any,
        done: Any,
        infos: Any,
    ) -> None:
        """Add transitions of episodes that are under way, until these come as a whole.

        Args:
            obs: Observations before the step, shape (n, size).
            next_obs: Observations after the step, shape (n, size).
            action: Actions of the step, shape (n, actions).
            reward: Rewards of the step, shape (n,).
            done: Whether the episode's horizon was reached, which ends nothing for a critic; not
                used.
            infos: Information of stable-baselines3, which is not used.
        """
        del done, infos
        rows = self._room(len(reward))
        self.observations[rows, 0], self.next_observations[rows, 0] = obs, next_obs
        self.actions[rows, 0], self.rewards[rows, 0] = action, reward
        self.pos = rows.stop

    def add_episodes(self, episodes: Episodes) -> None:
        """Add whole episodes, in the place of the transitions that were added one by one."""
        self.pos = self._whole
        rows = self._room(episodes.transitions)
        mdp = self._mdp.over(episodes.groundings)
        steps = episodes.actions.shape[1]
        numbers = np.repeat(episodes.numbers, steps)
        width = episodes.states.shape[2]
        before = episodes.states[:, :-1].reshape(-1, width)
        after = episodes.states[:, 1:].reshape(-1, width)
        self.observations[rows, 0] = self._normalisation(mdp.observe(before, numbers))
        self.next_observations[rows, 0] = self._normalisation(mdp.observe(after, numbers))
        self.actions[rows, 0] = episodes.actions.reshape(len(numbers), -1)
        begun = np.repeat(episodes.states[:, 0], steps, axis=0)
        self.rewards[rows, 0] = mdp.rewards(after, numbers, begun)[0]
        self.pos = self._whole = rows.stop

    def size(self) -> int:
        """Transitions in the buffer."""
        return self.pos

    def sample(self, batch_size: int, env: Any = None) -> ReplayBufferSamples:
        """Draw a batch with replacement.

        Args:
            batch_size: Number of transitions.
            env: Environment of stable-baselines3, which is not used: observations are normalised
                already.
        """
        del env
        rows = self.generator.integers(self.pos, size=batch_size)
        zeros = np.zeros((batch_size, 1), dtype=np.float32)
        data = (
            self.observations[rows, 0],
            self.actions[rows, 0],
            self.next_observations[rows, 0],
            zeros,  # nothing is terminal
            self.rewards[rows],
        )
        return ReplayBufferSamples(*map(torch.from_numpy, data))  # copies of rows already

    @property
    def generator_state(self) -> str:
        """The generator's state, as text."""
        return json.dumps(self.generator.bit_generator.state)

    @generator_state.setter
    def generator_state(self, text: str) -> None:
        self.generator.bit_generator.state = json.loads(text)

    def _room(self, count: int) -> slice:
        """The rows for the next transitions; the oldest are forgotten where there is no room."""
        if self.pos + count > self.buffer_size:
            kept = max(self.buffer_size - count, 0)
            lost = self.pos - kept
            for array in (self.observations, self.next_observations, self.actions, self.rewards):
                array[:kept] = array[lost : self.pos].copy()
            self.pos, self._whole = kept, max(self._whole - lost, 0)
        return slice(self.pos, self.pos + count)
