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
        hidden: Units of each hidden layer, of actor and critics alike.
        batch_size: Transitions of an update.
        steps_per_update: Environment steps for each update.
        learning_rate: Of actor, critics and the entropy's weight.
        discount: Of rewards, per environment step.
        tau: How far target networks follow in each update.
        entropy_per_action: Target entropy, for each action.
        random_steps: Environment steps with random actions, before the first update.
        capacity: Transitions that are kept; the oldest episodes are forgotten first.

    Raises:
        InvalidParameterError: Environments that no whole number of updates can follow.
    """

    environments: int = 8
    hidden: tuple[int, ...] = (64, 64)
    batch_size: int = 128
    steps_per_update: int = 2
    learning_rate: float = 1e-3
    discount: float = 0.98
    tau: float = 0.005
    entropy_per_action: float = -1.0
    random_steps: int = 800
    capacity: int = 200_000

    def __post_init__(self) -> None:
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
        batch_size=1024,
        steps_per_update=3,
        learning_rate=3e-5,
        discount=0.99,
        tau=1e-3,
        random_steps=30_000,
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
