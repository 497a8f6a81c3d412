# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many tasks acquired skills solve where a plan that fails is made again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.api.opening import open_chosen
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import Experiment, Trial, task_job, try_task
from slap_ros.evaluation.summary import format_spread
from slap_ros.planning.execution import MAX_REPLANS
from slap_ros.skills.domain_choice import DomainChoice, chosen_skills
from slap_ros.studies.comparison import failures, failures_in_words, named_tasks, not_solved
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    HandWrittenLibraries,
    all_goals,
    hand_written,
    shipped_skills,
)
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.replanned_trials import ReplannedTrials
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_each, plot_interval, plot_whole
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = f"""\
Each task is planned and executed as in `slap evaluate`: the planner tries the skills in its
model. Where a skill fails in the world, the planner plans again from there, {MAX_REPLANS} times
at most. A task is solved if the goal holds within the domain's step limit. Success has Wilson's
95 % interval, over the tasks of all libraries of a row. Replans are the mean over tasks; steps
are the mean over solved tasks; both are ± sample standard deviation. Failures are counted by the
error code that ended the task: `UNSOLVABLE` (no plan was left), `REPLANS_EXHAUSTED`,
`STEP_LIMIT`. The seeds of these tasks were used neither to train skills nor to judge them. The
library that ships solves the tasks of all seeds. Libraries that other seeds trained solve the
tasks of the first seeds, as many as `others` says. The data has the options of every task in
order, each with its environment steps."""


FIGURES = ("success", "replans", "steps", "failures")


@dataclass(frozen=True)
class LibraryOutcomes:
    """What came of a goal's tasks with one library.

    Args:
        digest: Digest of the library.
        seed: Seed that the library was trained with.
        trials: Trials, one per task.
    """

    digest: str
    seed: int
    trials: tuple[Trial, ...]

    @property
    def rate(self) -> float:
        """The share of solved tasks."""
        return sum(trial.success for trial in self.trials) / len(self.trials)

    def as_json(self) -> dict[str, Any]:
        """The summary, and every task in words."""
        return {
            "library": self.digest,
            "seed": self.seed,
            "success_rate": self.rate,
            "planning_seconds": sum(trial.planning_seconds for trial in self.trials),
            "tasks": list(map(_in_words, self.trials)),
        }


def _in_words(trial: Trial) -> str:
    """Options in order, and why the task was not solved."""
    options = [
        f"{edge.option} {edge.steps}{'' if edge.reached else ' failed'}" for edge in trial.edges
    ]
    end = [] if trial.success else [f"{ErrorCode(trial.error_code).name}: {trial.reason}"]
    return "; ".join([", ".join(options), *end])


@dataclass(frozen=True)
class ReplanningRow:
    """Libraries at one goal: the one that ships, or those that other seeds trained.

    Args:
        goal: Name of the goal; empty for the goal that comes with each task.
        libraries: Outcomes with each library, one at least.
    """

    goal: str
    libraries: tuple[LibraryOutcomes, ...]

    @property
    def trials(self) -> list[Trial]:
        """The trials of all libraries."""
        return [trial for library in self.libraries for trial in library.trials]

    @property
    def seeds(self) -> str:
        """The seeds that the libraries were trained with, in words."""
        plural = "s" if len(self.libraries) > 1 else ""
        return f"seed{plural} {', '.join(str(library.seed) for library in self.libraries)}"

    @property
    def figures(self) -> ReplannedTrials:
        """Success, length and replans of the trials of all libraries."""
        return ReplannedTrials(self.trials)

    def as_json(self) -> dict[str, Any]:
        """The summary, and that of each library."""
        figures = self.figures
        return {
            "goal": self.goal,
            "tasks": len(self.trials),
            "success_rate": figures.solved.share,
            "success_interval": asdict(figures.solved.interval),
            "replans": asdict(figures.replans),
            "replanned": sum(trial.replans > 0 for trial in self.trials),
            "steps": asdict(figures.length) if figures.length else None,
            "failures": dict(failures(self.trials)),
            "libraries": [library.as_json() for library in self.libraries],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        tasks, figures = len(self.libraries[0].trials), self.figures
        return [
            self.goal or "(the task's own)",
            self.seeds,
            f"{len(self.libraries)} × {tasks}",
            str(figures.solved),
            format_spread(figures.replans, 2),
            format_spread(figures.length, 0),
            failures_in_words(self.trials),
        ]


def study(
    experiments: Sequence[Experiment], goals: Sequence[str], runner: JobRunner
) -> StudyReport:
    """Solve tasks with the skills of libraries, planning again where plans fail.

    Args:
        experiments: Experiment with each library; the first library is the one that ships.
        goals: Names of goals; an empty name for the goal that comes with each task.
        runner: Runner of the jobs.

    Returns:
        The report.

    Raises:
        InvalidLibraryError: A folder has no library of the domain.
        UnknownGoalError: The domain has no goal of that name.
    """
    first, *others = experiments
    found = []
    for goal in goals:
        for some in filter(None, ([first], others)):
            trials = [_of_library(replace(one, goal=goal or None), runner) for one in some]
            found.append(ReplanningRow(goal, tuple(trials)))
    return StudyReport(
        study="replanning",
        source="",
        title=f"Success with acquired skills and replanning: {first.domain.name}",
        measured=MEASURED,
        table=MarkdownTable(
            ["goal", "trained with", "libraries × tasks", *FIGURES],
            [row.as_row() for row in found],
        ),
        found={"goals": [row.as_json() for row in found]},
        draw=lambda figure: draw(figure, found),
        size=(7.0, 1.4 + 0.35 * len(found)),
    )


def _of_library(experiment: Experiment, runner: JobRunner) -> LibraryOutcomes:
    """What comes of an experiment with one library."""
    library = chosen_skills(DomainChoice.of(experiment.domain, experiment.skills))
    assert library is not None
    goal = experiment.goal or "own goal"
    jobs = {
        f"{goal}, {library.digest}: {name}": task_job(experiment, PURE_PLANNING, seed, index)
        for name, (seed, index) in named_tasks(experiment).items()
    }
    trials = runner.run(goal, try_task, Trial.from_json, jobs, failure=not_solved)
    trained = int(library.record.get("seed", 0))
    return LibraryOutcomes(library.digest, trained, tuple(trials.values()))


def draw(figure: Figure, goals: Sequence[ReplanningRow]) -> None:
    """Draw success with its interval, and that of each library."""
    axes = figure.subplots()
    for place, goal in enumerate(goals):
        plot_interval(axes, place, goal.figures.solved.interval)
        plot_each(axes, place, [100 * library.rate for library in goal.libraries])
        plot_whole(axes, place, 100 * goal.figures.solved.share)
    name_rows(axes, [f"{one.goal or 'own goal'}: {one.seeds}" for one in goals])
    axes.set_xlim(-3, 103)
    axes.set_xlabel("success [%]: each library, all of a row (dot) with 95 % interval")


@dataclass(frozen=True, kw_only=True)
class ReplanningOptions:
    """Options of this study."""

    domain: DomainName
    library: HandWrittenLibraries = None
    goal: GoalNames = None
    tasks: Annotated[int, CommandOption("Number of tasks per seed and goal.", least=1)] = 20
    seeds: Annotated[int, CommandOption("Number of seeds for the first library.", least=1)] = 5
    others: Annotated[int, CommandOption("Number of seeds for every other library.", least=1)] = 1
    first_seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: ReplanningOptions, tell: Tell) -> PreparedStudy:
    """Open the domain with each library, and choose goals."""
    folders = options.library or hand_written(shipped_skills(options.domain))
    choices = [
        DomainChoice(options.domain, options.preset or "", str(folder)) for folder in folders
    ]
    opened = [open_chosen(choice, tell) for choice in choices]
    counts = [options.seeds, *[options.others] * (len(opened) - 1)]
    experiments = [
        Experiment(one, options.tasks, count, options.first_seed, skills=choice.skills)
        for one, count, choice in zip(opened, counts, choices, strict=True)
    ]
    preset = opened[0].preset
    names = options.goal or all_goals(get_domain(options.domain, preset))
    return PreparedStudy(
        {
            "preset": preset,
            "tasks": options.tasks,
            "seeds": options.seeds,
            "others": options.others,
            "first_seed": options.first_seed,
        },
        lambda runner: study(experiments, names, runner),
        {"library": options.library, "goal": options.goal},
    )


STUDY = Study(
    "replanning",
    help="Success with acquired skills, per goal, with a new plan after each failure.",
    example="slap study replanning stow_hammer",
    options=ReplanningOptions,
    prepare=prepare,
)
