# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What shortcuts over a domain's skills could save at most, and which of them exploration finds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_skills
from slap_ros.api.opening import open_chosen
from slap_ros.drawing.palette import MUTED
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.planning.problem import require_skills
from slap_ros.shortcuts import jobs as training_jobs
from slap_ros.shortcuts.candidate_groups import ProblemKey, problem_key
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.named_settings import NEAR, training_settings
from slap_ros.shortcuts.saving_bounds import Operators, SavingBound, saving_bounds
from slap_ros.shortcuts.way_on import steps_to_goal
from slap_ros.skills.domain_choice import DEMONSTRATOR, SHIPPED, DomainChoice
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import RESULTS, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_each, plot_whole
from slap_ros.studies.slap.explored_tasks import explore_tasks
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
A shortcut replaces the skills between two abstract states of a task's graph. It saves at most what
it would save if it took no steps: the plan's length, less the ways to the first state and on from
the second. Ways are valued by the mean environment steps of each skill, as exploration values them,
so the bound is an estimate. A row is about all pairs of abstract states between which the cheapest
way has the same skills, in this order. Of each task, the pair that is worth most counts. Only pairs
that no skill joins count. "No skills" are pairs between which no skills lead.

"Saves at most" is the share of the plan, mean over the tasks that have such a pair. "May take" is
how many environment steps a shortcut may take to save {share:.0%} of the plan, where the skills
take what the column before says. A negative number means that even a shortcut without steps saves
less. "Found" counts the tasks in which exploration found such a shortcut that it expects to
save steps.

{tried}{scripted}"""
TRIED = """\
Exploration was that of `--settings {settings}`, as `slap train` explores: {steps:,} environment
steps in {tasks} tasks of training, with {pairs:,} pairs of abstract states.

{beyond}"""
BEYOND = (
    "Beyond these pairs, in abstract states that no skills lead to, it found shortcuts that it "
    "expects to save steps in {tasks} tasks, {saving:.0%} of the plan at most."
)
NOTHING_BEYOND = "In abstract states that no skills lead to, it found nothing that saves steps."
SCRIPTED = """

The skills are scripts of the demonstrator: nothing was acquired here. Exploration begins where its
scripts end, and inside them."""
WORTH = 0.1  # share of a plan from which on a shortcut counts as worth having


@dataclass(frozen=True)
class PossibleSaving:
    """Shortcuts in place of the same skills, in one task.

    Args:
        replaced: Names of the skills that lead from one abstract state to the other, in order.
        steps: Environment steps that these skills take; None where no skills lead there.
        saving: Environment steps that a shortcut saves if it takes none itself.
        found: Environment steps that exploration expects such a shortcut to save; 0 where it found
            none.
    """

    replaced: Operators
    steps: float | None
    saving: float
    found: float


@dataclass(frozen=True)
class TaskSavings:
    """What shortcuts could save in one task.

    Args:
        index: Index of the task among those that training explores.
        plan: Environment steps of the plan, by the mean steps of each skill.
        pairs: Number of pairs of abstract states that no skill joins.
        explored_steps: Environment steps of exploration.
        beyond: Share of the plan that exploration expects to save at most by a shortcut to an
            abstract state that no skills lead to; 0 where it found none.
        savings: Savings by the skills that are replaced.
    """

    index: int
    plan: float
    pairs: int
    explored_steps: int
    beyond: float
    savings: tuple[PossibleSaving, ...]

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> TaskSavings:
        """The savings of a job's JSON.

        Raises:
            LookupError, TypeError: The data is none.
        """
        savings = (
            PossibleSaving(**{**one, "replaced": tuple(one["replaced"])}) for one in data["savings"]
        )
        return cls(**{**data, "savings": tuple(savings)})


def savings_in_task(
    distribution: TaskDistribution, index: int, settings: ExplorationSettings
) -> TaskSavings | str:
    """Explore a task and bound what shortcuts could save in it.

    Args:
        distribution: Distribution from which the task is drawn.
        index: Index of the task among those that training explores.
        settings: Settings of exploration.

    Returns:
        The savings; or why the task has no plan, in words.
    """
    try:
        explorer = training_jobs.explorer(distribution, index, settings)
    except (UnsolvableError, PlanningLimitError) as error:
        return str(error)
    explored = explorer.explore()
    beyond = [c.expected_saving / c.plan_steps for c in explored.candidates if c.beyond]
    return TaskSavings(
        index,
        steps_to_goal(explorer.graph, explored.operator_steps)[0],
        explored.pairs,
        explored.environment_steps,
        max(beyond, default=0.0),
        tuple(_by_skills(explorer, explored)),
    )


def _by_skills(explorer: Explorer, explored: ExplorationResult) -> Iterator[PossibleSaving]:
    """Yield what shortcuts in place of the same skills could save, the largest saving first.

    Args:
        explorer: Explorer of the task.
        explored: Outcome of exploring it.
    """
    nodes = explorer.graph.nodes

    def key(pair: tuple[int, int]) -> ProblemKey:
        source, target = (nodes[node] for node in pair)
        return problem_key(explorer.signature(source, target))

    found: dict[ProblemKey, float] = {}
    for one in explored.candidates:
        own = problem_key(one.signature)
        found[own] = max(one.expected_saving, found.get(own, 0.0))
    groups: dict[Operators, list[SavingBound]] = {}
    for bound in saving_bounds(explorer.graph, explored.operator_steps):
        groups.setdefault(bound.replaced, []).append(bound)
    for replaced, bounds in groups.items():
        best = bounds[0]  # they come in the order of their savings
        expected = max(found.get(key(bound.pair), 0.0) for bound in bounds)
        steps = best.steps if math.isfinite(best.steps) else None
        yield PossibleSaving(replaced, steps, best.saving, expected)


@dataclass(frozen=True)
class SavingsRow:
    """Shortcuts in place of the same skills, over all tasks that could have one.

    Args:
        replaced: Names of the skills, in order.
        tasks: Number of tasks that have such a pair of abstract states.
        shares: Share of the plan that a shortcut saves at most, by task.
        steps: Environment steps of the skills, mean over tasks; None where there are none.
        most_steps: Environment steps that a shortcut may take, mean over tasks.
        found: Number of tasks in which exploration found one that saves steps.
        expected: Largest share of a plan that exploration expects one to save.
    """

    replaced: Operators
    tasks: int
    shares: tuple[float, ...]
    steps: float | None
    most_steps: float
    found: int
    expected: float

    @classmethod
    def of(
        cls, replaced: Operators, savings: Sequence[tuple[TaskSavings, PossibleSaving]]
    ) -> SavingsRow:
        """The row of the same skills.

        Args:
            replaced: Names of the skills, in order.
            savings: Tasks, each with its saving.
        """
        steps = [saving.steps for _, saving in savings if saving.steps is not None]
        return cls(
            replaced,
            len(savings),
            tuple(saving.saving / task.plan for task, saving in savings),
            fmean(steps) if steps else None,
            fmean(saving.saving - WORTH * task.plan for task, saving in savings),
            sum(saving.found > 0.0 for _, saving in savings),
            max(saving.found / task.plan for task, saving in savings),
        )

    @property
    def name(self) -> str:
        """The skills in words."""
        return ", ".join(self.replaced) or "no skills"

    def as_row(self) -> list[str]:
        """Row of the table."""
        return [
            self.name,
            str(self.tasks),
            f"{fmean(self.shares):.0%}",
            "-" if self.steps is None else f"{self.steps:.1f}",
            f"{self.most_steps:.1f}",
            f"{self.found}, {self.expected:.0%} at most" if self.found else "none",
        ]


def rows_of(tasks: Sequence[TaskSavings]) -> list[SavingsRow]:
    """A row for the same skills in all tasks, the largest mean saving first.

    Args:
        tasks: Savings of each task.
    """
    groups: dict[Operators, list[tuple[TaskSavings, PossibleSaving]]] = {}
    for task in tasks:
        for saving in task.savings:
            groups.setdefault(saving.replaced, []).append((task, saving))
    rows = [SavingsRow.of(replaced, savings) for replaced, savings in groups.items()]
    return sorted(rows, key=lambda row: (-fmean(row.shares), row.replaced))


def study(
    distribution: TaskDistribution, tasks: int, settings: str, runner: JobRunner
) -> StudyReport:
    """Explore tasks, and bound what shortcuts could save.

    Args:
        distribution: Distribution of the tasks.
        tasks: Number of tasks.
        settings: Name of the settings of exploration.
        runner: Runner of the jobs.

    Returns:
        The report.

    Raises:
        UnsolvableError: No task has a plan.
    """
    exploration = training_settings(settings, distribution.make_domain()).exploration
    jobs = {f"task {index}": (distribution, index, exploration) for index in range(tasks)}
    decode, name = TaskSavings.from_json, distribution.domain.name
    found = list(explore_tasks(runner, name, savings_in_task, decode, jobs).values())
    rows = rows_of(found)
    return StudyReport(
        study="possible_savings",
        source="",
        title=f"What shortcuts could save: {distribution.domain.name}",
        measured=MEASURED.format(
            share=WORTH,
            tried=_tried(found, settings),
            scripted=SCRIPTED if distribution.domain.skills == DEMONSTRATOR else "",
        ),
        table=_table(rows),
        found={
            "exploration": exploration.as_json(),
            "rows": [asdict(row) for row in rows],
            "tasks": [asdict(one) for one in found],
        },
        draw=lambda figure: draw(figure, rows),
        size=(7.0, 1.4 + 0.3 * len(rows)),
    )


def _table(rows: Sequence[SavingsRow]) -> MarkdownTable:
    columns = ("in place of", "tasks", "saves at most", "the skills take [steps]")
    return MarkdownTable((*columns, "may take [steps]", "found"), [row.as_row() for row in rows])


def _tried(found: Sequence[TaskSavings], settings: str) -> str:
    """What exploration did, and what it found beyond the graph, in words."""
    beyond = [task.beyond for task in found if task.beyond]
    said = BEYOND.format(tasks=len(beyond), saving=max(beyond)) if beyond else NOTHING_BEYOND
    return TRIED.format(
        settings=settings,
        tasks=len(found),
        steps=sum(task.explored_steps for task in found),
        pairs=sum(task.pairs for task in found),
        beyond=said,
    )


def draw(figure: Figure, rows: Sequence[SavingsRow]) -> None:
    """Draw what shortcuts save at most: their means, and each task."""
    axes = figure.subplots()
    for place, row in enumerate(rows):
        plot_each(axes, place, [100 * share for share in row.shares])
        plot_whole(axes, place, 100 * fmean(row.shares))
    name_rows(axes, [row.name for row in rows])
    axes.axvline(100 * WORTH, color=MUTED, linestyle="--", linewidth=1)
    axes.set_xlim(0, 103)
    axes.set_xlabel("saved at most [% of the plan]: each task, mean (dot)")


@dataclass(frozen=True, kw_only=True)
class PossibleSavingsOptions:
    """Options of this study."""

    domain: DomainName
    tasks: Annotated[int, CommandOption("Number of tasks to explore.", least=1)] = 4
    seed: Annotated[
        int, CommandOption("Seed of the training whose tasks are explored.", least=0)
    ] = 0
    preset: Preset = None
    skills: Annotated[
        str,
        CommandOption(
            "Folder that `slap acquire` made, or demonstrator. Default: the skills that ship, else "
            "the domain's own."
        ),
    ] = SHIPPED
    settings: Annotated[str, CommandOption("Settings of exploration, as for `slap train`.")] = NEAR
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: PossibleSavingsOptions, tell: Tell) -> PreparedStudy:
    """Open the domain with its skills."""
    opened = open_chosen(DomainChoice(options.domain, options.preset or "", options.skills), tell)
    require_skills(opened)
    choice = DomainChoice.of(opened, options.skills)
    training_settings(options.settings, opened)  # refused before anything is done
    distribution = TaskDistribution(choice, options.seed)
    settings: dict[str, Any] = {
        "preset": opened.preset,
        "tasks": options.tasks,
        "seed": options.seed,
        "settings": options.settings,
    }
    if described := describe_skills(opened):
        settings["skills"] = described
    elif options.skills:
        settings["skills"] = options.skills
    return PreparedStudy(
        settings,
        lambda runner: study(distribution, options.tasks, options.settings, runner),
        {"skills": options.skills or None},
    )


STUDY = Study(
    "possible_savings",
    help="What shortcuts over skills could save at most, and which of them exploration finds.",
    example="slap study possible_savings make_coffee",
    options=PossibleSavingsOptions,
    prepare=prepare,
    costs="exploring",
)
