# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The map from a policy's actions to the robot's."""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain
from slap_ros.relational.state import Array


class ActionMap:
    """Scales actions from [-1, 1] to the range of the learned axes of a domain."""

    def __init__(self, domain: Domain, gripper: bool) -> None:
        """Map to a domain's axes; ``gripper`` says whether the policy commands a gripper too."""
        space = domain.learned_actions
        low, high = np.array(space.low), np.array(space.high)
        self.axes = list(range(len(low)) if gripper else space.displacement_indices)
        self.size, self._all = len(self.axes), len(low)
        self._middle, self._half = ((low + high) / 2)[self.axes], ((high - low) / 2)[self.axes]

    def places_of(self, fewer: ActionMap) -> list[int]:
        """Where the axes of a map that commands no more than this one are among its own."""
        return [self.axes.index(axis) for axis in fewer.axes]

    def __call__(self, actions: Array) -> Array:
        """The robot's actions, shape (..., axes); one that is not commanded is 0."""
        mapped = np.zeros((*actions.shape[:-1], self._all))
        scaled = self._half * np.minimum(np.maximum(actions, -1.0), 1.0)
        mapped[..., self.axes] = self._middle + scaled
        return mapped

    def inverse(self, commands: Array) -> Array:
        """The actions that are mapped to these commands of the robot, or come next to them.

        Args:
            commands: Robot's actions, shape (..., axes).

        Returns:
            Shape (..., size), from -1 to 1.
        """
        actions: Array = (commands[..., self.axes] - self._middle) / self._half
        return np.minimum(np.maximum(actions, -1.0), 1.0)
