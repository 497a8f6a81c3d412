# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The reward of a shortcut's MDP (SLAP §4.2), with potential-based shaping."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array


@dataclass(frozen=True)
class Rewards:
    """The rewards of a step, in environment steps; the sum is multiplied by ``scale``.

    The paper's -1 per step, for ever, adds up to -1 / (1 - gamma). Our default has the same
    optimum, but 0 for standing still and that much more for success: a critic that begins at 0
    is then right about doing nothing, and the policy does not learn to avoid the first contact.

    Args:
        step: Reward of every step.
        success: Reward of the step that reaches the target.
        failure: Reward of the step after which the target cannot be reached any more, on top of
            ``step`` for ever.
        shaping: Weight of the difference of the potential.
        gamma: Discount per step; here, for what ``step`` adds up to for ever.
        scale: Factor of all rewards, which gives returns a magnitude that critics learn well.
    """

    step: float = 0.0
    success: float = 43.0
    failure: float = -5.0
    shaping: float = 1.0
    gamma: float = 0.97
    scale: float = 0.1

    def of(self, gain: Array, success: Bools, failure: Bools) -> Array:
        """Rewards of n steps.

        The gain is not discounted. With the discount (potential-based shaping, Ng, Harada and
        Russell 1999), shaping changes returns by a function of the state alone, which the critic
        learns; what remains is what there is without shaping, and a policy that never succeeded
        yet finds no direction to be better than another.

        A failure ends the episode, so it must cost more than all the steps that it saves.

        Args:
            gain: Increase of the potential in each step, shape (n,).
            success: Whether each step reached the target, shape (n,).
            failure: Whether the target cannot be reached any more after each step, shape (n,); a
                success counts as one even then.

        Returns:
            Shape (n,).
        """
        worst = self.failure + self.step / (1.0 - self.gamma)
        return self.scale * (
            self.step + self.success * success + self.shaping * gain + worst * (failure & ~success)
        )
