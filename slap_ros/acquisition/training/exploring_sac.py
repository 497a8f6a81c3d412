# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic with noise that is correlated in time. Needs torch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from slap_ros.acquisition.training.sac_update import LeanSac


class ExploringSac(LeanSac):
    """SAC whose noise is held: in the last environment longest, in each before it half as long.

    Random actions of the beginning are held for 1, 2, 3 steps and so on. Noise that is correlated
    in time reaches what white noise hardly does (Eberhard et al. 2023): fingers that are to grasp
    must close for some steps on end. It is a function of seed and step, so that nothing of it
    needs to be kept.
    """

    longest_hold = 1  # longest time that noise is held, environment steps

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        del action_noise
        if self.num_timesteps < learning_starts:
            holds = [1 + env % self.longest_hold for env in range(n_envs)]
            drawn = [rng.uniform(-1.0, 1.0, self._axes) for rng in self._draws(holds)]
            actions = np.stack(drawn).astype(np.float32)
        else:
            holds = [max(1, self.longest_hold >> (n_envs - 1 - env)) for env in range(n_envs)]
            noise = [rng.standard_normal(self._axes) for rng in self._draws(holds)]
            actions = self._act_with(np.stack(noise).astype(np.float32))
        return actions, actions

    def _draws(self, holds: Sequence[int]) -> Iterator[np.random.Generator]:
        """A generator for each environment, the same for the steps that it holds what it drew."""
        assert self.seed is not None
        step = self.num_timesteps // len(holds)
        for env, hold in enumerate(holds):
            yield np.random.default_rng((self.seed, env, step // hold))

    @property
    def _axes(self) -> int:
        assert self.action_space.shape is not None
        return self.action_space.shape[0]

    def _act_with(self, noise: NDArray[np.float32]) -> NDArray[np.float32]:
        """The policy's actions in the present states, given noise of deviation 1, (n, axes)."""
        with torch.no_grad():
            mean, log_std = self.distribution(torch.as_tensor(self._last_obs))
            actions: NDArray[np.float32] = torch.tanh(
                mean + log_std.exp() * torch.from_numpy(noise)
            ).numpy()
        return actions
