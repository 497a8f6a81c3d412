# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole tasks for learners that are told their goal, and for hindsight experience replay."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from slap_ros.environments.observations import truths
from slap_ros.environments.task_env import TaskEnv
from slap_ros.relational.state import Array


class GoalTaskEnv(TaskEnv):
    """The same as :class:`TaskEnv`, with goals among its observations.

    An observation has ``observation``, as ``obs="state"`` has it, ``achieved_goal`` (1 for each
    ground atom that holds) and ``desired_goal`` (1 for each that must). Atoms are numbered over the
    objects of the first task, so that only tasks with the same objects are drawn.
    """

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Array:
        """The sparse reward of goals, also of many at once.

        Args:
            achieved_goal: Atoms that hold, shape (..., atoms).
            desired_goal: Atoms that must hold, of the same shape.
            info: Not used.

        Returns:
            -1 where an atom that must hold does not, else 0; shape (...).
        """
        del info
        reached = (np.asarray(achieved_goal) >= np.asarray(desired_goal)).all(axis=-1)
        return np.where(reached, 0.0, -1.0)

    def _make_observation_space(self) -> spaces.Space[Any]:
        goal = spaces.Box(0.0, 1.0, (len(self._first.atoms),), np.float32)
        own = super()._make_observation_space()
        return spaces.Dict({"observation": own, "achieved_goal": goal, "desired_goal": goal})

    @property
    def _needs_same_objects(self) -> bool:
        return True

    def _observe(self) -> Any:
        episode = self._under_way
        return {
            "observation": super()._observe(),
            "achieved_goal": truths(episode.space, episode.abstract),
            "desired_goal": truths(episode.space, episode.goal),
        }
