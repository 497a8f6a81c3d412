# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proximal policy optimisation of whole tasks, joint by joint (SLAP §5, appendix C). Needs torch.

The algorithm is stable-baselines3's (Schulman et al. 2017). The reward is the task's: -1 per step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slap_ros.baselines.budgeted_learner import BudgetedLearner
from slap_ros.baselines.method import Method
from slap_ros.baselines.training_envs import TrainingEnvs, as_observed, joined_envs
from slap_ros.learning.policy_export import exported_layers, hidden_layers, weights_of
from slap_ros.learning.ppo import make_ppo
from slap_ros.policies.mlp_policy import MlpPolicy


@dataclass(frozen=True)
class TaskPpoSettings:
    """PPO's hyper-parameters for whole tasks, under the names of stable-baselines3."""

    n_envs: int = 64
    n_steps: int = 32  # actions in each environment between updates
    batch_size: int = 256
    n_epochs: int = 10
    learning_rate: float = 3e-4
    gamma: float = 0.99
    gae_lambda: float = 0.95
    ent_coef: float = 0.0
    log_std_init: float = 0.0
    net_arch: tuple[int, ...] = (64, 64)
    total_steps: int = 1_000_000  # environment steps
    validation: int = 20  # tasks on which it is decided whether the policy acts with its noise


# Of entropies 0, .01 and .05 (Obstacle 2D, seed 0), the only one that solves a validation task.
OURS = TaskPpoSettings(ent_coef=0.05)
PAPER = TaskPpoSettings(n_envs=1, n_steps=2048, batch_size=16, ent_coef=0.05)


class PpoLearner(BudgetedLearner):
    """PPO on the training tasks."""

    def __init__(
        self, settings: TaskPpoSettings, envs: TrainingEnvs, seed: int, **options: Any
    ) -> None:
        """Begin with random weights.

        Args:
            settings: PPO's hyper-parameters.
            envs: Environments of the training tasks.
            seed: Seed of weights and noise.
            options: Further arguments of stable-baselines3's PPO.
        """
        self._hidden = len(settings.net_arch)
        self._ppo = make_ppo(envs.make(), settings, settings.learning_rate, seed, **options)
        super().__init__(self._ppo, envs, settings.total_steps, seed)

    def policy(self) -> MlpPolicy:
        """See :class:`~slap_ros.baselines.method.TaskLearner`."""
        weights = weights_of(self._ppo.policy)
        hidden = hidden_layers("mlp_extractor.policy_net", self._hidden)
        layers = exported_layers(weights, [*hidden, "action_net"])
        return MlpPolicy(as_observed(layers[0][0].shape[1]), layers, weights["log_std"])

    def state(self) -> dict[str, Any]:
        """See :class:`~slap_ros.baselines.budgeted_learner.BudgetedLearner`."""
        policy = self._ppo.policy
        return {"policy": policy.state_dict(), "optimizer": policy.optimizer.state_dict()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """See :class:`~slap_ros.baselines.budgeted_learner.BudgetedLearner`."""
        self._ppo.policy.load_state_dict(saved["policy"])
        self._ppo.policy.optimizer.load_state_dict(saved["optimizer"])


METHOD = Method(
    {"obs": "state", "control": "joints", "reward": "sparse"},
    {"ours": OURS, "paper": PAPER},
    PpoLearner,
    joined_envs,
)
