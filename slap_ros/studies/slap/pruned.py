# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Candidates that random rollouts prune, learned all the same: what pruning loses (SLAP B.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.domains import get_domain
from slap_ros.drawing.palette import MUTED, PLAN, SHORTCUT
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.planning.problem import require_skills
from slap_ros.shortcuts import jobs as training_jobs
from slap_ros.shortcuts.exploration_result import mean_operator_steps
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.settings import ENOUGH_SUCCESS, TrainingSettings
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.figures import legend_above
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import RESULTS, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.drawn_candidates import (
    DrawnCandidate,
    LearnedCandidate,
    LearningProblem,
    TaskCandidates,
    candidates_of_task,
    learn_candidate,
    problems_of,
    starts_in_task,
)
from slap_ros.studies.slap.explored_tasks import explore_tasks
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Candidates are pairs of abstract states of a task's graph, the later one second, that no option
joins. Of the {pairs:,} of {tasks} tasks of training, {drawn} were drawn, of each task as many as is
its share. A candidate is pruned where no random rollout in any of these tasks joined a pair that is
the same up to objects; rollouts begin in the abstract states that are cheapest to reach, as in
training. All were learned, pruned or not, as a training does it: from the states where they begin
in up to {starts} tasks, with {steps:,} environment steps, once for all that are the same up to
objects. Where a task has no such state, or none that leads on to its goal, it is left out.

Learned are those that reach their target in {enough:.0%} or more of the last episodes of training.
Shorter are those with which plans are shorter by {least:.1%} or more, mean over {validation}
validation tasks, each used alone. Shares are of the candidates that were drawn.

The paper draws 200 pruned candidates and learns 3.6 % of them."""
CLASSES = {True: "pruned", False: "joined by rollouts"}


@dataclass(frozen=True)
class PrunedRow:
    """What learning a candidate came to.

    Args:
        problem: What was learned.
        learned: What it came to.
    """

    problem: LearningProblem
    learned: LearnedCandidate

    def shorter(self, least: float) -> bool:
        """Whether it makes plans shorter by this share at least."""
        relative = self.learned.relative
        return relative is not None and relative <= 1.0 - least

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        problem = {"pairs": self.problem.pairs, "pruned": self.problem.pruned}
        return {**self.problem.candidate.as_json(), **problem, **asdict(self.learned)}


@dataclass(frozen=True)
class ClassCounts:
    """How many of the candidates that are pruned, or are not, can be learned.

    Args:
        pairs: Number that was drawn.
        problems: Number of different ones, up to objects.
        startless: Number that can begin nowhere.
        learned: Number that was learned.
        shorter: Number with which plans are shorter.
    """

    pairs: int
    problems: int
    startless: int
    learned: int
    shorter: int

    @classmethod
    def of(cls, rows: Sequence[PrunedRow], least: float) -> ClassCounts:
        """The counts of rows.

        Args:
            rows: Rows of the class.
            least: Share by which plans have to be shorter.
        """
        return cls(
            sum(row.problem.pairs for row in rows),
            len(rows),
            sum(row.problem.pairs for row in rows if not row.learned.starts),
            sum(row.problem.pairs for row in rows if row.learned.success >= ENOUGH_SUCCESS),
            sum(row.problem.pairs for row in rows if row.shorter(least)),
        )

    def as_cells(self) -> list[str]:
        """Cells of a table."""
        shares = [self._share(n) for n in (self.startless, self.learned, self.shorter)]
        return [str(self.pairs), str(self.problems), *shares]

    def _share(self, number: int) -> str:
        return f"{number} ({number / self.pairs:.1%})" if self.pairs else "-"


def study(
    distribution: TaskDistribution,
    tasks: int,
    candidates: int,
    settings: TrainingSettings,
    runner: JobRunner,
) -> StudyReport:
    """Draw candidates of the first tasks of a training, and learn all of them.

    Args:
        distribution: Distribution of the tasks.
        tasks: Number of tasks to explore.
        candidates: Number of candidates to draw.
        settings: Settings of the training.
        runner: Runner of the jobs.

    Returns:
        The report.

    Raises:
        UnsolvableError: No task has a plan.
    """
    explored = _explore(distribution, tasks, candidates, settings, runner)
    plain = _plan_without(distribution, settings, runner)
    rows = _learn(
        problems_of(explored, candidates), explored, plain, distribution, settings, runner
    )
    return StudyReport(
        study="pruned",
        source="SLAP B.1",
        title=f"Pruned candidates, learned all the same: {distribution.domain.name}",
        measured=_measured(rows, explored, settings, len(plain)),
        table=_table(rows, settings.least_saving),
        found={
            "training": settings.as_json(),
            "pairs": [one.explored.pairs for one in explored],
            "classes": {
                CLASSES[pruned]: asdict(ClassCounts.of(own, settings.least_saving))
                for pruned, own in _by_class(rows).items()
            },
            "candidates": [row.as_json() for row in rows],
        },
        draw=lambda figure: draw(figure, rows),
        size=(5.6, 3.4),
    )


def _explore(
    distribution: TaskDistribution,
    tasks: int,
    candidates: int,
    settings: TrainingSettings,
    runner: JobRunner,
) -> list[TaskCandidates]:
    """The candidates of each task that has a plan."""
    jobs = {f"task {i}": (distribution, i, settings, candidates) for i in range(tasks)}
    decode, name = TaskCandidates.from_json, distribution.domain.name
    return list(explore_tasks(runner, name, candidates_of_task, decode, jobs).values())


def _plan_without(
    distribution: TaskDistribution, settings: TrainingSettings, runner: JobRunner
) -> dict[int, int]:
    """Environment steps of the plans of validation tasks without shortcuts, by the task's index."""
    goals = training_jobs.any_goal(distribution, settings.random_goals)
    indices = {f"plan {i}": i for i in range(settings.validation)}
    results = runner.run(
        "planning",
        training_jobs.plan_length,
        lambda data: data if isinstance(data, str) else int(data),
        {name: (goals, i, (), settings.sampling) for name, i in indices.items()},
        failure=lambda one: f"has no plan: {one}" if isinstance(one, str) else None,
    )
    return {indices[name]: one for name, one in results.items() if not isinstance(one, str)}


def _starts(
    candidates: Sequence[DrawnCandidate],
    operator_steps: Mapping[str, float],
    distribution: TaskDistribution,
    tasks: int,
    runner: JobRunner,
) -> list[tuple[StartRecord, ...]]:
    """Where each candidate begins: at most once in each task."""
    found = runner.run(
        "collecting starts",
        starts_in_task,
        lambda data: [None if one is None else StartRecord.from_json(one) for one in data],
        {f"starts {i}": (distribution, i, candidates, operator_steps) for i in range(tasks)},
    )
    by_candidate = zip(*found.values(), strict=True)
    return [tuple(one for one in starts if one is not None) for starts in by_candidate]


def _learn(
    problems: Sequence[LearningProblem],
    explored: Sequence[TaskCandidates],
    plain: Mapping[int, int],
    distribution: TaskDistribution,
    settings: TrainingSettings,
    runner: JobRunner,
) -> list[PrunedRow]:
    """Learn each of them once."""
    candidates = [one.candidate for one in problems]
    operator_steps = mean_operator_steps([task.explored for task in explored])
    starts = _starts(candidates, operator_steps, distribution, settings.starts, runner)
    results = runner.run(
        "learning",
        learn_candidate,
        lambda data: LearnedCandidate(**data),
        {
            f"candidate {i}": (distribution, one.signature, own, settings, plain)
            for i, (one, own) in enumerate(zip(candidates, starts, strict=True))
        },
    )
    return [PrunedRow(one, own) for one, own in zip(problems, results.values(), strict=True)]


def _by_class(rows: Sequence[PrunedRow]) -> dict[bool, list[PrunedRow]]:
    """The rows of what is pruned, and of what is not."""
    return {pruned: [row for row in rows if row.problem.pruned is pruned] for pruned in CLASSES}


def _measured(
    rows: Sequence[PrunedRow],
    explored: Sequence[TaskCandidates],
    settings: TrainingSettings,
    validation: int,
) -> str:
    return MEASURED.format(
        pairs=sum(one.explored.pairs for one in explored),
        tasks=len(explored),
        drawn=sum(row.problem.pairs for row in rows),
        starts=settings.starts,
        steps=settings.total_steps,
        enough=ENOUGH_SUCCESS,
        least=settings.least_saving,
        validation=validation,
    )


def _table(rows: Sequence[PrunedRow], least: float) -> MarkdownTable:
    """A row for what is pruned and one for what is not; then each that was learned."""
    columns = ["candidates", "drawn", "different", "can begin nowhere", "learned", "plans shorter"]
    cells = [
        [CLASSES[pruned], *ClassCounts.of(own, least).as_cells()]
        for pruned, own in _by_class(rows).items()
    ]
    return MarkdownTable(columns, cells)


def draw(figure: Figure, rows: Sequence[PrunedRow]) -> None:
    """Draw the success of all that was learned, the best first, over the share of candidates.

    Args:
        figure: Figure to draw into.
        rows: What was learned.
    """
    axes = figure.subplots()
    for pruned, own in _by_class(rows).items():
        success = [100.0 * row.learned.success for row in own for _ in range(row.problem.pairs)]
        if success:
            ordered = sorted(success, reverse=True)
            shares = [100.0 * i / len(ordered) for i in range(len(ordered) + 1)]
            colour, width = (PLAN, 2.0) if pruned else (SHORTCUT, 1.2)
            axes.stairs(ordered, shares, color=colour, linewidth=width, label=CLASSES[pruned])
    axes.axhline(100.0 * ENOUGH_SUCCESS, color=MUTED, linestyle="--", linewidth=1)
    axes.set_ylim(0, 103)
    axes.set_xlim(0, 100)
    axes.set_xlabel("candidates, the best first [%]")
    axes.set_ylabel("success at the end of training [%]")
    legend_above(figure, axes)


def _summary(found: Data) -> str:
    pruned = found["classes"][CLASSES[True]]
    return (
        f"{pruned['learned']} of {pruned['pairs']} pruned candidates learned, "
        f"{pruned['shorter']} shorten plans"
    )


@dataclass(frozen=True, kw_only=True)
class PrunedOptions:
    """Options of this study."""

    domain: DomainName
    candidates: Annotated[int, CommandOption("Number of candidates to draw.", least=1)] = 200
    tasks: Annotated[
        int | None,
        CommandOption("Number of tasks to explore. Default: as many as a training.", least=1),
    ] = None
    starts: Annotated[
        int | None,
        CommandOption("Tasks whose states are learned from. Default: as a training.", least=1),
    ] = None
    steps: Annotated[
        int | None,
        CommandOption("Environment steps per candidate. Default: as a training.", least=1),
    ] = None
    seed: Annotated[int, CommandOption("Seed of the training.", least=0)] = 0
    settings: Annotated[str, CommandOption("Settings, as for `slap train`.")] = "ours"
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: PrunedOptions, _: Tell) -> PreparedStudy:
    """Open the domain, and choose the settings of training."""
    chosen = get_domain(options.domain, options.preset)
    require_skills(chosen)
    settings = training_settings(options.settings, chosen)
    if options.starts is not None:
        settings = replace(settings, starts=options.starts)
    if options.steps is not None:
        settings = settings.with_total_steps(options.steps)
    tasks = options.tasks or settings.exploration.tasks
    distribution = TaskDistribution(DomainChoice.of(chosen), options.seed)
    named: dict[str, Any] = {
        "preset": chosen.preset,
        "candidates": options.candidates,
        "tasks": tasks,
        "starts": settings.starts,
        "steps": settings.total_steps,
        "seed": options.seed,
        "settings": options.settings,
    }
    return PreparedStudy(
        named, lambda runner: study(distribution, tasks, options.candidates, settings, runner)
    )


STUDY = Study(
    "pruned",
    help="SLAP B.1: candidates that random rollouts prune, learned all the same.",
    example="slap study pruned obstacle2d",
    options=PrunedOptions,
    prepare=prepare,
    summary=_summary,
    costs="learning",
    figures=(
        PaperFigure(
            "SLAP B.1",
            "pruned candidates that can be learned",
            SLAP_DOMAINS,
            {"": "200 pruned candidates, 3.6% learned"},
            not_run="each candidate is a training of its own: 36 of 40 of a task of "
            "cluttered_drawer differ, which is eight hours of one core",
        ),
    ),
)
