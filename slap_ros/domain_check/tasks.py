# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the sampled tasks are worth having: different, and solved by planning alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from slap_ros.core import Domain
from slap_ros.doctor.check import Check
from slap_ros.errors import MalformedPddlError, SlapError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.planning.execution import EpisodeResult
from slap_ros.relational.pddl import write_domain, write_problem

SHOWN = 3  # reasons for failures that are told


def different(domain: Domain, seed: int, count: int) -> Check:
    """Whether the same seed gives the same task, other seeds other tasks, and goals lie ahead.

    Args:
        domain: Domain to check.
        seed: Seed of the tasks.
        count: Number of tasks that are sampled.
    """
    name = "tasks"
    samples = [domain.task(seed, index) for index in range(count)]
    again = [domain.task(seed, index) for index in range(count)]
    for index, (one, other) in enumerate(zip(samples, again, strict=True)):
        if one.initial_state.key != other.initial_state.key or one.goal != other.goal:
            return Check(
                name,
                "problem",
                f"task {index} of seed {seed} is another one when it is sampled again",
                "draw from the Generator that sample_task is given, and from nothing else",
            )
    reached = [i for i, t in enumerate(samples) if all(a.holds(t.initial_state) for a in t.goal)]
    if reached:
        return Check(
            name,
            "problem",
            f"the goal of task {reached[0]} of seed {seed} holds at the start, as do those of "
            f"{len(reached) - 1} other tasks",
            "sample initial states in which the goal does not hold",
        )
    distinct = len({(task.initial_state.key, task.goal) for task in samples})
    if distinct == 1 < count:
        return Check(name, "warning", f"all {count} tasks are the same", "training needs others")
    return Check(name, "ok", f"{distinct} different tasks among {count}")


def names(domain: Domain, seed: int) -> Check:
    """Whether what has a name can be written as PDDL, as nodes and bags have operators.

    Args:
        domain: Domain to check.
        seed: Seed of the task whose objects are looked at.
    """
    task = domain.task(seed)
    try:
        write_domain(domain.name, domain.types, domain.predicates, domain.operators)
        write_problem("task", domain.name, task.initial_state.objects, (), task.goal)
    except MalformedPddlError as error:
        return Check("names", "problem", str(error), "give it another name")
    return Check("names", "ok", "all of them can be written as PDDL")


@dataclass(frozen=True)
class SolvedTasks:
    """What came of planning and executing tasks without shortcuts.

    Args:
        domain: Name of their domain.
        seed: Seed of the tasks.
        episodes: Episodes that were executed, successful or not.
        failures: Reason why a task was not solved, by its index.
        count: Number of tasks.
        planner: Name of the planner.
    """

    domain: str
    seed: int
    episodes: tuple[EpisodeResult, ...]
    failures: dict[int, str]
    count: int
    planner: str = "lazy"

    @classmethod
    def of(cls, domain: Domain, seed: int, count: int, planner: str = "lazy") -> SolvedTasks:
        """Plan and execute the first tasks of a seed.

        Args:
            domain: Domain of the tasks.
            seed: Seed of the tasks.
            count: Number of tasks.
            planner: Name of the planner.

        Returns:
            What came of each.
        """
        if not domain.operators:
            return cls(domain.name, seed, (), {}, 0, planner)
        episodes, failures = [], {}
        for index in range(count):
            try:
                episode = solve(domain, domain.task(seed, index), PURE_PLANNING, planner)
            except SlapError as error:
                failures[index] = f"{type(error).__name__}: {error}"
                continue
            episodes.append(episode)
            if not episode.success:
                failures[index] = episode.error.reason
        return cls(domain.name, seed, tuple(episodes), failures, count, planner)

    @property
    def _name(self) -> str:
        return "demonstrator" if self.planner == "astar" else "pure planning"

    def check(self) -> Check:
        """How many were solved, and why the others were not."""
        solved = self.count - len(self.failures)
        if not self.count:
            return Check(
                self._name,
                "warning",
                "no task was tried, as there are neither skills nor scripts",
                "Acquisition.scripts shows that the tasks can be solved",
            )
        if not self.failures:
            steps = [episode.plan_length for episode in self.episodes]
            found = f"all {self.count} tasks, in {min(steps)} to {max(steps)} steps"
            return Check(self._name, "ok", found)
        reasons = Counter(self.failures.values()).most_common(SHOWN)
        told = "; ".join(f"{number} x {reason}" for reason, number in reasons)
        return Check(
            self._name,
            "problem" if solved == 0 else "warning",
            f"{solved} of {self.count} tasks solved; not so: {told}",
            f"look at one: slap run {self.domain} --seed {self.seed} --index "
            f"{min(self.failures)}"
            f"{' --shortcuts none' if self.planner == 'lazy' else ''}",
        )
