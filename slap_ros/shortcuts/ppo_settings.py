# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PPO's hyper-parameters; apart from PPO, so that they can be read without torch."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PpoSettings:
    """PPO's hyper-parameters, under their usual names."""

    environments: int = 16
    parts: int = 1  # of the environments, that may be stepped side by side
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
