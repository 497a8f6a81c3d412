# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks that are planned for and executed with several trained libraries: a row per way to plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

from slap_ros.api.left_out import Tell
from slap_ros.api.shortcut_choice import choose_library
from slap_ros.core import Domain
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.statistics import Interval, SuccessRate, ratio_interval
from slap_ros.evaluation.summary import Spread, lengths_of_both
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup, named_tasks, not_solved, solve_task
from slap_ros.studies.job_runner import Job, JobRunner
from slap_ros.studies.replanned_trials import ReplannedTrials


@dataclass(frozen=True)
class TrainedLibrary:
    """A library and what it is called: that of its folder."""

    name: str
    library: ShortcutLibrary


@dataclass(frozen=True)
class PlannedWay:
    """A library, and how it is planned with.

    Args:
        library: Name of the library; empty for pure planning.
        digest: Digest of the library; empty for pure planning.
        approach: Way to plan.
    """

    library: str
    digest: str
    approach: Approach

    @classmethod
    def of(cls, trained: TrainedLibrary, approach: Approach) -> PlannedWay:
        """A way to plan with a library."""
        return cls(trained.name, trained.library.digest, approach)


PURELY = PlannedWay("", "", PURE_PLANNING)


@dataclass(frozen=True)
class LibraryTrials:
    """All tasks of a preset, with one library or without.

    Args:
        library: Name of the library; empty for pure planning.
        approach: Name of the way to plan.
        trials: Trials by seed and index.
    """

    library: str
    approach: str
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class Row:
    """A way to plan, over all tasks of a preset and all libraries.

    Args:
        preset: Name of the domain's preset.
        approach: Name of the way to plan.
        tasks: Number of different tasks.
        results: Trials with each library.
        baseline: Trials of the same tasks with pure planning.
    """

    preset: str
    approach: str
    tasks: int
    results: tuple[LibraryTrials, ...]
    baseline: tuple[Trial, ...]

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        approach: str,
        trials: Mapping[str, tuple[Trial, ...]],
        baseline: tuple[Trial, ...],
    ) -> Row:
        """The row of an experiment.

        Args:
            experiment: Tasks that were solved.
            approach: Name of the way to solve them.
            trials: Trials by the name of the library, which is empty for pure planning.
            baseline: Trials of the same tasks with pure planning.
        """
        results = tuple(LibraryTrials(name, approach, found) for name, found in trials.items())
        return cls(experiment.domain.preset, approach, len(experiment), results, baseline)

    @property
    def trials(self) -> list[Trial]:
        """The trials of all libraries."""
        return [trial for result in self.results for trial in result.trials]

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks that were solved."""
        return ReplannedTrials(self.trials).solved

    @property
    def at_step_limit(self) -> int:
        """Trials given up at the step limit."""
        return sum(trial.at_step_limit for trial in self.trials)

    @property
    def length(self) -> Spread | None:
        """Plan length over solved tasks; None where none was solved."""
        return ReplannedTrials(self.trials).length

    @property
    def length_over_libraries(self) -> Spread | None:
        """Spread of the libraries' mean lengths; None with fewer than two libraries."""
        means = [
            fmean(lengths)
            for result in self.results
            if (lengths := [t.plan_length for t in result.trials if t.success])
        ]
        return Spread.of(means) if len(means) > 1 else None

    @property
    def relative(self) -> tuple[float, Interval | None] | None:
        """Relative length and its interval; None where there are no common tasks.

        A task's length is its mean over the libraries that solved it, as tasks are what is
        resampled.
        """
        own, other = [], []
        for i, pure in enumerate(self.baseline):
            solved = [r.trials[i].plan_length for r in self.results if r.trials[i].success]
            if solved and pure.success and pure.plan_length:
                own.append(fmean(solved))
                other.append(float(pure.plan_length))
        return (sum(own) / sum(other), ratio_interval(own, other)) if other else None

    @property
    def planning_seconds(self) -> Spread:
        """Seconds that planning took for a task."""
        return Spread.of([trial.planning_seconds for trial in self.trials])

    def as_json(self) -> dict[str, Any]:
        """Every figure and every trial, for the report's JSON."""
        relative = self.relative
        return {
            "preset": self.preset,
            "approach": self.approach,
            "tasks": self.tasks,
            "success_rate": self.solved.share,
            "success_interval": asdict(self.solved.interval),
            "at_step_limit": self.at_step_limit,
            "plan_length": asdict(self.length) if self.length else None,
            "plan_length_over_libraries": (
                asdict(self.length_over_libraries) if self.length_over_libraries else None
            ),
            "relative_length": relative[0] if relative else None,
            "relative_interval": asdict(relative[1]) if relative and relative[1] else None,
            "planning_seconds": asdict(self.planning_seconds),
            "libraries": [
                {
                    "library": result.library or None,
                    "relative_length": relative_length(result.trials, self.baseline),
                    "trials": [trial.as_json() for trial in result.trials],
                }
                for result in self.results
            ],
        }


def open_library(folder: Path, domain: Domain, tell: Tell) -> TrainedLibrary | None:
    """Open a library, and name it as people tell them apart: by the folder, and the seed.

    Args:
        folder: Folder of the library.
        domain: Domain that the library must fit.
        tell: Function that receives warnings about shortcuts that are left out.

    Returns:
        The library and its name; None where there is none.
    """
    library = choose_library(str(folder), domain, "lazy", tell)
    name = "/".join(folder.resolve().parts[-2:])
    return None if library is None else TrainedLibrary(name, library)


def solved_in(
    ways: Sequence[PlannedWay],
    experiment: Experiment,
    runner: JobRunner,
    solve: Callable[..., Trial] = solve_task,
    conditions: tuple[Any, ...] = (),
) -> list[LibraryTrials]:
    """Solve every task in every way.

    Args:
        ways: Ways to plan.
        experiment: Tasks to solve.
        runner: Runner of the jobs.
        solve: Function that solves a task, of the setup, the conditions, a seed and an index.
        conditions: What else the function is called with.

    Returns:
        The trials of each way.
    """
    batches = [_jobs(way, experiment, conditions) for way in ways]
    preset = experiment.domain.preset
    found = runner.run(preset, solve, Trial.from_json, *batches, failure=not_solved)
    return [
        LibraryTrials(way.library, way.approach.name, tuple(found[name] for name in batch))
        for way, batch in zip(ways, batches, strict=True)
    ]


def _jobs(way: PlannedWay, experiment: Experiment, conditions: tuple[Any, ...]) -> dict[str, Job]:
    """The tasks of an experiment, for a way to plan."""
    setup = PlanningSetup(DomainChoice.of(experiment.domain), experiment.planner, way.approach)
    whose = " ".join(filter(None, (way.library, way.digest, way.approach.name)))
    return {
        f"{experiment.domain.preset}, {whose}: {name}": (setup, *conditions, *task)
        for name, task in named_tasks(experiment).items()
    }


def rows_of(experiment: Experiment, results: Sequence[LibraryTrials]) -> list[Row]:
    """A row per approach, in the order of their first trials.

    Args:
        experiment: Tasks that were solved.
        results: Trials with each library, pure planning among them.
    """
    by_approach: dict[str, list[LibraryTrials]] = {}
    for one in results:
        by_approach.setdefault(one.approach, []).append(one)
    baseline = by_approach[PURE_PLANNING.name][0].trials
    return [
        Row(experiment.domain.preset, name, len(experiment), tuple(each), baseline)
        for name, each in by_approach.items()
    ]


def relative_cell(row: Row) -> str:
    """Relative length with its interval."""
    if row.approach == "pure_planning":
        return "1"
    if row.relative is None:
        return "-"
    value, interval = row.relative
    return f"{value:.2f}" + (f" [{interval.low:.2f}, {interval.high:.2f}]" if interval else "")


def relative_length(trials: Sequence[Trial], baseline: Sequence[Trial]) -> float | None:
    """Steps of trials relative to those of others, in tasks that both solved; None without any.

    Args:
        trials: Trials of some tasks.
        baseline: Trials of the same tasks, in the same order.
    """
    own, other = lengths_of_both(trials, baseline)
    return sum(own) / sum(other) if other else None
