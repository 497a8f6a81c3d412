# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP on the same tasks: what most studies rest on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.approaches import Approach
from slap_ros.evaluation.experiment import Experiment, Trial, solve
from slap_ros.evaluation.summary import Spread, Summary
from slap_ros.planning.planner import Planner
from slap_ros.relational import State
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.studies.job_runner import JobRunner


class TaskOutcome(Protocol):
    """What came of a task."""

    @property
    def success(self) -> bool:
        """Whether the task was solved."""
        ...

    @property
    def reason(self) -> str:
        """Why the task was not solved; empty where it was."""
        ...


Result = TypeVar("Result", bound=TaskOutcome)


@dataclass(frozen=True)
class PlanningSetup:
    """What a process needs to make domain and planner again."""

    choice: DomainChoice
    planner: str
    approach: Approach

    def make_domain(self) -> Domain:
        """Open the chosen domain.

        Raises:
            UnknownDomainError: It is not registered.
            InvalidParameterError: It has no such preset or setting.
        """
        return open_domain(self.choice)

    def make_planner(self, domain: Domain, state: State) -> Planner:
        """A planner for tasks with the objects of a state.

        Raises:
            InvalidParameterError: There is no such planner, or it cannot use shortcuts.
        """
        return self.approach.planner(self.planner, domain, state)


@dataclass(frozen=True)
class ApproachResult:
    """One approach on all tasks of an experiment."""

    summary: Summary
    trials: tuple[Trial, ...]  # by seed and index

    def as_json(self) -> dict[str, Any]:
        """The summary and every trial, for a report's JSON."""
        return {**self.summary.as_row(), "trials": [trial.as_json() for trial in self.trials]}


@dataclass(frozen=True)
class Comparison:
    """What is compared, and on which tasks.

    Args:
        domain: Domain of the tasks.
        approaches: Ways to plan, pure planning first.
        tasks: Number of tasks per seed.
        seeds: Number of seeds.
        first_seed: First of the seeds.
        runner: Runner of the jobs.
        planner: Name of the planner: lazy, exhaustive, ff or astar.
    """

    domain: Domain
    approaches: tuple[Approach, ...]
    tasks: int
    seeds: int
    first_seed: int
    runner: JobRunner
    planner: str = "lazy"

    def under(self, preset: str) -> Comparison:
        """The same comparison under another preset.

        Raises:
            InvalidParameterError: The domain has no such preset or setting.
        """
        return replace(self, domain=get_domain(self.domain.name, preset))

    @property
    def experiment(self) -> Experiment:
        """The tasks to be solved, and how."""
        return Experiment(
            self.domain, self.tasks, self.seeds, self.first_seed, planner=self.planner
        )

    def measure(self) -> tuple[ApproachResult, ...]:
        """Solve every task with every approach; one that is not solved counts as failed."""
        jobs = named_tasks(self.experiment)
        found = self.attempt(self.domain.preset, solve_task, Trial.from_json, jobs)
        yardstick = found[self.approaches[0].name]
        return tuple(
            ApproachResult(Summary.of(self.experiment, name, trials, yardstick), trials)
            for name, trials in found.items()
        )

    def attempt(
        self,
        what: str,
        function: Callable[..., Result],
        decode: Callable[[Any], Result],
        jobs: Mapping[str, tuple[Any, ...]],
    ) -> dict[str, tuple[Result, ...]]:
        """Do something with tasks, by every approach, each in processes of its own.

        Args:
            what: Name of what is done; nothing else in the study has the same name.
            function: Function that does a job: it gets a :class:`PlanningSetup`, then the job's
                arguments.
            decode: Function that makes a result of its JSON.
            jobs: Arguments of each job, by the job's name.

        Returns:
            Results in the order of ``jobs``, by the approach's name.
        """
        choice = DomainChoice.of(self.domain)
        batches = {
            approach.name: {
                f"{what}, {approach.name}: {name}": (
                    PlanningSetup(choice, self.planner, approach),
                    *job,
                )
                for name, job in jobs.items()
            }
            for approach in self.approaches
        }
        found = self.runner.run(what, function, decode, *batches.values(), failure=not_solved)
        return {
            approach: tuple(found[name] for name in batch) for approach, batch in batches.items()
        }


def named_tasks(tasks: Iterable[tuple[int, int]]) -> dict[str, tuple[int, int]]:
    """Seed and index of tasks, by what they are called on the terminal and in logs."""
    return {f"seed {seed}, task {index}": (seed, index) for seed, index in tasks}


def failures(trials: Iterable[Trial]) -> Counter[str]:
    """Numbers of tasks that were not solved, by the name of their error code."""
    return Counter(ErrorCode(one.error_code).name for one in trials if not one.success)


def failures_in_words(trials: Iterable[Trial]) -> str:
    """The same for a cell of a table, the most frequent first."""
    counts = failures(trials).most_common()
    return ", ".join(f"`{name}` {count}" for name, count in counts) or "none"


def not_solved(attempted: TaskOutcome) -> str | None:
    """What there is to say of a task that was not solved."""
    return None if attempted.success else f"not solved: {attempted.reason}"


def solve_task(setup: PlanningSetup, seed: int, index: int) -> Trial:
    """Plan for a task and execute the plan.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What came of it.
    """
    domain = setup.make_domain()
    return Trial.of(
        seed, index, solve(domain, domain.task(seed, index), setup.approach, setup.planner)
    )


def spread_of(values: Sequence[float]) -> Spread | None:
    """The spread of values; None where there are none."""
    return Spread.of(values) if values else None
