# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far plans get with acquired skills: task progress, never planned again (LG-SAIL Table 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from slap_ros.api.command_options import DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.domains import get_domain
from slap_ros.drawing.palette import MUTED
from slap_ros.evaluation.summary import format_spread
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    LibraryTasks,
    SkillLibraries,
    all_goals,
    shipped_skills,
)
from slap_ros.studies.lg_sail.library_progress import (
    PAPER_PROGRESS,
    LibrariesProgress,
    LibraryProgress,
    Origin,
    of_library,
)
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_each, plot_whole
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
A* makes a plan of acquired operators, with as few operators as possible. The learned skills carry
it out, approach and policy, and nothing is planned again. Task progress is the share of the plan's
stages that were done in order. A stage is done once all expected atoms hold, and none that its
operator deletes. The seeds of these tasks were used neither to train skills nor to judge them. A
row is of all libraries whose operators are from the same proposer and whose rewards are from the
same rewarder. Task progress is the mean over tasks, then the mean ± sample standard deviation over
libraries. *Solved* is the share of tasks whose stages were all done, of these libraries together,
with Wilson's 95 % interval. The paper's figures are LG-SAIL's, in a simulator of its own."""


@dataclass(frozen=True, kw_only=True)
class GoalProgress(LibrariesProgress):
    """All libraries of one origin at one goal.

    Args:
        domain: Name of the domain.
        goal: Name of the goal; empty for the goal that comes with each task.
        libraries: Progress with each library, one at least.
        origin: Proposer and rewarder of the libraries.
    """

    origin: Origin

    @property
    def paper(self) -> float | None:
        """LG-SAIL's task progress."""
        return PAPER_PROGRESS.get((self.domain, self.goal))

    def as_json(self) -> dict[str, Any]:
        """The summary, and that of each library."""
        return {
            "goal": self.goal,
            **self.origin._asdict(),
            "progress": asdict(self.progress),
            "solved_interval": asdict(self.solved.interval),
            "paper": self.paper,
            "libraries": [library.as_json() for library in self.libraries],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        return [
            self.goal or "(the task's own)",
            ", ".join(self.origin),
            f"{len(self.libraries)} × {len(self.libraries[0].rollouts)}",
            format_spread(self.progress, 2),
            str(self.solved),
            self.failures,
            "" if self.paper is None else f"{self.paper:.2f}",
        ]


def study(
    choices: Sequence[DomainChoice],
    counts: Mapping[str, int],
    seed: int,
    runner: JobRunner,
) -> StudyReport:
    """Carry out plans with the skills of libraries.

    Args:
        choices: Domain with the skills of each library.
        counts: Number of tasks of each goal, by name; an empty name for the goal that comes with
            each task.
        seed: Seed of the tasks.
        runner: Runner of the jobs.

    Returns:
        The report.

    Raises:
        InvalidLibraryError: A folder has no library of the domain.
        UnknownGoalError: The domain has no goal of that name.
    """
    name = choices[0].name
    goals = []
    for goal, count in counts.items():
        found: dict[Origin, list[LibraryProgress]] = {}
        for choice in choices:
            origin, progress = of_library(choice, goal, range(count), seed, runner)
            found.setdefault(origin, []).append(progress)
        goals += [
            GoalProgress(domain=name, goal=goal, origin=origin, libraries=tuple(each))
            for origin, each in found.items()
        ]
    return StudyReport(
        study="acquisition",
        source="LG-SAIL Table 1",
        title=f"Task progress with acquired skills: {name}",
        measured=MEASURED,
        table=MarkdownTable(
            [
                "goal",
                "operators, rewards",
                "libraries × tasks",
                "task progress",
                "solved",
                "stages that failed",
                "paper",
            ],
            [goal.as_row() for goal in goals],
        ),
        found={"goals": [goal.as_json() for goal in goals]},
        draw=lambda figure: draw(figure, goals),
        size=(7.0, 1.4 + 0.35 * len(goals)),
    )


def draw(figure: Figure, goals: Sequence[GoalProgress]) -> None:
    """Draw every library's task progress, their mean, and the paper's."""
    axes = figure.subplots()
    for place, goal in enumerate(goals):
        plot_each(axes, place, [library.progress for library in goal.libraries])
        plot_whole(axes, place, goal.progress.mean)
        if goal.paper is not None:
            axes.plot([goal.paper], [place], "D", color=MUTED, markersize=5, fillstyle="none")
    name_rows(axes, [f"{goal.goal or 'own goal'}: {', '.join(goal.origin)}" for goal in goals])
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("task progress: each library, their mean (dot), the paper's (diamond)")


def _summary(found: Data) -> str:
    return ", ".join(
        f"{one['goal']}{_made_by(one)} {one['progress']['mean']:.2f}" for one in found["goals"]
    )


def _made_by(goal: Data) -> str:
    origin = {goal.get("proposer", "manual"), goal.get("rewarder", "manual")}
    return "" if origin == {"manual"} else f" ({goal['proposer']}, {goal['rewarder']})"


@dataclass(frozen=True, kw_only=True)
class AcquisitionOptions:
    """Options of this study."""

    domain: DomainName
    library: SkillLibraries = None
    goal: GoalNames = None
    tasks: LibraryTasks = 100
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: AcquisitionOptions, _: Tell) -> PreparedStudy:
    """Open the domain, and choose libraries and goals."""
    folders = options.library or shipped_skills(options.domain)
    chosen = get_domain(options.domain, options.preset)
    choices = [DomainChoice(options.domain, chosen.preset, str(folder)) for folder in folders]
    counts = dict.fromkeys(options.goal or all_goals(chosen), options.tasks)
    return PreparedStudy(
        {"preset": chosen.preset, "tasks": options.tasks, "seed": options.seed},
        lambda runner: study(choices, counts, options.seed, runner),
        {"library": options.library, "goal": options.goal},
    )


STUDY = Study(
    "acquisition",
    help="Task progress with acquired skills, per goal, without planning again.",
    example="slap study acquisition stow_hammer",
    options=AcquisitionOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "LG-SAIL Table 1",
            "task progress with acquired skills",
            ("stow_hammer", "peg_in_hole", "stack_at_target", "make_coffee"),
            {
                "stow_hammer": "training 0.96, test1 0.91, test2 0.71",
                "peg_in_hole": "training 0.92, test1 0.59, test2 0.93",
                "stack_at_target": "1.00",
            },
        ),
    ),
)
