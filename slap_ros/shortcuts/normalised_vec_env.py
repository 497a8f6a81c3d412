# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environments of shortcuts as stable-baselines3 steps them, with figures. Needs torch."""

from __future__ import annotations

from collections import deque

import numpy as np

from slap_ros.learning.stable_baselines import StableBaselinesVecEnv
from slap_ros.learning.vec_env import VecEnv, VecEnvStep
from slap_ros.policies.mlp_policy import ObservationNormalisation
from slap_ros.shortcuts.progress import Progress

RECENT = 200  # episodes over which success and length are taken
ACTION_REPEAT = 8  # steps for which a random action is repeated before normalisation


class NormalisedVecEnv(StableBaselinesVecEnv):
    """The environments of a shortcut, with normalised observations and statistics of episodes."""

    def __init__(self, env: VecEnv, normalisation: ObservationNormalisation) -> None:
        super().__init__(env, normalisation)
        self.history: deque[tuple[bool, int, bool]] = deque(maxlen=RECENT)
        self.episodes = 0
        self.shortest = env.horizon

    def count(self, step: VecEnvStep, i: int) -> None:
        """Take note of an episode that ended."""
        success, length = bool(step.success[i]), int(step.lengths[i])
        self.history.append((success, length, bool(step.failure[i])))
        self.episodes += 1
        if success:
            self.shortest = min(self.shortest, length)

    def progress(self, steps: int) -> Progress:
        """The figures of recent episodes.

        Args:
            steps: Environment steps so far.
        """
        lengths = [length for success, length, _ in self.history if success]
        count = max(len(self.history), 1)
        return Progress(
            steps,
            self.episodes,
            len(lengths) / count,
            float(np.mean(lengths)) if lengths else float("nan"),
            sum(failure for _, _, failure in self.history) / count,
            self.shortest,
        )


def normalisation_of(env: VecEnv, rng: np.random.Generator, steps: int) -> ObservationNormalisation:
    """Mean and deviation of the observations that random actions lead to.

    Args:
        env: Environments that random actions step.
        rng: Generator that draws the actions, each of which is repeated for a while.
        steps: Number of steps in each environment.

    Returns:
        The normalisation.
    """
    observations = []
    for step in range(steps):
        if step % ACTION_REPEAT == 0:
            actions = rng.uniform(-1.0, 1.0, (env.num_envs, env.action_map.size))
        observations.append(env.step(actions).observations)
    return ObservationNormalisation.of(np.concatenate(observations))
