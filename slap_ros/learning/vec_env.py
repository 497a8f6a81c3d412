# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The interface of vectorised environments: many episodes that are stepped together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.policies.action_map import ActionMap
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array


@dataclass(frozen=True)
class VecEnvStep:
    """The outcome of one step in all of n environments; those whose episode ended were reset.

    Args:
        observations: Observations after resets, shape (n, size).
        rewards: Rewards of the step, shape (n,).
        success: Whether the target was reached, shape (n,).
        failure: Whether the target cannot be reached any more, shape (n,).
        truncated: Whether the horizon was reached first, shape (n,).
        lengths: Number of steps of the episode so far, or until its end, shape (n,).
        final_observations: Observations before resets, shape (n, size).
    """

    observations: NDArray[np.float32]
    rewards: Array
    success: Bools
    failure: Bools
    truncated: Bools
    lengths: NDArray[np.intp]
    final_observations: NDArray[np.float32]

    @property
    def dones(self) -> Bools:
        """Whether each episode is over, for whatever reason, shape (n,)."""
        return self.success | self.failure | self.truncated


class VecEnvShape(Protocol):
    """What is known of environments before they are made."""

    @property
    def num_envs(self) -> int:
        """The number n of environments."""
        ...

    @property
    def horizon(self) -> int:
        """Environment steps after which an episode is truncated."""
        ...

    @property
    def action_map(self) -> ActionMap:
        """The map from the policy's actions to the robot's."""
        ...


class VecEnv(VecEnvShape, Protocol):
    """Environments that are stepped together, in this process or in others."""

    @property
    def observations(self) -> NDArray[np.float32]:
        """The present observations, shape (n, size)."""
        ...

    def step(self, actions: Array) -> VecEnvStep:
        """Act in every environment and reset those whose episode ended.

        Args:
            actions: Actions of the policy, from -1 to 1, shape (n, action_map.size).

        Returns:
            The outcome.
        """
        ...
