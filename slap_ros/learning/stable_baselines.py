# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectorised environments as stable-baselines3 wants them. Needs torch."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import VecEnv as Sb3VecEnv

from slap_ros.learning.vec_env import VecEnv, VecEnvStep
from slap_ros.policies.mlp_policy import ObservationNormalisation


class StableBaselinesVecEnv(Sb3VecEnv):
    """A vectorised environment with normalised observations."""

    def __init__(self, env: VecEnv, normalisation: ObservationNormalisation) -> None:
        self.env, self.normalisation = env, normalisation
        size = env.observations.shape[1]
        super().__init__(
            env.num_envs,
            gym.spaces.Box(-np.inf, np.inf, (size,), np.float32),
            gym.spaces.Box(-1.0, 1.0, (env.action_map.size,), np.float32),
        )

    def reset(self) -> Any:
        """The present observations: environments reset themselves."""
        return self.normalisation(self.env.observations)

    def step_async(self, actions: Any) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Step the environments; see :meth:`slap_ros.learning.vec_env.VecEnv.step`."""
        step = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        final = self.normalisation(step.final_observations)
        for i in np.flatnonzero(step.dones):
            infos[i]["terminal_observation"] = final[i]
            infos[i]["TimeLimit.truncated"] = bool(step.truncated[i])
            self.count(step, int(i))
        self.tell(step, infos)
        observations = self.normalisation(step.observations)
        return observations, step.rewards.astype(np.float32), step.dones, infos

    def count(self, step: VecEnvStep, i: int) -> None:
        """Take note of an episode that ended, in environment ``i``; does nothing here."""

    def tell(self, step: VecEnvStep, infos: list[dict[str, Any]]) -> None:
        """Add what a learner is told of a step besides; nothing here.

        Args:
            step: Step in all environments.
            infos: What is said of each environment, to be added to.
        """

    def close(self) -> None:
        """Do nothing: the environments are closed where they were made."""
        return

    def get_attr(self, attr_name: str, _: Any = None) -> list[Any]:
        """The value of an attribute for each environment; None if it is not one of all of them."""
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, *_: Any) -> None:
        """Refuse to set an attribute: the environments have none."""
        raise NotImplementedError(f"the environments have no attribute {attr_name} to be set")

    def env_method(self, method_name: str, *_: Any, **__: Any) -> list[Any]:
        """Refuse to call a method: the environments have none."""
        raise NotImplementedError(f"the environments have no method {method_name}")

    def env_is_wrapped(self, *_: Any) -> list[bool]:
        """No environment is wrapped by another."""
        return [False] * self.num_envs
