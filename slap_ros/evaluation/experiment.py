# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Experiments: many tasks, planned and executed in the world (SLAP §5)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any

from slap_ros.core import Domain, Task, task_with_goal
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach
from slap_ros.learning.workers import Workers
from slap_ros.planning.execution import EpisodeResult, ExecutedEdge, Executor
from slap_ros.relational import GroundAtom
from slap_ros.skills.domain_choice import SHIPPED, DomainChoice, open_domain

# Values that most edges have; left out of their JSON, which would else be twice as large.
MOST_EDGES: Mapping[str, Any] = MappingProxyType({"kind": "operator", "reached": True})


@dataclass(frozen=True)
class Experiment:
    """Tasks to solve: ``tasks`` of each of ``seeds`` seeds, the first being ``first_seed``.

    Args:
        domain: Domain of the tasks, with the skills of the experiment.
        tasks: Number of tasks of each seed.
        seeds: Number of seeds.
        first_seed: First of the seeds; the others follow it.
        planner: Name of the planner, one of :data:`slap_ros.planning.planner.PLANNERS`.
        left_out: Seeds and indices of tasks that are not solved.
        goal: Goal by name or as atoms, as :func:`~slap_ros.core.task_with_goal` takes it; None for
            the goal that comes with each task.
        skills: Choice of the domain's skills, as in
            :class:`~slap_ros.skills.domain_choice.DomainChoice`.
    """

    domain: Domain
    tasks: int
    seeds: int
    first_seed: int = 0
    planner: str = "lazy"
    left_out: frozenset[tuple[int, int]] = frozenset()
    goal: str | None = None
    skills: str = SHIPPED

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Seed and index of each task."""
        for seed in range(self.first_seed, self.first_seed + self.seeds):
            for index in range(self.tasks):
                if (seed, index) not in self.left_out:
                    yield seed, index

    def __len__(self) -> int:
        return self.tasks * self.seeds - len(self.left_out)

    def task(self, seed: int, index: int) -> Task:
        """One of the tasks."""
        return task_with_goal(self.domain, seed, index, self.goal)

    def first_equals(self) -> dict[tuple[int, int], tuple[int, int]]:
        """The first task that each one equals in state and goal, by seed and index."""
        known: dict[tuple[bytes, frozenset[GroundAtom]], tuple[int, int]] = {}
        found = {}
        for seed, index in self:
            task = self.task(seed, index)
            key = (task.initial_state.key, task.goal)
            found[seed, index] = known.setdefault(key, (seed, index))
        return found

    def without_repetitions(self) -> Experiment:
        """The experiment without tasks that are equal to an earlier one, in state and goal."""
        again = {task for task, first in self.first_equals().items() if task != first}
        return replace(self, left_out=frozenset(self.left_out | again))

    def run(self, seed: int, index: int, approach: Approach = PURE_PLANNING) -> EpisodeResult:
        """Solve one task, in a world of its own.

        Args:
            seed: Seed of the task.
            index: Index of the task.
            approach: Approach to planning.

        Returns:
            What happened.
        """
        return solve(self.domain, self.task(seed, index), approach, self.planner)


def solve(domain: Domain, task: Task, approach: Approach, planner: str = "lazy") -> EpisodeResult:
    """Plan for any task of a domain and execute the plan, in a world of its own.

    Args:
        domain: Domain of the task.
        task: Task to solve.
        approach: Approach to planning.
        planner: Name of the planner, one of :data:`slap_ros.planning.planner.PLANNERS`.

    Returns:
        What happened.
    """
    space = domain.atom_space(task.initial_state)
    return Executor(
        domain,
        approach.planner(planner, domain, task.initial_state),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal),
        task.step_limit,
    ).run()


@dataclass(frozen=True)
class Trial:
    """The figures of one task, whether it was solved or not.

    Args:
        seed: Seed of the task.
        index: Index of the task.
        success: Whether the goal was reached.
        plan_length: Number of environment steps executed.
        shortcut_steps: Number of environment steps that shortcuts took, out of ``plan_length``.
        planning_seconds: Planning time of all plans together, s.
        edges_rolled_out: Number of options simulated while planning.
        reason: Reason of the failure, in words; empty where the task was solved.
        replans: Number of plans that replaced a diverged one.
        error_code: Error code of the failure, as in the ensemble's messages; 0 where the task was
            solved.
        bound: How many times as long as the shortest the first plan is at most; None where nothing
            is proven.
        edges: Edges that were executed, in order.
    """

    seed: int
    index: int
    success: bool
    plan_length: int
    shortcut_steps: int
    planning_seconds: float
    edges_rolled_out: int
    reason: str
    replans: int = 0
    error_code: int = 0
    bound: float | None = None
    edges: tuple[ExecutedEdge, ...] = ()

    @property
    def at_step_limit(self) -> bool:
        """Whether the task was given up at its step limit."""
        return self.error_code == ErrorCode.STEP_LIMIT

    @classmethod
    def of(cls, seed: int, index: int, episode: EpisodeResult) -> Trial:
        """The figures of an episode.

        Args:
            seed: Seed of the task.
            index: Index of the task.
            episode: Result of the episode.

        Returns:
            The figures.
        """
        return cls(
            seed,
            index,
            episode.success,
            episode.plan_length,
            episode.shortcut_steps,
            episode.planning_seconds,
            episode.edges_rolled_out,
            episode.error.reason,
            episode.replans,
            int(episode.error.code),
            episode.bound,
            tuple(episode.edges),
        )

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Trial:
        """The trial that :meth:`as_json` or :func:`dataclasses.asdict` made such data of."""
        edges = tuple(
            ExecutedEdge(**{**MOST_EDGES, **edge, "objects": tuple(edge["objects"])})
            for edge in data["edges"]
        )
        return cls(**{**data, "edges": edges})

    def as_json(self) -> dict[str, Any]:
        """Its fields; edges without the fields in which they are like most (:data:`MOST_EDGES`)."""
        data = asdict(self)
        edges = [
            {key: value for key, value in edge.items() if value != MOST_EDGES.get(key)}
            for edge in data["edges"]
        ]
        return {**data, "edges": edges}


def run_with(workers: Workers, experiment: Experiment, approach: Approach) -> Iterator[Trial]:
    """Solve every task of an experiment.

    Args:
        workers: Workers that solve the tasks, and nothing under another approach: what motion
            planning has cached of the same task would make planning look faster than it is.
        experiment: Experiment whose tasks are solved.
        approach: Approach to planning.

    Yields:
        The figures of each task, as it ends.
    """
    work = [task_job(experiment, approach, seed, index) for seed, index in experiment]
    for _, trial in workers.run(try_task, work):
        yield trial


TaskJob = tuple[DomainChoice, str | None, str, Approach, int, int]


def task_job(experiment: Experiment, approach: Approach, seed: int, index: int) -> TaskJob:
    """The arguments of :func:`try_task` for a task of an experiment.

    Args:
        experiment: Experiment whose task is solved.
        approach: Approach to planning.
        seed: Seed of the task.
        index: Index of the task.
    """
    choice = DomainChoice.of(experiment.domain, experiment.skills)
    return choice, experiment.goal, experiment.planner, approach, seed, index


def try_task(
    choice: DomainChoice, goal: str | None, planner: str, approach: Approach, seed: int, index: int
) -> Trial:
    """Solve one task, in whichever process this runs.

    Args:
        choice: Choice of the domain, which is made in this process.
        goal: Goal by name or as atoms; None for the goal that comes with the task.
        planner: Name of the planner, one of :data:`slap_ros.planning.planner.PLANNERS`.
        approach: Approach to planning.
        seed: Seed of the task.
        index: Index of the task.

    Returns:
        The figures of the task.
    """
    experiment = Experiment(open_domain(choice), 1, 1, planner=planner, goal=goal)
    return Trial.of(seed, index, experiment.run(seed, index, approach))
