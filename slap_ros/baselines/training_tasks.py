# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The tasks that baselines learn from: none of them is ever evaluated on."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import gymnasium

from slap_ros.core import Task
from slap_ros.environments.task_env import TaskEnv
from slap_ros.learning.task_range import TaskRange

RECENT = 100  # episodes over which success is taken
EACH = 10_000_000  # tasks of an environment
TRAINING = TaskRange("training", 0, 2**31)
VALIDATION = TaskRange("validation", 2**31)


@dataclass
class TrainingTally:
    """What happened in all environments of a training.

    Args:
        steps: Environment steps: an action that runs a skill takes many.
        episodes: Episodes that ended.
        recent: Whether the last of them reached their goal.
        durations: Environment steps of the newest action, by the number of the environment.
    """

    steps: int = 0
    episodes: int = 0
    recent: deque[bool] = field(default_factory=lambda: deque(maxlen=RECENT))
    durations: dict[int, int] = field(default_factory=dict)

    def count(self, number: int, steps: int) -> None:
        """Count the environment steps of an action.

        Args:
            number: Number of the environment.
            steps: Environment steps that the action took.
        """
        self.steps += steps
        self.durations[number] = steps

    def ended(self, success: bool) -> None:
        """Count an episode that ended."""
        self.episodes += 1
        self.recent.append(success)


class TaskStream(Iterator[Task]):
    """The training tasks of one environment, one after the other; those that fit in it."""

    def __init__(self, env: TaskEnv, seed: int, number: int) -> None:
        """Begin before the first task.

        Args:
            env: Environment in which they must fit.
            seed: Seed of the training tasks.
            number: Number of the environment; each has tasks of its own.
        """
        self._env, self._seed, self.number = env, seed, number
        self._all = TRAINING.batch(number, EACH)
        self._indices = iter(self._all)

    def skip(self, steps: int) -> None:
        """Go on where an earlier run stopped, which had no more episodes than steps."""
        self._indices = iter(self._all[steps:])

    def __next__(self) -> Task:
        return self._env.first_task(self._seed, self._indices)


class TrainingTasks(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose episodes are the tasks of a stream."""

    def __init__(self, env: TaskEnv, tasks: TaskStream, tally: TrainingTally) -> None:
        """Begin before the first task.

        Args:
            env: Environment of the tasks.
            tasks: Tasks of the episodes.
            tally: Counts of the whole training.
        """
        super().__init__(env)
        self._tasks, self._tally = tasks, tally
        self._steps = 0  # of this episode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin the next task, whatever seed a learner would like."""
        del seed, options
        self._steps = 0
        return self.env.reset(options={"task": next(self._tasks)})

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """See :class:`gymnasium.Env`."""
        seen, reward, reached, cut, info = self.env.step(action)
        self._tally.count(self._tasks.number, info["steps"] - self._steps)
        self._steps = info["steps"]
        if reached or cut:
            self._tally.ended(reached)
        return seen, reward, reached, cut, info
