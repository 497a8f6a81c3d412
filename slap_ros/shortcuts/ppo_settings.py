# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PPO's hyper-parameters, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class PpoSettings:
    """PPO's hyper-parameters, under their usual names."""

    environments: int = 16
    parts: int = 1  # that the environments are divided into, for processes of their own
    rollout_steps: int = 64  # in each environment between updates
    batch_size: int = 256
    epochs: int = 10
    learning_rate: float = 1e-3
    anneal: bool = True  # the learning rate, linearly, to a twentieth
    discount: float = 0.97
    gae_lambda: float = 0.9
    entropy: float = 0.0
    log_std: float = -0.5
    hidden: tuple[int, ...] = (64, 64)
    total_steps: int = 300_000

    def __post_init__(self) -> None:
        if self.environments % self.parts:
            raise InvalidParameterError(
                f"{self.environments} environments cannot be divided into {self.parts} equal parts"
            )
