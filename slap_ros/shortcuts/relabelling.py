# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Transitions that are learned from as if another shortcut had been meant. Needs torch.

Environments that know what else may begin in the same state say so with each step
(:class:`~slap_ros.shortcuts.hindsight_vec_env.HindsightStep`). The buffer keeps such transitions
apart, so that an update has a given share of them (the paper's Abstract HER: .95).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.shortcuts.hindsight_vec_env import HindsightStep
from slap_ros.shortcuts.normalised_vec_env import NormalisedVecEnv

OTHER = "other_target"  # key of what an environment is told of another shortcut


class RelabelledVecEnv(NormalisedVecEnv):
    """Environments of shortcuts, which say of each step what it was for another one."""

    def tell(self, step: VecEnvStep, infos: list[dict[str, Any]]) -> None:
        """Say what the transition of each environment was for another shortcut, if for any."""
        if not isinstance(step, HindsightStep):
            return
        before, after = self.normalisation(step.before), self.normalisation(step.after)
        for i in np.flatnonzero(step.relabelled):
            infos[i][OTHER] = (before[i], after[i], step.other_rewards[i], step.other_dones[i])


class RelabellingBuffer(ReplayBuffer):
    """A replay buffer of which a share of each sample is about another shortcut."""

    def __init__(self, *args: Any, share: float, **options: Any) -> None:
        """Make an empty buffer.

        Args:
            args: Arguments of stable-baselines3's buffer.
            share: Share of the transitions of a sample that are about another shortcut.
            options: Further arguments of stable-baselines3's buffer.
        """
        super().__init__(*args, **options)
        self._share = share
        size = self.buffer_size * self.n_envs if share else 1
        self._others = ReplayBuffer(size, self.observation_space, self.action_space, self.device)

    def add(
        self,
        obs: NDArray[Any],
        next_obs: NDArray[Any],
        action: NDArray[Any],
        reward: NDArray[Any],
        done: NDArray[Any],
        infos: list[dict[str, Any]],
    ) -> None:
        """Take a transition of each environment, and what it was for another shortcut."""
        super().add(obs, next_obs, action, reward, done, infos)
        if not self._share:
            return
        for i, info in enumerate(infos):
            if OTHER in info:
                before, after, gain, ended = info[OTHER]
                self._others.add(
                    before[None],
                    after[None],
                    action[i][None],
                    np.array([gain]),
                    np.array([ended]),
                    [{}],
                )

    def sample(self, batch_size: int, env: Any = None) -> ReplayBufferSamples:
        """Transitions for an update, those about another shortcut last."""
        others = round(self._share * batch_size) if self._others.size() else 0
        if not others:
            return super().sample(batch_size, env)
        parts = (super().sample(batch_size - others, env), self._others.sample(others, env))
        return _joined(*parts)


def _joined(one: ReplayBufferSamples, other: ReplayBufferSamples) -> ReplayBufferSamples:
    """Two samples as one, of the fields that both have."""
    own, others = one._asdict(), other._asdict()
    both = {name: (own[name], others[name]) for name in own if others.get(name) is not None}
    return one._replace(
        **{name: torch.cat(pair) for name, pair in both.items() if pair[0] is not None}
    )
