# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hyper-parameters of warm starts, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class WarmStartSettings:
    """How a new skill makes use of a known one.

    Critics that begin with random weights, and have seen random actions alone, destroy a good
    policy. So by default the known skill acts until the first update, with little noise, and the
    critics learn alone for a while before the policy does.

    Args:
        candidates: Number of known skills, the nearest ones, that are tried at most.
        trials: Number of episodes in which each of them is tried, without learning.
        least_success: Least success rate in these episodes of a skill that is worth beginning with.
        acting: Share of the environments in which the known skill acts, with noise, instead of
            random actions, before the first update.
        critic_updates: Number of updates of the critics alone before the first one of the policy.
            Critics that know nothing can destroy a good policy.
        cloning: Weight, in units of the critics' values, of the term that keeps the policy's
            actions near those of the known skill.
        cloning_steps: Environment steps over which that term fades.
        noise: Factor of the policy's noise in the beginning.
        entropy: Factor of the weight of the entropy in the beginning.

    Raises:
        InvalidParameterError: A share outside 0 to 1, or a factor that is not positive.
    """

    candidates: int = 3
    trials: int = 10
    least_success: float = 0.1
    acting: float = 1.0
    critic_updates: int = 2000
    cloning: float = 0.0
    cloning_steps: int = 8000
    noise: float = 0.3
    entropy: float = 0.1

    def __post_init__(self) -> None:
        if not (0.0 <= self.acting <= 1.0 and min(self.noise, self.entropy) > 0.0):
            raise InvalidParameterError(
                f"acting is {self.acting}, noise {self.noise}, entropy {self.entropy}; give a "
                "share from 0 to 1, and positive factors"
            )
