# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MDPs of several shortcuts side by side, for one policy that observes which it is in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slap_ros.learning.subproc_vec_env import concatenated
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational.state import Array
from slap_ros.shortcuts.shortcut_actions import uses_gripper
from slap_ros.shortcuts.shortcut_env_spec import ShortcutEnvSpec
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import restore_starts
from slap_ros.shortcuts.subgoal_observation import SubgoalObservation


class SubgoalVecEnv:
    """Environments of several shortcuts; each has as many as it is given."""

    def __init__(
        self,
        envs: Sequence[tuple[Signature, ShortcutVecEnv]],
        observation: SubgoalObservation,
        action_map: ActionMap,
    ) -> None:
        """Begin an episode in each environment.

        Args:
            envs: Environments of each shortcut.
            observation: What is observed in all of them.
            action_map: Map from actions to all axes that one of the shortcuts commands.
        """
        self._envs, self._observation = envs, observation
        self.action_map, self.horizon = action_map, envs[0][1].horizon
        self._axes = [action_map.places_of(env.action_map) for _, env in envs]
        sizes = [env.num_envs for _, env in envs]
        self.num_envs, self._bounds = sum(sizes), np.cumsum(sizes)[:-1]
        self.observations: NDArray[np.float32] = np.concatenate(
            [observation.embed(signature, env.observations) for signature, env in envs]
        )

    def step(self, actions: Array) -> VecEnvStep:
        """See :meth:`slap_ros.learning.vec_env.VecEnv.step`."""
        shares = np.split(actions, self._bounds)
        steps = [
            self._embedded(signature, env.step(share[:, axes]))
            for (signature, env), axes, share in zip(self._envs, self._axes, shares, strict=True)
        ]
        whole = concatenated(steps)
        self.observations = whole.observations
        return whole

    def _embedded(self, signature: Signature, step: VecEnvStep) -> VecEnvStep:
        return replace(
            step,
            observations=self._observation.embed(signature, step.observations),
            final_observations=self._observation.embed(signature, step.final_observations),
        )


@dataclass(frozen=True)
class SubgoalEnvSpec:
    """What a :class:`SubgoalVecEnv` is made from, as data that other processes can be sent.

    Args:
        parts: Environments of each shortcut, alike in domain and horizon.
    """

    parts: tuple[ShortcutEnvSpec, ...]

    @property
    def num_envs(self) -> int:
        """The number of all environments."""
        return sum(part.num_envs for part in self.parts)

    @property
    def horizon(self) -> int:
        """Environment steps after which an episode is truncated."""
        return self.parts[0].horizon

    @property
    def action_map(self) -> ActionMap:
        """The map from actions to all axes that one of the shortcuts commands."""
        domain = self.parts[0].domain.make()
        return ActionMap(domain, any(uses_gripper(domain, part.signature) for part in self.parts))

    def observation(self) -> SubgoalObservation:
        """What is observed in all environments."""
        domain = self.parts[0].domain.make()
        states = [restore_starts(domain, part.starts[:1])[0].state for part in self.parts]
        signatures = [part.signature for part in self.parts]
        return SubgoalObservation.of(domain, zip(signatures, states, strict=True))

    def make(self) -> SubgoalVecEnv:
        """The environments themselves, in this process."""
        envs = [(part.signature, part.make()) for part in self.parts]
        return SubgoalVecEnv(envs, self.observation(), self.action_map)
