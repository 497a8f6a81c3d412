# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hyper-parameters of warm starts, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class WarmStartSettings:
    """How a new skill makes use of a known one.

    Args:
        candidates: Number of known skills, the nearest ones, that are tried at most.
        trials: Number of episodes in which each of them is tried, without learning.
        least_success: Least success rate in these episodes of a skill that is worth beginning with.
        acting: Share of the environments in which the known skill acts, with noise, instead of
            random actions, before the first update.
        critic_updates: Number of updates of the critics alone before the first one of the policy.
            Critics that know nothing destroy a good policy.
        cloning: Weight, in units of the critics' values, of the term that keeps the policy's
            actions near those of the known skill.
        cloning_steps: Environment steps over which that term fades.
        log_std: Logarithm of the deviation of the policy's noise in the beginning.
        ent_coef: Weight of the entropy in the beginning.

    Raises:
        InvalidParameterError: A share outside 0 to 1, or a weight of the entropy of 0.
    """

    candidates: int = 3
    trials: int = 10
    least_success: float = 0.1
    acting: float = 0.75
    critic_updates: int = 1000
    cloning: float = 0.5
    cloning_steps: int = 8000
    log_std: float = -1.0
    ent_coef: float = 0.02

    def __post_init__(self) -> None:
        if not (0.0 <= self.acting <= 1.0 and self.ent_coef > 0.0):
            raise InvalidParameterError(
                f"acting is {self.acting}, ent_coef {self.ent_coef}; give a share from 0 to 1, and "
                "a positive number"
            )
