# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning-time search alone: what shortcuts are worth without anything that was learned.

Between the same pairs of abstract states, the same number of rollouts is spent on random actions,
and then on variations of the shortest success, as with a learned policy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slap_ros.core import Domain
from slap_ros.policies.mlp_policy import ActionSampler, Weights
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_actions import make_action_map

HOLD = 4  # steps that a random action is kept, as in exploration: noise of single steps cancels out


@dataclass(frozen=True)
class RandomActions:
    """A policy of random actions, which has learned nothing.

    Args:
        actions: Number of the policy's actions.
        hold: Number of steps for which a random action is kept.
    """

    actions: int
    hold: int = HOLD

    def mean(self, observations: Weights) -> Weights:
        """Actions that do not move the robot, shape (n, actions)."""
        return np.zeros((len(observations), self.actions), dtype=np.float32)

    def sampler(
        self,
        rng: np.random.Generator,
        temperature: float | Weights = 1.0,  # noqa: ARG002 -- uniform actions have no scale
    ) -> ActionSampler:
        """See :class:`~slap_ros.policies.mlp_policy.SampledPolicy`; random actions are held."""
        held = np.zeros((0, self.actions), dtype=np.float32)

        def sample(step: int, observations: Weights) -> Weights:
            nonlocal held
            if step % self.hold == 0:
                shape = (len(observations), self.actions)
                held = rng.uniform(-1.0, 1.0, shape).astype(np.float32)
            return held

        return sample


def unlearned(shortcut: Shortcut, domain: Domain) -> Shortcut:
    """A shortcut between the same abstract states, without its policy and what training knew.

    Args:
        shortcut: Learned shortcut.
        domain: Domain in which the shortcut is used.
    """
    actions = make_action_map(domain, shortcut.signature).size
    return Shortcut(shortcut.signature, RandomActions(actions), shortest=1)


def exhaustive(sampling: Sampling) -> Sampling:
    """Sampling with the same number of rollouts, all made whether or not the first succeed."""
    return replace(sampling, patience=sampling.samples * sampling.batch + 1)
