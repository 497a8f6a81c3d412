# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far plans get with acquired skills: task progress, never planned again (LG-SAIL Table 1)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from statistics import fmean
from typing import TYPE_CHECKING, Any, NamedTuple

from slap_ros.acquisition.curriculum.rollouts import PlanRollout, Stage, roll_out
from slap_ros.api.command_options import DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.drawing.palette import MUTED
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.skills.domain_choice import DomainChoice, chosen_skills, open_domain
from slap_ros.skills.skill import LearnedSkill
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    LibraryTasks,
    SkillLibraries,
    all_goals,
    shipped_skills,
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
# Task progress that LG-SAIL's Table 1 has, by domain and goal.
PAPER: Mapping[tuple[str, str], float] = {
    ("stack_at_target", "training"): 1.00,
    ("stow_hammer", "training"): 0.96,
    ("stow_hammer", "test1"): 0.91,
    ("stow_hammer", "test2"): 0.71,
    ("peg_in_hole", "training"): 0.92,
    ("peg_in_hole", "test1"): 0.59,
    ("peg_in_hole", "test2"): 0.93,
}


class Origin(NamedTuple):
    """Where operators and rewards of a library are from, by name."""

    proposer: str
    rewarder: str


@dataclass(frozen=True)
class LibraryProgress:
    """What came of a goal's tasks with one library.

    Args:
        digest: Digest of the library.
        seed: Seed that the library was trained with.
        rollouts: Rollouts of the plans, one per task.
    """

    digest: str
    seed: int
    rollouts: tuple[PlanRollout, ...]

    @property
    def progress(self) -> float:
        """Mean task progress."""
        return fmean(rollout.progress for rollout in self.rollouts)

    @property
    def failures(self) -> Counter[str]:
        """Stages that failed, by operator, and plans that do not lead to the goal, by reason."""
        failed = [rollout for rollout in self.rollouts if rollout.progress < 1.0]
        return Counter(r.failure.operator if r.failure else _reason(r) for r in failed)

    def as_json(self) -> dict[str, Any]:
        """The summary, and every task: of each stage operator, environment steps, why it failed."""
        return {
            "library": self.digest,
            "seed": self.seed,
            "progress": self.progress,
            "failures": dict(self.failures),
            "tasks": list(map(_task_in_words, self.rollouts)),
        }


def _reason(rollout: PlanRollout) -> str:
    """Why there is no plan, without the objects of the task."""
    return rollout.unplanned.partition(":")[0]


def _task_in_words(rollout: PlanRollout) -> dict[str, Any]:
    stages = list(map(_in_words, rollout.stages))
    why = {"unplanned": rollout.unplanned} if rollout.unplanned else {}
    return {"progress": rollout.progress, "stages": stages, **why}


def _in_words(stage: Stage) -> str:
    failed = "" if stage.done else f": {stage.end}"
    return f"{stage.operator} {stage.steps}{failed}"


@dataclass(frozen=True, kw_only=True)
class LibrariesProgress:
    """Several libraries at one goal.

    Args:
        domain: Name of the domain.
        goal: Name of the goal; empty for the goal that comes with each task.
        libraries: Progress with each library, one at least.
    """

    domain: str
    goal: str
    libraries: tuple[LibraryProgress, ...]

    @property
    def rollouts(self) -> list[PlanRollout]:
        """The rollouts of all libraries."""
        return [rollout for library in self.libraries for rollout in library.rollouts]

    @property
    def progress(self) -> Spread:
        """Mean task progress, over libraries."""
        return Spread.of([library.progress for library in self.libraries])

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks whose stages were all done."""
        done = sum(rollout.progress == 1.0 for rollout in self.rollouts)
        return SuccessRate(done, len(self.rollouts))

    @property
    def failures(self) -> str:
        """What failed of all libraries, in words: see :attr:`LibraryProgress.failures`."""
        failures = sum((library.failures for library in self.libraries), Counter[str]())
        return ", ".join(f"{name} {count}" for name, count in failures.most_common()) or "none"


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
        return PAPER.get((self.domain, self.goal))

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


def of_library(
    choice: DomainChoice, goal: str, indices: Sequence[int], seed: int, runner: JobRunner
) -> tuple[Origin, LibraryProgress]:
    """Where a library is from, and what comes of a goal's tasks with it.

    Args:
        choice: Domain with the skills of the library.
        goal: Name of the goal; empty for the goal that comes with each task.
        indices: Indices of the tasks.
        seed: Seed of the tasks.
        runner: Runner of the jobs.
    """
    library = chosen_skills(choice)
    assert library is not None
    record = library.record
    origin = Origin(*(str(record.get(name, "manual")) for name in Origin._fields))
    jobs = {f"{goal} {library.digest} {i}": (choice, goal, seed, i) for i in indices}
    rollouts = runner.run(goal or choice.name, carry_out_task, PlanRollout.from_json, jobs)
    trained = int(record.get("seed", 0))
    return origin, LibraryProgress(library.digest, trained, tuple(rollouts.values()))


def carry_out_task(choice: DomainChoice, goal: str, seed: int, index: int) -> dict[str, Any]:
    """Carry out one task's plan.

    Args:
        choice: Domain with the skills of a library.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task.

    Returns:
        A :class:`~slap_ros.acquisition.curriculum.rollouts.PlanRollout` as JSON, without states.
    """
    domain = open_domain(choice)
    return carry_out(domain, goal, seed, index, learned_skills(domain))


def learned_skills(domain: Domain) -> dict[str, LearnedSkill]:
    """The skills of a domain that were learned, by operator name."""
    return {n: skill for n, skill in domain.skills.items() if isinstance(skill, LearnedSkill)}


def carry_out(
    domain: Domain, goal: str, seed: int, index: int, skills: Mapping[str, LearnedSkill]
) -> dict[str, Any]:
    """Carry out one task's plan with given skills.

    Args:
        domain: Domain with the operators to plan with.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task.
        skills: Skills by operator name.

    Returns:
        A :class:`~slap_ros.acquisition.curriculum.rollouts.PlanRollout` as JSON, without states.
    """
    task = task_with_goal(domain, seed, index, goal)
    return without_states(roll_out(domain, task, index, domain.operators, skills))


def without_states(rollout: PlanRollout) -> dict[str, Any]:
    """A rollout as JSON, without the states in which skills began."""
    return replace(rollout, stages=tuple(replace(s, state=()) for s in rollout.stages)).as_json()


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
