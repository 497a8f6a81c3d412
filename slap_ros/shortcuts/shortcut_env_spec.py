# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environments of one shortcut as data: what another process makes them from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slap_ros.policies.action_map import ActionMap
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.shortcut_actions import make_action_map
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord, restore_starts
from slap_ros.skills.domain_choice import DomainChoice


@dataclass(frozen=True)
class ShortcutEnvSpec:
    """What a :class:`ShortcutVecEnv` is made from, as data that other processes can be sent.

    Args:
        domain: Domain of the worlds.
        signature: Signature of the shortcut.
        starts: Starts that episodes draw from.
        num_envs: Number of environments.
        horizon: Environment steps after which an episode is truncated.
        rewards: Reward function.
        seed: Seed of the generator that draws the starts.
    """

    domain: DomainChoice
    signature: Signature
    starts: tuple[StartRecord, ...]
    num_envs: int
    horizon: int
    rewards: Rewards
    seed: tuple[int, ...]

    @property
    def action_map(self) -> ActionMap:
        """The map from the policy's actions to the robot's."""
        return make_action_map(self.domain.make(), self.signature)

    def make(self) -> ShortcutVecEnv:
        """The environments themselves, in this process."""
        domain, rng = self.domain.make(), np.random.default_rng(self.seed)
        starts = restore_starts(domain, self.starts)
        return ShortcutVecEnv(
            domain, self.signature, starts, self.num_envs, self.horizon, self.rewards, rng
        )
