# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PPO's hyper-parameters, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class PpoSettings:
    """PPO's hyper-parameters, under the names of stable-baselines3."""

    n_envs: int = 16
    parts: int = 1  # parts that the environments are divided into, for processes of their own
    n_steps: int = 64  # steps in each environment between updates
    batch_size: int = 256
    n_epochs: int = 10
    learning_rate: float = 1e-3
    anneal: bool = True  # whether the learning rate falls, linearly, to a twentieth
    gamma: float = 0.97
    gae_lambda: float = 0.9
    ent_coef: float = 0.0
    log_std_init: float = -0.5
    net_arch: tuple[int, ...] = (64, 64)
    total_steps: int = 300_000

    def __post_init__(self) -> None:
        if self.n_envs % self.parts:
            raise InvalidParameterError(
                f"{self.n_envs} environments cannot be divided into {self.parts} equal parts"
            )

    @property
    def rollout_steps(self) -> int:
        """Environment steps between updates, all environments together."""
        return self.n_envs * self.n_steps
