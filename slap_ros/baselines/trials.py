# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Baselines on the tasks of an evaluation: the same tasks, step limits and figures as planning."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from slap_ros.environments.registration import make_task_env
from slap_ros.environments.task_env import TaskEnv
from slap_ros.errors import (
    ErrorCode,
    InvalidCommandError,
    InvalidLibraryError,
    InvalidStateError,
)
from slap_ros.evaluation.experiment import Trial

OUT_OF_STEPS = "the goal was not reached within the task's step limit"
MOST_OPEN = 8  # environments that a process keeps


class Rival(Protocol):
    """A policy for whole tasks: a trained baseline, or anybody's."""

    @property
    def name(self) -> str:
        """What the rows of tables are called."""
        ...

    @property
    def domain(self) -> str:
        """Name of the domain."""
        ...

    @property
    def preset(self) -> str:
        """Preset as whose tasks it observes others."""
        ...

    @property
    def environment(self) -> Mapping[str, str]:
        """Arguments of the environment that it acts in, beside domain and preset."""
        ...

    def act(self, observation: Any, rng: np.random.Generator) -> Any:
        """The action for an observation of the environment."""
        ...

    def require_fit(self, features: int, actions: int) -> None:
        """Refuse an environment with other observations or actions than those of learning.

        Raises:
            InvalidStateError: Says how many there are, and how many there were.
        """
        ...


def try_baseline(baseline: Rival, preset: str, goal: str | None, seed: int, index: int) -> Trial:
    """Let a baseline act in one task until its goal holds, or its steps are used up.

    Args:
        baseline: Baseline that acts.
        preset: Preset of the task.
        goal: Goal by name or as atoms; None for the goal that comes with the task.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        The figures of the task; one that the baseline cannot observe counts as failed.

    Raises:
        InvalidLibraryError: It gives no action of the environment.
    """
    try:
        info = _act(baseline, preset, goal, seed, index)
    except InvalidCommandError as error:
        raise InvalidLibraryError(f"{baseline.name}: {error}") from error
    except InvalidStateError as error:
        return _trial(seed, index, False, 0, error.code, str(error))
    if info["success"]:
        return _trial(seed, index, True, info["steps"], ErrorCode.NONE, "")
    return _trial(seed, index, False, info["steps"], ErrorCode.STEP_LIMIT, OUT_OF_STEPS)


def task_progress(baseline: Rival, preset: str, goal: str | None, seed: int, index: int) -> float:
    """Share of the stages of a task's plan that a baseline does in order; 1 where it is solved.

    Args:
        baseline: Baseline that acts, in an environment with the reward ``stages``.
        preset: Preset of the task.
        goal: Goal by name or as atoms; None for the goal that comes with the task.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        The share, from 0 to 1.

    Raises:
        InvalidStateError: The baseline cannot observe the task.
    """
    return float(_act(baseline, preset, goal, seed, index)["progress"])


def _act(
    baseline: Rival, preset: str, goal: str | None, seed: int, index: int
) -> Mapping[str, Any]:
    """What the environment says of a task once the baseline has acted to its end."""
    env = _environment(
        baseline.domain, preset, baseline.preset, goal, tuple(baseline.environment.items())
    )
    rng = np.random.default_rng([seed, index])
    observation, info = env.reset(seed=seed, options={"index": index})
    baseline.require_fit(env.observed_features, int(np.prod(env.action_space.shape or (1,))))
    solved, cut = bool(info["success"]), False
    while not (solved or cut):
        observation, _, solved, cut, info = env.step(baseline.act(observation, rng))
    return info


@lru_cache(maxsize=MOST_OPEN)
def _environment(
    domain: str, preset: str, like: str, goal: str | None, options: tuple[tuple[str, str], ...]
) -> TaskEnv:
    """The environment of a preset's tasks, which are observed as those of another."""
    return make_task_env(domain, preset, like=like, goal=goal, **dict(options))


def _trial(seed: int, index: int, success: bool, steps: int, code: ErrorCode, reason: str) -> Trial:
    return Trial(seed, index, success, steps, 0, 0.0, 0, reason, error_code=int(code))
