# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a policy's actions to the robot's."""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain
from slap_ros.relational.state import Array


class ActionMap:
    """Scales actions from [-1, 1] to the range of the learned axes of a domain."""

    def __init__(self, domain: Domain, gripper: bool) -> None:
        """``gripper``: whether the policy has the gripper among its actions, as the last axis."""
        space = domain.learned_actions
        low, high = np.array(space.low), np.array(space.high)
        self._middle, self._half = (low + high) / 2, (high - low) / 2
        self._gripper = gripper
        self.size = len(low) if gripper else len(low) - 1

    def __call__(self, actions: Array) -> Array:
        """The robot's actions, shape (..., axes); without a gripper axis it stays as it is."""
        if not self._gripper:
            actions = np.concatenate([actions, np.zeros((*actions.shape[:-1], 1))], axis=-1)
        mapped: Array = self._middle + self._half * np.clip(actions, -1.0, 1.0)
        return mapped
