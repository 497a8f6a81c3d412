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
    """SAC's hyper-parameters, under their usual names.

    Args:
        environments: Episodes side by side.
        hidden: Units of each hidden layer of the actor, which is what a library ships.
        critic_hidden: Of the critics, where they differ. Larger ones cost time in training, and
            nothing where the skill is used.
        critic_layer_norm: Whether hidden layers of the critics are normalised. Without, the value
            of what was never tried runs ahead of what is known, and success swings late.
        batch_size: Transitions of an update.
        steps_per_update: Environment steps for each update.
        learning_rate: Of actor, critics and the entropy's weight.
        discount: Of rewards, per environment step.
        tau: How far target networks, and the policy that is judged, follow in each update.
        entropy_per_action: Target entropy, for each action.
        entropy_weight: What entropy is worth in the beginning. The library's 1 outweighs a reward
            of at most 1 for the first 5,000 steps or so.
        random_steps: Environment steps with random actions, before the first update.
        longest_hold: Environment steps for which the last environment holds its noise; each one
            before it holds it half as long, one step at least. Random actions of the beginning
            are held for 1, 2, 3 steps and so on, at most this.
        capacity: Transitions that are kept; the oldest episodes are forgotten first.

    Raises:
        InvalidParameterError: Environments that no whole number of updates can follow.
    """

    environments: int = 8
    hidden: tuple[int, ...] = (64, 64)
    critic_hidden: tuple[int, ...] = ()
    critic_layer_norm: bool = True
    batch_size: int = 128
    steps_per_update: int = 2
    learning_rate: float = 1e-3
    discount: float = 0.98
    tau: float = 0.005
    entropy_per_action: float = -1.0
    entropy_weight: float = 0.1
    random_steps: int = 1600
    longest_hold: int = 8
    capacity: int = 200_000

    def __post_init__(self) -> None:
        if not (self.entropy_weight > 0.0 and self.longest_hold >= 1):
            raise InvalidParameterError(
                f"entropy_weight is {self.entropy_weight}, longest_hold {self.longest_hold}; "
                "give a positive number, and 1 at least"
            )
        if self.environments % self.steps_per_update:
            raise InvalidParameterError(
                f"{self.environments} environments are stepped together, and after each step an "
                f"update for {self.steps_per_update} environment steps is to follow: give a "
                "multiple of these"
            )


SMALL = SacSettings()
SAC_PRESETS: Mapping[str, SacSettings] = {
    "small": SMALL,
    "large": replace(SMALL, hidden=(256, 256)),
    # Nasiriany et al. 2022, as their code has it.
    "maple": SacSettings(
        environments=3,
        hidden=(256, 256),
        critic_layer_norm=False,
        batch_size=1024,
        steps_per_update=3,
        learning_rate=3e-5,
        discount=0.99,
        tau=1e-3,
        entropy_weight=1.0,
        random_steps=30_000,
        longest_hold=1,
        capacity=1_000_000,
    ),
}


def sac_preset(name: str) -> SacSettings:
    """Settings by name.

    Raises:
        InvalidParameterError: There are none of that name.
    """
    try:
        return SAC_PRESETS[name]
    except KeyError:
        known = ", ".join(SAC_PRESETS)
        raise InvalidParameterError(f"unknown SAC settings {name!r}; there are {known}") from None
