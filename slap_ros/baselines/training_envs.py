# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environments of a training as stable-baselines3 steps them. Needs torch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv
from stable_baselines3.common.vec_env import VecEnv as Sb3VecEnv

from slap_ros.baselines.training_tasks import TaskStream, TrainingTally, TrainingTasks
from slap_ros.core import Domain
from slap_ros.environments.task_env import TaskEnv
from slap_ros.environments.task_vec_env import TaskVecEnv
from slap_ros.learning.stable_baselines import StableBaselinesVecEnv
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.mlp_policy import ObservationNormalisation

MakeEnv = Callable[[], TaskEnv]


@dataclass(frozen=True)
class TrainingEnvs:
    """Environments of the training tasks, and what happened in them.

    Args:
        domain: Domain of the tasks.
        streams: Tasks of each environment.
        tally: Counts over all environments.
        make: Function that makes the environments as stable-baselines3 wants them, which begins
            their first tasks.
    """

    domain: Domain
    streams: Sequence[TaskStream]
    tally: TrainingTally
    make: Callable[[], Sb3VecEnv]

    @property
    def step_limit(self) -> int:
        """Environment steps of an episode at most."""
        return self.domain.step_limit

    @property
    def joint_axes(self) -> int:
        """Number of the axes that move joints and gripper, which come first in an action."""
        return ActionMap(self.domain, gripper=True).size

    def durations(self) -> list[int]:
        """Environment steps of the newest action in each environment."""
        return [self.tally.durations[stream.number] for stream in self.streams]

    def skip(self, steps: int) -> None:
        """Go on where an earlier run stopped after so many environment steps."""
        for stream in self.streams:
            stream.skip(steps)


def separate_envs(make_env: MakeEnv, seed: int, count: int) -> TrainingEnvs:
    """Environments that are stepped one after the other.

    Args:
        make_env: Function that makes an environment.
        seed: Seed of the training tasks.
        count: Number of environments.

    Returns:
        The environments, whose episodes have not begun.
    """
    envs, tally = [make_env() for _ in range(count)], TrainingTally()
    streams = [TaskStream(env, seed, number) for number, env in enumerate(envs)]
    return stepped_apart(envs, streams, tally)


def stepped_apart(
    envs: Sequence[TaskEnv], streams: Sequence[TaskStream], tally: TrainingTally
) -> TrainingEnvs:
    """Environments that are stepped one after the other, with the tasks of these streams.

    Args:
        envs: Environments, one at least.
        streams: Tasks of each environment.
        tally: Counts over all environments.

    Returns:
        The environments, whose episodes have not begun.
    """

    def make() -> DummyVecEnv:
        wrapped = [TrainingTasks(*pair, tally) for pair in zip(envs, streams, strict=True)]
        return DummyVecEnv([partial(_given, env) for env in wrapped])

    return TrainingEnvs(envs[0].domain, streams, tally, make)


def joined_envs(make_env: MakeEnv, seed: int, count: int) -> TrainingEnvs:
    """Environments that are stepped by one computation, of the same tasks as separate ones.

    Args:
        make_env: Function that makes an environment with joints and the sparse reward.
        seed: Seed of the training tasks.
        count: Number of environments.

    Returns:
        The environments, whose episodes have not begun.
    """
    env, tally = make_env(), TrainingTally()
    streams = [TaskStream(env, seed, number) for number in range(count)]
    return TrainingEnvs(
        env.domain, streams, tally, lambda: _CountedVecEnv(TaskVecEnv(env, streams), tally)
    )


class _CountedVecEnv(StableBaselinesVecEnv):
    """The environments of tasks, which count what happens in them."""

    def __init__(self, env: TaskVecEnv, tally: TrainingTally) -> None:
        super().__init__(env, as_observed(env.observations.shape[1]))
        self._tally = tally

    def count(self, step: VecEnvStep, i: int) -> None:
        """Take note of an episode that ended."""
        self._tally.ended(bool(step.success[i]))

    def step_wait(self) -> Any:
        """Count a step in each environment."""
        self._tally.steps += self.num_envs
        return super().step_wait()


def as_observed(size: int) -> ObservationNormalisation:
    """The normalisation that changes nothing: environments scale features themselves."""
    return ObservationNormalisation(np.zeros(size, np.float32), np.ones(size, np.float32))


def _given(env: TrainingTasks) -> TrainingTasks:
    return env
