# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC's hyper-parameters for shortcuts, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ShortcutSacSettings:
    """SAC's hyper-parameters for shortcuts, under the names of stable-baselines3.

    Args:
        n_envs: Number of environments.
        parts: Number of parts that the environments are divided into.
        buffer_size: Number of transitions that are kept.
        learning_starts: Environment steps with random actions, before the first update.
        batch_size: Number of transitions of an update.
        learning_rate: Learning rate of actor, critics and the entropy's weight.
        ent_coef_init: Weight of the entropy in the beginning; it is learned.
        tau: Share by which target networks follow in each update.
        gamma: Discount per environment step.
        train_freq: Environment steps in each environment between updates.
        gradient_steps: Number of updates in a row.
        hindsight: Share of the transitions of an update that are relabelled with the target of
            another shortcut that begins in the same state; 0 for none. It needs shortcuts that
            share a policy.
        net_arch: Units of each hidden layer.
        total_steps: Environment steps in all.
    """

    n_envs: int = 16
    parts: int = 1
    buffer_size: int = 100_000
    learning_starts: int = 2_000
    batch_size: int = 256
    learning_rate: float = 1e-3
    ent_coef_init: float = 0.1
    tau: float = 0.01
    gamma: float = 0.97
    train_freq: int = 1
    gradient_steps: int = 2
    hindsight: float = 0.0
    net_arch: tuple[int, ...] = (64, 64)
    total_steps: int = 200_000

    @property
    def rollout_steps(self) -> int:
        """Environment steps between updates, all environments together."""
        return self.n_envs * self.train_freq
