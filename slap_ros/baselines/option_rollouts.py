# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rewards and advantages of actions that take several environment steps.

A semi-Markov decision process (Sutton, Precup and Singh 1999): what follows an option of k steps is
discounted by the k-th power of gamma. Were it discounted once, as stable-baselines3 does for each
action, then failing by skills of seven steps would look seven times as bad as failing on the spot,
and skills would be unlearned. They are as well while values, which begin at 0, do not know yet that
every way to fail costs the same. So the reward is 1 at the goal and 0 before, both discounted,
which is that of -1 per step but for a factor and a constant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

Durations = Callable[[], Sequence[int]]  # environment steps of the newest action, of each of n


class SuccessRewards(VecEnvWrapper):
    """Environments whose reward is 1 at the goal, discounted within the action, and 0 before."""

    def __init__(self, envs: VecEnv, durations: Durations, gamma: float) -> None:
        """Take the place of the reward per step.

        Args:
            envs: Environments of tasks.
            durations: Function that gives the environment steps of the newest action in each.
            gamma: Discount of an environment step.
        """
        super().__init__(envs)
        self._durations, self._gamma = durations, gamma

    def reset(self) -> Any:
        """See stable-baselines3."""
        return self.venv.reset()

    def step_wait(self) -> Any:
        """See stable-baselines3."""
        observations, _, dones, infos = self.venv.step_wait()
        reached = np.array([info["success"] for info in infos], dtype=np.float32)
        rewards = reached * self._gamma ** (np.array(self._durations()) - 1)
        return observations, rewards.astype(np.float32), dones, infos


class OptionRolloutBuffer(RolloutBuffer):
    """A buffer of rollouts that knows how many environment steps each action took."""

    def __init__(self, *args: Any, durations: Durations, **options: Any) -> None:
        """Make an empty buffer.

        Args:
            args: Arguments of stable-baselines3's buffer.
            durations: Function that gives the environment steps of the newest action in each
                environment.
            options: Further arguments of stable-baselines3's buffer.
        """
        self._newest = durations
        super().__init__(*args, **options)

    def reset(self) -> None:
        """Forget all rollouts."""
        super().reset()
        self.durations = np.ones((self.buffer_size, self.n_envs), dtype=np.float32)

    def add(self, *args: Any) -> None:
        """Take an action of each environment, and how long it took."""
        self.durations[self.pos] = self._newest()
        super().add(*args)

    def compute_returns_and_advantage(
        self, last_values: torch.Tensor, dones: NDArray[np.bool_]
    ) -> None:
        """Generalised advantages (Schulman et al. 2016) with the discount of each action's steps.

        Args:
            last_values: Values of the states after the last action.
            dones: Whether the episodes ended with the last action.
        """
        value = last_values.detach().cpu().numpy().flatten()
        goes_on = 1.0 - dones.astype(np.float32)
        advantage = np.zeros(self.n_envs, dtype=np.float32)
        for step in reversed(range(self.buffer_size)):
            discount = goes_on * self.gamma ** self.durations[step]
            error = self.rewards[step] + discount * value - self.values[step]
            advantage = error + discount * self.gae_lambda * advantage
            self.advantages[step] = advantage
            value, goes_on = self.values[step], 1.0 - self.episode_starts[step]
        self.returns = self.advantages + self.values
