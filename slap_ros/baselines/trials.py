# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Baselines on the tasks of an evaluation: the same tasks, step limits and figures as planning."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from slap_ros.baselines.trained_baseline import TrainedBaseline
from slap_ros.environments.registration import make_task_env
from slap_ros.environments.task_env import TaskEnv
from slap_ros.errors import ErrorCode, InvalidStateError
from slap_ros.evaluation.experiment import Trial

OUT_OF_STEPS = "the goal was not reached within the task's step limit"
MOST_OPEN = 8  # environments that a process keeps


def try_baseline(
    baseline: TrainedBaseline, preset: str, goal: str | None, seed: int, index: int
) -> Trial:
    """Let a baseline act in one task until its goal holds, or its steps are used up.

    Args:
        baseline: Baseline that acts.
        preset: Preset of the task.
        goal: Goal by name or as atoms; None for the goal that comes with the task.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        The figures of the task; one that the baseline cannot observe counts as failed.
    """
    env = _environment(
        baseline.domain, preset, baseline.preset, goal, tuple(baseline.environment.items())
    )
    try:
        observation, info = env.reset(seed=seed, options={"index": index})
        _require_fit(baseline, env)
    except InvalidStateError as error:
        return _trial(seed, index, False, 0, ErrorCode.INVALID_STATE, str(error))
    rng = np.random.default_rng([seed, index])
    solved, cut = bool(info["success"]), False
    while not (solved or cut):
        observation, _, solved, cut, info = env.step(baseline.act(observation, rng))
    if solved:
        return _trial(seed, index, True, info["steps"], ErrorCode.NONE, "")
    return _trial(seed, index, False, info["steps"], ErrorCode.STEP_LIMIT, OUT_OF_STEPS)


@lru_cache(maxsize=MOST_OPEN)
def _environment(
    domain: str, preset: str, like: str, goal: str | None, options: tuple[tuple[str, str], ...]
) -> TaskEnv:
    """The environment of a preset's tasks, which are observed as those of another."""
    return make_task_env(domain, preset, like=like, goal=goal, **dict(options))


def _require_fit(baseline: TrainedBaseline, env: TaskEnv) -> None:
    """Refuse an environment with other observations or actions than the baseline has.

    Raises:
        InvalidStateError: Says how many there are, and how many the baseline has.
    """
    features = env.observed_features
    actions = int(np.prod(env.action_space.shape or (1,)))
    if (features, actions) != (baseline.features, baseline.actions):
        raise InvalidStateError(
            f"{baseline.method} was learned on {baseline.features} features and "
            f"{baseline.actions} actions; here are {features} and {actions}"
        )


def _trial(seed: int, index: int, success: bool, steps: int, code: ErrorCode, reason: str) -> Trial:
    return Trial(seed, index, success, steps, 0, 0.0, 0, reason, error_code=int(code))
