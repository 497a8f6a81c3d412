# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""stable-baselines3's SAC (Haarnoja et al. 2018) with ReLU networks, from settings. Needs torch."""

from __future__ import annotations

from typing import Any, Protocol

from stable_baselines3 import SAC
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.vec_env import VecEnv


class SacNumbers(Protocol):
    """SAC's hyper-parameters, under the names of stable-baselines3."""

    @property
    def batch_size(self) -> int: ...  # noqa: D102 -- as stable-baselines3 documents it
    @property
    def learning_rate(self) -> float: ...  # noqa: D102
    @property
    def ent_coef_init(self) -> float: ...  # noqa: D102 -- weight of entropy at first
    @property
    def tau(self) -> float: ...  # noqa: D102
    @property
    def gamma(self) -> float: ...  # noqa: D102
    @property
    def train_freq(self) -> int: ...  # noqa: D102
    @property
    def gradient_steps(self) -> int: ...  # noqa: D102
    @property
    def net_arch(self) -> tuple[int, ...]: ...  # noqa: D102


def make_sac(
    envs: VecEnv,
    settings: SacNumbers,
    seed: int,
    *,
    policy: str = "MlpPolicy",
    replay: type[ReplayBuffer],
    kind: type[SAC] = SAC,
    **options: Any,
) -> SAC:
    """SAC with random weights and no transitions.

    Args:
        envs: Environments to act in.
        settings: Hyper-parameters.
        seed: Seed of weights and noise.
        policy: Kind of policy, as stable-baselines3 has it.
        replay: Kind of replay buffer.
        kind: SAC itself, or a kind of it.
        options: Further arguments of stable-baselines3's SAC, such as the buffer's size.

    Returns:
        The algorithm, before its first step.
    """
    return kind(
        policy,
        envs,
        replay_buffer_class=replay,
        batch_size=settings.batch_size,
        learning_rate=settings.learning_rate,
        ent_coef=f"auto_{settings.ent_coef_init}",
        tau=settings.tau,
        gamma=settings.gamma,
        train_freq=settings.train_freq,
        gradient_steps=settings.gradient_steps,
        policy_kwargs={"net_arch": list(settings.net_arch)},
        seed=seed,
        device="cpu",
        **options,
    )
