# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scalable option learning (Henaff et al. 2025) of whole tasks. Needs torch.

A controller over given skills and learned options, all in one network, written from the paper
alone (arXiv 2509.00338). The options lead to abstract states and are paid as shortcuts are; skills
are frozen. Its learner is PPO here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slap_ros.baselines.method import Method
from slap_ros.baselines.ppo import PpoLearner, TaskPpoSettings
from slap_ros.baselines.scores import SCORE_NOISE
from slap_ros.baselines.training_envs import TrainingEnvs, separate_envs
from slap_ros.baselines.turns import TurnBuffer, TurnPolicy, TurnRewards
from slap_ros.environments.option_task_env import LENGTHS
from slap_ros.policies.mlp_policy import MlpPolicy


class SolLearner(PpoLearner):
    """PPO of a controller and its options, on the training tasks."""

    _options_acted = 0.0  # share of the newest actions

    def __init__(self, settings: TaskPpoSettings, envs: TrainingEnvs, seed: int) -> None:
        """See :class:`~slap_ros.baselines.ppo.PpoLearner`."""
        made = TurnRewards(envs.make(), envs.durations, settings.gamma)
        self._axes = envs.joint_axes
        (size,) = made.observation_space.shape or (0,)
        (actions,) = made.action_space.shape or (0,)
        turn = size - 1 - int(made.get_attr("option_count")[0])
        choices = (actions - envs.joint_axes - len(LENGTHS), len(LENGTHS))
        super().__init__(
            settings,
            replace(envs, make=lambda: made),
            seed,
            policy=TurnPolicy,
            policy_kwargs={"axes": envs.joint_axes, "choices": choices, "turn": turn},
            rollout_buffer_class=TurnBuffer,
            rollout_buffer_kwargs={"durations": envs.durations, "turns": lambda: made.turns},
        )

    def policy(self) -> MlpPolicy:
        """The most likely choices and motions, kept within (-1, 1), and noise on both.

        With it, others are chosen about as often as learned. Without it, an option that leads
        nowhere is chosen for ever.
        """
        likely = super().policy()
        noise = np.full(len(likely.log_std), math.log(SCORE_NOISE), np.float32)
        noise[: self._axes] = likely.log_std[: self._axes]
        return replace(likely, log_std=noise, squashed=True)

    def figures(self) -> Mapping[str, float]:
        """How often options act, as a share of the newest actions of all environments."""
        buffer = self._ppo.rollout_buffer
        assert isinstance(buffer, TurnBuffer)
        if buffer.pos:
            self._options_acted = 1.0 - float(np.mean(buffer.taken.controller[: buffer.pos]))
        return {"options_acted": self._options_acted}


# With 1e-3, options that lead nowhere yet are preferred to skills for 300,000 steps and longer.
OURS = TaskPpoSettings(
    n_envs=16,
    n_steps=64,
    learning_rate=3e-4,
    gamma=0.995,
    gae_lambda=0.98,
    ent_coef=0.01,
    total_steps=1_000_000,
)

METHOD = Method(
    {"obs": "options", "control": "both", "reward": "sparse"},
    {"ours": OURS, "paper": replace(OURS, total_steps=10_000_000)},
    SolLearner,
    separate_envs,
)
