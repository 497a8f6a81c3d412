# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic with hindsight experience replay of whole tasks. Needs torch.

SLAP §5, appendix C. Both algorithms are stable-baselines3's (Haarnoja et al. 2018, Andrychowicz et
al. 2017).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from numpy.typing import NDArray

from slap_ros.baselines.hindsight_buffer import HindsightBuffer
from slap_ros.baselines.method import Method
from slap_ros.baselines.sac import SacTaskLearner
from slap_ros.baselines.training_envs import TrainingEnvs, separate_envs


@dataclass(frozen=True)
class HerSettings:
    """Hyper-parameters of SAC and hindsight, under the names of stable-baselines3."""

    n_envs: int = 8
    buffer_size: int = 1_000_000  # transitions
    learning_starts: int = 1_000  # environment steps with random actions, one episode at least
    batch_size: int = 256
    learning_rate: float = 3e-4
    ent_coef_init: float = 1.0  # weight of entropy at first; it is learned
    tau: float = 0.005
    gamma: float = 0.99
    train_freq: int = 1  # actions in each environment between updates
    gradient_steps: int = 1
    n_sampled_goal: int = 4  # virtual transitions for each real one
    net_arch: tuple[int, ...] = (256, 256)
    total_steps: int = 1_000_000  # environment steps
    validation: int = 20  # tasks on which it is decided whether the policy acts with its noise


OURS = HerSettings()


class SacHerLearner(SacTaskLearner):
    """SAC on the training tasks, with goals that were reached later in the same episode."""

    def __init__(self, settings: HerSettings, envs: TrainingEnvs, seed: int) -> None:
        """Begin with random weights and no transitions.

        Args:
            settings: Hyper-parameters.
            envs: Environments of the training tasks, with goals among their observations.
            seed: Seed of weights and noise.
        """
        first_episode = settings.n_envs * (envs.step_limit + 1)
        super().__init__(
            settings,
            envs,
            seed,
            HindsightBuffer,
            replay_buffer_kwargs={
                "n_sampled_goal": settings.n_sampled_goal,
                "goal_selection_strategy": "future",
            },
            buffer_size=min(settings.buffer_size, settings.total_steps + first_episode),
            learning_starts=max(settings.learning_starts, first_episode),
        )

    @property
    def buffer(self) -> HindsightBuffer:
        """The replay buffer that is learned from."""
        buffer = super().buffer
        assert isinstance(buffer, HindsightBuffer)
        return buffer

    def _transitions(self) -> dict[str, NDArray[Any]]:
        return self.buffer.arrays()

    def _restore_transitions(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.buffer.restore(arrays)


METHOD = Method(
    {"obs": "dict", "control": "joints", "reward": "sparse"},
    {"ours": OURS, "paper": replace(OURS, n_envs=1, batch_size=16)},
    SacHerLearner,
    separate_envs,
    noisy=False,
)
