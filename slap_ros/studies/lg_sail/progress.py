# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Acquired skills beside learners of the whole task, over environment steps (LG-SAIL Fig. 4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.api.baselines import describe_baseline, require_gymnasium
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.baselines.trained_baseline import TrainedBaseline
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.skills.skill_library import read_library_record
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    LibraryTasks,
    SkillLibraries,
    all_goals,
    shipped_skills,
)
from slap_ros.studies.lg_sail.library_progress import PAPER_PROGRESS, of_library
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study
from slap_ros.studies.trained_baselines import (
    BASELINES,
    baselines_in_runs,
    open_baselines,
    shipped_baselines,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Task progress is the share of the stages of a task's plan that were done in order; a task whose goal
holds counts 1. Plans are A*'s, with as few operators as possible. Skills carry a plan out, approach
and policy, and nothing is planned again. `sac` and `curriculum` are one policy for the whole task,
without a planner: each moves the joints in every step until the goal holds or the task's {limit:,}
steps are used up. They observe all objects and the goal, and are rewarded stage by stage, dense
within the present one. `curriculum` begins its episodes near the end of 20 demonstrations at first,
and earlier as success rises; the steps of the demonstrations are not counted. `maple` is one policy
too: it chooses movements of the hand and their parameters, relative to what the plan's present
operator acts on. `ours` has the
proposer and the rewarder of its libraries in brackets: with both *manual*, operators and rewards
are hand-written, as LEAGUE has them, and no known skill is begun with. *Steps* are environment
steps of a training, of all skills together; for skills, neither approaches nor the episodes in
which checkpoints are judged are counted. The table is measured after all of them, in tasks whose
seed no training used: task progress is the mean over tasks, then the mean ± sample standard
deviation over trainings, and *solved* is the share of tasks with all stages done, with Wilson's
95 % interval. The picture is measured during the trainings, in tasks of the training goal that they
had not learned from: learners of the whole task without exploring, in the same tasks each time;
skills between rounds, in other tasks each time. A library that was made before such records had
steps has its first and its last point alone, joined by a dotted line. A method without
a row was not run. The paper's figures are of a simulator of its own; it does not say how many steps
its trainings had."""
OURS = "ours"
SAC: Mapping[tuple[str, str], float] = {  # task progress in LG-SAIL's Table 1
    ("stow_hammer", "training"): 0.15,
    ("stow_hammer", "test1"): 0.07,
    ("stow_hammer", "test2"): 0.09,
    ("peg_in_hole", "training"): 0.19,
    ("peg_in_hole", "test1"): 0.09,
    ("peg_in_hole", "test2"): 0.10,
}


@dataclass(frozen=True)
class MeasuredTraining:
    """A training, and what was measured on the way.

    Args:
        name: Name of the training; of a library, its digest.
        steps: Environment steps of the whole training.
        curve: Task progress over environment steps, in order.
        is_whole: Whether the curve has all that was measured, not its ends alone.
    """

    name: str
    steps: int
    curve: tuple[Point, ...]
    is_whole: bool = True

    @classmethod
    def of_library(cls, name: str, record: Mapping[str, Any]) -> MeasuredTraining:
        """The training that made a library of skills, from its record.

        Args:
            name: Digest of the library.
            record: Record of the library.
        """
        steps, progress = int(record["steps"]), list(map(float, record["progress"]))
        at = record.get("progress_steps")
        if at is None:
            ends = (Point(0, progress[0]), Point(steps, progress[-1]))
            return cls(name, steps, ends, is_whole=False)
        return cls(name, steps, tuple(map(Point, map(int, at), progress)))

    @classmethod
    def of_baseline(cls, name: str, baseline: TrainedBaseline) -> MeasuredTraining:
        """The training of a baseline, from its record.

        Args:
            name: Name of the baseline's folder.
            baseline: Baseline that was trained.
        """
        points = tuple(Point(int(s), float(p)) for s, p in baseline.record["task_progress"])
        return cls(name, int(baseline.record["environment_steps"]), points)


@dataclass(frozen=True)
class LearnerProgress:
    """What came of a goal's tasks with all trainings of one method.

    Args:
        domain: Name of the domain.
        goal: Name of the goal; empty for the goal that comes with each task.
        method: Name of the method.
        trainings: Trainings of the method, one at least.
        progress: Task progress of each task, by training in the same order.
        trained: What is said of each training of a baseline, for the command that makes it again.
    """

    domain: str
    goal: str
    method: str
    trainings: tuple[MeasuredTraining, ...]
    progress: tuple[tuple[float, ...], ...]
    trained: tuple[Data, ...] = ()

    @property
    def spread(self) -> Spread:
        """Mean task progress, over trainings."""
        return Spread.of([fmean(tasks) for tasks in self.progress])

    @property
    def solved(self) -> SuccessRate:
        """Share of tasks that were solved, of all trainings."""
        tasks = list(chain.from_iterable(self.progress))
        return SuccessRate(sum(one == 1.0 for one in tasks), len(tasks))

    @property
    def steps(self) -> Spread:
        """Environment steps of a training."""
        return Spread.of([float(one.steps) for one in self.trainings])

    @property
    def paper(self) -> float | None:
        """LG-SAIL's task progress, where its Table 1 has one."""
        known = {"sac": SAC, f"{OURS} (manual, manual)": PAPER_PROGRESS}.get(self.method, {})
        return known.get((self.domain, self.goal))

    def _over_trainings(self, spread: Spread, digits: int) -> str:
        """Mean ± sample standard deviation; the value alone where there is one training."""
        if len(self.trainings) == 1:
            return f"{spread.mean:.{digits}f}"
        return format_spread(spread, digits)

    def as_json(self) -> dict[str, Any]:
        """The summary, every task and every curve."""
        return {
            "goal": self.goal,
            "method": self.method,
            "task_progress": asdict(self.spread),
            "solved": self.solved.share,
            "solved_interval": asdict(self.solved.interval),
            "steps": asdict(self.steps),
            "paper": self.paper,
            "trainings": [
                {"name": one.name, "steps": one.steps, "curve": one.curve, "tasks": tasks}
                for one, tasks in zip(self.trainings, self.progress, strict=True)
            ],
            "trained": list(self.trained),
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        return [
            self.goal or "(the task's own)",
            self.method,
            f"{len(self.trainings)} × {len(self.progress[0])}",
            self._over_trainings(self.steps, 0),
            self._over_trainings(self.spread, 2),
            str(self.solved),
            "" if self.paper is None else f"{self.paper:.2f}",
        ]


COLUMNS = (
    "goal",
    "method",
    "trainings × tasks",
    "steps",
    "task progress",
    "solved [95 %]",
    "paper",
)


def study(
    domain: Domain,
    choices: Sequence[DomainChoice],
    baselines: Mapping[str, TrainedBaseline],
    goals: Sequence[str],
    tasks: tuple[int, int],
    runner: JobRunner,
) -> StudyReport:
    """Put acquired skills and learners of the whole task side by side.

    Args:
        domain: Domain of all of them.
        choices: Domain with the skills of each library.
        baselines: Trained baselines by the names of their folders.
        goals: Names of goals; an empty name for the goal that comes with each task.
        tasks: Number of tasks per goal and training, and their seed.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    rows: list[LearnerProgress] = []
    for goal in goals:
        rows += _of_libraries(domain.name, choices, goal, tasks, runner)
        rows += _of_baselines(domain.name, baselines, goal, tasks, runner)
    return StudyReport(
        study="progress",
        source="LG-SAIL Fig. 4",
        title=f"Task progress over environment steps: {domain.name}",
        measured=MEASURED.format(limit=domain.step_limit),
        table=MarkdownTable(COLUMNS, [row.as_row() for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: draw(figure, [row for row in rows if row.goal == goals[0]]),
        size=(7.0, 3.4),
    )


def _of_libraries(
    domain: str,
    choices: Sequence[DomainChoice],
    goal: str,
    tasks: tuple[int, int],
    runner: JobRunner,
) -> list[LearnerProgress]:
    """A row for the libraries of each proposer and rewarder."""
    count, seed = tasks
    found: dict[str, list[tuple[MeasuredTraining, tuple[float, ...]]]] = {}
    for choice in choices:
        origin, library = of_library(choice, goal, range(count), seed, runner)
        record = read_library_record(Path(choice.skills))
        training = MeasuredTraining.of_library(library.digest, record)
        progress = tuple(rollout.progress for rollout in library.rollouts)
        found.setdefault(f"{OURS} ({', '.join(origin)})", []).append((training, progress))
    return [
        LearnerProgress(domain, goal, method, *map(tuple, zip(*each, strict=True)))
        for method, each in found.items()
    ]


def _of_baselines(
    domain: str,
    baselines: Mapping[str, TrainedBaseline],
    goal: str,
    tasks: tuple[int, int],
    runner: JobRunner,
) -> list[LearnerProgress]:
    """A row for all trainings of each method."""
    from slap_ros.baselines.trials import task_progress

    count, seed = tasks
    jobs = {
        f"{goal}, {name}, {one.digest}: {i}": (one, one.preset, goal or None, seed, i)
        for name, one in baselines.items()
        for i in range(count)
    }
    results = list(runner.run(f"{goal}, other learners", task_progress, float, jobs).values())
    by_name = {
        name: tuple(results[number * count : (number + 1) * count])
        for number, name in enumerate(baselines)
    }
    rows = []
    for method in dict.fromkeys(one.name for one in baselines.values()):
        own = {name: one for name, one in baselines.items() if one.name == method}
        rows.append(
            LearnerProgress(
                domain,
                goal,
                method,
                tuple(MeasuredTraining.of_baseline(name, one) for name, one in own.items()),
                tuple(by_name[name] for name in own),
                tuple({"name": name, **describe_baseline(one)} for name, one in own.items()),
            )
        )
    return rows


def draw(figure: Figure, rows: Sequence[LearnerProgress]) -> None:
    """Draw the task progress of every training over environment steps."""
    axes = figure.subplots()
    for colour, row in zip(LINES, rows, strict=False):
        for number, training in enumerate(row.trainings):
            axes.plot(
                [point.steps for point in training.curve],
                [point.success for point in training.curve],
                color=colour,
                marker=".",
                linewidth=1.0,
                linestyle="-" if training.is_whole else ":",
                label=row.method if number == 0 else None,
            )
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlim(left=0)
    axes.set_xlabel("environment steps")
    axes.set_ylabel("task progress")
    axes.legend(loc="center right")


def _summary(found: Data) -> str:
    """Task progress and steps of every method at the first goal; at the others progress alone."""
    rows = found["rows"]
    goals = dict.fromkeys(row["goal"] for row in rows)
    return "; ".join(
        f"{goal}: {', '.join(map(_in_words, (row for row in rows if row['goal'] == goal)))}"
        for goal in goals
    )


def _in_words(row: Data) -> str:
    progress, steps = row["task_progress"]["mean"], row["steps"]["mean"]
    return f"{row['method']} {progress:.2f} after {steps:,.0f} steps"


@dataclass(frozen=True, kw_only=True)
class ProgressOptions:
    """Options of this study."""

    domain: DomainName
    library: SkillLibraries = None
    against: Annotated[
        list[Path] | None,
        CommandOption(
            "Folder of a baseline with the reward `stages` that `slap baseline train` made. May be "
            "repeated: trainings of the same method share a row. Default: all of "
            f"{BASELINES}/DOMAIN-*, or else those that ship.",
            metavar="FOLDER",
        ),
    ] = None
    goal: GoalNames = None
    tasks: LibraryTasks = 50
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: ProgressOptions, tell: Tell) -> PreparedStudy:
    """Open the libraries and every baseline; one that cannot be used is left out, and said.

    Raises:
        InvalidParameterError: No baseline can be used, or Gymnasium is not installed.
    """
    require_gymnasium()
    domain = get_domain(options.domain, options.preset)
    libraries = options.library or shipped_skills(options.domain)
    choices = [DomainChoice(domain.name, domain.preset, str(folder)) for folder in libraries]
    named = options.against or baselines_in_runs(domain.name)
    folders = named or shipped_baselines(domain.name)
    baselines = open_baselines(folders, domain, lambda one: _why_not(one, domain.preset), tell)
    if not baselines:
        raise InvalidParameterError(
            f"there is no baseline of {domain.name} to compare with; `slap baseline train sac "
            f"{domain.name} --preset {domain.preset}` makes one"
        )
    goals = list(dict.fromkeys(options.goal or all_goals(domain)))
    tasks = (options.tasks, options.seed)
    return PreparedStudy(
        {
            "preset": domain.preset,
            "trainings": len(libraries) + len(baselines),
            "tasks": options.tasks,
            "seed": options.seed,
        },
        lambda runner: study(domain, choices, baselines, goals, tasks, runner),
        {
            "library": options.library,
            "against": named or None,
            "goal": options.goal,
            "trainings": None,
        },
    )


def _why_not(baseline: TrainedBaseline, preset: str) -> str:
    """Why a baseline cannot be compared under a preset; empty where it can."""
    if baseline.preset != preset:
        return f"trained under {baseline.preset}, not {preset}"
    return "" if "task_progress" in baseline.record else "task progress was not measured"


STUDY = Study(
    "progress",
    help="LG-SAIL Fig. 4: task progress over environment steps, beside learners of whole tasks.",
    example="slap study progress stack_at_target",
    options=ProgressOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "LG-SAIL Fig. 4",
            "learning curves beside other learners",
            ("stow_hammer", "peg_in_hole", "stack_at_target"),
            {
                "": "curves",
                "stow_hammer": "curves; SAC in Table 1: training 0.15, test1 0.07, test2 0.09",
                "peg_in_hole": "curves; SAC in Table 1: training 0.19, test1 0.09, test2 0.10",
            },
        ),
    ),
)
