# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The jobs of a training: functions of plain data, run anywhere in any order.

Those that learn are in ``learning_attempt``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf
from statistics import fmean
from time import process_time
from typing import Any

import numpy as np

from slap_ros.errors import PlanningLimitError, SlapError, UnsolvableError
from slap_ros.learning.random_goals import RandomGoalsChoice
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.task_range import TaskRange
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts.demonstrations import demonstrate
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.kept_shortcuts import NOTHING_KEPT, KeptShortcuts
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_candidate import OperatorPath
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord, find_start

EXPLORATION = TaskRange("exploration", 0, 10_000)
STARTS = TaskRange("starts", 10_000, 90_000)
VALIDATION = TaskRange("validation", 90_000)


def explore(
    distribution: TaskDistribution,
    index: int,
    settings: ExplorationSettings,
    kept: KeptShortcuts = NOTHING_KEPT,
) -> dict[str, Any]:
    """Explore one task.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task among those that are explored, from 0.
        settings: Settings of exploration.
        kept: Shortcuts that are options like any other.

    Returns:
        JSON of an :class:`~slap_ros.shortcuts.exploration_result.ExplorationResult`, with
        ``cpu_s``.

    Raises:
        UnsolvableError: The task has no plan.
        PlanningLimitError: A limit was reached before a plan was found.
    """
    began = process_time()
    found = explorer(distribution, index, settings, kept).explore()
    return {**found.as_json(), "cpu_s": process_time() - began}


def explorer(
    distribution: TaskDistribution,
    index: int,
    settings: ExplorationSettings,
    kept: KeptShortcuts = NOTHING_KEPT,
) -> Explorer:
    """The explorer of one task, with its random numbers.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task among those that are explored, from 0.
        settings: Settings of exploration.
        kept: Shortcuts that are options like any other.

    Raises:
        UnsolvableError: The task has no plan.
        PlanningLimitError: A limit was reached before a plan was found.
    """
    rng = np.random.default_rng([distribution.seed, EXPLORATION.first, index])
    task = distribution.task_seed, EXPLORATION.index(index)
    return Explorer.of_task(distribution.make_domain(), *task, settings, rng, kept)


def try_to_explore(
    distribution: TaskDistribution,
    index: int,
    settings: ExplorationSettings,
    kept: KeptShortcuts = NOTHING_KEPT,
) -> dict[str, Any] | str:
    """What :func:`explore` returns, or why the task has no plan, in words.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task.
        settings: Settings of exploration.
        kept: Shortcuts that are options like any other.
    """
    try:
        return explore(distribution, index, settings, kept)
    except (UnsolvableError, PlanningLimitError) as error:
        return str(error)


def start(
    distribution: TaskDistribution,
    index: int,
    signature: Signature,
    operator_path: OperatorPath,
    operator_steps: Mapping[str, float],
    beyond: bool = False,
    anywhere: bool = False,
    kept: KeptShortcuts = NOTHING_KEPT,
) -> dict[str, Any] | None:
    """The start of a shortcut in one task; see :func:`~slap_ros.shortcuts.starts.find_start`.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task among those that starts are collected from, from 0.
        signature: Signature of the shortcut.
        operator_path: Names of the operators that lead to the start.
        operator_steps: Mean environment steps of each operator, by name.
        beyond: Whether the shortcut leads to abstract states that operators alone do not reach.
        anywhere: Whether it is drawn from all that any operators lead to.
        kept: Shortcuts that are options like any other.

    Returns:
        A :class:`~slap_ros.shortcuts.starts.StartRecord` as JSON; None where there is no start.
    """
    drawing = np.random.default_rng([distribution.seed, STARTS.first, index]) if anywhere else None
    found = find_start(
        distribution.make_domain(),
        distribution.task_seed,
        STARTS.index(index),
        signature,
        None if anywhere else operator_path,
        operator_steps,
        beyond,
        drawing,
        kept,
    )
    return None if found is None else found.as_json()


def demonstration(
    distribution: TaskDistribution,
    start: StartRecord,
    signature: Signature,
    tries: int,
    kept: KeptShortcuts = NOTHING_KEPT,
    push: int = 0,
) -> dict[str, Any]:
    """A demonstration of a shortcut; see :func:`~slap_ros.shortcuts.demonstrations.demonstrate`.

    Args:
        distribution: Distribution from which the start's task is drawn.
        start: Start of the shortcut.
        signature: Signature of the shortcut.
        tries: Number of stretches that are tried to make the skills' execution shorter.
        kept: Shortcuts that are skills like any other.
        push: Environment steps of pushes that follow approaches; 0 where skills show the shortcut.

    Returns:
        A :class:`~slap_ros.shortcuts.demonstrations.DemonstrationAttempt` as JSON.
    """
    rng = np.random.default_rng([distribution.seed, STARTS.first, start.index])
    domain = distribution.make_domain()
    return demonstrate(domain, start, signature, tries, rng, kept, push).as_json()


def plan_length(
    distribution: TaskDistribution, index: int, shortcuts: tuple[Shortcut, ...], sampling: Sampling
) -> int | str:
    """Plan for one validation task.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task among the validation tasks, from 0.
        shortcuts: Shortcuts that may be used besides the given options.
        sampling: Settings of how shortcuts are tried out in the model.

    Returns:
        Environment steps of the plan in the model; or why there is none that reaches the goal
        there, in words.
    """
    domain = distribution.make_domain()
    task = domain.task(distribution.task_seed, VALIDATION.index(index))
    problem, initial = Problem.of(domain, task.initial_state), task.initial_state
    grounded = GroundedShortcuts(domain, shortcuts, initial, sampling) if shortcuts else None
    planner = GraphPlanner(problem, shortcuts=grounded)
    try:
        result = planner.plan(initial, problem.model.space.mask(task.goal))
    except SlapError as error:
        return str(error)
    return result.fails or result.plan.predicted_steps


def any_goal(distribution: TaskDistribution, share: float) -> TaskDistribution:
    """The tasks that are explored and validated on: the same, some for another goal.

    Args:
        distribution: Distribution of the tasks that are learned from.
        share: Share of the tasks that have another goal than their own.
    """
    if not share:
        return distribution
    return replace(distribution, domain=RandomGoalsChoice.of_choice(distribution.domain, share))


def mean_length(lengths: Sequence[int | str]) -> float:
    """Mean plan length, environment steps; infinite where a task has no plan.

    Args:
        lengths: Results of :func:`plan_length`.
    """
    return fmean(length if isinstance(length, int) else inf for length in lengths)
