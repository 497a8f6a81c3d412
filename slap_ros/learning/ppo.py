# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""stable-baselines3's PPO (Schulman et al. 2017) with tanh networks, from settings. Needs torch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecEnv


class PpoNumbers(Protocol):
    """PPO's hyper-parameters, under the names of stable-baselines3."""

    @property
    def n_steps(self) -> int: ...  # noqa: D102 -- as stable-baselines3 documents it
    @property
    def batch_size(self) -> int: ...  # noqa: D102
    @property
    def n_epochs(self) -> int: ...  # noqa: D102
    @property
    def gamma(self) -> float: ...  # noqa: D102
    @property
    def gae_lambda(self) -> float: ...  # noqa: D102
    @property
    def ent_coef(self) -> float: ...  # noqa: D102
    @property
    def log_std_init(self) -> float: ...  # noqa: D102
    @property
    def net_arch(self) -> tuple[int, ...]: ...  # noqa: D102


def make_ppo(
    envs: VecEnv,
    settings: PpoNumbers,
    learning_rate: float | Callable[[float], float],
    seed: int,
    *,
    policy: str | type[ActorCriticPolicy] = "MlpPolicy",
    policy_kwargs: Mapping[str, Any] | None = None,
    **options: Any,
) -> PPO:
    """PPO with random weights.

    Args:
        envs: Environments to act in.
        settings: Hyper-parameters.
        learning_rate: Learning rate, or a function of the share of learning that is left.
        seed: Seed of weights and noise.
        policy: Kind of policy, as stable-baselines3 has it.
        policy_kwargs: Further arguments of the policy.
        options: Further arguments of stable-baselines3's PPO.
    """
    return PPO(
        policy,
        envs,
        n_steps=settings.n_steps,
        batch_size=settings.batch_size,
        n_epochs=settings.n_epochs,
        learning_rate=learning_rate,
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        ent_coef=settings.ent_coef,
        policy_kwargs={
            "net_arch": list(settings.net_arch),
            "activation_fn": torch.nn.Tanh,
            "log_std_init": settings.log_std_init,
            **(policy_kwargs or {}),
        },
        seed=seed,
        device="cpu",
        **options,
    )
