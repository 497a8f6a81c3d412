# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What happens to an action on its way to the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slap_ros.core import Action, ActionSpace


@dataclass(frozen=True)
class Disturbances:
    """Noise on actions, and drops.

    Args:
        action_noise: Standard deviation of the normal noise on each displacement of an action, in
            the unit of its axis; a disturbed displacement stays within the axis' limits.
        drop_probability: Probability that what is held at the beginning of a step is let go in it.
    """

    action_noise: float = 0.0
    drop_probability: float = 0.0

    def disturbed(
        self, action: Action, actions: ActionSpace, holds: bool, random: np.random.Generator
    ) -> Action:
        """The action that is carried out in place of the commanded one.

        Args:
            action: Commanded action.
            actions: Actions of the robot.
            holds: Whether the robot holds something.
            random: Source of random numbers for this step alone.

        Returns:
            The commanded action, to the bit, where nothing disturbs it.
        """
        # Both are drawn in each step, so that noise does not depend on what is held.
        drops = bool(random.random() < self.drop_probability)
        noise = random.standard_normal(len(actions.displacement_indices))
        displacements, command = actions.split(action)
        if self.action_noise > 0.0:
            displacements = self._noisy(displacements, actions, noise)
        if drops and holds and actions.gripper is not None:
            command = actions.gripper.opens
        return actions.join(displacements, command)

    def _noisy(self, displacements: Action, actions: ActionSpace, noise: Action) -> Action:
        """The displacements with noise, each within its limits."""
        at = list(actions.displacement_indices)
        low, high = (np.array(limits)[at] for limits in (actions.low, actions.high))
        return np.clip(displacements + self.action_noise * noise, low, high)
