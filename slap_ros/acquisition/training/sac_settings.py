# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC's hyper-parameters, in a module of their own that does not import torch.

The paper gives none of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class SacSettings:
    """SAC's hyper-parameters, under the names of stable-baselines3 where it has them.

    Args:
        n_envs: Number of environments, whose episodes run side by side.
        net_arch: Units of each hidden layer of the actor, which is what a library ships.
        critic_net_arch: Units of each hidden layer of the critics, where they differ from the
            actor's. Larger ones cost time in training, and nothing where the skill is used.
        critic_layer_norm: Whether hidden layers of the critics are normalised. Without, the value
            of what was never tried runs ahead of what is known, and success swings late.
        batch_size: Number of transitions of an update.
        train_freq: Number of environment steps for each update.
        learning_rate: Learning rate of actor, critics and the entropy's weight.
        gamma: Discount of rewards, per environment step.
        tau: Share by which target networks, and the policy that is judged, follow in each update.
        entropy_per_action: Target entropy, for each action.
        ent_coef: Weight of the entropy in the beginning. The library's 1 outweighs a reward of at
            most 1 for the first 5,000 steps or so.
        learning_starts: Number of environment steps with random actions, before the first update.
        longest_hold: Environment steps for which the last environment holds its noise; each one
            before it holds it half as long, one step at least. Random actions of the beginning
            are held for 1, 2, 3 steps and so on, at most this.
        buffer_size: Number of transitions that are kept; the oldest episodes are forgotten first.

    Raises:
        InvalidParameterError: Environments that no whole number of updates can follow.
    """

    n_envs: int = 8
    net_arch: tuple[int, ...] = (64, 64)
    critic_net_arch: tuple[int, ...] = ()
    critic_layer_norm: bool = True
    batch_size: int = 128
    train_freq: int = 2
    learning_rate: float = 1e-3
    gamma: float = 0.98
    tau: float = 0.005
    entropy_per_action: float = -1.0
    ent_coef: float = 0.1
    learning_starts: int = 1600
    longest_hold: int = 8
    buffer_size: int = 200_000

    def __post_init__(self) -> None:
        if not (self.ent_coef > 0.0 and self.longest_hold >= 1):
            raise InvalidParameterError(
                f"ent_coef is {self.ent_coef}, longest_hold {self.longest_hold}; "
                "give a positive number, and 1 at least"
            )
        if self.n_envs % self.train_freq:
            raise InvalidParameterError(
                f"{self.n_envs} environments are stepped together, and after each step an "
                f"update for {self.train_freq} environment steps is to follow: give a "
                "multiple of these"
            )


SMALL = SacSettings()
SAC_PRESETS: Mapping[str, SacSettings] = {
    "small": SMALL,
    "large": replace(SMALL, net_arch=(256, 256)),
    # Nasiriany et al. 2022, as their code has it.
    "maple": SacSettings(
        n_envs=3,
        net_arch=(256, 256),
        critic_layer_norm=False,
        batch_size=1024,
        train_freq=3,
        learning_rate=3e-5,
        gamma=0.99,
        tau=1e-3,
        ent_coef=1.0,
        learning_starts=30_000,
        longest_hold=1,
        buffer_size=1_000_000,
    ),
}
