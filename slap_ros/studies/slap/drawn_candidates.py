# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Candidates that are drawn from a task's abstract graph, pruned or not, and learned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.shortcuts import jobs as training_jobs
from slap_ros.shortcuts.candidate_groups import ProblemKey, problem_key
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.learning_attempt import LearningAttempt, learn
from slap_ros.shortcuts.progress import latest
from slap_ros.shortcuts.settings import ENOUGH_SUCCESS, TrainingSettings
from slap_ros.shortcuts.shortcut_candidate import OperatorPath
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartGraph, StartRecord, shortest_paths

DRAWING = 20_000  # sets the random numbers that draw candidates apart from those of a training


@dataclass(frozen=True)
class DrawnCandidate:
    """A pair of abstract states, up to objects, that no option joins.

    Args:
        signature: Lifted change from the first abstract state to the second.
        operator_path: Names of the fewest operators that lead to the first.
    """

    signature: Signature
    operator_path: OperatorPath

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {"signature": self.signature.as_json(), "operator_path": list(self.operator_path)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> DrawnCandidate:
        """The candidate of :meth:`as_json`.

        Raises:
            LookupError, TypeError, ValueError: The data is none.
        """
        return cls(Signature.from_json(data["signature"]), tuple(data["operator_path"]))


@dataclass(frozen=True)
class TaskCandidates:
    """Candidates of one task.

    Args:
        explored: Outcome of exploring it.
        drawn: Some of its pairs that no option joins, in random order.
        joined: Those that rollouts joined.
    """

    explored: ExplorationResult
    drawn: tuple[DrawnCandidate, ...]
    joined: tuple[Signature, ...]

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {
            "explored": self.explored.as_json(),
            "drawn": [one.as_json() for one in self.drawn],
            "joined": [one.as_json() for one in self.joined],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> TaskCandidates:
        """The candidates of :meth:`as_json`.

        Raises:
            LookupError, TypeError, ValueError: The data is none.
        """
        return cls(
            ExplorationResult.from_json(data["explored"]),
            tuple(DrawnCandidate.from_json(one) for one in data["drawn"]),
            tuple(Signature.from_json(one) for one in data["joined"]),
        )


def candidates_of_task(
    distribution: TaskDistribution, index: int, settings: TrainingSettings, most: int
) -> dict[str, Any] | str:
    """Explore a task, and draw candidates.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task among those that training explores.
        settings: Settings of the training.
        most: Number of candidates that are drawn, if there are so many.

    Returns:
        A :class:`TaskCandidates` as JSON; or why the task has no plan, in words.
    """
    tasks = training_jobs.any_goal(distribution, settings.random_goals)
    try:
        explorer = training_jobs.explorer(tasks, index, settings.exploration)
    except (UnsolvableError, PlanningLimitError) as error:
        return str(error)
    explored = explorer.explore()
    drawn = _draw(explorer, most, np.random.default_rng([distribution.seed, DRAWING, index]))
    joined = {one.signature.name: one.signature for one in explorer.shown}
    return TaskCandidates(explored, tuple(drawn), tuple(joined.values())).as_json()


def _draw(explorer: Explorer, most: int, rng: np.random.Generator) -> Iterator[DrawnCandidate]:
    graph, pairs = explorer.graph, explorer.graph.candidates()
    paths = {path[-1].target if path else 0: path for path in shortest_paths(graph)}
    for number in rng.permutation(len(pairs))[:most].tolist():
        source, target = pairs[number]
        yield DrawnCandidate(
            explorer.signature(graph.nodes[source], graph.nodes[target]),
            tuple(edge.option.skill.name for edge in paths[source]),
        )


@dataclass(frozen=True)
class LearnedCandidate:
    """What learning a candidate came to.

    Args:
        starts: Number of tasks in which it can begin.
        success: Share of the last episodes that reached the target; 0 without a start.
        relative: Length of plans with it beside other plans, mean over validation tasks; None where
            it was not learned, or no task has a plan.
    """

    starts: int
    success: float
    relative: float | None


def starts_in_task(
    distribution: TaskDistribution,
    index: int,
    candidates: Sequence[DrawnCandidate],
    operator_steps: Mapping[str, float],
) -> list[dict[str, Any] | None]:
    """Where each candidate begins in a task, all in one graph.

    Args:
        distribution: Distribution of the tasks.
        index: Index of the task among those that starts are collected from, from 0.
        candidates: Candidates to begin.
        operator_steps: Mean environment steps of each operator, by name.

    Returns:
        For each candidate a :class:`~slap_ros.shortcuts.starts.StartRecord` as JSON; None where
        there is no start.
    """
    index = training_jobs.STARTS.index(index)
    graph = StartGraph.of_task(distribution.make_domain(), distribution.task_seed, index)
    if graph is None:
        return [None] * len(candidates)
    found = (graph.find(one.signature, one.operator_path, operator_steps) for one in candidates)
    return [None if one is None else one.as_json() for one in found]


def learn_candidate(
    distribution: TaskDistribution,
    signature: Signature,
    starts: tuple[StartRecord, ...],
    settings: TrainingSettings,
    plain: Mapping[int, int],
) -> LearnedCandidate:
    """Learn a candidate as a training does, and plan with it if that succeeds.

    Args:
        distribution: Distribution of the tasks.
        signature: Signature of the candidate.
        starts: Where it begins, each in a task of its own.
        settings: Settings of the training.
        plain: Environment steps of the plans of validation tasks without it, by the task's index.

    Returns:
        What came of it; nothing learned where it can begin nowhere.
    """
    if not starts:
        return LearnedCandidate(0, 0.0, None)
    with TemporaryDirectory() as folder:
        attempt = LearningAttempt(distribution, signature, starts, settings, folder)
        shortcut = learn(attempt, processes=1)
        success = latest(attempt.work)[len(settings.stages) - 1].success
    if success < ENOUGH_SUCCESS:
        return LearnedCandidate(len(starts), success, None)
    tasks = training_jobs.any_goal(distribution, settings.random_goals)
    planned = {
        i: training_jobs.plan_length(tasks, i, (shortcut,), settings.sampling) for i in plain
    }
    relative = [length / plain[i] for i, length in planned.items() if isinstance(length, int)]
    return LearnedCandidate(len(starts), success, fmean(relative) if relative else None)


@dataclass(frozen=True)
class LearningProblem:
    """Drawn candidates that are the same up to objects.

    Args:
        candidate: One of them.
        pairs: Number of them.
        pruned: Whether no rollout joined such a pair.
    """

    candidate: DrawnCandidate
    pairs: int
    pruned: bool


def problems_of(tasks: Sequence[TaskCandidates], candidates: int) -> list[LearningProblem]:
    """The different things to learn among drawn candidates, the most frequent first.

    Args:
        tasks: Candidates of each task.
        candidates: Number of candidates; of each task as many as is its share of all pairs.
    """
    pairs = sum(task.explored.pairs for task in tasks)
    joined = {problem_key(one) for task in tasks for one in task.joined}
    groups: dict[ProblemKey, list[DrawnCandidate]] = {}
    for task in tasks:
        for one in task.drawn[: round(candidates * task.explored.pairs / max(1, pairs))]:
            groups.setdefault(problem_key(one.signature), []).append(one)
    problems = [LearningProblem(own[0], len(own), key not in joined) for key, own in groups.items()]
    return sorted(problems, key=lambda one: (-one.pairs, one.candidate.signature.name))
