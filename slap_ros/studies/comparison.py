# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP on the same tasks: what most studies rest on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol, TypeVar

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.evaluation.approaches import Approach
from slap_ros.evaluation.experiment import Experiment, Trial, run_all
from slap_ros.evaluation.summary import Spread, Summary
from slap_ros.learning.workers import local_workers
from slap_ros.planning.planner import Planner
from slap_ros.relational import State

Result = TypeVar("Result")


class StudyProgress(Protocol):
    """Is called as the jobs of a study begin and end, to show its progress."""

    def begin(self, what: str, total: int) -> None:
        """So many jobs of a kind follow."""
        ...

    def advance(self) -> None:
        """One of them has ended."""
        ...

    def report_failure(self, complaint: str) -> None:
        """A task was not solved, and why."""
        ...


@dataclass(frozen=True)
class PlanningSetup:
    """What a process needs to make domain and planner again."""

    domain: str
    preset: str
    planner: str
    approach: Approach

    def make_domain(self) -> Domain:
        """The domain under its preset.

        Raises:
            UnknownDomainError: It is not registered.
            InvalidParameterError: It has no such preset or setting.
        """
        return get_domain(self.domain, self.preset)

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
        return {**self.summary.as_row(), "trials": [asdict(trial) for trial in self.trials]}


@dataclass(frozen=True)
class Comparison:
    """What is compared, and on which tasks.

    Args:
        domain: Whose tasks.
        approaches: Ways to plan, pure planning first.
        tasks: Number of tasks per seed.
        seeds: Number of seeds, from 0 on.
        jobs: Number of processes.
        planner: Name of the planner: lazy, exhaustive or ff.
    """

    domain: Domain
    approaches: tuple[Approach, ...]
    tasks: int
    seeds: int
    jobs: int = 1
    planner: str = "lazy"

    def under(self, preset: str) -> Comparison:
        """The same under another preset.

        Raises:
            InvalidParameterError: The domain has no such preset or setting.
        """
        return replace(self, domain=get_domain(self.domain.name, preset))

    @property
    def experiment(self) -> Experiment:
        """The tasks to be solved, and how."""
        return Experiment(self.domain, self.tasks, self.seeds, planner=self.planner)

    def measure(self, progress: StudyProgress) -> tuple[ApproachResult, ...]:
        """Solve every task with every approach; one that is not solved counts as failed."""
        experiment = self.experiment
        measured: list[ApproachResult] = []
        progress.begin(self.domain.preset, len(experiment) * len(self.approaches))
        for approach in self.approaches:
            trials = []
            for trial in run_all(experiment, approach, self.jobs):
                trials.append(trial)
                progress.advance()
                if not trial.success:
                    progress.report_failure(
                        complaint(approach, trial.seed, trial.index, trial.reason)
                    )
            trials.sort(key=lambda trial: (trial.seed, trial.index))
            yardstick = measured[0].trials if measured else trials
            summary = Summary.of(experiment, approach.name, trials, yardstick)
            measured.append(ApproachResult(summary, tuple(trials)))
        return tuple(measured)

    def map_jobs(
        self, function: Callable[..., Result], approach: Approach, jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Result]]:
        """Run jobs in processes; every approach has processes of its own, as in :func:`run_all`.

        Args:
            function: Does a job; called with a :class:`PlanningSetup`, then the job's arguments.
            approach: How its planner plans.
            jobs: Arguments of each job.

        Yields:
            Number and result of each job, in the order in which they end.
        """
        setup = PlanningSetup(self.domain.name, self.domain.preset, self.planner, approach)
        with local_workers(self.jobs) as workers:
            yield from workers.run(function, [(setup, *job) for job in jobs])


def complaint(approach: Approach, seed: int, index: int, reason: str) -> str:
    """A line about a task that was not solved.

    Args:
        approach: Which did not solve it.
        seed: Of the task.
        index: Number of the task among its seed's.
        reason: Why not.
    """
    return f"{approach.name}: seed {seed}, task {index} not solved: {reason}"


def spread_of(values: Sequence[float]) -> Spread | None:
    """The spread of values; None where there are none."""
    return Spread.of(values) if values else None


def format_spread(spread: Spread | None, digits: int) -> str:
    """Mean ± sample standard deviation with so many digits, for a table; a dash for None."""
    return "-" if spread is None else f"{spread.mean:.{digits}f} ± {spread.sd:.{digits}f}"
