# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a domain's tasks can be solved: its demonstrator, on many tasks of each goal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.studies.comparison import not_solved, spread_of
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import GoalNames, all_goals, with_demonstrator
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_each, plot_interval, plot_whole
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
The demonstrator plans with A* over the domain's hand-written operators. It runs a script for
each operator in the world, closed loop and with knowledge of the whole state. Then it plans
again from wherever the script has left the robot, up to five times. The demonstrator is not a
skill, and no skill learns from it: it shows that the tasks can be solved. Success means that all
atoms of the goal hold within the domain's step limit. The interval is Wilson's, with 95 %. Steps
are environment steps of solved tasks, mean ± sample standard deviation. For each operator, the
last column has how many of its options failed, of how many began. A task in which an option
failed may still be solved."""


@dataclass(frozen=True)
class DemonstratedTask:
    """What came of one task.

    Args:
        index: Index of the task among those of its seed.
        success: Whether the goal was reached.
        steps: Environment steps executed.
        replans: Number of plans after the first.
        begun: Number of options begun, by operator.
        failed: Number of begun options that did not end in the expected abstract state, by
            operator.
        reason: Why the goal was not reached; empty where it was.
    """

    index: int
    success: bool
    steps: int
    replans: int
    begun: dict[str, int]
    failed: dict[str, int]
    reason: str


@dataclass(frozen=True)
class GoalDemonstrations:
    """All tasks of a goal; an empty name stands for the goal that comes with each task."""

    goal: str
    tasks: tuple[DemonstratedTask, ...]

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks whose goal was reached."""
        return SuccessRate(sum(task.success for task in self.tasks), len(self.tasks))

    @property
    def steps(self) -> Spread | None:
        """Spread of the environment steps of solved tasks; None without any."""
        return spread_of([float(task.steps) for task in self.tasks if task.success])

    @property
    def replans(self) -> Spread:
        """Spread of the replans over all tasks."""
        return Spread.of([float(task.replans) for task in self.tasks])

    @property
    def options(self) -> dict[str, tuple[int, int]]:
        """How many options failed, and how many were begun, by operator."""
        begun: Counter[str] = Counter()
        failed: Counter[str] = Counter()
        for task in self.tasks:
            begun.update(task.begun)
            failed.update(task.failed)
        return {name: (failed[name], count) for name, count in sorted(begun.items())}

    def as_json(self) -> dict[str, Any]:
        """The summary and every task."""
        return {
            "goal": self.goal,
            "success_rate": self.solved.share,
            "success_interval": asdict(self.solved.interval),
            "steps": asdict(self.steps) if self.steps else None,
            "replans": asdict(self.replans),
            "options": {
                name: {"failed": failed, "begun": begun}
                for name, (failed, begun) in self.options.items()
            },
            "tasks": [asdict(task) for task in self.tasks],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        failures = [
            f"{name} {failed} of {begun}"
            for name, (failed, begun) in self.options.items()
            if failed
        ]
        return [
            self.goal or "(the task's own)",
            str(len(self.tasks)),
            f"{self.solved.share:.0%}",
            f"{self.solved.interval.low:.0%} to {self.solved.interval.high:.0%}",
            format_spread(self.steps, 0),
            format_spread(self.replans, 2),
            ", ".join(failures) or "none",
        ]


def study(
    choice: DomainChoice,
    counts: Mapping[str, int],
    seed: int,
    runner: JobRunner,
) -> StudyReport:
    """Let the demonstrator solve tasks.

    Args:
        choice: Domain with its demonstrator for skills.
        counts: Number of tasks of each goal, by name; an empty name for the goal that comes with
            each task.
        seed: Seed of the tasks.
        runner: Runner of the jobs.

    Returns:
        The report.

    Raises:
        InvalidParameterError: The domain has no demonstrator.
        UnknownGoalError: The domain has no goal of that name.
    """
    open_domain(choice)
    goals = []
    for goal, count in counts.items():
        jobs = {
            f"{goal}: seed {seed}, task {index}": (choice, goal, seed, index)
            for index in range(count)
        }
        tasks = runner.run(
            goal or choice.name,
            demonstrate_task,
            lambda data: DemonstratedTask(**data),
            jobs,
            failure=not_solved,
        )
        goals.append(GoalDemonstrations(goal, tuple(tasks.values())))
    return StudyReport(
        study="demonstrations",
        source="",
        title=f"Demonstrations: {choice.name}",
        measured=MEASURED,
        table=MarkdownTable(
            [
                "goal",
                "tasks",
                "success",
                "95 % interval",
                "steps",
                "replans",
                "options that failed",
            ],
            [goal.as_row() for goal in goals],
        ),
        found={"goals": [goal.as_json() for goal in goals]},
        draw=lambda figure: draw(figure, goals),
        size=(8.6, 1.4 + 0.35 * len(goals)),
    )


def demonstrate_task(choice: DomainChoice, goal: str, seed: int, index: int) -> DemonstratedTask:
    """Solve one task.

    Args:
        choice: Domain with its demonstrator for skills.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task.

    Returns:
        What came of it.
    """
    domain = open_domain(choice)
    episode = demonstrate(domain, domain.task(seed, index, goal or None)).episode
    return DemonstratedTask(
        index,
        episode.success,
        episode.plan_length,
        episode.replans,
        dict(Counter(edge.option for edge in episode.edges)),
        dict(Counter(edge.option for edge in episode.edges if not edge.reached)),
        episode.error.reason,
    )


def draw(figure: Figure, goals: Sequence[GoalDemonstrations]) -> None:
    """Draw success with its interval, and the steps of every solved task."""
    success, steps = figure.subplots(1, 2, sharey=True)
    for place, goal in enumerate(goals):
        plot_interval(success, place, goal.solved.interval)
        plot_whole(success, place, 100 * goal.solved.share)
        plot_each(steps, place, [task.steps for task in goal.tasks if task.success])
    name_rows(success, [goal.goal or "task's own" for goal in goals])
    success.set_xlim(-3, 103)
    success.set_xlabel("success [%], with 95 % interval")
    steps.set_xlim(left=0)
    steps.set_xlabel("environment steps of solved tasks")


@dataclass(frozen=True, kw_only=True)
class DemonstrationOptions:
    """Options of this study."""

    domain: DomainName
    goal: GoalNames = None
    tasks: Annotated[int, CommandOption("Number of tasks of the first goal.", least=1)] = 100
    others: Annotated[int, CommandOption("Number of tasks of every other goal.", least=1)] = 50
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: DemonstrationOptions, _: Tell) -> PreparedStudy:
    """Open the domain with its demonstrator."""
    choice = with_demonstrator(options.domain, options.preset)
    tasks, others, seed = options.tasks, options.others, options.seed
    names = options.goal or all_goals(open_domain(choice))
    counts = {name: others if i else tasks for i, name in enumerate(names)}
    return PreparedStudy(
        {"preset": choice.preset, "tasks": tasks, "others": others, "seed": seed},
        lambda runner: study(choice, counts, seed, runner),
        {"goal": options.goal},
    )


STUDY = Study(
    "demonstrations",
    help="Whether tasks can be solved: success of the domain's demonstrator, per goal.",
    example="slap study demonstrations stow_hammer",
    options=DemonstrationOptions,
    prepare=prepare,
)
