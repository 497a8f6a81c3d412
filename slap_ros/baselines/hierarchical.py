# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PPO over joints and an activation for each ground skill (SLAP §5, appendix C). Needs torch.

The highest activation above one half runs its skill to the end; without one, the joints move. A
skill that does not apply holds still for a step. With many skills and a wide Gaussian, some
activation nearly always is above one half: how often joints are moved is among the figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slap_ros.baselines.method import Method
from slap_ros.baselines.option_rollouts import OptionRolloutBuffer, SuccessRewards
from slap_ros.baselines.ppo import OURS, PAPER, PpoLearner, TaskPpoSettings
from slap_ros.baselines.training_envs import TrainingEnvs, separate_envs
from slap_ros.environments.controls import ACTIVE


class HierarchicalLearner(PpoLearner):
    """PPO on the training tasks, with skills among its actions."""

    _joints_moved = 0.0  # share of the newest actions

    def __init__(self, settings: TaskPpoSettings, envs: TrainingEnvs, seed: int) -> None:
        """See :class:`~slap_ros.baselines.ppo.PpoLearner`."""
        durations = envs.durations
        super().__init__(
            settings,
            replace(envs, make=lambda: SuccessRewards(envs.make(), durations, settings.gamma)),
            seed,
            rollout_buffer_class=OptionRolloutBuffer,
            rollout_buffer_kwargs={"durations": durations},
        )

    def figures(self) -> Mapping[str, float]:
        """How often joints are moved, as a share of the newest actions of all environments."""
        buffer = self._ppo.rollout_buffer
        if buffer.pos:
            activations = buffer.actions[: buffer.pos, :, self.envs.joint_axes :]
            self._joints_moved = float(np.mean(activations.max(axis=-1) <= ACTIVE))
        return {"joints_moved": self._joints_moved}


METHOD = Method(
    {"obs": "state", "control": "both", "reward": "sparse"},
    {
        "ours": replace(
            OURS,
            n_envs=16,
            n_steps=16,
            batch_size=64,
            learning_rate=1e-3,
            ent_coef=0.0,
            total_steps=300_000,
        ),
        "paper": replace(PAPER, total_steps=1_000_000),
    },
    HierarchicalLearner,
    separate_envs,
)
